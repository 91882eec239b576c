#pragma once
// Irradiance of all surfaces as a mesh of triangles, from sorted photons.

#include "ln/sorted_photons.hpp"
#include "ln/tri_mesh.hpp"

namespace ln {

struct PhotonMeshOptions {
  NodeId node = 0;       // on whose account rays are cast
  int neighbours = 100;  // photons under a kernel
  float max_radius = 0;  // no kernel is wider [normalised units]; 0: chosen from the photons of each surface
  float spacing = 0.5f;  // longest edges [radii of the kernel there]
};

/// Estimates the density of photons at the vertices of a mesh that is as fine as the kernels are small. Without cracks. A
/// surface that no photon hit has no triangles.
TriMesh photon_mesh(PrepareContext& context, const SortedPhotons& sorted, const PhotonMeshOptions& options);

}  // namespace ln
