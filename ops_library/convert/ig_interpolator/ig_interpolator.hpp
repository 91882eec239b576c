#pragma once

#include "ln/hemisphere_request.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// Irradiance between records; see ig_interpolator.ln.
struct IGInterpolator {
  NodeId node;
  bool gradients = true;

  template <class Request>
  Color answer(Request& request, const auto& records) const {
    if constexpr (!any(Request::receives & Events::D)) return Color(0);
    const Interaction& at = request.at();
    if (!any(at.bsdf().events() & Events::D)) return Color(0);
    WeightedMean mean{at.at.p, at.frame.n, gradients};
    RecordRequest query(request.tracer(), request.random(), at, request.depth(), mean);
    records(query);
    return mean.weight > 0 ? request.scatter_irradiance(glm::max(mean.sum / mean.weight, Color(0))) : Color(0);
  }

 private:
  struct WeightedMean {
    Vec3 p, n;
    bool gradients;
    Color sum{0};
    float weight = 0;

    void operator()(const IrradianceRecord& record, float w) {
      sum += w * (gradients ? record.at(p, n) : record.sample.irradiance);
      weight += w;
    }
  };
};

}  // namespace ln::ops
