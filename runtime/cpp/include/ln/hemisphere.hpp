#pragma once
// Irradiance and its gradients from a stratified hemisphere (Ward and Heckbert 1992, "Irradiance Gradients").

#include <span>
#include <vector>

#include "ln/math.hpp"

namespace ln {

/// Cells of equal projected solid angle: `polar` rings, from the normal to the horizon, of `azimuth` cells each.
struct HemisphereGrid {
  int polar = 1, azimuth = 3;

  /// About `count` cells, as wide as they are high (N = pi M; Ward and Heckbert 1992, section 3).
  static HemisphereGrid of(float count);

  int cells() const { return polar * azimuth; }
  /// The direction in the local frame at `u` of the unit square inside of cell (ring, sector).
  Vec3 direction(int ring, int sector, const Vec2& u) const;
};

/// What is seen through one cell.
struct HemisphereCell {
  Color radiance{0};           // [W/(m^2 sr)]
  float distance = kInfinity;  // [normalised units]
  Vec3 plane{0};               // tangent plane of what is seen: 1/distance along w is dot(w, plane); 0 if not known
};

/// Irradiance at a point and how it changes around it. The gradients hold a vector a channel, in world space.
struct IrradianceSample {
  Color irradiance{0};          // [W/m^2]
  glm::mat3 rotation{0.0f};     // by the angle about an axis: a normal `m` near `n` gets (n x m) * rotation more
  glm::mat3 translation{0.0f};  // [W/m^2 a unit]: a point `d` away gets d * translation more
  float distance = kInfinity;   // harmonic mean of the distances of what is seen
  float nearest = kInfinity;    // the least of them
  std::vector<float> horizon;   // inverse distance along the surface of what the lowest ring saw, sector by sector
};

/// The irradiance of a surface with the local frame `frame`; `cells` ring by ring. The translational gradient is meant for
/// steps of about this size: what is nearer counts as being so far away, for its borders are left behind on the way.
IrradianceSample integrate(const HemisphereGrid& grid, std::span<const HemisphereCell> cells, const Frame& frame,
                           float step = 0);

}  // namespace ln
