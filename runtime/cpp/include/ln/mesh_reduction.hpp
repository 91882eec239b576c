#pragma once
// Fewer triangles for nearly the same irradiance.

#include "ln/tri_mesh.hpp"

namespace ln {

/// A mesh whose irradiance differs from that of `mesh` by at most `error` times the mean irradiance of `mesh`, in every channel
/// and at every point. Its vertices are among those of `mesh`. Neighbouring faces remain without cracks.
TriMesh reduce(const TriMesh& mesh, float error, Workers& workers);

}  // namespace ln
