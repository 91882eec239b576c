#pragma once

#include "ln/operator.hpp"
#include "ln/photon_mesh.hpp"

namespace ln::ops {

/// Irradiance at the vertices of a mesh, from photons by surface; see surface_de.ln.
struct SurfaceDE {
  NodeId node;
  std::int64_t neighbours = 6400;
  std::int64_t fewest = 25;
  float radius = 0;  // [m]; 0: automatic
  float spacing = 0.7f;

  void prepare(PrepareContext& context, const SortedPhotons& photons) {
    const auto unit = static_cast<float>(context.scene().data().unit);
    mesh_ =
        photon_mesh(context, photons, {node, {static_cast<int>(fewest), static_cast<int>(neighbours), radius / unit}, spacing});
  }

  /// The TriMesh wire.
  const TriMesh& tri_mesh() const { return mesh_; }

  // State.
  TriMesh mesh_{};
};

}  // namespace ln::ops
