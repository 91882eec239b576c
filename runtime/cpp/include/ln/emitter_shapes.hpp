#pragma once
// The shapes of light sources: how they look from a point and how points and directions on them are chosen.

#include "ln/math.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// A triangle or a parallelogram that emits. Corners: a, a + e1, (a + e1 + e2,) a + e2, counter-clockwise from the front.
struct AreaLight {
  Vec3 a{0}, e1{0}, e2{0};
  Vec3 n{0, 0, 1};                       // unit normal of the front
  float size = 0;                        // |e1 x e2|: area of the parallelogram, twice that of the triangle
  float error = 0;                       // of positions on it
  Color radiance{0};                     // [W/(m^2 sr)], mean if it varies
  std::uint32_t triangle = kNoTriangle;  // the first of one or two
  bool quad = false, double_sided = false, varies = false;

  AreaLight() = default;
  AreaLight(const Vec3& a, const DVec3& edge1, const DVec3& edge2, bool quad) : a(a), e1(edge1), e2(edge2), quad(quad) {
    const DVec3 normal = glm::cross(edge1, edge2);
    const double length = glm::length(normal);
    // Below what float can express, it remains without size: no light.
    if (!(length > 1e-37) || !std::isfinite(length)) return;
    n = Vec3(normal / length);
    size = static_cast<float>(length);
    error = position_error(glm::abs(a) + glm::abs(e1) + glm::abs(e2));
  }

  float area() const { return quad ? size : 0.5f * size; }

  /// Point a + s e1 + t e2.
  SurfacePosition at(float s, float t) const { return {a + s * e1 + t * e2, error, n}; }

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

/// atan2(y, x) for y >= 0, within 1e-7 (interpolated at Chebyshev's nodes).
inline float angle_of(float y, float x) {
  const float abs_x = std::abs(x), high = std::max(y, abs_x), low = std::min(y, abs_x);
  const float a = high > 0 ? low / high : 0.0f, t = a * a;
  float r = 0.0027662835f;
  r = r * t - 0.0157312491f;
  r = r * t + 0.0421376236f;
  r = r * t - 0.0745685483f;
  r = r * t + 0.106183706f;
  r = r * t - 0.141977978f;
  r = r * t + 0.19991872f;
  r = r * t - 0.333330367f;
  r = (r * t + 0.999999982f) * a;
  r = y > abs_x ? 0.5f * kPi - r : r;
  return x < 0 ? kPi - r : r;
}
inline double angle_of(double y, double x) { return std::atan2(y, x); }

/// Sine and cosine of an angle in [0, pi], in the same way.
inline void sine_cosine(float angle, float& sine, float& cosine) {
  const bool obtuse = angle > 0.5f * kPi;
  const float x = obtuse ? kPi - angle : angle, t = x * x;
  sine = ((((2.60510764e-06f * t - 0.000198090174f) * t + 0.00833305017f) * t - 0.166666579f) * t + 1) * x;
  const float c = ((((-2.60506575e-07f * t + 2.47601097e-05f) * t - 0.00138883603f) * t + 0.0416666362f) * t - 0.5f) * t + 1;
  cosine = obtuse ? -c : c;
}
inline void sine_cosine(double angle, double& sine, double& cosine) { sine = std::sin(angle), cosine = std::cos(angle); }

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

  LN_INLINE ViewedLight(const AreaLight& light, const Vec3& p, float height) {
    using V = glm::vec<3, T>;
    determinant = std::abs(T(height)) * T(light.size);
    const V r0 = V(light.a) - V(p), r1 = r0 + V(light.e1), r2 = r0 + V(light.e2);
    l0 = glm::length(r0), l1 = glm::length(r1), l2 = glm::length(r2);
    r01 = glm::dot(r0, r1), r02 = glm::dot(r0, r2);
    if (light.quad) {
      const V r3 = r1 + V(light.e2);
      l3 = glm::length(r3);
      r03 = glm::dot(r0, r3), r13 = glm::dot(r1, r3), r32 = glm::dot(r3, r2);
      first = angle_of(determinant, triangle_denominator(l0, l1, l3, r01, r03, r13));
      second = angle_of(determinant, triangle_denominator(l0, l3, l2, r03, r02, r32));
    } else {
      r12 = glm::dot(r1, r2);
      first = angle_of(determinant, triangle_denominator(l0, l1, l2, r01, r02, r12));
      second = 0;
    }
  }

  /// The point that sweeps the share u.x of the solid angle around corner 0, from corner 1 to corner 2, and the share u.y
  /// from corner 0 outwards.
  LN_INLINE AreaSample sample(bool quad, const Vec2& u) const {
    // The triangle (0, b, c) that is swept, and half the solid angle from b on.
    T lb = l1, lc = l2, r0b = r01, r0c = r02, rbc = r12, tau = T(u.x) * (first + second);
    const bool in_second = quad && tau >= first;
    if (in_second) {
      tau -= first;
      lb = l3, r0b = r03, rbc = r32;
    } else if (quad) {
      lc = l3, r0c = r03, rbc = r13;
    }

    // Corner c moves along its arc to c' = (k_b b + k_c c) / norm (unit vectors), such that (0, b, c') has the solid
    // angle 2 tau.
    if (!(l0 * lb * lc > 0)) return {};  // seen from a corner
    const T inv_l0 = 1 / l0, inv_lb = 1 / lb, inv_lc = 1 / lc;
    const T cos_bc = rbc * inv_lb * inv_lc;
    const T g1 = r0c * lb + rbc * l0, g2 = l0 * lb * lc + r0b * lc;
    T sin_tau, cos_tau;
    sine_cosine(tau, sin_tau, cos_tau);
    // Normalised, as squares of these can be too small for float.
    const T scale = inv_l0 * inv_lb * inv_lc;
    const T x = (determinant * cos_tau - g1 * sin_tau) * scale, y = g2 * sin_tau * scale;
    const T norm = x * x + y * y + 2 * x * y * cos_bc;
    if (!(norm > 0)) return {};
    const T k_b = x * x - y * y, k_c = 2 * y * (x + y * cos_bc);

    // A point on the arc from corner 0 to c': k_0 a + k c'. The arc's cosine is c / norm.
    const T inv_norm = 1 / norm;
    const T c = std::min((k_b * r0b * inv_lb + k_c * r0c * inv_lc) * inv_l0, norm), part = T(u.y) * (norm - c);
    if (!(norm + c > 0)) return {};  // half a circle, in the plane of the light
    const T k = std::sqrt(std::max(T(0), u.y * (2 * norm - part) / (norm + c)));
    const T k_0 = 1 - (part + k * c) * inv_norm, k_1 = k * inv_norm;

    // Onto the plane of the light.
    const T w0 = std::max(T(0), k_0 * inv_l0), wb = std::max(T(0), k_1 * k_b * inv_lb), wc = std::max(T(0), k_1 * k_c * inv_lc);
    const T sum = w0 + wb + wc;
    if (!(sum > 0) || !std::isfinite(sum)) return {};
    const T inv_sum = 1 / sum;
    const auto at_b = static_cast<float>(wb * inv_sum), at_c = static_cast<float>(wc * inv_sum);
    if (!quad) return {at_b, at_c, 1};
    const float both = std::min(at_b + at_c, 1.0f);
    return in_second ? AreaSample{at_b, both, 1} : AreaSample{both, at_c, 1};
  }
};

LN_NOINLINE inline AreaSample sample_precisely(const AreaLight& light, const Vec3& p, float height, const Vec2& u) {
  return ViewedLight<double>(light, p, height).sample(light.quad, u);
}

}  // namespace detail

/// Solid angle of a light that is seen from `p`, which is `height` above it.
LN_INLINE float solid_angle(const AreaLight& light, const Vec3& p, float height) {
  const detail::ViewedLight<float> view(light, p, height);
  return 2 * (view.first + view.second);
}

/// Chooses a point such that its direction from `p` is uniform within the light's solid angle (Arvo 1995, in the form of
/// Peters 2021, "BRDF Importance Sampling for Polygonal Lights", section 4, with barycentric coordinates read off the
/// construction instead of found by intersection: it keeps its precision down to lights of any smallness, where it
/// becomes uniform sampling of the area). The density is 1 / solid_angle() to the last bit.
LN_INLINE AreaSample sample_solid_angle(const AreaLight& light, const Vec3& p, float height, const Vec2& u) {
  const detail::ViewedLight<float> view(light, p, height);
  const float solid = 2 * (view.first + view.second);
  if (!(solid > 0)) return {};
  // Next to a light, the arcs are nearly half circles: their ends say too little about what is between them.
  constexpr float kLarge = 4;
  AreaSample result = solid < kLarge ? view.sample(light.quad, u) : detail::sample_precisely(light, p, height, u);
  result.pdf_w /= solid;
  return result;
}

/// A point or spot light. Falloff of spots: the reference code of KHR_lights_punctual.
struct PunctualSource {
  Vec3 position{0};
  Vec3 direction{0, 0, -1};
  Color intensity{0};  // on the axis [W/sr, normalised units]
  float cos_outer = -1;
  float scale = 0;  // 0: point light

  static PunctualSource spot(const Vec3& position, const Vec3& direction, const Color& intensity, float cos_inner,
                             float cos_outer) {
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
