#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light that was scattered once more, found along the shared BSDF sample; see path_tracer.ln.
template <class Via>
struct PathTracer {
  NodeId node;
  std::int64_t max_depth = 0;
  TagSet from = kAnyTag;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    if (request.depth() > static_cast<std::uint64_t>(max_depth - 1)) return Color(0);  // 0 wraps around: no bound
    const BsdfRay* ray = request.bsdf_ray(node);
    if (!ray || !ray->hit.found()) return Color(0);
    return arrive(request.tracer(), request.random(), *ray, request.beta(), request.depth(), in);
  }

 private:
  static constexpr Events kVia = single_step(Via{});

  /// Asks for the light at the point that `ray` hit. The one function of a pull cycle that is not inlined.
  template <class In>
  LN_NOINLINE Color arrive(Tracer& tracer, const SampleStream& random, const BsdfRay& ray, const Color& beta, std::uint32_t depth,
                           In in) const {
    const Scene& scene = tracer.scene();
    const Interaction at(scene, ray.ray, ray.hit);
    if (from != kAnyTag && !(scene.part_tags(at.part) & from)) return Color(0);
    if (!any(at.bsdf().events() & kVia)) return Color(0);

    Color weight = ray.weight * at.transmittance;
    const float survival = survival_probability(beta * weight, depth);
    if (survival < 1) {
      if (random.get1(depth, kRoulette) >= survival) return Color(0);
      weight /= survival;
    }
    ln::Request<kVia> next(tracer, random, at, beta * weight, depth + 1, RayKind::gather);
    return weight * in(next);
  }
};

}  // namespace ln::ops
