#include "ln/distribution.hpp"

namespace ln {

Distribution::Distribution(const std::vector<double>& weights) {
  constexpr std::uint32_t kAll = 1u << 24;
  const auto usable = [](double w) { return w > 0 && std::isfinite(w); };
  std::uint32_t positive = 0;
  for (const double w : weights) {
    if (!usable(w)) continue;
    total_ += w;
    ++positive;
  }
  if (total_ == 0) return;

  // Round the cumulated weights, but leave a quantum to each positive weight, before and behind.
  bounds_.reserve(weights.size() + 1);
  bounds_.push_back(0);
  double sum = 0;
  std::uint32_t bound = 0;
  for (const double w : weights) {
    if (usable(w)) {
      sum += w;
      --positive;
      const auto target = static_cast<std::uint32_t>(std::llround(sum / total_ * kAll));
      bound = std::min(std::max(target, bound + 1), kAll - positive);
    }
    bounds_.push_back(bound);
  }
}

}  // namespace ln
