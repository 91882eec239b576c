#pragma once
// What a rough refracting surface loses by following one bounce only, for one refractive index: seen from both sides,
// by cosine and roughness. Scenes with rough solids build one per index; nothing else needs it.

#include <array>
#include <vector>

#include "ln/albedo_table.hpp"

namespace ln {

class DielectricTable {
 public:
  /// `ior` > 0: index inside over the index outside. A table for the roughnesses that occur takes some 10 ms if it is a
  /// single one, else some 50 ms.
  explicit DielectricTable(float ior, float min_roughness = kMinRoughness, float max_roughness = 1);

  /// What is missing from the single-bounce albedo for light from the cosine `mu` on one side: of a surface whose Fresnel
  /// reflection is suppressed by a coating (x), and of a plain one (y).
  Vec2 deficit(bool outside, float roughness, float mu) const {
    const float y = row_of(roughness) * static_cast<float>(rows_ - 1);
    const int row = static_cast<int>(y), next = std::min(row + 1, rows_ - 1);
    const auto& side = deficit_[outside];
    return lookup<kColumns>(side[row].data(), side[next].data(), y - static_cast<float>(row),
                            column(roughness * roughness, mu));
  }

  /// Its cosine-weighted average over the hemisphere.
  Vec2 average(bool outside, float roughness) const {
    const int last = kFiner * (rows_ - 1);
    const float y = row_of(roughness) * static_cast<float>(last);
    const int row = static_cast<int>(y), next = std::min(row + 1, last);
    const auto& side = average_[outside];
    return glm::mix(side[row], side[next], y - static_cast<float>(row)) * sqr(roughness * roughness);
  }

 private:
  static constexpr int kColumns = 80, kFiner = 8;
  using Row = float[kColumns][2];
  struct Pairs {
    Row values;
    const Row& data() const { return values; }
  };

  /// Half of the columns for grazing directions, half for the critical angle, wherever it is.
  static float column(float alpha, float mu) { return 0.5f * (grazing_column(alpha, mu) + mu); }

  /// Row of a roughness, from 0 to 1, denser at the smooth end: roughness = min + span (x + x^2) / 2.
  float row_of(float roughness) const {
    const float t = std::clamp((roughness - min_roughness_) * inverse_span_, 0.0f, 1.0f);
    return 0.5f * (std::sqrt(1 + 8 * t) - 1);
  }

  float min_roughness_, inverse_span_;
  int rows_;
  std::array<std::vector<Pairs>, 2> deficit_;  // inside, outside; by roughness
  std::array<std::vector<Vec2>, 2> average_;   // per alpha^2; kFiner times as many rows
};

}  // namespace ln
