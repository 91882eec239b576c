#pragma once

#include "ln/ambient.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// The mean irradiance of surfaces; see average_ambient.ln.
struct AverageAmbient {
  NodeId node;
  TagSelection from;

  void prepare(PrepareContext& context, const QuadTree& in) { mean_ = ambient_irradiance(context, node, in, from); }

  template <class Request>
  Color answer(Request& request, const QuadTree&) const {
    return request.scatter_irradiance([&](const Interaction&) { return mean_; });
  }

  // State.
  Color mean_{0};
};

}  // namespace ln::ops
