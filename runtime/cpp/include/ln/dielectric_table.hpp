#pragma once
// What a rough refracting surface loses by following one bounce only, for one refractive index: seen from both sides,
// by cosine and roughness. Scenes with rough solids build one per index; nothing else needs it.

#include "ln/albedo_table.hpp"

namespace ln {

class DielectricTable {
 public:
  static constexpr int kRows = 16, kColumns = 32;
  using Row = RoughnessRow<kRows>;

  /// `ior` > 0: index inside over the index outside.
  explicit DielectricTable(float ior);

  float ior() const { return ior_; }

  /// 1 - single-bounce albedo for light from the cosine `mu` on one side: of a surface whose Fresnel reflection is
  /// suppressed by a coating (x) and of a plain one (y).
  Vec2 deficit(bool outside, const Row& row, float alpha, float mu) const { return lookup(deficit_[outside], row, alpha, mu); }

  /// Its cosine-weighted averages over the hemisphere.
  Vec2 average(bool outside, float roughness) const {
    const Row at(roughness);
    const float* v = average_[outside][at.row];
    const float alpha = roughness * roughness;
    return Vec2(v[0] + at.fraction * (v[2] - v[0]), v[1] + at.fraction * (v[3] - v[1])) * alpha;
  }

 private:
  float ior_;
  float deficit_[2][kRows][kColumns][2];
  float average_[2][kRows][2];  // per alpha
};

}  // namespace ln
