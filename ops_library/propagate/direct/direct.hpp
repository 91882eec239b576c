#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light that reaches a point straight from emitters; see direct.ln.
struct Direct {
  NodeId node;
  std::int64_t samples = 1;

  template <class Request>
  LN_INLINE Color answer(Request& request, const Emitters& light) const {
    Color result(0);
    if (request.takes_samples() && !light.empty()) result += sample_emitters(request, light);
    if (light.has_area()) result += emission_on_bsdf_ray(request, light);
    return result;
  }

 private:
  enum Dimensions : std::uint32_t { kPosition, kPick, kDimensions };

  std::uint32_t own(std::uint32_t d) const { return kOwn + node * kDimensions + d; }

  /// Emitters chosen by their importance for the point; area emitters share their light with the BSDF's sample.
  template <class Request>
  LN_INLINE Color sample_emitters(Request& request, const Emitters& light) const {
    return samples == 1 ? sample_emitter(request, light, 0, 1) : sample_several(request, light);
  }

  template <class Request>
  LN_NOINLINE Color sample_several(Request& request, const Emitters& light) const {
    const auto n = static_cast<std::uint32_t>(samples);
    Color sum(0);
    for (std::uint32_t j = 0; j < n; ++j) sum += sample_emitter(request, light, j, n);
    return sum;
  }

  /// Sample `j` of `n`.
  template <class Request>
  LN_INLINE Color sample_emitter(Request& request, const Emitters& light, std::uint32_t j, std::uint32_t n) const {
    const float pick = light.size() == 1 ? 0 : request.random().get1(request.depth(), own(kPick), j, n);
    const Vec2 position = request.random().get2(request.depth(), own(kPosition), j, n);
    const LightSample s = light.sample(request.at().at, request.emitter_side(), pick, position);
    if (!(s.pdf_w > 0) || is_black(s.radiance)) return Color(0);
    const BsdfValue bsdf = request.evaluate(s.wi);
    if (is_black(bsdf.f_cos) || !request.visible(s, node)) return Color(0);
    const float density = s.pdf_w * static_cast<float>(n);
    const float weight = s.delta ? 1.0f : mis_weight(density, bsdf.pdf_w);
    return bsdf.f_cos * s.radiance * (weight / density);
  }

  template <class Request>
  LN_INLINE Color emission_on_bsdf_ray(Request& request, const Emitters& light) const {
    const BsdfRay* ray = request.bsdf_ray(node);
    if (!ray) return Color(0);
    const Vec3 wi = ray->ray.direction;
    const Color radiance = ray->hit.found() ? light.radiance(ray->hit, -wi) : light.environment(wi);
    if (is_black(radiance)) return Color(0);
    float weight = 1;
    if (ray->event != Events::S) {
      const float pdf_w = ray->hit.found() ? light.pdf_w(request.at().at, request.emitter_side(), ray->hit, wi)
                                           : light.environment_pdf_w(request.at().at, request.emitter_side(), wi);
      weight = mis_weight(ray->pdf_w, pdf_w * static_cast<float>(samples));
    }
    return ray->weight * radiance * weight;
  }
};

}  // namespace ln::ops
