#pragma once

#include "ln/operator.hpp"
#include "ln/tri_mesh.hpp"

namespace ln::ops {

/// Linear interpolation in a mesh; see tri_mesh_to_points.ln.
struct TriMeshToPoints {
  NodeId node;

  template <class Request>
  Color answer(Request& request, const TriMesh& mesh) const {
    if constexpr (!any(Request::receives & Events::D)) return Color(0);
    const Interaction& at = request.at();
    if (!any(at.bsdf().events() & Events::D)) return Color(0);
    return request.scatter_irradiance(mesh.irradiance(at.hit.triangle, at.hit.u, at.hit.v, at.front));
  }
};

}  // namespace ln::ops
