#pragma once

#include "ln/operator.hpp"
#include "ln/quad_tree.hpp"

namespace ln::ops {

/// The mean irradiance of surfaces; see average_ambient.ln.
struct AverageAmbient {
  NodeId node;
  TagSelection from;

  void prepare(PrepareContext& context, const QuadTree& in) {
    const Scene& scene = context.scene();
    mean_ = in.mean([&](std::uint32_t face) { return from(scene.part_tags(in.patches().part(face / 2))); });
  }

  template <class Request>
  Color answer(Request& request, const QuadTree&) const {
    if constexpr (!any(Request::receives & Events::D)) return Color(0);
    if (!any(request.at().bsdf().events() & Events::D)) return Color(0);
    return request.scatter_irradiance(mean_);
  }

  // State.
  Color mean_{0};
};

}  // namespace ln::ops
