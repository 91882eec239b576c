#pragma once
// Irradiance from a Points wire, for operators that store it and results that show it.

#include "ln/request.hpp"

namespace ln {

/// The white Lambertian surface whose radiance, times pi, is the irradiance.
inline const Bsdf& white_receiver() {
  static const Bsdf white = Bsdf::lambertian(Color(1));
  return white;
}

/// One sample of the irradiance [W/m^2] that `in` brings to `at`, an Interaction with white_receiver(). `depth` as in Request:
/// dimensions of `random` from there on are used.
template <class In>
LN_INLINE Color sample_irradiance(Tracer& tracer, const SampleStream& random, const Interaction& at, const In& in,
                                  std::uint32_t depth = 1) {
  Request<Events::D> request(tracer, random, at, Color(1), depth, RayKind::gather);
  return kPi * in(request);
}

/// The same for one side of the surface at `hit`.
template <class In>
LN_INLINE Color sample_irradiance(Tracer& tracer, const SampleStream& random, const Hit& hit, bool front, const In& in,
                                  std::uint32_t depth = 1) {
  const Interaction at(tracer.scene(), hit, front, white_receiver());
  return sample_irradiance(tracer, random, at, in, depth);
}

}  // namespace ln
