#include "ln/photon_bandwidth.hpp"

#include <algorithm>

namespace ln {

namespace {

/// Kernels that an estimate may choose from.
constexpr int kMaxKernels = 13;
/// Of them, so many get their photons from one search: most points need several.
constexpr int kKernelsInASearch = 3;

/// Determinant of the covariance of places under the kernel, below which the surface is too thin for a slope; 1/36 on a full
/// disc.
constexpr float kMinDeterminant = 1e-5f;

/// Photons nearer than this [normalised units] are at one place.
constexpr float kMinRadius = 1e-6f;

/// How much two estimates differ [standard errors], if the light is that of the wider one. Then the variance of the narrower
/// is as much greater as its kernel is smaller, and the photons that they share count once.
float standard_errors(const LocalEstimate& wider, const LocalEstimate& narrower) {
  const float difference = std::abs(mean_component(wider.E) - mean_component(narrower.E));
  const float variance = sqr(wider.sigma) * (wider.area / narrower.area - 1);
  return difference == 0 ? 0 : variance > 0 ? difference / std::sqrt(variance) : kInfinity;
}

bool nearer(const NearPhoton& a, const NearPhoton& b) { return a.distance2 < b.distance2; }

/// Mean and covariance of places under a kernel.
struct Covariance {
  explicit Covariance(const SurfaceMoments& m)
      : x(m.x / m.one),
        y(m.y / m.one),
        xx(m.xx / m.one - x * x),
        xy(m.xy / m.one - x * y),
        yy(m.yy / m.one - y * y),
        determinant(xx * yy - xy * xy) {}

  /// May a slope be told?
  bool is_wide() const { return determinant > kMinDeterminant; }

  float x, y, xx, xy, yy, determinant;
};

/// Of the linear function whose integrals under the kernel, times 1, x and y, are `sums`; 0 where the surface is too thin.
Vec2 linear_slope(const SurfaceMoments& m, const Vec3& sums) {
  const Covariance c(m);
  if (!c.is_wide()) return Vec2(0);
  const float x = sums.y - c.x * sums.x, y = sums.z - c.y * sums.x;
  return Vec2(c.yy * x - c.xy * y, c.xx * y - c.xy * x) / (c.determinant * m.one);
}

/// Photons near a point, as sums over them want them.
class LocalPhotons {
 public:
  LocalPhotons(const PhotonMap& map, const Neighbourhood& around)
      : map_(map), around_(around), frame_(make_frame(around.normal)) {}

  /// In this order, from here on.
  void assign(std::span<const NearPhoton> photons) {
    blocks_.assign((photons.size() + kLanes - 1) / kLanes, Block{});
    for (std::size_t i = 0; i < photons.size(); ++i) {
      Block& block = blocks_[i / kLanes];
      const std::size_t lane = i % kLanes;
      const Vec3 offset = map_.position(photons[i].slot) - around_.point;
      const Color flux = map_.flux(photons[i].slot);
      block.distance2[lane] = photons[i].distance2;
      block.x[lane] = glm::dot(offset, frame_.s);
      block.y[lane] = glm::dot(offset, frame_.t);
      block.red[lane] = flux.x;
      block.green[lane] = flux.y;
      block.blue[lane] = flux.z;
    }
    for (Block& block : blocks_) {
      const Lanes in_plane2 = block.x * block.x + block.y * block.y;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        block.stretch[lane] = in_plane2[lane] > 0 ? std::sqrt(block.distance2[lane] / in_plane2[lane]) : 0;
    }
  }

  /// The estimate from the photons within `radius`, which are among the first `count`, or among all.
  LocalEstimate estimate(std::size_t count, float radius, const SurfaceArea& area, std::uint32_t label) const {
    return estimate(count, radius, measure(radius, area, label));
  }

  /// The estimate from all photons within `radius`.
  LinearEstimate linear_estimate(float radius, const SurfaceArea& area, std::uint32_t label) const {
    const SurfaceCoverage coverage = measure(radius, area, label);
    return {estimate(kLanes * blocks_.size(), radius, coverage), gradient(coverage)};
  }

 private:
  /// (x, y): place in the tangent plane; times `stretch`, it is as far from the point as the photon is.
  struct Block {
    Lanes distance2 = Lanes{} + kInfinity, x{}, y{}, stretch{}, red{}, green{}, blue{};

    Lanes mean() const { return (red + green + blue) * (1.0f / 3); }
  };

  SurfaceCoverage measure(float radius, const SurfaceArea& area, std::uint32_t label) const {
    SurfaceCoverage coverage;
    area.measure(around_, std::max(radius, kMinRadius), PhotonKernel::parabola, coverage, label);
    return coverage;
  }

  /// The kernel at a block's photons, whose places are (x, y) [radii]: 0 where it does not reach.
  static Lanes kernel_at(const Block& block, const Lanes& x, const Lanes& y, const SurfaceCoverage& coverage) {
    const float scale = 1 / coverage.radius;
    const Lanes kernel = 1 - block.distance2 * sqr(scale);
    LaneMask counts = kernel > 0;
    if (coverage.blockers > 0) counts &= ~coverage.hides(x, y);
    return counts ? kernel : Lanes{};
  }

  LocalEstimate estimate(std::size_t count, float radius, const SurfaceCoverage& coverage) const {
    if (!(coverage.area > 0)) return {.radius = radius};
    const Vec3 weights = linear_weights(coverage.moments);
    const float scale = 1 / coverage.radius, inverse_area = sqr(scale);
    Lanes red{}, green{}, blue{}, variance{};
    for (std::size_t i = 0; i < std::min((count + kLanes - 1) / kLanes, blocks_.size()); ++i) {
      const Block& block = blocks_[i];
      const Lanes x = block.x * scale, y = block.y * scale;
      const Lanes weight = kernel_at(block, x, y, coverage) * (weights.x + (weights.y * x + weights.z * y) * block.stretch);
      red += weight * block.red;
      green += weight * block.green;
      blue += weight * block.blue;
      const Lanes term = weight * block.mean();
      variance += term * term;
    }
    const Color E = Color(sum(red), sum(green), sum(blue)) * inverse_area;
    return {glm::max(E, Color(0)), std::sqrt(sum(variance)) * inverse_area, radius, coverage.area};
  }

  /// Of the linear function that the estimate is the value of.
  Vec3 gradient(const SurfaceCoverage& coverage) const {
    if (!(coverage.area > 0)) return Vec3(0);
    const float scale = 1 / coverage.radius;
    Lanes one{}, along_x{}, along_y{};
    for (const Block& block : blocks_) {
      const Lanes x = block.x * scale, y = block.y * scale;
      const Lanes term = kernel_at(block, x, y, coverage) * block.mean();
      one += term;
      along_x += term * x * block.stretch;
      along_y += term * y * block.stretch;
    }
    const Vec2 slope = linear_slope(coverage.moments, {sum(one), sum(along_x), sum(along_y)});
    return (slope.x * frame_.s + slope.y * frame_.t) * (scale * sqr(scale));
  }

  const PhotonMap& map_;
  const Neighbourhood& around_;
  const Frame frame_;
  std::vector<Block> blocks_;
};

}  // namespace

Vec3 linear_weights(const SurfaceMoments& m) {
  const Covariance c(m);
  if (!c.is_wide()) return {1 / m.one, 0, 0};
  const float c1 = (c.xy * c.y - c.yy * c.x) / c.determinant, c2 = (c.xy * c.x - c.xx * c.y) / c.determinant;
  return Vec3(1 - c1 * c.x - c2 * c.y, c1, c2) / m.one;
}

LinearEstimate local_linear(const PhotonMap& map, std::span<const NearPhoton> photons, const SurfaceArea& area,
                            const Neighbourhood& around, float radius, std::uint32_t label) {
  LocalPhotons local(map, around);
  local.assign(photons);
  return local.linear_estimate(radius, area, label);
}

LocalEstimate adaptive_local_linear(const PhotonMap& map, const SurfaceArea& area, const Neighbourhood& around,
                                    const KernelRange& range, std::uint32_t label) {
  NearPhoton found[PhotonMap::capacity(KernelRange::kMost)];
  LocalPhotons photons(map, around);
  LocalEstimate narrower[kMaxKernels], result;
  std::size_t searched = 0, count = 0;  // photons looked for, and found
  int kernels = 0;
  for (auto wanted = static_cast<std::size_t>(range.least); wanted <= static_cast<std::size_t>(range.most);
       wanted *= 2, ++kernels) {
    if (wanted > searched) {
      // Those of the next kernels in one go, ordered so that each kernel's come first.
      searched = wanted;
      for (int next = 1; next < kKernelsInASearch && 2 * searched <= static_cast<std::size_t>(range.most); ++next)
        searched *= 2;
      count = map.nearest(around, sqr(range.max_radius), searched, found);
      std::size_t end = count;
      for (std::size_t part = searched; part >= wanted; part /= 2) {
        if (part >= end) continue;
        std::nth_element(found, found + (part - 1), found + end, nearer);
        end = part - 1;
      }
      photons.assign({found, count});
    }
    if (count < wanted && kernels > 0) break;
    const float reach = count < wanted ? kInfinity : std::sqrt(found[wanted - 1].distance2);
    const float radius = kernels == 0 ? std::min(reach, range.narrow_radius) : reach;
    const LocalEstimate e = photons.estimate(wanted, radius, area, label);
    float difference = 0;
    for (int k = 0; k < kernels; ++k) difference = std::max(difference, standard_errors(e, narrower[k]));
    if (difference >= range.different) break;
    const float old = std::max((difference - range.same) / (range.different - range.same), 0.0f);
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
