#pragma once
// Light from surfaces: secondary sources, for operators that look where rays from other surfaces arrive.

#include "ln/operator.hpp"

namespace ln {

/// Radiance from the point that `ray` hit, weighted as the surface scatters it that `ray` left: what the point scatters by the
/// events of `Via` (see single_step) of the illumination `in`. `beta`, `depth`, `steps`: of the request at that surface. Only
/// points that `from` selects send light. `kScene`: as in Request. Paths end by Russian roulette. The one function of a pull
/// cycle that is not inlined.
template <class Via, Events kScene, class In>
LN_NOINLINE Color secondary_light(Tracer& tracer, const SampleStream& random, const BsdfRay& ray, const Color& beta,
                                  std::uint32_t depth, std::uint32_t steps, TagSelection from, In in) {
  const Scene& scene = tracer.scene();
  const Interaction at(scene, ray.ray, ray.hit);
  if (!from.everything() && !from(scene.part_tags(at.part))) return Color(0);
  return with_step(Via{}, scene, at.part, [&]<Events kVia>() __attribute__((always_inline)) {
    if (!any(at.bsdf().events() & kVia & kScene)) return Color(0);

    Color weight = ray.weight * at.transmittance;
    const float survival = survival_probability(beta * weight, at, depth);
    if (survival < 1) {
      if (random.get1(depth, kRoulette) >= survival) return Color(0);
      weight /= survival;
    }
    Request<kVia & kScene, kVia & kScene, kScene> next(tracer, random, at, beta * weight, depth + 1, RayKind::gather, steps + 1,
                                                       ray.hit.t);
    return weight * in(next);
  });
}

/// The mean over `samples` directions of their own, drawn as the request draws its shared sample.
template <class Via, class Request, class In>
LN_NOINLINE Color light_along_directions(Request& request, NodeId node, std::int64_t samples, TagSelection from, const In& in) {
  const auto n = static_cast<std::uint32_t>(samples);
  const float share = 1 / static_cast<float>(n);
  Color sum(0);
  for (std::uint32_t j = 0; j < n; ++j) {
    const SampleStream random = request.random().branch(request.depth(), j, n);
    BsdfRay ray;
    if (!request.trace_sample(random, node, ray) || !ray.hit.found()) continue;
    sum += secondary_light<Via, Request::scene_events>(request.tracer(), random, ray, request.beta(), request.depth(),
                                                       request.steps(), from, in);
  }
  return sum * share;
}

/// What the receiver of `request` makes of light from surfaces (see secondary_light) that `samples` directions find, drawn from
/// its BSDF at the cost of `node`. A single one is the shared sample, and so is one that is given.
template <class Via, class Request, class In>
LN_INLINE Color light_from_surfaces(Request& request, NodeId node, std::int64_t samples, TagSelection from, const In& in) {
  if (samples > 1 && !request.sample_given()) return light_along_directions<Via>(request, node, samples, from, in);
  const BsdfRay* ray = request.bsdf_ray(node);
  if (!ray || !ray->hit.found()) return Color(0);
  return secondary_light<Via, Request::scene_events>(request.tracer(), request.random(), *ray, request.beta(), request.depth(),
                                                     request.steps(), from, in);
}

}  // namespace ln
