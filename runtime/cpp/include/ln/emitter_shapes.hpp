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

/// A point on a light and the solid-angle density with which it was chosen.
struct AreaSample {
  float s = 0, t = 0;  // point = a + s e1 + t e2
  float pdf_w = 0;     // 0: the light has no extent from here
};

namespace detail {

/// Tangent of half the solid angle of a triangle whose corners have distances l0, l1, l2 and inner products rij, as seen
/// from the origin, is |determinant| / this (van Oosterom & Strackee 1983). With the determinant taken from the edges it
/// is accurate for tiny and for nearly hemispherical triangles alike.
template <class T>
T triangle_denominator(T l0, T l1, T l2, T r01, T r02, T r12) {
  return l0 * l1 * l2 + r01 * l2 + r02 * l1 + r12 * l0;
}

/// A light seen from a point: its corners' distances and inner products. Corner 3 is the one opposite to corner 0.
template <class T>
struct ViewedLight {
  T determinant;
  T l0, l1, l2, l3;
  T r01, r02, r12, r03, r13, r32;
  T first, second;  // half the solid angles of the triangles (0, 1, 3) and (0, 3, 2); of a triangle (0, 1, 2) and zero

  ViewedLight(const AreaLight& light, const Vec3& p, float height) {
    using V = glm::vec<3, T>;
    determinant = std::abs(T(height)) * T(light.size);
    const V r0 = V(light.a) - V(p), r1 = r0 + V(light.e1), r2 = r0 + V(light.e2);
    l0 = glm::length(r0), l1 = glm::length(r1), l2 = glm::length(r2);
    r01 = glm::dot(r0, r1), r02 = glm::dot(r0, r2);
    if (light.quad) {
      const V r3 = r1 + V(light.e2);
      l3 = glm::length(r3);
      r03 = glm::dot(r0, r3), r13 = glm::dot(r1, r3), r32 = glm::dot(r3, r2);
      first = std::atan2(determinant, triangle_denominator(l0, l1, l3, r01, r03, r13));
      second = std::atan2(determinant, triangle_denominator(l0, l3, l2, r03, r02, r32));
    } else {
      r12 = glm::dot(r1, r2);
      first = std::atan2(determinant, triangle_denominator(l0, l1, l2, r01, r02, r12));
      second = 0;
    }
  }

  /// The point that sweeps the share u.x of the solid angle around corner 0, from corner 1 to corner 2, and the share u.y
  /// from corner 0 outwards.
  AreaSample sample(bool quad, const Vec2& u) const {
    // The triangle (0, b, c) that is swept, and half the solid angle from b on.
    T lb = l1, lc = l2, r0b = r01, r0c = r02, rbc = r12, tau = T(u.x) * (first + second);
    const bool in_second = quad && tau >= first;
    if (in_second) {
      tau -= first;
      lb = l3, r0b = r03, rbc = r32;
    } else if (quad) {
      lc = l3, r0c = r03, rbc = r13;
    }

    // Corner c moves along its arc to c' = k_b b + k_c c (unit vectors), such that (0, b, c') has the solid angle 2 tau.
    const T inv_l0 = 1 / l0, inv_lb = 1 / lb, inv_lc = 1 / lc;
    const T cos_bc = rbc * inv_lb * inv_lc;
    const T g0 = determinant * inv_l0 * inv_lb * inv_lc;
    const T g1 = r0c * inv_l0 * inv_lc + cos_bc;
    const T g2 = 1 + r0b * inv_l0 * inv_lb;
    const T sin_tau = std::sin(tau), cos_tau = std::cos(tau);
    const T x = g0 * cos_tau - g1 * sin_tau, y = g2 * sin_tau;
    const T norm = x * x + y * y + 2 * x * y * cos_bc;
    if (!(norm > 0)) return {};
    const T k_b = (x * x - y * y) / norm, k_c = 2 * y * (x + y * cos_bc) / norm;

    // A point on the arc from corner 0 to c': k_0 a + k c'.
    const T one_minus_cos = std::max(T(0), 1 - (k_b * r0b * inv_lb + k_c * r0c * inv_lc) * inv_l0);
    const T k = std::sqrt(std::max(T(0), u.y * (2 - u.y * one_minus_cos) / (2 - one_minus_cos)));
    const T k_0 = 1 - u.y * one_minus_cos - k * (1 - one_minus_cos);

    // Onto the plane of the light.
    const T w0 = std::max(T(0), k_0 * inv_l0), wb = std::max(T(0), k * k_b * inv_lb), wc = std::max(T(0), k * k_c * inv_lc);
    const T sum = w0 + wb + wc;
    if (!(sum > 0) || !std::isfinite(sum)) return {};
    const auto b = static_cast<float>(wb / sum), c = static_cast<float>(wc / sum);
    if (!quad) return {b, c, 1};
    return in_second ? AreaSample{b, std::min(b + c, 1.0f), 1} : AreaSample{std::min(b + c, 1.0f), c, 1};
  }
};

}  // namespace detail

/// Solid angle of a light that is seen from `p`, which is `height` above it.
inline float solid_angle(const AreaLight& light, const Vec3& p, float height) {
  const detail::ViewedLight<float> view(light, p, height);
  return 2 * (view.first + view.second);
}

/// Chooses a point such that its direction from `p` is uniform within the light's solid angle (Arvo 1995, in the form of
/// Peters 2021, "BRDF Importance Sampling for Polygonal Lights", section 4, with barycentric coordinates read off the
/// construction instead of found by intersection: it keeps its precision down to lights of any smallness, where it
/// becomes uniform sampling of the area). The density is 1 / solid_angle() to the last bit.
inline AreaSample sample_solid_angle(const AreaLight& light, const Vec3& p, float height, const Vec2& u) {
  const detail::ViewedLight<float> view(light, p, height);
  const float solid = 2 * (view.first + view.second);
  if (!(solid > 0)) return {};
  // Next to a light, the arcs are nearly half circles: their ends say too little about what is between them.
  constexpr float kLarge = 4;
  AreaSample result = solid < kLarge ? view.sample(light.quad, u) : detail::ViewedLight<double>(light, p, height).sample(light.quad, u);
  result.pdf_w /= solid;
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
