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
      InterpolatedIrradiance mean(at.at.p, at.frame.n, gradients);
      RecordRequest query(request.tracer(), request.random(), at, request.depth(), mean);
      records(query);
      return mean.value();
    });
  }
};

}  // namespace ln::ops
