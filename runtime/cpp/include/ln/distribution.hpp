#pragma once
// Piecewise-constant distributions over a list of things.

#include <vector>

#include "ln/math.hpp"

namespace ln {

/// Picks index i with probability weight[i] / sum. Probabilities are kept as multiples of 2^-24, the grid on which random
/// numbers lie, so that `pmf` is exactly what `sample` does; nothing of positive weight gets less than one such quantum.
/// Inversion keeps the stratification of the random number, which an alias table would destroy.
class Distribution {
 public:
  struct Sample {
    std::uint32_t index = 0;
    float pmf = 0;  // 0: there is nothing to pick
    float u = 0;    // the random number made new, in [0, 1)
  };

  Distribution() = default;
  /// Weights that are not positive and finite count as 0. At most 2^23 of them may be positive.
  explicit Distribution(const std::vector<double>& weights);

  bool empty() const { return total_ == 0; }
  std::size_t size() const { return bounds_.empty() ? 0 : bounds_.size() - 1; }
  /// Sum of the weights.
  double total() const { return total_; }

  float pmf(std::size_t i) const { return static_cast<float>(bounds_[i + 1] - bounds_[i]) * kQuantum; }

  Sample sample(float u) const {
    if (empty()) return {};
    const float scaled = u * kSteps;
    const auto key = static_cast<std::uint32_t>(scaled);
    // Find the last i with bounds_[i] <= key: its interval is not empty.
    std::size_t low = 0, high = size();
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      if (bounds_[middle] <= key)
        low = middle;
      else
        high = middle;
    }
    const auto width = static_cast<float>(bounds_[low + 1] - bounds_[low]);
    const float rest = (scaled - static_cast<float>(bounds_[low])) / width;
    return {static_cast<std::uint32_t>(low), width * kQuantum, std::min(rest, kOneMinusEpsilon)};
  }

 private:
  static constexpr float kSteps = 0x1p24f, kQuantum = 0x1p-24f;

  std::vector<std::uint32_t> bounds_;  // cumulated, in quanta; bounds_[0] = 0, bounds_[n] = 2^24
  double total_ = 0;
};

}  // namespace ln
