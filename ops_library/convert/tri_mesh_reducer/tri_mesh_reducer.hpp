#pragma once

#include "ln/mesh_reduction.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A mesh with fewer triangles; see tri_mesh_reducer.ln.
struct TriMeshReducer {
  NodeId node;
  float error = 0.05f;

  void prepare(PrepareContext& context, const TriMesh& mesh) { mesh_ = reduce(mesh, error, context.workers()); }

  /// The TriMesh wire.
  const TriMesh& tri_mesh() const { return mesh_; }

  // State.
  TriMesh mesh_{};
};

}  // namespace ln::ops
