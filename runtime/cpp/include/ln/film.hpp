#pragma once
// The film: where samples of pixels are added up.
//
// Each pixel belongs to one thread at a time, and its samples are added in the order of their numbers, in double precision:
// the picture does not depend on tiles, passes or threads, only on the number of samples.
//
// The picture is kept as two halves, for an estimate of its error from their difference. Which half a sample belongs to depends
// on its number alone; halves are made of runs of 2^k samples at multiples of 2^k, each a whole net of a low-discrepancy
// sequence (even and odd numbers would be the two halves of a *domain*, not of the samples).

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ln/math.hpp"

namespace ln {

/// 0 or 1. Samples [2^m, 2^(m+1)) are dealt out in quarters: 0, 1, 1, 0.
inline unsigned film_half(std::uint32_t sample) {
  const int m = static_cast<int>(std::bit_width(sample)) - 1;
  if (m < 2) return sample & 1;
  return ((sample >> (m - 1)) ^ (sample >> (m - 2))) & 1;
}

struct ErrorEstimate {
  double rel_mse = kInfinity;         // estimated relMSE of the mean picture: mean of (x - r)^2 / (r^2 + 0.01)
  double standard_error = kInfinity;  // of that estimate, from the differences between pixels
};

/// How far two pictures are apart, over all pixels and channels.
struct Comparison {
  double mean = 0;     // of a - b [the picture's unit]
  double rmse = 0;     // square root of the mean of (a - b)^2 [the picture's unit]
  double rel_mse = 0;  // mean of (a - b)^2 / (b^2 + 0.01)
  double bias = 0;     // mean(a - b) / mean(b); 0 if b is black
  double largest = 0;  // largest |a - b| [the picture's unit]
};

class Film {
 public:
  /// Values that single samples may have. `signed_values`: of networks that subtract, where the mean alone has to be positive.
  /// `difference`: the mean may be negative, too, and the picture is its absolute value.
  enum class Samples : std::uint8_t { positive, signed_values, difference };

  /// Throws Error if the machine has too little memory for it.
  Film(int width, int height, int layer_count = 0, Samples samples = Samples::positive);

  int width() const { return width_; }
  int height() const { return height_; }
  int layer_count() const { return layer_count_; }
  bool shows_difference() const { return samples_ == Samples::difference; }
  static std::uint64_t bytes_needed(int width, int height, int layer_count);

  /// Adds a sample of the picture. Row 0 is the top. A value that no picture may hold is repaired (not a number, infinite: 0;
  /// negative where samples are to be positive: 0) and counted.
  void add(int x, int y, std::uint32_t sample, const Color& radiance) {
    const std::size_t index = pixel_index(x, y);
    const unsigned half = film_half(sample);
    accumulate(pixels_[index].sum[half], radiance);
    ++pixels_[index].count[half];
  }

  /// Adds the value of the same sample on a layer's wire; `add` counts the sample.
  void add_layer(int layer, int x, int y, const Color& radiance) {
    accumulate(layers_[static_cast<std::size_t>(layer) * pixels_.size() + pixel_index(x, y)].value, radiance);
  }

  /// Mean of the picture, or of a layer (0 and up), as it is written: finite, not negative; black without samples.
  static constexpr int kPicture = -1;
  Color mean(int x, int y, int layer = kPicture) const;
  /// Mean of a layer with its sign.
  Color signed_mean(int x, int y, int layer) const;

  /// Layer `a` beside layer `b`.
  Comparison compare(int a, int b) const;

  std::uint32_t samples(int x, int y) const {
    const Pixel& pixel = pixels_[pixel_index(x, y)];
    return pixel.count[0] + pixel.count[1];
  }
  /// Least and most samples of any pixel.
  struct Range {
    std::uint32_t least = 0, most = 0;
  };
  Range sample_range() const;

  /// Infinite while some pixel has a half without samples. Stated in film.cpp: what it assumes and which way it errs.
  ErrorEstimate estimate_error() const;

  /// Samples that had to be repaired: 0 in a correct program.
  std::uint64_t non_finite_samples() const { return non_finite_.load(std::memory_order_relaxed); }
  std::uint64_t negative_samples() const { return negative_.load(std::memory_order_relaxed); }

 private:
  struct Sum {
    double value[3] = {0, 0, 0};
  };
  struct Pixel {
    double sum[2][3] = {{0, 0, 0}, {0, 0, 0}};
    std::uint32_t count[2] = {0, 0};
  };

  Color picture_mean(int x, int y) const;

  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  /// Finite and not negative, in bits: holds under any floating-point option of the compiler.
  static bool is_presentable(float x) { return std::bit_cast<std::uint32_t>(x) < 0x7f800000u; }

  void accumulate(double (&sum)[3], const Color& c) {
    if (is_presentable(c.x) && is_presentable(c.y) && is_presentable(c.z)) [[likely]] {
      sum[0] += static_cast<double>(c.x);
      sum[1] += static_cast<double>(c.y);
      sum[2] += static_cast<double>(c.z);
    } else {
      accumulate_repaired(sum, c);
    }
  }
  void accumulate_repaired(double (&sum)[3], const Color& c);

  int width_, height_, layer_count_;
  Samples samples_;
  std::vector<Pixel> pixels_;
  std::vector<Sum> layers_;  // layer by layer
  std::atomic<std::uint64_t> non_finite_{0}, negative_{0};
};

}  // namespace ln
