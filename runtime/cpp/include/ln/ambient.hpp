#pragma once
// The mean irradiance of surfaces, for those that light can reach.

#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"

namespace ln {

/// The sides of surfaces that lie in lit space have the mean irradiance of those among them that are averaged; all others are
/// dark.
///
/// Lit space is where light arrives, and those dark places from which light that is scattered on and on would come to where it
/// does, as shadows. What is outside of a closed room, below what stands on its floor, or inside of a thing exchanges light
/// with nothing that has any. Where all is averaged and scatters diffusely, as much light is given as there was.
class AmbientLight {
 public:
  AmbientLight() = default;
  /// Averages the irradiance `in` on what `from` selects.
  AmbientLight(PrepareContext& context, NodeId node, const QuadTree& in, const TagSelection& from);

  /// Irradiance [W/m^2] of lit space.
  const Color& mean() const { return mean_; }
  /// Irradiance [W/m^2] on one side of a point of a scene's triangle (barycentric u, v).
  Color irradiance(std::uint32_t triangle, float u, float v, bool front) const {
    return space_.irradiance(triangle, u, v, front) * mean_;
  }

 private:
  QuadTree space_;  // share of each cell that lies in lit space
  Color mean_{0};
};

}  // namespace ln
