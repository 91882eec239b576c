#pragma once

#include "ln/ambient.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// The mean irradiance of surfaces, in lit space; see average_ambient.ln.
struct AverageAmbient {
  NodeId node;
  TagSelection from;

  void prepare(PrepareContext& context, const QuadTree& in) { light_ = AmbientLight(context, node, in, from); }

  template <class Request>
  Color answer(Request& request, const QuadTree&) const {
    return request.scatter_irradiance(
        [&](const Interaction& at) { return light_.irradiance(at.hit.triangle, at.hit.u, at.hit.v, at.front); });
  }

  // State.
  AmbientLight light_{};
};

}  // namespace ln::ops
