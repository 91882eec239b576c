#pragma once

#include "ln/operator.hpp"
#include "ln/tri_mesh.hpp"

namespace ln::ops {

/// Linear interpolation in a mesh; see tri_mesh_to_points.ln.
struct TriMeshToPoints {
  NodeId node;

  template <class Request>
  Color answer(Request& request, const TriMesh& mesh) const {
    return request.scatter_irradiance(
        [&](const Interaction& at) { return mesh.irradiance(at.hit.triangle, at.hit.u, at.hit.v, at.front); });
  }
};

}  // namespace ln::ops
