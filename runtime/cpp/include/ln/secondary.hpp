#pragma once
// Light from surfaces: secondary sources, for operators that look where rays from other surfaces arrive.

#include "ln/operator.hpp"

namespace ln {

/// Radiance from the point that `ray` hit, weighted as the surface scatters it that `ray` left: what the point scatters by the events
/// of `Via` (see single_step) of the illumination `in`. `beta`, `depth`, `steps`: of the request at that surface. Only points that
/// `from` selects send light. `kScene`: as in Request. Paths end by Russian roulette. The one function of a pull cycle that is not
/// inlined.
template <class Via, Events kScene, class In>
LN_NOINLINE Color secondary_light(Tracer& tracer, const SampleStream& random, const BsdfRay& ray, const Color& beta, std::uint32_t depth,
                                  std::uint32_t steps, TagSelection from, In in) {
  const Scene& scene = tracer.scene();
  const Interaction at(scene, ray.ray, ray.hit);
  if (!from.everything() && !from(scene.part_tags(at.part))) return Color(0);
  return with_step(Via{}, scene, at.part, [&]<Events kVia>() __attribute__((always_inline)) {
    if (!any(at.bsdf().events() & kVia & kScene)) return Color(0);

    Color weight = ray.weight * at.transmittance;
    const float survival = survival_probability(beta * weight, depth);
    if (survival < 1) {
      if (random.get1(depth, kRoulette) >= survival) return Color(0);
      weight /= survival;
    }
    Request<kVia & kScene, kVia & kScene, kScene> next(tracer, random, at, beta * weight, depth + 1, RayKind::gather, steps + 1);
    return weight * in(next);
  });
}

}  // namespace ln
