#pragma once

#include "ln/operator.hpp"
#include "ln/quad_tree_mesh.hpp"

namespace ln::ops {

/// Linear reconstruction of cells; see quad_tree_to_tri_mesh.ln.
struct QuadTreeToTriMesh {
  NodeId node;

  void prepare(PrepareContext& context, const QuadTree& tree) { mesh_ = reconstruct(tree, context.workers()); }

  /// The TriMesh wire.
  const TriMesh& tri_mesh() const { return mesh_; }

  // State.
  TriMesh mesh_{};
};

}  // namespace ln::ops
