#pragma once

#include "ln/operator.hpp"
#include "ln/quad_tree.hpp"

namespace ln::ops {

/// Look-up of cells; see quad_tree_to_points.ln.
struct QuadTreeToPoints {
  NodeId node;

  template <class Request>
  Color answer(Request& request, const QuadTree& tree) const {
    return request.scatter_irradiance(
        [&](const Interaction& at) { return tree.irradiance(at.hit.triangle, at.hit.u, at.hit.v, at.front); });
  }
};

}  // namespace ln::ops
