#pragma once
// A photon: light that arrived at a surface, in 32 bytes.

#include <cstdint>

#include "ln/math.hpp"

namespace ln {

/// Unit vector in 32 bits: the sphere folded onto a square of 2^16 x 2^16 points (Meyer et al. 2010, "On
/// Floating-Point Normal Vectors"). The error is below 1e-4.
inline std::uint32_t pack_unit(const Vec3& v) {
  const float scale = 1 / (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  float x = v.x * scale, y = v.y * scale;
  if (v.z < 0) {
    const float folded = (1 - std::abs(y)) * std::copysign(1.0f, x);
    y = (1 - std::abs(x)) * std::copysign(1.0f, y);
    x = folded;
  }
  const auto steps = [](float c) {
    return static_cast<std::uint32_t>(std::min(std::max((c + 1) * 32767.5f + 0.5f, 0.0f), 65535.0f));
  };
  return steps(x) << 16 | steps(y);
}

inline Vec3 unpack_unit(std::uint32_t bits) {
  const float x = static_cast<float>(bits >> 16) * (2.0f / 65535) - 1;
  const float y = static_cast<float>(bits & 0xffffu) * (2.0f / 65535) - 1;
  Vec3 v(x, y, 1 - std::abs(x) - std::abs(y));
  if (v.z < 0) {
    v.x = (1 - std::abs(y)) * std::copysign(1.0f, x);
    v.y = (1 - std::abs(x)) * std::copysign(1.0f, y);
  }
  return glm::normalize(v);
}

/// A non-negative colour in 8 bytes: 18 bits a channel and a shared exponent. The error is at most 2^-19 of the largest
/// channel; below 2^-140 it becomes 0, from 2^95 on it is clamped.
struct PackedColor {
  std::uint32_t low = 0, high = 0;

  PackedColor() = default;
  PackedColor(std::uint32_t l, std::uint32_t h) : low(l), high(h) {}
  explicit PackedColor(const Color& c) {
    const float largest = max_component(c);
    if (!(largest > 0x1p-140f)) return;
    int exponent;
    std::frexp(std::min(largest, 0x1.fp94f), &exponent);
    if (std::ldexp(largest, kBits - exponent) + 0.5f >= static_cast<float>(1u << kBits)) ++exponent;
    const auto mantissa = [&](float x) {
      const float steps = std::ldexp(std::max(x, 0.0f), kBits - exponent) + 0.5f;
      return static_cast<std::uint32_t>(std::min(steps, static_cast<float>((1u << kBits) - 1)));
    };
    const std::uint32_t r = mantissa(c.x), g = mantissa(c.y), b = mantissa(c.z);
    low = r | g << kBits;
    high = g >> (32 - kBits) | b << 4 | static_cast<std::uint32_t>(exponent - kBits + kBias) << 22;
  }

  Color unpack() const {
    constexpr std::uint32_t kMask = (1u << kBits) - 1;
    // Two factors, since their product may be a denormal number.
    const float scale = __builtin_bit_cast(float, (high >> 22) << 23);
    const Vec3 steps(static_cast<float>(low & kMask), static_cast<float>((low >> kBits | high << (32 - kBits)) & kMask),
                     static_cast<float>(high >> 4 & kMask));
    return steps * scale * 0x1p-32f;
  }

 private:
  static constexpr int kBits = 18, kBias = 127 + 32;
};

/// Normal of the side of the surface on which light arrived, and whether that is the front.
struct PackedNormal {
  std::uint32_t bits = 0;

  PackedNormal() = default;
  explicit PackedNormal(std::uint32_t b) : bits(b) {}
  PackedNormal(const Vec3& normal, bool front) : bits((pack_unit(normal) & ~1u) | (front ? 1u : 0u)) {}

  Vec3 normal() const { return unpack_unit(bits); }
  bool front() const { return bits & 1u; }
};

/// A hit of a particle on a surface that can scatter it diffusely or glossily.
struct Photon {
  Vec3 position{0};
  std::uint32_t wi = 0;  // packed unit vector to where the light came from
  PackedNormal normal;   // geometric, on the side of arrival
  std::uint32_t triangle = 0;
  PackedColor flux;  // arriving, before it is scattered [W / SceneData::unit^2]; see trace_photons
};
static_assert(sizeof(Photon) == 32);

}  // namespace ln
