#include <algorithm>

#include "ln/surface_density.hpp"

namespace ln {

namespace {

/// Photons whose distance to their neighbours decides about the widest kernel, the share of them that must reach their
/// neighbours, and the margin beyond that.
constexpr std::size_t kPilots = 128;
constexpr double kPilotShare = 0.9;
constexpr float kPilotMargin = 2;
constexpr float kUnlimited = 4;  // the scene lies within a ball of radius 1

/// Photons nearer than this [normalised units] are at one place.
constexpr float kMinRadius = 1e-6f;

/// Determinant of the covariance of places under the kernel, below which the surface is too thin for a slope; 1/36 on a full
/// disc.
constexpr float kMinDeterminant = 1e-5f;

/// Weights c0 + c1 x + c2 y of photons, besides the kernel's, that give a linear density its value at the centre: the solution
/// of M c = (1, 0, 0) for the matrix M of moments (Walter et al. 1997; Ruppert and Wand 1994, eq. 2.2).
Vec3 linear_weights(const SurfaceMoments& m) {
  const float x = m.x / m.one, y = m.y / m.one;
  const float xx = m.xx / m.one - x * x, xy = m.xy / m.one - x * y, yy = m.yy / m.one - y * y;
  const float determinant = xx * yy - xy * xy;
  if (!(determinant > kMinDeterminant)) return {1 / m.one, 0, 0};
  const float c1 = (xy * y - yy * x) / determinant, c2 = (xy * x - xx * y) / determinant;
  return Vec3(1 - c1 * x - c2 * y, c1, c2) / m.one;
}

}  // namespace

SurfaceDensity::SurfaceDensity(PrepareContext& context, const SurfaceArea& area, const SortedPhotons& sorted,
                               std::uint32_t surface, int neighbours, float max_radius)
    : area_(&area),
      sheet_{sorted.sheet_of_triangle.data(), surface / 2},
      neighbours_(static_cast<std::size_t>(std::max(neighbours / 2, 1))),
      max_radius_(max_radius) {
  const std::span<const Photon> photons = sorted.on(surface);
  if (photons.size() < 4 * neighbours_) {
    DVec3 flux(0);
    for (const Photon& photon : photons) flux += DVec3(photon.flux.unpack());
    const double whole = sorted.sheet_area[surface / 2];
    if (whole > 0) even_irradiance_ = Color(flux / whole);
    return;
  }
  const std::size_t middle = photons.size() / 2;
  half_[0] = PhotonMap(context, photons.first(middle));
  half_[1] = PhotonMap(context, photons.subspan(middle));
  if (!(max_radius_ > 0)) max_radius_ = automatic_radius();
}

float SurfaceDensity::automatic_radius() const {
  const std::size_t pilots = std::min(kPilots, half_[0].size());
  std::vector<float> reach(pilots);
  for (std::size_t i = 0; i < pilots; ++i) {
    const auto slot = static_cast<std::uint32_t>(i * half_[0].size() / pilots);
    const PackedNormal normal = half_[0].normal(slot);
    reach[i] = distance_in(1, {half_[0].position(slot), normal.normal(), normal.front()});
  }
  const auto share = reach.begin() + static_cast<std::ptrdiff_t>(kPilotShare * static_cast<double>(pilots - 1));
  std::nth_element(reach.begin(), share, reach.end());
  return std::max(kPilotMargin * *share, kMinRadius);
}

float SurfaceDensity::distance_in(int half, const Neighbourhood& around) const {
  NearPhoton found[PhotonMap::capacity(kMaxNeighbours)];
  const float widest = max_radius_ > 0 ? max_radius_ : kUnlimited;
  const std::size_t wanted = std::min(neighbours_, kMaxNeighbours);
  const std::size_t n = half_[half].nearest(around, sqr(widest), wanted, found);
  return n < wanted ? widest : std::max(std::sqrt(found[n - 1].distance2), kMinRadius);
}

// Each half's kernel is as wide as the other half says, so that photons do not choose their own weight.
KernelRadii SurfaceDensity::radii(const Neighbourhood& around) const {
  if (even()) return {{kInfinity, kInfinity}};
  return {{distance_in(1, around), distance_in(0, around)}};
}

Color SurfaceDensity::irradiance(const Neighbourhood& around, const KernelRadii& radii) const {
  if (even()) return even_irradiance_;
  return glm::max(sum(0, around, radii.half[0]) + sum(1, around, radii.half[1]), Color(0));
}

Color SurfaceDensity::sum(int half, const Neighbourhood& around, float radius) const {
  SurfaceCoverage coverage;
  area_->measure(around, radius, PhotonKernel::parabola, coverage, sheet_);
  if (!(coverage.area > 0)) return Color(0);
  const Vec3 weights = linear_weights(coverage.moments);
  const PhotonMap& map = half_[half];
  Color flux(0);
  map.within(around, sqr(radius), [&](const NearPhoton& photon) {
    const Vec3 offset = map.position(photon.slot) - around.point;
    if (coverage.blockers > 0 && coverage.hides(offset)) return;
    const float q = photon.distance2 / sqr(radius);
    const Vec2 in_plane(glm::dot(offset, coverage.s), glm::dot(offset, coverage.t));
    const float length = glm::length(in_plane);
    const Vec2 place = length > 0 ? in_plane * (std::sqrt(q) / length) : Vec2(0);
    flux += (1 - q) * (weights.x + weights.y * place.x + weights.z * place.y) * map.flux(photon.slot);
  });
  return flux / sqr(radius);
}

}  // namespace ln
