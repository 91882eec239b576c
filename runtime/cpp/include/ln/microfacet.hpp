#pragma once
// The GGX distribution of microfacet normals with Smith's shadowing and masking, sampled by visible normals.
//
// Directions are unit vectors in the shading frame (z: the normal); half vectors need not be normalised. All quotients
// are arranged such that neither grazing directions nor alpha = 1e-4 cancel or overflow in single precision.

#include "ln/math.hpp"

namespace ln {

/// (cos, sin) of 2 pi u, u in [0, 1], to 1e-7: the same bits on every machine.
inline Vec2 unit_circle(float u) {
  const float quarters = 4 * u;
  const float nearest = std::floor(quarters + 0.5f);
  const float x = (quarters - nearest) * (kPi / 2);
  const float x2 = x * x;
  const float s = x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 * (1.0f / 362880)))));
  const float c = 1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))));
  switch (static_cast<int>(nearest) & 3) {
    case 0: return {c, s};
    case 1: return {-s, c};
    case 2: return {-c, -s};
    default: return {s, -c};
  }
}

/// Direction of the upper hemisphere with density z / pi (Shirley and Chiu 1997: concentric squares to concentric circles).
inline Vec3 sample_cosine(const Vec2& u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  const bool x_major = std::abs(a) > std::abs(b);
  const float r = x_major ? a : b;
  const float q = x_major ? b / a : (b != 0 ? a / b : 0.0f);
  // cos and sin of q pi / 4 with q in [-1, 1].
  const float x = q * (kPi / 4), x2 = x * x;
  const float s = r * x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 * (1.0f / 362880)))));
  const float c = r * (1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320)))));
  // |r| can round to 1: keep the direction above the horizon.
  const float z = std::sqrt(std::max((1 - r) * (1 + r), 1e-10f));
  return x_major ? Vec3(c, s, z) : Vec3(s, c, z);
}

/// GGX of width `alpha` in [1e-4, 1].
struct Ggx {
  float alpha, alpha2;

  explicit Ggx(float a) : alpha(a), alpha2(a * a) {}

  /// z * sqrt(1 + alpha^2 tan^2): all shadowing functions are made of it. Smith's Lambda is (reach(z) / z - 1) / 2.
  float reach(float z) const { return std::sqrt(alpha2 + (1 - alpha2) * z * z); }

  /// Distribution of normals D at the unnormalised half vector `h` (Walter et al. 2007, eq. 33).
  float density(const Vec3& h) const {
    const float q = alpha * glm::dot(h, h) / std::max(h.x * h.x + h.y * h.y + alpha2 * h.z * h.z, 1e-30f);
    return q * q * kInvPi;
  }

  /// Height-correlated masking and shadowing over 4 cos cos (Heitz 2014, eq. 99).
  static float visibility(float z_o, float reach_o, float z_i, float reach_i) { return 0.5f / (z_o * reach_i + z_i * reach_o); }

  /// Smith's G1 (Heitz 2014, eq. 43).
  static float masking(float z, float reach) { return 2 * z / (z + reach); }

  /// Share of the cap of visible normals that is kept when only reflection above the horizon counts (Eto and Tokuyoshi
  /// 2023, "Bounded VNDF Sampling for the Smith-GGX BRDF", eq. 4).
  float cap_share(const Vec3& wo) const {
    const float s = 1 + std::sqrt(wo.x * wo.x + wo.y * wo.y);
    return (1 - alpha2) * s * s / (s * s + alpha2 * wo.z * wo.z);
  }

  /// Normal visible from `wo`; `share` = 1: all of them, density D G1 (wo.m) / wo.z; `cap_share(wo)`: only those that can
  /// reflect upwards (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps").
  Vec3 sample_visible(const Vec3& wo, const Vec2& u, float share) const {
    const Vec3 v = glm::normalize(Vec3(alpha * wo.x, alpha * wo.y, wo.z));
    const float b = share * v.z;
    const float z = (1 - u.y) * (1 + b) - b;
    const float r = safe_sqrt((1 - z) * (1 + z));
    const Vec2 c = unit_circle(u.x);
    const Vec3 h(alpha * (r * c.x + v.x), alpha * (r * c.y + v.y), std::max(z + v.z, 1e-7f));
    return glm::normalize(h);
  }

  /// Density of visible normals times 1 / (4 wo.m): the density of the reflected direction, per D.
  static float reflection_pdf(float z_o, float reach_o, float share) { return 0.5f / (share * z_o + reach_o); }
};

}  // namespace ln
