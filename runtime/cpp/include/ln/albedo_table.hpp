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

/// Column of cosine `mu`, from 0 to 1.
inline float grazing_column(float alpha, float mu) {
  return std::sqrt(std::clamp(mu * (1 + alpha) / (mu + alpha), 0.0f, 1.0f));
}

/// Bilinear look-up between two rows of pairs of values, `t` from one to the other, at `column` in [0, 1].
template <int Columns>
inline Vec2 lookup(const float (*row)[2], const float (*next)[2], float t, float column) {
  const float x = column * (Columns - 1);
  const int i = std::min(static_cast<int>(x), Columns - 2);
  const float s = x - static_cast<float>(i);
  const float wa = (1 - t) * (1 - s), wb = (1 - t) * s, wc = t * (1 - s), wd = t * s;
  const float *a = row[i], *b = row[i + 1], *c = next[i], *d = next[i + 1];
  return {wa * a[0] + wb * b[0] + wc * c[0] + wd * d[0], wa * a[1] + wb * b[1] + wc * c[1] + wd * d[1]};
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
/// Cosine-weighted averages of what `facets` returns, as pairs (deficit / alpha^2, Schlick part).
extern const float kAverage[kAverages][2];

inline FacetAlbedo facets(const float (*row)[2], const float (*next)[2], float fraction, float alpha, float mu) {
  const Vec2 v = lookup<kColumns>(row, next, fraction, grazing_column(alpha, mu));
  const float x = std::clamp(1 - mu - alpha * v.y, 0.0f, 1.0f), x2 = x * x;
  return {v.x, (1 - v.x) * x2 * x2 * x};
}

inline FacetAlbedo facets(const Row& at, float alpha, float mu) {
  return facets(kFacets[at.row], kFacets[at.row + 1], at.fraction, alpha, mu);
}

inline FacetAlbedo facets_average(float roughness) {
  const RoughnessRow<kAverages> at(roughness);
  const float* v = kAverage[at.row];
  const float alpha = roughness * roughness;
  return {(v[0] + at.fraction * (v[2] - v[0])) * alpha * alpha, v[1] + at.fraction * (v[3] - v[1])};
}
}  // namespace albedo_table

}  // namespace ln
