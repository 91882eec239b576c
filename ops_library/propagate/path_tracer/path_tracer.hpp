#pragma once

#include "ln/operator.hpp"
#include "ln/secondary.hpp"

namespace ln::ops {

/// Light that was scattered once more, found along the shared BSDF sample; see path_tracer.ln.
template <class Via>
struct PathTracer {
  NodeId node;
  std::int64_t max_depth = 0;
  TagSelection from;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    if (request.steps() > static_cast<std::uint64_t>(max_depth - 1)) return Color(0);  // 0 wraps around: no bound
    const BsdfRay* ray = request.bsdf_ray(node);
    if (!ray || !ray->hit.found()) return Color(0);
    return secondary_light<Via, Request::scene_events>(request.tracer(), request.random(), *ray, request.beta(), request.depth(), request.steps(), from, in);
  }
};

}  // namespace ln::ops
