#pragma once
// Reflectance of smooth interfaces. Directions are given by their cosine, `eta` is the refractive index behind the
// interface divided by the one in front of it.

#include "ln/math.hpp"

namespace ln {

/// Schlick's weight (1 - cos)^5: reflectance = f0 + (f90 - f0) * weight (Schlick 1994, eq. 15).
inline float schlick_weight(float cosine) {
  const float x = std::clamp(1 - cosine, 0.0f, 1.0f);
  const float x2 = x * x;
  return x2 * x2 * x;
}

/// Cosine-weighted average of Schlick's weight over the hemisphere.
inline constexpr float kSchlickAverage = 1.0f / 21;

/// Reflectance of a dielectric at normal incidence; index 0 stands for an infinite one, as in KHR_materials_ior.
inline float normal_reflectance(float ior) { return ior > 0 ? sqr((ior - 1) / (ior + 1)) : 1; }

/// What an ideal dielectric interface does to unpolarised light.
struct Fresnel {
  float reflectance;    // 1 under total internal reflection
  float transmittance;  // 1 - reflectance, without cancellation
  float cos_t;          // cosine of the refracted direction, 0 under total internal reflection
};

/// Fresnel's equations; `eta` > 0.
inline Fresnel fresnel_dielectric(float cos_i, float eta) {
  // cos_t^2 without cancellation near eta = 1 and at grazing angles.
  const float cos2_t = ((eta - 1) * (eta + 1) + cos_i * cos_i) / (eta * eta);
  if (!(cos2_t > 0)) return {1, 0, 0};
  const float cos_t = std::sqrt(cos2_t);
  const float s = cos_i + eta * cos_t, p = eta * cos_i + cos_t;
  const float product = 2 * eta * cos_i * cos_t;
  const float transmittance = product * (1 / (s * s) + 1 / (p * p));
  return {0.5f * (sqr((cos_i - eta * cos_t) / s) + sqr((eta * cos_i - cos_t) / p)), transmittance, cos_t};
}

/// Cosine-weighted average of the reflectance over the hemisphere in front of a denser medium (fit of Kulla and Conty 2017,
/// error < 0.1 %).
inline float fresnel_average(float eta) { return (eta - 1) / (4.08567f + 1.00071f * eta); }

/// What a thin slab does, given what one of its faces reflects and transmits: R + T^2 R (1 + R^2 + R^4 + ...), and the rest.
inline Color slab_reflectance(const Color& face) { return 2.0f * face / (1.0f + face); }
inline Color slab_transmittance(const Color& face_transmittance) { return face_transmittance / (2.0f - face_transmittance); }

}  // namespace ln
