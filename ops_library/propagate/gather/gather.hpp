#pragma once

#include "ln/operator.hpp"
#include "ln/secondary.hpp"

namespace ln::ops {

/// Light that arrives straight from diffuse surfaces; see gather.ln.
template <class Via>
struct Gather {
  NodeId node;
  std::int64_t samples = 1;
  TagSelection from;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    if (samples > 1 && !request.sample_given()) return many(request, in);
    const BsdfRay* ray = request.bsdf_ray(node);
    if (!ray || !ray->hit.found()) return Color(0);
    return secondary_light<Via, Request::scene_events>(request.tracer(), request.random(), *ray, request.beta(), request.depth(), request.steps(), from, in);
  }

 private:
  template <class Request, class In>
  Color many(Request& request, const In& in) const {
    const auto n = static_cast<std::uint32_t>(samples);
    const float share = 1 / static_cast<float>(n);
    Color sum(0);
    for (std::uint32_t j = 0; j < n; ++j) {
      const SampleStream random = request.random().branch(request.depth(), j, n);
      BsdfRay ray;
      if (!request.trace_sample(random, node, ray) || !ray.hit.found()) continue;
      sum += secondary_light<Via, Request::scene_events>(request.tracer(), random, ray, request.beta() * share, request.depth(), request.steps(), from, in);
    }
    return sum * share;
  }
};

}  // namespace ln::ops
