#pragma once
// Vectors, colours and the few constants and helpers that everything shares.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#define GLM_FORCE_INLINE
#define GLM_FORCE_SIZE_T_LENGTH
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

/// For the few functions that are the inside of every sample: their callers are what is measured.
#define LN_INLINE [[gnu::always_inline]] inline
#define LN_NOINLINE [[gnu::noinline]]

namespace ln {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using DVec3 = glm::dvec3;
using UVec3 = glm::uvec3;

/// Linear Rec. 709 triple; its unit (radiance, irradiance, flux, reflectance) is said where it is used.
using Color = glm::vec3;

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Largest float below 1: every random number lies in [0, kOneMinusEpsilon].
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

inline float sqr(float x) { return x * x; }
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }
inline float max_component(const Color& c) { return std::max(c.x, std::max(c.y, c.z)); }
inline float min_component(const Color& c) { return std::min(c.x, std::min(c.y, c.z)); }
inline float mean_component(const Color& c) { return (c.x + c.y + c.z) * (1.0f / 3.0f); }
inline float luminance(const Color& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
inline bool is_black(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline bool is_finite(const Color& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

/// Upper bound of the relative rounding error of `n` chained float operations (Higham's gamma).
constexpr float rounding_bound(int n) {
  constexpr float kHalfUlp = 0x1p-24f;
  return (static_cast<float>(n) * kHalfUlp) / (1 - static_cast<float>(n) * kHalfUlp);
}

/// Right-handed orthonormal frame with `n` as its z axis.
struct Frame {
  Vec3 s, t, n;

  Vec3 to_local(const Vec3& v) const { return {glm::dot(v, s), glm::dot(v, t), glm::dot(v, n)}; }
  Vec3 to_world(const Vec3& v) const { return s * v.x + t * v.y + n * v.z; }
};

/// A frame around the unit vector `n`, continuous but for n.z = 0 (Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited").
inline Frame make_frame(const Vec3& n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

}  // namespace ln
