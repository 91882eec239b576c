#pragma once
// The surface around a point: integrals of a kernel over triangles, along many directions, and over pieces small enough to be
// taken for points.

#include <algorithm>
#include <array>
#include <bit>

#include "ln/surface_area.hpp"

namespace ln {

// Lengths are in radii of the ball from here on.

/// Directions in which the surface is measured: more of them where moments are wanted, as weights made of these are sensitive
/// to a strip of surface between a point and a border that it is near to.
constexpr int direction_count(PhotonKernel kernel) { return kernel == PhotonKernel::parabola ? 128 : 32; }
/// Parts of equal area along each direction, for telling what is covered twice.
constexpr int kRings = 64;
/// Height over the surface from which it is seen: what stands higher, and not along it, hides what is behind.
constexpr float kEyeHeight = 0.02f;
/// A blocker nearer than this is the rounding error of a point that lies at a wall.
constexpr float kMinBlockerDistance = 1e-3f;
/// Where less than this share of the surface is visible (grass, leaves), blockers are not considered.
constexpr float kMinVisibleShare = 0.1f;

template <int count>
struct Directions {
  alignas(32) float x[count], y[count];

  Directions() {
    for (int j = 0; j < count; ++j) {
      const float angle = (static_cast<float>(j) + 0.5f) * (2 * kPi / count);
      x[j] = std::cos(angle);
      y[j] = std::sin(angle);
    }
  }
};

/// Integral of the kernel over a disc of radius sqrt(q), as a share of pi; q: squared distance.
template <PhotonKernel kernel>
float kernel_integral(float q) {
  if constexpr (kernel == PhotonKernel::constant) return q;
  if constexpr (kernel == PhotonKernel::cone) return q - (2.0f / 3) * q * std::sqrt(q);
  return q - 0.5f * q * q;
}

/// The same of the parabola times the distance, and times its square.
inline float parabola_first(float q) { return q * std::sqrt(q) * (2.0f / 3 - 2.0f / 5 * q); }
inline float parabola_second(float q) { return q * q * (0.5f - 1.0f / 3 * q); }

/// The sectors and rings of the disc in which the surface that counts is summed up, to find out what lies on each other.
struct Occupancy {
  static constexpr int kSectors = 8, kBands = 2;
  /// Pieces at a border of two parts belong to one of them, so there may be more than all of it.
  static constexpr float kMost = 1.5f;

  float area[kSectors][kBands] = {};

  static int sector(float x, float y) { return (x < 0 ? 4 : 0) + (y < 0 ? 2 : 0) + (std::abs(x) < std::abs(y) ? 1 : 0); }

  bool overlaps() const {
    constexpr float kWhole = kPi / (kSectors * kBands);
    return std::any_of(&area[0][0], &area[0][0] + kSectors * kBands, [](float a) { return a > kMost * kWhole; });
  }
};

/// A triangle in the frame of the tangent plane: z is the height.
struct LocalTriangle {
  Vec3 corner[3];
};

/// The surface along all directions from the point.
template <PhotonKernel kernel>
class Sweep {
 public:
  Sweep() { std::fill(reach_, reach_ + kDirections, 1.0f); }

  /// Nothing counts behind the line from a to b.
  void block(const SurfaceBlocker& line) {
    const Vec2 along = line.b - line.a;
    const float c = line.a.x * line.b.y - line.a.y * line.b.x;  // distance of the line * its length
    if (std::abs(c) < kMinBlockerDistance * glm::length(along)) return;
    const float orientation = c > 0 ? 1.0f : -1.0f;
    for (int j = 0; j < kDirections; ++j) {
      const float dx = kDirection.x[j], dy = kDirection.y[j];
      const bool between =
          (line.a.x * dy - line.a.y * dx) * orientation >= 0 && (dx * line.b.y - dy * line.b.x) * orientation >= 0;
      const float slope = dx * along.y - dy * along.x;
      const float distance = c / slope;
      if (between && distance > 0) reach_[j] = std::min(reach_[j], distance * distance);
    }
  }

  void add(const LocalTriangle& triangle) {
    const auto [a, b, c] = triangle.corner;
    const Vec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    const Vec3 nearest = glm::max(glm::max(low, -high), Vec3(0));
    if (glm::dot(nearest, nearest) >= 1) return;
    const Vec3 normal = glm::cross(b - a, c - a);
    if (!(normal.z > 0)) return;

    Plane plane;
    plane.h0 = glm::dot(normal, a) / normal.z;
    plane.gx = -normal.x / normal.z;
    plane.gy = -normal.y / normal.z;
    const float cosine = normal.z / glm::length(normal);
    plane.tilt = 1 / cosine;
    plane.step = plane.h0 * (1 + cosine);
    plane.max_step = Neighbourhood::max_step(cosine);
    // Directions come quadrant by quadrant: most small triangles lie in one.
    if (high.x >= 0 && high.y >= 0) add_quadrant<0>(triangle, plane);
    if (low.x <= 0 && high.y >= 0) add_quadrant<1>(triangle, plane);
    if (low.x <= 0 && low.y <= 0) add_quadrant<2>(triangle, plane);
    if (high.x >= 0 && low.y <= 0) add_quadrant<3>(triangle, plane);
  }

  /// Integrals of the kernel over the surface that is visible, and over all of it.
  SurfaceMoments visible() const { return scaled(visible_); }
  SurfaceMoments whole() const { return scaled(whole_); }

  /// Adds the area that is covered.
  void occupy(Occupancy& occupancy) const {
    constexpr int kRingsOfBand = kRings / Occupancy::kBands;
    for (int j = 0; j < kDirections; ++j)
      for (int band = 0; band < Occupancy::kBands; ++band)
        occupancy.area[Occupancy::sector(kDirection.x[j], kDirection.y[j])][band] +=
            static_cast<float>(std::popcount(covered_[j] >> (band * kRingsOfBand) & ((std::uint64_t{1} << kRingsOfBand) - 1))) *
            (kPi / (kDirections * kRings));
  }

 private:
  static constexpr int kDirections = direction_count(kernel), kQuadrant = kDirections / 4;
  static inline const Directions<kDirections> kDirection;

  /// Of a triangle: height over the tangent plane is h0 + gx x + gy y, area over projected area is tilt; offset . (sum of
  /// normals) is step + gx x + gy y, which may be max_step times the distance.
  struct Plane {
    float h0, gx, gy, tilt, step, max_step;
  };

  template <int quadrant>
  void add_quadrant(const LocalTriangle& triangle, const Plane& plane) {
    const float* const dx = kDirection.x + quadrant * kQuadrant;
    const float* const dy = kDirection.y + quadrant * kQuadrant;
    // Intersect the triangle with each direction: lower <= distance in the plane <= upper.
    alignas(32) float lower[kQuadrant], upper[kQuadrant];
    for (int j = 0; j < kQuadrant; ++j) {
      lower[j] = 0;
      upper[j] = 2;
    }
    for (int e = 0; e < 3; ++e) {
      const Vec3& a = triangle.corner[e];
      const Vec3& b = triangle.corner[e == 2 ? 0 : e + 1];
      const float nx = b.y - a.y, ny = a.x - b.x;  // outwards
      const float c = a.x * b.y - a.y * b.x;
      const float parallel = c < 0 ? 3.0f : 0.0f;  // a direction along the edge lies on the inner side of it, or on the outer
      for (int j = 0; j < kQuadrant; ++j) {
        const float d = nx * dx[j] + ny * dy[j];
        const float t = c / d;
        const float low = d < 0 ? t : d == 0 ? parallel : 0.0f, high = d > 0 ? t : 2.0f;
        lower[j] = low > lower[j] ? low : lower[j];
        upper[j] = high < upper[j] ? high : upper[j];
      }
    }
    // Cut off what is too steep or a step away, and what is outside the ball.
    alignas(32) float from[kQuadrant], to[kQuadrant], density[kQuadrant];
    int any = 0;
    for (int j = 0; j < kQuadrant; ++j) {
      const float g = plane.gx * dx[j] + plane.gy * dy[j];
      constexpr float kSlope = Neighbourhood::kMaxSlope;
      float near = lower[j];
      const float above = plane.h0 / (kSlope - g), below = -plane.h0 / (kSlope + g);
      near = above > near ? above : near;
      near = below > near ? below : near;
      const float step_up = plane.step / (plane.max_step - g), step_down = -plane.step / (plane.max_step + g);
      near = step_up > near ? step_up : near;
      near = step_down > near ? step_down : near;
      const float far = upper[j] > near ? upper[j] : near;
      const float h_near = plane.h0 + g * near, h_far = plane.h0 + g * far;
      const float q_near = near * near + h_near * h_near, q_far = far * far + h_far * h_far;
      from[j] = q_near;
      to[j] = q_far < 1.0f ? q_far : 1.0f;
      any |= q_far > q_near && q_near < 1.0f ? 1 : 0;
      // Area element over that of the kernel's distance d: rho drho / (d dd), which is exact on a plane through the point.
      const float middle = 0.5f * (near + (far < 1.0f ? far : 1.0f)) + 1e-12f;
      density[j] = plane.tilt * middle / (middle + (plane.h0 + g * middle) * g);
    }
    if (any == 0) return;
    for (int j = 0; j < kQuadrant; ++j)
      if (to[j] > from[j]) count(quadrant * kQuadrant + j, from[j], to[j], density[j]);
  }

  /// Counts what is not covered yet: surfaces may lie on each other.
  void count(int direction, float from, float to, float density) {
    const std::uint64_t rings = mask(to) & ~mask(from);
    const std::uint64_t fresh = rings & ~covered_[direction];
    covered_[direction] |= rings;
    if (fresh != rings) {
      if (fresh == 0) return;
      density *= static_cast<float>(std::popcount(fresh)) / static_cast<float>(std::popcount(rings));
    }
    accumulate(whole_, direction, from, to, density);
    const float end = std::min(to, reach_[direction]);
    if (end > from) accumulate(visible_, direction, from, end, density);
  }

  static void accumulate(SurfaceMoments& sums, int direction, float from, float to, float density) {
    sums.one += density * (kernel_integral<kernel>(to) - kernel_integral<kernel>(from));
    if constexpr (kernel == PhotonKernel::parabola) {
      const float dx = kDirection.x[direction], dy = kDirection.y[direction];
      const float first = density * (parabola_first(to) - parabola_first(from));
      const float second = density * (parabola_second(to) - parabola_second(from));
      sums.x += first * dx;
      sums.y += first * dy;
      sums.xx += second * dx * dx;
      sums.xy += second * dx * dy;
      sums.yy += second * dy * dy;
    }
  }

  /// From sums over directions to integrals; the powers of the place, too, are integrated over the sector of each direction.
  static SurfaceMoments scaled(const SurfaceMoments& sums) {
    constexpr float kSector = 2 * kPi / kDirections;
    const float scale = 0.5f * kSector;
    const float first = scale * std::sin(0.5f * kSector) / (0.5f * kSector), second = scale * std::sin(kSector) / kSector;
    const float even = scale * 0.5f * (sums.xx + sums.yy), odd = second * 0.5f * (sums.xx - sums.yy);
    return {scale * sums.one, first * sums.x, first * sums.y, even + odd, second * sums.xy, even - odd};
  }

  /// The rings within the squared distance q.
  static std::uint64_t mask(float q) {
    const int rings = static_cast<int>(q * kRings + 0.5f);
    return rings >= kRings ? ~std::uint64_t{0} : (std::uint64_t{1} << rings) - 1;
  }

  alignas(32) float reach_[kDirections];  // squared distance up to which the surface is visible
  std::uint64_t covered_[kDirections] = {};
  SurfaceMoments visible_, whole_;
};

/// A piece of surface in the frame of the tangent plane.
struct LocalPiece {
  Vec3 center;
  float step;    // offset . (sum of normals)
  float cosine;  // between its normal and the tangent plane's
  float area;
  float spread;  // mean squared distance of its points from its centre
};

/// Means over a piece of surface.
struct PieceMeans {
  float kernel;
  float inside;  // share of it that is within the ball
};

/// `q`: mean squared distance. The piece is taken for a square; the ball's border cuts it along a side.
template <PhotonKernel kernel>
PieceMeans piece_means(float q, float spread) {
  constexpr bool kParabola = kernel == PhotonKernel::parabola;
  const float half = std::sqrt((kParabola ? 6.0f : 1.5f) * spread);  // change of the kernel over half a side
  // Of two coordinates, one changes the distance in first order; the spread along the other makes its mean greater.
  const float middle = 1 - (kParabola ? q : std::sqrt(q - 0.5f * spread));
  if (middle <= -half) return {0, 0};
  if (middle >= half) return {kernel == PhotonKernel::constant ? 1 : middle, 1};
  const float inside = (middle + half) / (2 * half);
  return {kernel == PhotonKernel::constant ? inside : half * sqr(inside), inside};
}

/// Integrals of the kernel over pieces, each taken for a point.
template <PhotonKernel kernel>
class PieceSum {
 public:
  static constexpr std::uint32_t kMost = 4096;

  bool full() const { return count_ == kMost; }
  bool empty() const { return count_ == 0; }

  /// Must not be full.
  void add(const LocalPiece& piece) {
    const Vec3 c = piece.center;
    const float in_plane2 = sqr(c.x) + sqr(c.y), height2 = sqr(c.z);
    const float from2 = in_plane2 + piece.spread;  // a piece is not nearer to the point than it is wide
    if (height2 > sqr(Neighbourhood::kMaxSlope) * from2) return;
    if (sqr(piece.step) > sqr(Neighbourhood::max_step(piece.cosine)) * from2) return;
    const float q = from2 + height2;
    const PieceMeans means = piece_means<kernel>(q, piece.spread);
    if (!(piece.area * means.kernel > 0)) return;
    Block& block = blocks_[count_ / kLanes];
    if (count_ % kLanes == 0) block = Block{};
    const std::uint32_t lane = count_++ % kLanes;
    block.x[lane] = c.x;
    block.y[lane] = c.y;
    block.stretch[lane] = in_plane2 > 0 ? std::sqrt(1 + height2 / in_plane2) : 0;
    block.weight[lane] = piece.area * means.kernel;
    block.bent[lane] = piece.area * means.inside * piece.spread;
    block.spread[lane] = piece.spread;
    const int band = std::min(static_cast<int>(q * Occupancy::kBands), Occupancy::kBands - 1);
    occupancy_.area[Occupancy::sector(c.x, c.y)][band] += piece.area * piece.cosine;
  }

  /// Of all pieces, and of those that no blocker hides.
  void sum(const SurfaceCoverage& coverage, SurfaceMoments& whole, SurfaceMoments& visible) const {
    Lanes of_whole[6] = {}, of_visible[6] = {};
    for (std::uint32_t i = 0; i < (count_ + kLanes - 1) / kLanes; ++i) {
      const Block& block = blocks_[i];
      const Lanes x = block.x * block.stretch, y = block.y * block.stretch;
      accumulate(of_whole, block.weight, block.bent, block.spread, x, y);
      if (coverage.blockers == 0) continue;
      const LaneMask hidden = coverage.hides(block.x, block.y);
      accumulate(of_visible, hidden ? Lanes{} : block.weight, hidden ? Lanes{} : block.bent, block.spread, x, y);
    }
    add_lanes(whole, of_whole);
    add_lanes(visible, coverage.blockers > 0 ? of_visible : of_whole);
  }

  const Occupancy& occupancy() const { return occupancy_; }

 private:
  /// (x, y): place in the tangent plane; times `stretch`, it is as far from the point as the piece is. Integrals over the
  /// piece: `weight` of the kernel, `bent` of the area within the ball times the spread.
  struct Block {
    Lanes x, y, stretch, weight, bent, spread;
  };

  /// For the parabola, integrals of second order polynomials over places that spread evenly around (x, y), but for what is of
  /// fourth order in their spread.
  static void accumulate(Lanes (&sums)[6], const Lanes& weight, const Lanes& bent, const Lanes& spread, const Lanes& x,
                         const Lanes& y) {
    sums[0] += weight;
    if constexpr (kernel != PhotonKernel::parabola) return;
    const Lanes first = weight - bent, second = first - bent, around = 0.5f * weight * spread;
    sums[1] += first * x;
    sums[2] += first * y;
    sums[3] += second * x * x + around;
    sums[4] += second * x * y;
    sums[5] += second * y * y + around;
  }
  static void add_lanes(SurfaceMoments& moments, const Lanes (&sums)[6]) {
    float* const to[6] = {&moments.one, &moments.x, &moments.y, &moments.xx, &moments.xy, &moments.yy};
    for (int k = 0; k < 6; ++k) *to[k] += ln::sum(sums[k]);
  }

  std::uint32_t count_ = 0;
  Block blocks_[kMost / kLanes];
  Occupancy occupancy_;
};

}  // namespace ln
