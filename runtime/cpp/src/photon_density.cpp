#include "ln/photon_density.hpp"

#include <algorithm>

#include "ln/photon_bandwidth.hpp"

namespace ln {

namespace {

/// Photons nearer than this [normalised units] are at one place.
constexpr float kMinRadius = 1e-6f;

/// A stored estimate is taken for points up to so many radii of its kernel away. Of the nearest ones, that which is the least
/// part of its radius away: by distance alone, bright ones, which are dense, would reach beyond the edges of their light.
constexpr float kReach = 0.5f;
constexpr std::size_t kCandidates = 2;

struct Found {
  NearPhoton photons[PhotonMap::capacity(PhotonDensity::kMaxNeighbours)];
};

}  // namespace

PhotonDensity::PhotonDensity(PrepareContext& context, const PhotonMap& map, int neighbours, float radius, PhotonKernel kernel,
                             int every)
    : map_(&map), neighbours_(static_cast<std::size_t>(std::clamp(neighbours, 2, kMaxNeighbours))), kernel_(kernel) {
  if (map.empty()) return;
  surfaces_ = SurfaceArea(context, context.scene().data());
  max_radius_ = radius > 0 ? radius : automatic_radius(context, map, static_cast<int>(neighbours_));
  if (every > 1) store(context, static_cast<std::size_t>(every));
}

void PhotonDensity::store(PrepareContext& context, std::size_t every) {
  // Neighbours in the map are near each other: every so many of its slots lie as densely as the photons do. The estimates there
  // are made of the others alone: photons tell too much of their own places, and too little of those that have no such photon.
  std::vector<Photon> places, others;
  const std::size_t count = (map_->size() - 1) / every + 1;
  const float scale = static_cast<float>(map_->size()) / static_cast<float>(std::max<std::size_t>(map_->size() - count, 1));
  places.reserve(count);
  others.reserve(map_->size() - count);
  for (std::uint32_t slot = 0; slot < map_->size(); ++slot) {
    Photon photon;
    photon.position = map_->position(slot);
    photon.normal = map_->normal(slot);
    photon.flux = PackedColor(scale * map_->flux(slot));
    (slot % every == 0 ? places : others).push_back(photon);
  }
  const PhotonMap map(context, others);
  stored_places_ = PhotonMap(context, places);
  stored_.resize(count);
  context.for_chunks(count, 256, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto slot = static_cast<std::uint32_t>(i);
      const PackedNormal normal = stored_places_.normal(slot);
      stored_[i] = estimate_from(map, {stored_places_.position(slot), normal.normal(), normal.front()});
    }
  });
}

PhotonDensity::Estimate PhotonDensity::estimate(const Neighbourhood& around) const {
  if (!map_ || map_->empty()) return {};
  if (!stored_.empty()) {
    NearPhoton near[PhotonMap::capacity(kCandidates)];
    const std::size_t found = stored_places_.nearest(around, sqr(kReach * max_radius_), kCandidates, near);
    const Estimate* best = nullptr;
    float least = sqr(kReach);
    for (std::size_t i = 0; i < found; ++i) {
      const Estimate& stored = stored_[near[i].slot];
      const float away = near[i].distance2 / sqr(stored.radius);
      if (!(away < least)) continue;
      least = away;
      best = &stored;
    }
    if (best) return *best;
  }
  return estimate_from(*map_, around);
}

PhotonDensity::Estimate PhotonDensity::estimate_from(const PhotonMap& map, const Neighbourhood& around) const {
  Found found;
  std::size_t n = map.nearest(around, sqr(max_radius_), neighbours_, found.photons);
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
    if (coverage.blockers > 0 && coverage.hides(map.position(photon.slot) - around.point)) continue;
    const float distance = std::sqrt(photon.distance2) * inverse_radius;
    if (distance >= 1) continue;
    const float weight = kernel_ == PhotonKernel::constant ? 1 : 1 - distance;
    flux += weight * map.flux(photon.slot);
  }
  return {flux / coverage.area, coverage.radius};
}

}  // namespace ln
