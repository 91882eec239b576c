#pragma once
// Irradiance from a Points wire, for operators that store it.

#include "ln/request.hpp"

namespace ln {

/// One sample of the irradiance [W/m^2] that `in` brings to one side of the surface at `hit`: what a white Lambertian receiver
/// there makes of it, times pi. `depth` as in Request: dimensions of `random` from there on are used.
template <class In>
LN_INLINE Color sample_irradiance(Tracer& tracer, const SampleStream& random, const Hit& hit, bool front, const In& in,
                                  std::uint32_t depth = 1) {
  static const Bsdf kWhite = Bsdf::lambertian(Color(1));
  const Interaction at(tracer.scene(), hit, front, kWhite);
  Request<Events::D> request(tracer, random, at, Color(1), depth, RayKind::gather);
  return kPi * in(request);
}

}  // namespace ln
