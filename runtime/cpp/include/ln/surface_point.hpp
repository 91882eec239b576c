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
  Vec3 p_error{0};     // absolute bound per component
  Vec3 ng{0, 0, 1};    // geometric normal of the front side, unit length
};

/// A ray; `direction` is unit length unless said otherwise.
struct Ray {
  Vec3 origin{0};
  Vec3 direction{0, 0, 1};
  float tmax = kInfinity;
};

inline float next_float_up(float x) {
  if (x == kInfinity) return x;
  if (x == 0) x = 0.0f;
  std::uint32_t bits = __builtin_bit_cast(std::uint32_t, x);
  bits = x >= 0 ? bits + 1 : bits - 1;
  return __builtin_bit_cast(float, bits);
}
inline float next_float_down(float x) { return -next_float_up(-x); }

/// The origin of a ray that leaves `at` towards `w`: moved off the surface by the error bound of the position, to the
/// side that `w` points to (Pharr, Jakob & Humphreys, PBR 4th ed., section 6.8.6).
LN_INLINE Vec3 offset_origin(const SurfacePosition& at, const Vec3& w) {
  // A quarter more than the bound covers the rounding of the sum: an eighth of a bound that counts eight roundings at least.
  const float d = 1.25f * glm::dot(glm::abs(at.ng), at.p_error);
  return at.p + std::copysign(d, glm::dot(w, at.ng)) * at.ng;
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
