#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light that was scattered once more, found along the shared BSDF sample; see path_tracer.ln.
template <class Via>
struct PathTracer {
  NodeId node;
  std::int64_t max_depth = 0;
  TagSet from = kAnyTag, to = kAnyTag;

  template <class Request, class In>
  Color answer(Request& request, const In& in) const {
    if (!reaches(request, to)) return Color(0);
    if (max_depth > 0 && request.depth() >= static_cast<std::uint64_t>(max_depth)) return Color(0);
    const BsdfRay* ray = request.bsdf_ray(node);
    if (!ray || !ray->hit.found()) return Color(0);

    const Scene& scene = request.tracer().scene();
    const Interaction at(scene, ray->ray, ray->hit);
    if (from != kAnyTag && !(scene.part_tags(at.part) & from)) return Color(0);
    if (!any(at.bsdf().events() & kVia)) return Color(0);

    Color weight = ray->weight * at.transmittance;
    const float survival = survival_probability(request.beta() * weight, request.depth());
    if (survival < 1) {
      if (request.random().get1(request.dimension(kRoulette)) >= survival) return Color(0);
      weight /= survival;
    }
    ln::Request<kVia> next(request.tracer(), request.random(), at, request.beta() * weight, request.depth() + 1, RayKind::gather);
    return weight * in(next);
  }

 private:
  static constexpr Events kVia = single_step(Via{});

  /// Russian roulette: paths go on with the share of light that they still carry.
  static float survival_probability(const Color& beta, std::uint32_t depth) {
    constexpr std::uint32_t kFirst = 2;
    if (depth < kFirst) return 1;
    return std::min(max_component(beta), 0.95f);
  }
};

}  // namespace ln::ops
