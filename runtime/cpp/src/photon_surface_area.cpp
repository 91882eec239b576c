#include "ln/surface_area.hpp"

#include <algorithm>

#include "surface_sweep.hpp"

namespace ln {

namespace {

/// What is smaller than this is taken for points [radii].
constexpr float kPieceSize = 1.0f / 6;

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

SurfaceArea::Piece SurfaceArea::Node::get(std::size_t lane) const {
  const auto vector = [lane](const float (&values)[3][kWidth]) {
    return Vec3(values[0][lane], values[1][lane], values[2][lane]);
  };
  return {vector(low),    vector(high), vector(normal_low), vector(normal_high), vector(center),
          vector(normal), area[lane],   spread[lane],       label[lane]};
}

void SurfaceArea::Node::set(std::size_t lane, const Piece& piece) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis][lane] = piece.low[axis];
    high[axis][lane] = piece.high[axis];
    normal_low[axis][lane] = piece.normal_low[axis];
    normal_high[axis][lane] = piece.normal_high[axis];
    center[axis][lane] = piece.center[axis];
    normal[axis][lane] = piece.normal[axis];
  }
  area[lane] = piece.area;
  spread[lane] = piece.spread;
  label[lane] = piece.label;
}

SurfaceArea::Piece SurfaceArea::piece_of(std::uint32_t triangle) const {
  const UVec3 t = data_->triangles[triangle];
  const Vec3 a = data_->positions[t.x], b = data_->positions[t.y], c = data_->positions[t.z];
  const Vec3 ab = b - a, ac = c - a, cross = glm::cross(ab, ac);
  Piece piece;
  piece.low = glm::min(a, glm::min(b, c));
  piece.high = glm::max(a, glm::max(b, c));
  piece.center = a + (ab + ac) / 3.0f;
  piece.label = labels_.empty() ? 0 : labels_[triangle];
  const Vec3 normal = glm::normalize(cross);
  if (!is_finite(normal)) return piece;  // without area
  piece.normal_low = piece.normal_high = piece.normal = normal;
  piece.area = 0.5f * glm::length(cross);
  piece.spread = (glm::dot(ab, ab) + glm::dot(ac, ac) - glm::dot(ab, ac)) / 18;
  return piece;
}

SurfaceArea::Piece SurfaceArea::merge(std::span<const Piece> pieces) {
  Piece all;
  all.label = pieces.front().label;
  for (const Piece& piece : pieces) {
    all.low = glm::min(all.low, piece.low);
    all.high = glm::max(all.high, piece.high);
    all.normal_low = glm::min(all.normal_low, piece.normal_low);
    all.normal_high = glm::max(all.normal_high, piece.normal_high);
    all.center += piece.area * piece.center;
    all.normal += piece.area * piece.normal;
    all.area += piece.area;
    if (piece.label != all.label) all.label = kMixed;
  }
  if (!(all.area > 0)) return all;
  all.center /= all.area;
  const float length = glm::length(all.normal);
  if (length > 0) all.normal /= length;
  for (const Piece& piece : pieces) {
    const Vec3 offset = piece.center - all.center;
    all.spread += piece.area / all.area * (piece.spread + glm::dot(offset, offset));
  }
  return all;
}

SurfaceArea::SurfaceArea(PrepareContext& context, const SceneData& data, std::span<const std::uint32_t> labels)
    : data_(&data), labels_(labels.begin(), labels.end()) {
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

  // Merge groups of triangles, then groups of groups.
  std::vector<Piece> below((count - 1) / kLeaf + 1);
  context.for_chunks(below.size(), 1024, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) {
      Piece leaf[kLeaf];
      const std::size_t n = std::min<std::size_t>(kLeaf, count - i * kLeaf);
      for (std::size_t k = 0; k < n; ++k) leaf[k] = piece_of(triangles_[i * kLeaf + k]);
      below[i] = merge({leaf, n});
    }
  });
  for (bool top = false; !top;) {
    std::vector<Node> level((below.size() - 1) / kWidth + 1);
    std::vector<Piece> above(level.size());
    for (std::size_t i = 0; i < level.size(); ++i) {
      const std::span<const Piece> group(below.data() + i * kWidth, std::min<std::size_t>(kWidth, below.size() - i * kWidth));
      for (std::size_t lane = 0; lane < kWidth; ++lane) level[i].set(lane, lane < group.size() ? group[lane] : Piece{});
      above[i] = merge(group);
    }
    top = level.size() == 1;
    levels_.push_back(std::move(level));
    below.swap(above);
  }
}

template <class UsePiece, class UseTriangle>
void SurfaceArea::for_near(const Neighbourhood& around, float radius, float piece_size, std::uint32_t label,
                           UsePiece&& use_piece, UseTriangle&& use_triangle) const {
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
    const Node& node = levels_[at.level][at.index];
    bool near[kWidth], whole[kWidth], small[kWidth];
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      float distance2 = 0, size2 = 0, lowest = 0, highest = 0, most = 0, least = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float low = node.low[axis][i] - p[axis], high = node.high[axis][i] - p[axis];
        const float outside = std::max(std::max(low, -high), 0.0f);
        distance2 += outside * outside;
        size2 += sqr(high - low);
        lowest += std::min(n[axis] * low, n[axis] * high);
        highest += std::max(n[axis] * low, n[axis] * high);
        const float a = facing[axis] * node.normal_low[axis][i], b = facing[axis] * node.normal_high[axis][i];
        most += std::max(a, b);
        least += std::min(a, b);
      }
      // What faces another way can only hide something, if it is where the surface is seen from.
      const bool faces = most > Neighbourhood::kMinCos && lowest <= steepest && highest >= -steepest;
      near[i] = distance2 <= limit && (faces || (lowest <= eye && highest >= eye));
      whole[i] = least > Neighbourhood::kMinCos;
      small[i] = size2 < piece_size * piece_size;
    }
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      if (!near[i]) continue;
      if (whole[i] && node.label[i] != kMixed) {
        if (label != kEverything && node.label[i] != label) continue;
        if (small[i]) {
          if (!use_piece(node.get(i))) return;
          continue;
        }
      }
      const std::uint32_t child = at.index * kWidth + i;
      if (at.level > 0) {
        stack[depth++] = {at.level - 1, child};
        continue;
      }
      const std::uint32_t first = child * kLeaf, last = std::min(first + kLeaf, static_cast<std::uint32_t>(triangles_.size()));
      for (std::uint32_t k = first; k < last; ++k)
        if (!use_triangle(triangles_[k])) return;
    }
  }
}

template <PhotonKernel kernel>
SurfaceArea::Outcome SurfaceArea::measure_with(const Neighbourhood& around, float radius, float piece_size, std::uint32_t label,
                                               SurfaceCoverage& coverage) const {
  const Frame frame = make_frame(around.normal);
  const float side = around.front ? 1.0f : -1.0f;
  const float scale = 1 / radius;
  coverage.radius = radius;
  coverage.s = frame.s * scale;
  coverage.t = frame.t * scale;
  coverage.blockers = 0;

  Sweep<kernel> sweep;
  PieceSum<kernel> pieces;
  LocalTriangle facing[kMaxTriangles];
  int facing_count = 0;
  bool too_many = false;
  const auto local = [&](const Vec3& offset) {
    return Vec3(glm::dot(offset, coverage.s), glm::dot(offset, coverage.t), glm::dot(offset, around.normal) * scale);
  };
  const auto use_piece = [&](const Piece& piece) {
    if (pieces.full()) return false;
    const Vec3 offset = piece.center - around.point, normal = side * piece.normal;
    pieces.add({local(offset), glm::dot(offset, around.normal + normal) * scale, glm::dot(normal, around.normal),
                piece.area * sqr(scale), piece.spread * sqr(scale)});
    return true;
  };
  const auto use_triangle = [&](std::uint32_t triangle) {
    const UVec3 t = data_->triangles[triangle];
    const Vec3 a = data_->positions[t.x] - around.point, b = data_->positions[t.y] - around.point,
               c = data_->positions[t.z] - around.point;
    const Vec3 normal = glm::cross(b - a, c - a);
    const float agreement = glm::dot(normal, around.normal) * side;
    if (agreement > 0 && agreement * agreement > Neighbourhood::kMinCos * Neighbourhood::kMinCos * glm::dot(normal, normal)) {
      if (label != kEverything && labels_[triangle] != label) return true;
      const Vec3 size = glm::max(a, glm::max(b, c)) - glm::min(a, glm::min(b, c));
      const float size2 = glm::dot(size, size);
      if (size2 < sqr(piece_size)) return use_piece(piece_of(triangle));
      if (size2 < sqr(2 * piece_size)) {
        // Quarters: cheaper than the triangle along all directions.
        Piece quarter = piece_of(triangle);
        quarter.area *= 0.25f;
        quarter.spread *= 0.25f;
        const Vec3 middle = quarter.center;
        if (!use_piece(quarter)) return false;
        for (const Vec3& corner : {a, b, c}) {
          quarter.center = 0.5f * (middle + corner + around.point);
          if (!use_piece(quarter)) return false;
        }
        return true;
      }
      too_many = facing_count == kMaxTriangles;
      if (too_many) return false;
      LocalTriangle& mine = facing[facing_count++] = {{local(a), local(b), local(c)}};
      if (!around.front) std::swap(mine.corner[1], mine.corner[2]);  // seen from behind
      return true;
    }
    if (coverage.blockers == SurfaceCoverage::kMaxBlockers) return true;
    SurfaceBlocker& line = coverage.blocker[coverage.blockers];
    if (!crossing({{local(a), local(b), local(c)}}, line)) return true;
    const float c0 = std::abs(line.a.x * line.b.y - line.a.y * line.b.x), length = glm::length(line.b - line.a);
    if (c0 < length && c0 >= kMinBlockerDistance * length) {
      sweep.block(line);
      ++coverage.blockers;
    }
    return true;
  };
  for_near(around, radius, piece_size, label, use_piece, use_triangle);
  if (too_many) return Outcome::too_many;
  if (pieces.full()) return Outcome::too_fine;

  for (int i = 0; i < facing_count; ++i) sweep.add(facing[i]);
  SurfaceMoments whole = sweep.whole(), visible = sweep.visible();
  if (!pieces.empty()) {
    Occupancy occupancy = pieces.occupancy();
    if (facing_count > 0) sweep.occupy(occupancy);
    if (occupancy.overlaps()) return Outcome::overlapping;
    pieces.sum(coverage, whole, visible);
  }
  if (visible.one < kMinVisibleShare * whole.one) {
    visible = whole;
    coverage.blockers = 0;
  }
  coverage.area = visible.one * sqr(radius);
  coverage.moments = visible;
  return Outcome::measured;
}

void SurfaceArea::measure(const Neighbourhood& around, float radius, PhotonKernel kernel, SurfaceCoverage& coverage,
                          std::uint32_t label) const {
  const auto outcome = [&](float r, float piece_size) {
    switch (kernel) {
      case PhotonKernel::constant: return measure_with<PhotonKernel::constant>(around, r, piece_size, label, coverage);
      case PhotonKernel::cone: return measure_with<PhotonKernel::cone>(around, r, piece_size, label, coverage);
      case PhotonKernel::parabola: break;
    }
    return measure_with<PhotonKernel::parabola>(around, r, piece_size, label, coverage);
  };
  constexpr int kHalvings = 10;
  float r = radius;
  for (int i = 0; i <= kHalvings; ++i, r *= 0.5f) {
    float piece_size = kPieceSize * r;
    Outcome result = outcome(r, piece_size);
    for (; result == Outcome::too_fine && piece_size < r; piece_size *= 2) result = outcome(r, 2 * piece_size);
    if (result == Outcome::overlapping) result = outcome(r, 0);  // only triangles tell what lies on each other
    if (result == Outcome::measured) return;
  }

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
