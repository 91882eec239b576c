#include "ln/photon_density.hpp"

#include <algorithm>
#include <array>

namespace ln {

namespace {

constexpr float kUnlimited = 16;  // squared; the scene lies within a ball of radius 1

/// Photons whose distance to their neighbours decides about the automatic radius, the share of them that must reach their
/// neighbours, and the margin beyond that.
constexpr std::size_t kPilots = 512;
constexpr double kPilotShare = 0.9;
constexpr float kPilotMargin = 2;

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
  max_radius_ = radius > 0 ? radius : automatic_radius(context);
}

float PhotonDensity::automatic_radius(PrepareContext& context) const {
  const std::size_t pilots = std::min(kPilots, map_->size());
  std::vector<float> reach(pilots);
  context.parallel_for(pilots, [&](Tracer&, std::size_t i) {
    Found found;
    const auto slot = static_cast<std::uint32_t>(i * map_->size() / pilots);
    const PackedNormal normal = map_->normal(slot);
    const std::size_t n = map_->nearest({map_->position(slot), normal.normal(), normal.front()}, kUnlimited, neighbours_, found.photons);
    float farthest = 0;
    for (std::size_t k = 0; k < n; ++k) farthest = std::max(farthest, found.photons[k].distance2);
    reach[i] = std::sqrt(farthest);
  });
  const auto share = reach.begin() + static_cast<std::ptrdiff_t>(kPilotShare * static_cast<double>(pilots - 1));
  std::nth_element(reach.begin(), share, reach.end());
  return std::max(kPilotMargin * *share, kMinRadius);
}

Color PhotonDensity::irradiance(const Neighbourhood& around) const {
  if (!map_ || map_->empty()) return Color(0);
  Found found;
  std::size_t n = map_->nearest(around, sqr(max_radius_), neighbours_, found.photons);
  if (n == 0) return Color(0);

  // The farthest of `neighbours` photons sets the radius and is not counted; where there are fewer, the radius is fixed.
  float radius = max_radius_;
  if (n == neighbours_) radius = std::max(std::sqrt(found.photons[--n].distance2), kMinRadius);

  SurfaceCoverage coverage;
  surfaces_.measure(around, radius, kernel_, coverage);
  if (!(coverage.area > 0)) return Color(0);
  Color flux(0);
  const float inverse_radius = 1 / radius;
  for (std::size_t i = 0; i < n; ++i) {
    const NearPhoton& photon = found.photons[i];
    if (coverage.blockers > 0 && coverage.hides(map_->position(photon.slot) - around.point)) continue;
    const float weight = kernel_ == PhotonKernel::constant ? 1.0f : std::max(0.0f, 1 - std::sqrt(photon.distance2) * inverse_radius);
    flux += weight * map_->flux(photon.slot);
  }
  return flux / coverage.area;
}

}  // namespace ln
