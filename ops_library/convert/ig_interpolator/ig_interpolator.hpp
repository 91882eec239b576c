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
    return request.scatter_irradiance([&](const Interaction& at) {
      WeightedMean mean{at.at.p, at.frame.n, gradients};
      RecordRequest query(request.tracer(), request.random(), at, request.depth(), mean);
      records(query);
      return mean.weight > 0 ? glm::max(mean.sum / mean.weight, Color(0)) : Color(0);
    });
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
