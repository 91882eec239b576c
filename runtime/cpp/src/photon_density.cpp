#include "ln/photon_density.hpp"

#include <algorithm>

#include "ln/photon_bandwidth.hpp"

namespace ln {

namespace {

/// Photons nearer than this [normalised units] are at one place.
constexpr float kMinRadius = 1e-6f;

struct Found {
  NearPhoton photons[PhotonMap::capacity(PhotonDensity::kMaxNeighbours)];
};

}  // namespace

PhotonDensity::PhotonDensity(PrepareContext& context, const PhotonMap& map, int neighbours, float radius, PhotonKernel kernel)
    : map_(&map), neighbours_(static_cast<std::size_t>(std::clamp(neighbours, 2, kMaxNeighbours))), kernel_(kernel) {
  if (map.empty()) return;
  surfaces_ = SurfaceArea(context, context.scene().data());
  max_radius_ = radius > 0 ? radius : automatic_radius(context, map, static_cast<int>(neighbours_));
}

PhotonDensity::Estimate PhotonDensity::estimate(const Neighbourhood& around) const {
  if (!map_ || map_->empty()) return {};
  Found found;
  std::size_t n = map_->nearest(around, sqr(max_radius_), neighbours_, found.photons);
  if (n == 0) return {.radius = max_radius_};

  // The farthest of `neighbours` photons sets the radius and is not counted; where there are fewer, the radius is fixed.
  float radius = max_radius_;
  if (n == neighbours_) radius = std::max(std::sqrt(found.photons[--n].distance2), kMinRadius);

  SurfaceCoverage coverage;
  surfaces_.measure(around, radius, kernel_, coverage);
  if (!(coverage.area > 0)) return {.radius = radius};
  Color flux(0);
  const float inverse_radius = 1 / coverage.radius;
  for (std::size_t i = 0; i < n; ++i) {
    const NearPhoton& photon = found.photons[i];
    if (coverage.blockers > 0 && coverage.hides(map_->position(photon.slot) - around.point)) continue;
    const float distance = std::sqrt(photon.distance2) * inverse_radius;
    if (distance >= 1) continue;
    const float weight = kernel_ == PhotonKernel::constant ? 1 : 1 - distance;
    flux += weight * map_->flux(photon.slot);
  }
  return {flux / coverage.area, coverage.radius};
}

}  // namespace ln
