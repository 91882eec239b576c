#include "ln/film.hpp"

#include <string>

#include "ln/error.hpp"
#include "ln/stats.hpp"
#include "ln/text.hpp"

namespace ln {

namespace {

void check_memory(int width, int height, int layer_count) {
  const std::uint64_t needed = Film::bytes_needed(width, height, layer_count);
  const std::uint64_t available = available_memory_bytes() / 5 * 4;  // others live here too
  if (needed <= available) return;
  throw Error("a picture of " + std::to_string(width) + "x" + std::to_string(height) + " with " + std::to_string(layer_count) +
              " layers needs " + bytes_text(static_cast<double>(needed)) + " of memory, this machine has " +
              bytes_text(static_cast<double>(available)) + " free: choose a smaller --size");
}

float limited(double mean) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(mean, -kLargest, kLargest));
}

}  // namespace

std::uint64_t Film::bytes_needed(int width, int height, int layer_count) {
  return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
         (sizeof(Pixel) + sizeof(Sum) * static_cast<std::uint64_t>(layer_count));
}

Film::Film(int width, int height, int layer_count, Samples samples)
    : width_(width), height_(height), layer_count_(layer_count), samples_(samples) {
  check_memory(width, height, layer_count);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  pixels_.resize(pixels);
  layers_.resize(pixels * static_cast<std::size_t>(layer_count));
}

void Film::accumulate_repaired(double (&sum)[3], const Color& c) {
  bool non_finite = false, negative = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(c[i]);
    if ((bits & 0x7fffffffu) >= 0x7f800000u) {
      non_finite = true;
    } else if (bits > 0x80000000u && samples_ == Samples::positive) {
      negative = true;
    } else {
      sum[i] += static_cast<double>(c[i]);  // -0 is 0
    }
  }
  if (non_finite) non_finite_.fetch_add(1, std::memory_order_relaxed);
  if (negative) negative_.fetch_add(1, std::memory_order_relaxed);
}

Color Film::mean(int x, int y, int layer) const {
  const Color value = layer == kPicture ? picture_mean(x, y) : signed_mean(x, y, layer);
  const bool absolute = layer == kPicture && samples_ == Samples::difference;
  return absolute ? glm::abs(value) : glm::max(value, Color(0));
}

Color Film::picture_mean(int x, int y) const {
  const Pixel& pixel = pixels_[pixel_index(x, y)];
  const double count = static_cast<double>(pixel.count[0]) + static_cast<double>(pixel.count[1]);
  if (count == 0) return Color(0);
  return {limited((pixel.sum[0][0] + pixel.sum[1][0]) / count), limited((pixel.sum[0][1] + pixel.sum[1][1]) / count),
          limited((pixel.sum[0][2] + pixel.sum[1][2]) / count)};
}

Color Film::signed_mean(int x, int y, int layer) const {
  const std::uint32_t count = samples(x, y);
  if (count == 0) return Color(0);
  const Sum& sum = layers_[static_cast<std::size_t>(layer) * pixels_.size() + pixel_index(x, y)];
  return {limited(sum.value[0] / count), limited(sum.value[1] / count), limited(sum.value[2] / count)};
}

Comparison Film::compare(int a, int b) const {
  Comparison found;
  double sum = 0;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const DVec3 reference(signed_mean(x, y, b)), d = DVec3(signed_mean(x, y, a)) - reference;
      for (std::size_t i = 0; i < 3; ++i) {
        found.rel_mse += d[i] * d[i] / (reference[i] * reference[i] + 0.01);
        found.largest = std::max(found.largest, std::abs(d[i]));
        found.mean += d[i];
        found.rmse += d[i] * d[i];
        sum += reference[i];
      }
    }
  }
  if (sum != 0) found.bias = found.mean / sum;
  const double values = 3.0 * static_cast<double>(pixels_.size());
  found.mean /= values;
  found.rel_mse /= values;
  found.rmse = std::sqrt(found.rmse / values);
  return found;
}

Film::Range Film::sample_range() const {
  Range range{std::numeric_limits<std::uint32_t>::max(), 0};
  for (const Pixel& pixel : pixels_) {
    const std::uint32_t count = pixel.count[0] + pixel.count[1];
    range.least = std::min(range.least, count);
    range.most = std::max(range.most, count);
  }
  return range;
}

// With a and b the means of the halves, of n_a and n_b samples, (a - b)^2 n_a n_b / (n_a + n_b)^2 has the variance of the whole
// mean as its expectation if the halves are independent, and a b that of r^2. Where it is wrong:
// - Halves of a low-discrepancy sequence avoid each other, which makes a - b larger than it would be: the estimate errs
// upwards.
// - 1 / (a b + 0.01) is convex: upwards again.
// - Light that no sample has found yet is not in it: downwards, for all estimators of this kind. The standard error and the
//   16 samples that render_passes asks for keep a lucky first look from ending a render.
ErrorEstimate Film::estimate_error() const {
  double sum = 0, sum_of_squares = 0;
  for (const Pixel& pixel : pixels_) {
    if (pixel.count[0] == 0 || pixel.count[1] == 0) return {};
    const double n_a = pixel.count[0], n_b = pixel.count[1];
    const double weight = n_a * n_b / ((n_a + n_b) * (n_a + n_b));
    double error = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = pixel.sum[0][i] / n_a, b = pixel.sum[1][i] / n_b;
      error += (a - b) * (a - b) * weight / (std::max(a * b, 0.0) + 0.01);
    }
    error *= 1.0 / 3;
    sum += error;
    sum_of_squares += error * error;
  }
  const auto n = static_cast<double>(pixels_.size());
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(sum_of_squares / n - mean * mean, 0.0) / n)};
}

}  // namespace ln
