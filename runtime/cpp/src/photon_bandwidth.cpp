#include "ln/photon_bandwidth.hpp"

#include <algorithm>

namespace ln {

namespace {

/// Up to this difference estimates are taken to be of the same light, and of different light from the other one on [standard
/// errors of their difference]. In between, their means are taken: a choice would make specks.
constexpr float kSame = 2, kDifferent = 3.5f;

/// Kernels that an estimate may choose from.
constexpr int kMaxKernels = 13;

/// Determinant of the covariance of places under the kernel, below which the surface is too thin for a slope; 1/36 on a full
/// disc.
constexpr float kMinDeterminant = 1e-5f;

/// Photons nearer than this [normalised units] are at one place.
constexpr float kMinRadius = 1e-6f;

/// Weights c0 + c1 x + c2 y of photons, besides the kernel's: the solution of M c = (1, 0, 0) for the matrix M of moments.
Vec3 linear_weights(const SurfaceMoments& m) {
  const float x = m.x / m.one, y = m.y / m.one;
  const float xx = m.xx / m.one - x * x, xy = m.xy / m.one - x * y, yy = m.yy / m.one - y * y;
  const float determinant = xx * yy - xy * xy;
  if (!(determinant > kMinDeterminant)) return {1 / m.one, 0, 0};
  const float c1 = (xy * y - yy * x) / determinant, c2 = (xy * x - xx * y) / determinant;
  return Vec3(1 - c1 * x - c2 * y, c1, c2) / m.one;
}

/// How much two estimates differ [standard errors], if the light is that of the wider one. Then the variance of the narrower
/// is as much greater as its kernel is smaller, and the photons that they share count once.
float standard_errors(const LocalEstimate& wider, const LocalEstimate& narrower) {
  const float difference = std::abs(mean_component(wider.E) - mean_component(narrower.E));
  const float variance = sqr(wider.sigma) * (wider.area / narrower.area - 1);
  return difference == 0 ? 0 : variance > 0 ? difference / std::sqrt(variance) : kInfinity;
}

bool nearer(const NearPhoton& a, const NearPhoton& b) { return a.distance2 < b.distance2; }

}  // namespace

LocalEstimate local_linear(const PhotonMap& map, std::span<const NearPhoton> photons, const SurfaceArea& area,
                           const Neighbourhood& around, float radius, TriangleFilter filter) {
  SurfaceCoverage coverage;
  area.measure(around, std::max(radius, kMinRadius), PhotonKernel::parabola, coverage, filter);
  if (!(coverage.area > 0)) return {.radius = radius};
  const Vec3 weights = linear_weights(coverage.moments);
  const float inverse_area = 1 / sqr(coverage.radius);
  Color sum(0);
  float variance = 0;
  for (const NearPhoton& photon : photons) {
    const float q = photon.distance2 * inverse_area;
    if (q >= 1) continue;
    const Vec3 offset = map.position(photon.slot) - around.point;
    if (coverage.blockers > 0 && coverage.hides(offset)) continue;
    const Vec2 in_plane(glm::dot(offset, coverage.s), glm::dot(offset, coverage.t));
    const float length = glm::length(in_plane);
    const Vec2 place = length > 0 ? in_plane * (std::sqrt(q) / length) : Vec2(0);
    const Color term = (1 - q) * (weights.x + weights.y * place.x + weights.z * place.y) * map.flux(photon.slot);
    sum += term;
    variance += sqr(mean_component(term));
  }
  return {glm::max(sum * inverse_area, Color(0)), std::sqrt(variance) * inverse_area, radius, coverage.area};
}

LocalEstimate adaptive_local_linear(const PhotonMap& map, const SurfaceArea& area, const Neighbourhood& around,
                                    const KernelRange& range, TriangleFilter filter) {
  NearPhoton found[PhotonMap::capacity(KernelRange::kMost)];
  const auto estimate = [&](std::size_t count, float radius) {
    return local_linear(map, {found, count}, area, around, radius, filter);
  };
  LocalEstimate narrower[kMaxKernels], result;
  int kernels = 0;
  for (auto wanted = static_cast<std::size_t>(range.least); wanted <= static_cast<std::size_t>(range.most);
       wanted *= 2, ++kernels) {
    const float widest = kernels == 0 ? range.narrow_radius : range.max_radius;
    const std::size_t n = map.nearest(around, sqr(widest), wanted, found);
    if (n < wanted && kernels > 0) break;
    const LocalEstimate e = n < wanted ? estimate(n, widest) : estimate(n - 1, std::sqrt(found[n - 1].distance2));
    float difference = 0;
    for (int k = 0; k < kernels; ++k) difference = std::max(difference, standard_errors(e, narrower[k]));
    if (difference >= kDifferent) break;
    const float old = std::max((difference - kSame) / (kDifferent - kSame), 0.0f);
    result = {glm::mix(e.E, result.E, old), std::lerp(e.sigma, result.sigma, old), std::lerp(e.radius, result.radius, old),
              e.area};
    narrower[kernels] = e;
  }
  return result;
}

KernelRange kernel_range(PrepareContext& context, const PhotonMap& map, int least, int most, float radius) {
  const bool automatic = !(radius > 0);
  return {std::min(least, most), most, automatic ? automatic_radius(context, map, std::min(least, most)) : radius,
          automatic ? automatic_radius(context, map, most) : radius};
}

float automatic_radius(PrepareContext& context, const PhotonMap& map, int neighbours) {
  if (map.empty()) return kMinRadius;
  constexpr std::size_t kPilots = 512;
  constexpr double kShare = 0.9;
  constexpr float kMargin = 2;
  constexpr float kUnlimited = 16;  // squared; the scene lies within a ball of radius 1
  const std::size_t pilots = std::min(kPilots, map.size());
  std::vector<float> reach(pilots);
  context.parallel_for(pilots, [&](Tracer&, std::size_t i) {
    NearPhoton found[PhotonMap::capacity(KernelRange::kMost)];
    const auto slot = static_cast<std::uint32_t>(i * map.size() / pilots);
    const PackedNormal normal = map.normal(slot);
    const std::size_t n = map.nearest({map.position(slot), normal.normal(), normal.front()}, kUnlimited,
                                      static_cast<std::size_t>(neighbours), found);
    reach[i] = n == 0 ? 0 : std::sqrt(std::max_element(found, found + n, nearer)->distance2);
  });
  const auto share = reach.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(pilots - 1));
  std::nth_element(reach.begin(), share, reach.end());
  return std::max(kMargin * *share, kMinRadius);
}

}  // namespace ln
