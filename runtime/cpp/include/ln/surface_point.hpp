#pragma once
// A point on a surface, as a ray found it or an emitter sampled it.

#include "ln/math.hpp"

namespace ln {

inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;

/// What a ray query yields. `ng` is the geometric normal of the front side, not normalised.
struct Hit {
  float t = kInfinity;
  std::uint32_t triangle = kNoTriangle;
  float u = 0, v = 0;  // barycentric: point = (1-u-v) a + u b + v c

  bool found() const { return triangle != kNoTriangle; }
};

/// Position on a triangle with a bound of its rounding error, enough to spawn rays from.
struct SurfacePosition {
  Vec3 p{0};
  float error = 0;   // how far p may lie off its surface, for a ray query too; see position_error
  Vec3 ng{0, 0, 1};  // geometric normal of the front side, unit length
};

/// A ray; `direction` is unit length unless said otherwise.
struct Ray {
  Vec3 origin{0};
  Vec3 direction{0, 0, 1};
  float tmax = kInfinity;
};

/// Bound of the error of a position that was interpolated from terms whose absolute values add up to `magnitude`. The same
/// for all directions: a ray query rounds in the triangle's largest coordinates even where it lies exactly at 0. 7 roundings
/// of the interpolation (Pharr, Jakob & Humphreys, PBR 4th ed., section 6.8.4), the rest for the query.
inline float position_error(const Vec3& magnitude) { return rounding_bound(24) * max_component(magnitude); }

/// The origin of a ray that leaves `at` towards `w`: moved off the surface by the error bound of the position, to the
/// side that `w` points to.
LN_INLINE Vec3 offset_origin(const SurfacePosition& at, const Vec3& w) {
  return at.p + std::copysign(at.error, glm::dot(w, at.ng)) * at.ng;
}

LN_INLINE Ray spawn_ray(const SurfacePosition& at, const Vec3& w) { return {offset_origin(at, w), w, kInfinity}; }

/// A ray from `from` that ends just before `to`: both ends are moved off their surfaces, so that neither can block it.
LN_INLINE Ray spawn_ray_to(const SurfacePosition& from, const SurfacePosition& to) {
  const Vec3 o = offset_origin(from, to.p - from.p);
  const Vec3 e = offset_origin(to, o - to.p);
  const Vec3 d = e - o;
  const float length = glm::length(d);
  return {o, length > 0 ? d / length : Vec3(0, 0, 1), length * (1 - 0x1p-20f)};
}

}  // namespace ln
