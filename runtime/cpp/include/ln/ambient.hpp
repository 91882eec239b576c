#pragma once
// The mean irradiance of surfaces that light can reach.

#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"

namespace ln {

/// Area mean [W/m^2] of the irradiance on the sides of surfaces that `from` selects and that lie in lit space: where
/// light arrives, and those dark places from which light that is scattered on and on would come to where it does, as shadows.
/// What is outside of a closed room, or below what stands on its floor, exchanges light with nothing that has any and does not
/// count; neither do the dark backs of single-sided surfaces, which are the insides of things.
Color ambient_irradiance(PrepareContext& context, NodeId node, const QuadTree& in, const TagSelection& from);

}  // namespace ln
