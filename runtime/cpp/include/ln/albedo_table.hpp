#pragma once
// How much a rough surface of white microfacets reflects after one bounce: E(mu, alpha), as tables over cosine and
// roughness. What is missing from 1, the deficit, is what bounces more than once.
//
// The columns are u = sqrt(mu (1 + alpha) / (mu + alpha)): GGX depends on mu / alpha where both are small, so that one
// grid serves all roughnesses down to the smallest, angles down to grazing. The rows are roughness = sqrt(alpha).

#include "ln/math.hpp"

namespace ln {

inline constexpr float kMinRoughness = 0.01f;  // below: ideal specular

/// Where a roughness lies in a table of `Rows` rows.
template <int Rows>
struct RoughnessRow {
  std::int32_t row = 0;
  float fraction = 0;

  RoughnessRow() = default;
  explicit RoughnessRow(float roughness) {
    const float y = std::clamp((roughness - kMinRoughness) / (1 - kMinRoughness), 0.0f, 1.0f) * (Rows - 1);
    row = std::min(static_cast<std::int32_t>(y), Rows - 2);
    fraction = y - static_cast<float>(row);
  }
};

/// Bilinear look-up of a pair of values in a table of Rows x Columns pairs.
template <int Rows, int Columns>
inline Vec2 lookup(const float (&table)[Rows][Columns][2], const RoughnessRow<Rows>& at, float alpha, float mu) {
  const float u = std::sqrt(std::clamp(mu * (1 + alpha) / (mu + alpha), 0.0f, 1.0f)) * (Columns - 1);
  const int column = std::min(static_cast<int>(u), Columns - 2);
  const float s = u - static_cast<float>(column), t = at.fraction;
  const float* a = table[at.row][column];
  const float* b = table[at.row + 1][column];
  const float wa = (1 - t) * (1 - s), wb = (1 - t) * s, wc = t * (1 - s), wd = t * s;
  return {wa * a[0] + wb * a[2] + wc * b[0] + wd * b[2], wa * a[1] + wb * a[3] + wc * b[1] + wd * b[3]};
}

/// Single-bounce albedo of GGX with Schlick's Fresnel: it is f0 * (1 - deficit - schlick) + f90 * schlick.
struct FacetAlbedo {
  float deficit;  // 1 - E: what a white surface loses
  float schlick;  // average of Schlick's weight times E
};

namespace albedo_table {
inline constexpr int kRows = 64, kColumns = 64, kAverages = 256;
using Row = RoughnessRow<kRows>;
/// Pairs (deficit, shift): the average of Schlick's weight over what is reflected is that of the cosine mu + alpha * shift.
extern const float kFacets[kRows][kColumns][2];
/// Pairs (cosine-weighted average deficit / alpha^2, average of the Schlick part).
extern const float kAverage[kAverages][2];

inline FacetAlbedo facets(const Row& row, float alpha, float mu) {
  const Vec2 v = lookup(kFacets, row, alpha, mu);
  return {v.x, (1 - v.x) * std::clamp(1 - mu - alpha * v.y, 0.0f, 1.0f) * sqr(sqr(std::clamp(1 - mu - alpha * v.y, 0.0f, 1.0f)))};
}

inline FacetAlbedo facets_average(float roughness) {
  const RoughnessRow<kAverages> at(roughness);
  const float* v = kAverage[at.row];
  const float alpha = roughness * roughness;
  return {(v[0] + at.fraction * (v[2] - v[0])) * alpha * alpha, v[1] + at.fraction * (v[3] - v[1])};
}
}  // namespace albedo_table

}  // namespace ln
