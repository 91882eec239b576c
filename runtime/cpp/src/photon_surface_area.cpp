#include <algorithm>
#include <array>
#include <bit>

#include "ln/surface_area.hpp"

namespace ln {

namespace {

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
float parabola_first(float q) { return q * std::sqrt(q) * (2.0f / 3 - 2.0f / 5 * q); }
float parabola_second(float q) { return q * q * (0.5f - 1.0f / 3 * q); }

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
    plane.tilt = glm::length(normal) / normal.z;
    // Directions come quadrant by quadrant: most small triangles lie in one.
    if (high.x >= 0 && high.y >= 0) add_quadrant<0>(triangle, plane);
    if (low.x <= 0 && high.y >= 0) add_quadrant<1>(triangle, plane);
    if (low.x <= 0 && low.y <= 0) add_quadrant<2>(triangle, plane);
    if (high.x >= 0 && low.y <= 0) add_quadrant<3>(triangle, plane);
  }

  /// Integral of the kernel over the surface that is visible, and over all of it.
  float visible() const { return visible_.one * (kPi / kDirections); }
  float whole() const { return whole_.one * (kPi / kDirections); }
  SurfaceMoments visible_moments() const { return scaled(visible_); }
  SurfaceMoments whole_moments() const { return scaled(whole_); }

 private:
  static constexpr int kDirections = direction_count(kernel), kQuadrant = kDirections / 4;
  static inline const Directions<kDirections> kDirection;

  /// Of a triangle: height over the tangent plane is h0 + gx x + gy y, area over projected area is tilt.
  struct Plane {
    float h0, gx, gy, tilt;
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
    // Cut off what is too steep and what is outside the ball.
    alignas(32) float from[kQuadrant], to[kQuadrant], density[kQuadrant];
    int any = 0;
    for (int j = 0; j < kQuadrant; ++j) {
      const float g = plane.gx * dx[j] + plane.gy * dy[j];
      constexpr float kSlope = Neighbourhood::kMaxSlope;
      float near = lower[j];
      const float above = plane.h0 / (kSlope - g), below = -plane.h0 / (kSlope + g);
      near = above > near ? above : near;
      near = below > near ? below : near;
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

/// Interleaves zeros between the lower 20 bits.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  x = (x | x << 2) & 0x1249249249249249ull;
  return x;
}

/// Sorting by this puts triangles of similar size that are near each other together.
std::uint64_t sorting_key(const Vec3& low, const Vec3& high) {
  int size_class = 0;
  for (float size = 0x1p-7f; size_class < 7 && size < max_component(high - low); size *= 2) ++size_class;
  std::uint64_t key = static_cast<std::uint64_t>(size_class) << 60;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float c = std::clamp((0.5f * (low[axis] + high[axis]) + 1) * 0x1p19f, 0.0f, 0x1p20f - 1);
    key |= spread_bits(static_cast<std::uint64_t>(c)) << axis;
  }
  return key;
}

}  // namespace

SurfaceArea::SurfaceArea(PrepareContext& context, const SceneData& data) : data_(&data) {
  const std::size_t count = data.triangles.size();
  if (count == 0) return;

  // Sort: pieces in parallel, then merge them pair by pair.
  struct Key {
    std::uint64_t key;
    std::uint32_t triangle;
    bool operator<(const Key& other) const { return key != other.key ? key < other.key : triangle < other.triangle; }
  };
  std::vector<Key> keys(count);
  const std::size_t piece = std::max<std::size_t>((count + 15) / 16, 4096);
  context.for_chunks(count, piece, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) {
      const UVec3 t = data.triangles[i];
      const Vec3 a = data.positions[t.x], b = data.positions[t.y], c = data.positions[t.z];
      keys[i] = {sorting_key(glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))), static_cast<std::uint32_t>(i)};
    }
    std::sort(keys.begin() + static_cast<std::ptrdiff_t>(begin), keys.begin() + static_cast<std::ptrdiff_t>(end));
  });
  for (std::size_t width = piece; width < count; width *= 2) {
    context.parallel_for((count - 1) / (2 * width) + 1, [&](Tracer&, std::size_t i) {
      const auto at = [&](std::size_t k) { return keys.begin() + static_cast<std::ptrdiff_t>(std::min(k, count)); };
      std::inplace_merge(at(2 * i * width), at((2 * i + 1) * width), at((2 * i + 2) * width));
    });
  }
  triangles_.resize(count);
  for (std::size_t i = 0; i < count; ++i) triangles_[i] = keys[i].triangle;

  // Bound groups of triangles, then groups of groups.
  const auto empty_boxes = [] {
    Boxes boxes;
    for (auto* low : {&boxes.low, &boxes.normal_low}) std::fill(&(*low)[0][0], &(*low)[0][0] + 3 * kWidth, kInfinity);
    for (auto* high : {&boxes.high, &boxes.normal_high}) std::fill(&(*high)[0][0], &(*high)[0][0] + 3 * kWidth, -kInfinity);
    return boxes;
  };
  const auto include = [](float (&lows)[3][kWidth], float (&highs)[3][kWidth], std::size_t lane, const Vec3& low,
                          const Vec3& high) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lows[axis][lane] = std::min(lows[axis][lane], low[axis]);
      highs[axis][lane] = std::max(highs[axis][lane], high[axis]);
    }
  };
  std::vector<Boxes> lowest((count - 1) / (kLeaf * kWidth) + 1, empty_boxes());
  for (std::size_t i = 0; i < count; ++i) {
    const UVec3 t = data.triangles[triangles_[i]];
    const Vec3 a = data.positions[t.x], b = data.positions[t.y], c = data.positions[t.z];
    const Vec3 normal = glm::normalize(glm::cross(b - a, c - a));
    Boxes& boxes = lowest[i / (kLeaf * kWidth)];
    const std::size_t lane = i / kLeaf % kWidth;
    include(boxes.low, boxes.high, lane, glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c)));
    if (is_finite(normal)) include(boxes.normal_low, boxes.normal_high, lane, normal, normal);  // others have no area
  }
  levels_.push_back(std::move(lowest));
  while (levels_.back().size() > 1) {
    const std::vector<Boxes>& below = levels_.back();
    std::vector<Boxes> above((below.size() - 1) / kWidth + 1, empty_boxes());
    for (std::size_t i = 0; i < below.size(); ++i) {
      const auto corner = [](const float (&values)[3][kWidth], std::size_t lane) {
        return Vec3(values[0][lane], values[1][lane], values[2][lane]);
      };
      const Boxes& from = below[i];
      Boxes& to = above[i / kWidth];
      for (std::size_t lane = 0; lane < kWidth; ++lane) {
        include(to.low, to.high, i % kWidth, corner(from.low, lane), corner(from.high, lane));
        include(to.normal_low, to.normal_high, i % kWidth, corner(from.normal_low, lane), corner(from.normal_high, lane));
      }
    }
    levels_.push_back(std::move(above));
  }
}

template <class Use>
void SurfaceArea::for_near(const Neighbourhood& around, float radius, Use&& use) const {
  if (levels_.empty()) return;
  struct Pending {
    std::uint32_t level, index;
  };
  Pending stack[16 * kWidth];
  int depth = 0;
  stack[depth++] = {static_cast<std::uint32_t>(levels_.size() - 1), 0};
  const float limit = radius * radius, eye = kEyeHeight * radius;
  constexpr float kSlope = Neighbourhood::kMaxSlope;
  const float steepest = radius * kSlope / std::sqrt(1 + kSlope * kSlope);  // the greatest height in the neighbourhood
  const Vec3 p = around.point, n = around.normal, facing = around.front ? n : -n;
  while (depth > 0) {
    const Pending at = stack[--depth];
    const Boxes& boxes = levels_[at.level][at.index];
    bool near[kWidth];
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      float distance2 = 0, lowest = 0, highest = 0, agreement = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float low = boxes.low[axis][i] - p[axis], high = boxes.high[axis][i] - p[axis];
        const float outside = std::max(std::max(low, -high), 0.0f);
        distance2 += outside * outside;
        lowest += std::min(n[axis] * low, n[axis] * high);
        highest += std::max(n[axis] * low, n[axis] * high);
        agreement += std::max(facing[axis] * boxes.normal_low[axis][i], facing[axis] * boxes.normal_high[axis][i]);
      }
      // What faces another way can only hide something, if it is where the surface is seen from.
      const bool faces = agreement > Neighbourhood::kMinCos && lowest <= steepest && highest >= -steepest;
      near[i] = distance2 <= limit && (faces || (lowest <= eye && highest >= eye));
    }
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      if (!near[i]) continue;
      const std::uint32_t child = at.index * kWidth + i;
      if (at.level > 0) {
        stack[depth++] = {at.level - 1, child};
        continue;
      }
      const std::uint32_t first = child * kLeaf, last = std::min(first + kLeaf, static_cast<std::uint32_t>(triangles_.size()));
      for (std::uint32_t k = first; k < last; ++k)
        if (!use(triangles_[k])) return;
    }
  }
}

namespace {

/// The line in which a triangle crosses the height at which the surface is seen; false: it does not.
bool crossing(const LocalTriangle& triangle, SurfaceBlocker& line) {
  Vec2 ends[2];
  int count = 0;
  for (int e = 0; e < 3 && count < 2; ++e) {
    const Vec3& a = triangle.corner[e];
    const Vec3& b = triangle.corner[e == 2 ? 0 : e + 1];
    const float ha = a.z - kEyeHeight, hb = b.z - kEyeHeight;
    if ((ha < 0) == (hb < 0)) continue;
    ends[count++] = Vec2(a) + (Vec2(b) - Vec2(a)) * (ha / (ha - hb));
  }
  if (count < 2) return false;
  line = {ends[0], ends[1]};
  return true;
}

}  // namespace

/// False: there are too many triangles.
template <PhotonKernel kernel>
bool SurfaceArea::measure_with(const Neighbourhood& around, float radius, TriangleFilter filter,
                               SurfaceCoverage& coverage) const {
  const Frame frame = make_frame(around.normal);
  const float side = around.front ? 1.0f : -1.0f;
  const float scale = 1 / radius;
  coverage.radius = radius;
  coverage.s = frame.s * scale;
  coverage.t = frame.t * scale;
  coverage.blockers = 0;

  Sweep<kernel> sweep;
  LocalTriangle facing[kMaxTriangles];
  int facing_count = 0;
  bool too_many = false;
  for_near(around, radius, [&](std::uint32_t triangle) {
    const UVec3 t = data_->triangles[triangle];
    const Vec3 a = data_->positions[t.x] - around.point, b = data_->positions[t.y] - around.point,
               c = data_->positions[t.z] - around.point;
    const Vec3 normal = glm::cross(b - a, c - a);
    const float agreement = glm::dot(normal, around.normal) * side;
    const float ha = glm::dot(a, around.normal) * scale, hb = glm::dot(b, around.normal) * scale,
                hc = glm::dot(c, around.normal) * scale;
    const LocalTriangle local{{{glm::dot(a, coverage.s), glm::dot(a, coverage.t), ha},
                               {glm::dot(b, coverage.s), glm::dot(b, coverage.t), hb},
                               {glm::dot(c, coverage.s), glm::dot(c, coverage.t), hc}}};
    if (agreement > 0 && agreement * agreement > Neighbourhood::kMinCos * Neighbourhood::kMinCos * glm::dot(normal, normal)) {
      if (!filter(triangle)) return true;
      too_many = facing_count == kMaxTriangles;
      if (too_many) return false;
      facing[facing_count] = local;
      if (!around.front) std::swap(facing[facing_count].corner[1], facing[facing_count].corner[2]);  // seen from behind
      ++facing_count;
    } else if (coverage.blockers < SurfaceCoverage::kMaxBlockers && crossing(local, coverage.blocker[coverage.blockers])) {
      const SurfaceBlocker& line = coverage.blocker[coverage.blockers];
      const Vec2 along = line.b - line.a;
      const float c0 = std::abs(line.a.x * line.b.y - line.a.y * line.b.x), length = glm::length(along);
      if (c0 < length && c0 >= kMinBlockerDistance * length) {
        sweep.block(line);
        ++coverage.blockers;
      }
    }
    return true;
  });
  if (too_many) return false;
  for (int i = 0; i < facing_count; ++i) sweep.add(facing[i]);
  coverage.area = sweep.visible() * radius * radius;
  coverage.moments = sweep.visible_moments();
  if (sweep.visible() < kMinVisibleShare * sweep.whole()) {
    coverage.area = sweep.whole() * radius * radius;
    coverage.moments = sweep.whole_moments();
    coverage.blockers = 0;
  }
  return true;
}

void SurfaceArea::measure(const Neighbourhood& around, float radius, PhotonKernel kernel, SurfaceCoverage& coverage,
                          TriangleFilter filter) const {
  const auto fits = [&](float r) {
    switch (kernel) {
      case PhotonKernel::constant: return measure_with<PhotonKernel::constant>(around, r, filter, coverage);
      case PhotonKernel::cone: return measure_with<PhotonKernel::cone>(around, r, filter, coverage);
      case PhotonKernel::parabola: break;
    }
    return measure_with<PhotonKernel::parabola>(around, r, filter, coverage);
  };
  constexpr int kHalvings = 10;
  float r = radius;
  for (int i = 0; i <= kHalvings; ++i, r *= 0.5f)
    if (fits(r)) return;

  // A fan of triangles: a full disc.
  coverage.radius = radius;
  coverage.moments = {kPi / 2, 0, 0, kPi / 12, 0, kPi / 12};  // of the parabola
  const float share = kernel == PhotonKernel::constant ? kPi : kernel == PhotonKernel::cone ? kPi / 3 : coverage.moments.one;
  const Frame frame = make_frame(around.normal);
  coverage.area = share * radius * radius;
  coverage.blockers = 0;
  coverage.s = frame.s / radius;
  coverage.t = frame.t / radius;
}

}  // namespace ln
