#pragma once
// Irradiance of all surfaces as a mesh of triangles, from sorted photons.

#include "ln/surface_density.hpp"
#include "ln/tri_mesh.hpp"

namespace ln {

struct PhotonMeshOptions {
  NodeId node = 0;  // on whose account rays are cast
  SurfaceKernels kernels{};
  float spacing = 0.7f;  // longest edges [radii of the kernel there]
};

/// Estimates the density of photons at the vertices of a mesh that is as fine as the kernels are small. Without cracks. A
/// surface that no photon hit has no triangles.
TriMesh photon_mesh(PrepareContext& context, const SortedPhotons& sorted, const PhotonMeshOptions& options);

}  // namespace ln
