#pragma once
// The shapes of light sources: how they look from a point and how points and directions on them are chosen.

#include "ln/math.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// A triangle or a parallelogram that emits. Corners: a, a + e1, (a + e1 + e2,) a + e2, counter-clockwise from the front.
struct AreaLight {
  Vec3 a{0}, e1{0}, e2{0};
  Vec3 n{0, 0, 1};                        // unit normal of the front
  float size = 0;                         // |e1 x e2|: area of the parallelogram, twice that of the triangle
  Color radiance{0};                      // [W/(m^2 sr)], mean if it varies
  std::uint32_t triangle = kNoTriangle;   // the first of one or two
  bool quad = false, double_sided = false, varies = false;

  float area() const { return quad ? size : 0.5f * size; }

  /// Point a + s e1 + t e2.
  SurfacePosition at(float s, float t) const {
    return {a + s * e1 + t * e2, rounding_bound(16) * (glm::abs(a) + glm::abs(e1) + glm::abs(e2)), n};
  }

  /// Height of `p` above the front; at most 0: the front cannot be seen from there.
  float height(const Vec3& p) const { return glm::dot(p - a, n); }
  bool seen_from(float height) const { return double_sided ? height != 0 : height > 0; }
};

namespace detail {

/// Half the solid angle of a triangle whose corners have distances l0, l1, l2 and inner products rij, seen from the origin
/// (van Oosterom & Strackee 1983): its tangent is determinant / denominator. Accurate for tiny and for nearly
/// hemispherical triangles alike, because the determinant is taken from the edges.
inline float triangle_denominator(float l0, float l1, float l2, float r01, float r02, float r12) {
  return l0 * l1 * l2 + r01 * l2 + r02 * l1 + r12 * l0;
}

}  // namespace detail

/// Solid angle of a light that is seen from `p`, which is `height` above it.
inline float solid_angle(const AreaLight& light, const Vec3& p, float height) {
  const float determinant = std::abs(height) * light.size;
  const Vec3 r0 = light.a - p, r1 = r0 + light.e1, r2 = r0 + light.e2;
  const float l0 = glm::length(r0), l1 = glm::length(r1), l2 = glm::length(r2);
  if (!light.quad) {
    return 2 * std::atan2(determinant, detail::triangle_denominator(l0, l1, l2, glm::dot(r0, r1), glm::dot(r0, r2), glm::dot(r1, r2)));
  }
  const Vec3 r3 = r1 + light.e2;
  const float l3 = glm::length(r3), r03 = glm::dot(r0, r3);
  const float first = std::atan2(determinant, detail::triangle_denominator(l0, l1, l3, glm::dot(r0, r1), r03, glm::dot(r1, r3)));
  const float second = std::atan2(determinant, detail::triangle_denominator(l0, l3, l2, r03, glm::dot(r0, r2), glm::dot(r3, r2)));
  return 2 * (first + second);
}

/// A point on a light and the solid-angle density with which it was chosen.
struct AreaSample {
  float s = 0, t = 0;  // point = a + s e1 + t e2
  float pdf_w = 0;     // 0: the light has no extent from here
};

/// Chooses a point such that its direction from `p` is uniform within the light's solid angle (Arvo 1995, in the form of
/// Peters 2021, "BRDF Importance Sampling for Polygonal Lights", section 4, with barycentric coordinates read off the
/// construction instead of found by intersection: it keeps its precision down to lights of any smallness, where it
/// becomes uniform sampling of the area). The density is 1 / solid_angle() to the last bit.
inline AreaSample sample_solid_angle(const AreaLight& light, const Vec3& p, float height, const Vec2& u) {
  const float determinant = std::abs(height) * light.size;
  const Vec3 r0 = light.a - p, r1 = r0 + light.e1, r2 = r0 + light.e2;
  const float l0 = glm::length(r0), l1 = glm::length(r1), l2 = glm::length(r2);

  // The fan around corner 0: triangle (0, b, c), where quads have two to choose from. tau: half the solid angle that is
  // swept from b.
  float lb = l1, lc = l2, r0b = glm::dot(r0, r1), r0c, rbc, solid, tau;
  bool second = false;
  if (!light.quad) {
    r0c = glm::dot(r0, r2);
    rbc = glm::dot(r1, r2);
    const float half = std::atan2(determinant, detail::triangle_denominator(l0, l1, l2, r0b, r0c, rbc));
    solid = 2 * half;
    tau = u.x * half;
  } else {
    const Vec3 r3 = r1 + light.e2;
    const float l3 = glm::length(r3), r03 = glm::dot(r0, r3), r02 = glm::dot(r0, r2), r13 = glm::dot(r1, r3), r32 = glm::dot(r3, r2);
    const float first = std::atan2(determinant, detail::triangle_denominator(l0, l1, l3, r0b, r03, r13));
    const float other = std::atan2(determinant, detail::triangle_denominator(l0, l3, l2, r03, r02, r32));
    solid = 2 * (first + other);
    tau = u.x * (first + other);
    second = tau >= first;
    if (second) {
      tau -= first;
      lb = l3, lc = l2, r0b = r03, r0c = r02, rbc = r32;
    } else {
      lc = l3, r0c = r03, rbc = r13;
    }
  }
  if (!(solid > 0)) return {};

  // Corner c moves along its arc to c' = k_b b + k_c c (unit vectors), such that (0, b, c') has the solid angle 2 tau.
  const float inv_l0 = 1 / l0, inv_lb = 1 / lb, inv_lc = 1 / lc;
  const float cos_bc = rbc * inv_lb * inv_lc;
  const float g0 = determinant * inv_l0 * inv_lb * inv_lc;
  const float g1 = r0c * inv_l0 * inv_lc + cos_bc;
  const float g2 = 1 + r0b * inv_l0 * inv_lb;
  const float sin_tau = std::sin(tau), cos_tau = std::cos(tau);
  const float x = g0 * cos_tau - g1 * sin_tau, y = g2 * sin_tau;
  const float norm = x * x + y * y + 2 * x * y * cos_bc;
  if (!(norm > 0)) return {};
  const float k_b = (x * x - y * y) / norm, k_c = 2 * y * (x + y * cos_bc) / norm;

  // A point on the arc from corner 0 to c': k_0 a + k c'.
  const float one_minus_cos = std::max(0.0f, 1 - (k_b * r0b * inv_lb + k_c * r0c * inv_lc) * inv_l0);
  const float k = std::sqrt(u.y * (2 - u.y * one_minus_cos) / (2 - one_minus_cos));
  const float k_0 = 1 - u.y * one_minus_cos - k * (1 - one_minus_cos);

  // Onto the plane of the light.
  const float w0 = std::max(0.0f, k_0 * inv_l0), wb = std::max(0.0f, k * k_b * inv_lb), wc = std::max(0.0f, k * k_c * inv_lc);
  const float sum = w0 + wb + wc;
  if (!(sum > 0) || !std::isfinite(sum)) return {};
  const float b = wb / sum, c = wc / sum;
  AreaSample result{b, c, 1 / solid};
  if (light.quad) {
    if (second) result.s = b, result.t = b + c;  // b = corner 3, c = corner 2 (a + e2)
    else result.s = b + c, result.t = c;         // b = corner 1, c = corner 3
    result.s = std::min(result.s, 1.0f);
    result.t = std::min(result.t, 1.0f);
  }
  return result;
}

/// A point or spot light. Falloff of spots: the reference code of KHR_lights_punctual.
struct PunctualSource {
  Vec3 position{0};
  Vec3 direction{0, 0, -1};
  Color intensity{0};          // on the axis [W/sr, normalised units]
  float cos_outer = -1;
  float scale = 0;             // 0: point light

  static PunctualSource spot(const Vec3& position, const Vec3& direction, const Color& intensity, float cos_inner, float cos_outer) {
    return {position, direction, intensity, cos_outer, 1 / std::max(0.001f, cos_inner - cos_outer)};
  }

  float attenuation(float cos_theta) const {
    if (scale == 0) return 1;
    return sqr(std::clamp((cos_theta - cos_outer) * scale, 0.0f, 1.0f));
  }
  /// Solid angle weighted by the attenuation: power / intensity.
  float effective_solid_angle() const;
  /// Cosine to the axis with density proportional to the attenuation.
  float sample_cos(float u) const;
};

}  // namespace ln
