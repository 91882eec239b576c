#pragma once
// A continuous, piecewise linear function from the piecewise constant one of a QuadTree.

#include "ln/quad_tree.hpp"
#include "ln/tri_mesh.hpp"

namespace ln {

/// Linear reconstruction (the paper's Gouraud LightOp). Exact for functions that are linear over coplanar patches, but where a
/// patch stands alone and has a single row of cells. Continuous within faces and across edges between patches that are no
/// creases: neighbouring leaves differ by at most one level, and vertices in the middle of an edge belong to both sides.
///
/// A leaf has a gradient, fitted to its neighbours' means by least squares and limited to their range; a vertex has the average
/// of what the leaves around it extrapolate to it, and is not negative.
TriMesh reconstruct(const QuadTree& tree, Workers& workers);

}  // namespace ln
