#include "gltf_normalise.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

namespace ln::gltf {
namespace {

// ---------------------------------------------------------------- box

struct Box {
  DVec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  void add(const DVec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
};

/// The power of two such that `size` / unit lies in (1/2, 1].
double power_of_two_above(double size) {
  int exponent = 0;
  const double fraction = std::frexp(size, &exponent);
  return std::ldexp(1.0, fraction == 0.5 ? exponent - 1 : exponent);
}

// ---------------------------------------------------------------- duplicates

using Corner = std::array<std::uint32_t, 3>;  // the bits of a position, with one zero

Corner corner_bits(const Vec3& p) {
  const Vec3 q = p + Vec3(0.0f);  // -0 becomes 0
  return {std::bit_cast<std::uint32_t>(q.x), std::bit_cast<std::uint32_t>(q.y), std::bit_cast<std::uint32_t>(q.z)};
}

std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 31)) * 0x7fb5d329728ea185ull;
  x = (x ^ (x >> 27)) * 0x81dadef4bc2dd44dull;
  return x ^ (x >> 33);
}

/// Finds triangles with the same corners through a hash table with open addressing; its entries hold half of the hash, so
/// that triangles which differ are rarely looked at.
class DuplicateFinder {
 public:
  explicit DuplicateFinder(const SceneData& scene)
      : scene_(scene), slots_(std::bit_ceil(scene.triangles.size() * 3 / 2 + 1), kFree) {
    vertex_hashes_.reserve(scene.positions.size());
    for (const Vec3& position : scene.positions) {
      const Corner bits = corner_bits(position);
      vertex_hashes_.push_back(mix(mix(bits[0] + (static_cast<std::uint64_t>(bits[1]) << 32)) + bits[2]));
    }
    for (const Material& material : scene.materials) {
      groups_.push_back(material.alpha_mode == AlphaMode::opaque ? 0 : static_cast<std::uint32_t>(groups_.size()) + 1);
    }
  }

  /// Says that seen_before(triangle) will be asked soon.
  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&slots_[hash_of(triangle) & (slots_.size() - 1)]); }

  /// True if a triangle with the same corners was seen before.
  bool seen_before(std::uint32_t triangle) {
    const std::uint64_t hash = hash_of(triangle);
    const std::uint64_t entry = (hash & ~0xffffffffull) | triangle;
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = hash & mask;; at = (at + 1) & mask) {
      if (slots_[at] == kFree) {
        slots_[at] = entry;
        return false;
      }
      if ((slots_[at] ^ entry) >> 32 == 0 && same_corners(static_cast<std::uint32_t>(slots_[at]), triangle)) return true;
    }
  }

 private:
  static constexpr std::uint64_t kFree = ~0ull;

  std::uint64_t hash_of(std::uint32_t triangle) const {
    const UVec3& t = scene_.triangles[triangle];
    return mix(vertex_hashes_[t.x] + vertex_hashes_[t.y] + vertex_hashes_[t.z] + group(triangle));
  }

  std::uint32_t group(std::uint32_t triangle) const { return groups_[scene_.parts[scene_.triangle_part[triangle]].material]; }

  std::array<Corner, 3> corners(std::uint32_t triangle) const {
    const UVec3& t = scene_.triangles[triangle];
    std::array<Corner, 3> corners{corner_bits(scene_.positions[t.x]), corner_bits(scene_.positions[t.y]),
                                  corner_bits(scene_.positions[t.z])};
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  bool same_corners(std::uint32_t a, std::uint32_t b) const { return group(a) == group(b) && corners(a) == corners(b); }

  const SceneData& scene_;
  std::vector<std::uint64_t> slots_;
  std::vector<std::uint64_t> vertex_hashes_;
  std::vector<std::uint32_t> groups_;  // by material: 0, or one's own
};

// ---------------------------------------------------------------- removing

bool has_area(const SceneData& scene, const UVec3& t) {
  const DVec3 a(scene.positions[t.x]), b(scene.positions[t.y]), c(scene.positions[t.z]);
  const DVec3 n = glm::cross(b - a, c - a);
  return glm::dot(n, n) >= static_cast<double>(std::numeric_limits<float>::min());
}

/// Removes the marked triangles, and the parts that have none left.
void remove_triangles(SceneData& scene, const std::vector<bool>& doomed) {
  std::vector<Part> parts;
  std::uint32_t kept = 0;
  for (Part& part : scene.parts) {
    const std::uint32_t first = kept;
    for (std::uint32_t i = part.first_triangle; i < part.first_triangle + part.triangle_count; ++i) {
      if (doomed[i]) continue;
      scene.triangle_part[kept] = static_cast<std::uint32_t>(parts.size());
      scene.triangles[kept++] = scene.triangles[i];
    }
    part.first_triangle = first;
    part.triangle_count = kept - first;
    if (part.triangle_count > 0) parts.push_back(std::move(part));
  }
  scene.parts = std::move(parts);
  scene.triangles.resize(kept);
  scene.triangle_part.resize(kept);
}

template <class T>
void keep(std::vector<T>& values, const std::vector<bool>& used) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (used[i]) values[kept++] = values[i];
  }
  values.resize(kept);
}

std::vector<bool> used_vertices(const SceneData& scene, std::size_t count) {
  std::vector<bool> used(count, false);
  for (const UVec3& t : scene.triangles) used[t.x] = used[t.y] = used[t.z] = true;
  return used;
}

void remove_unused_vertices(SceneData& scene) {
  const std::vector<bool> used = used_vertices(scene, scene.positions.size());
  if (std::find(used.begin(), used.end(), false) == used.end()) return;
  std::vector<std::uint32_t> number(used.size());
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < used.size(); ++i) number[i] = used[i] ? next++ : 0;
  for (UVec3& t : scene.triangles) t = {number[t.x], number[t.y], number[t.z]};
  keep(scene.positions, used);
  keep(scene.normals, used);
  keep(scene.tangents, used);
  keep(scene.uvs[0], used);
  keep(scene.uvs[1], used);
  keep(scene.colors, used);
}

/// Marks triangles without area and all but one of each set of duplicates.
std::vector<bool> find_doomed(const SceneData& scene, Notes& notes) {
  std::vector<bool> doomed(scene.triangles.size(), false);
  double degenerate = 0, duplicate = 0;
  for (std::size_t i = 0; i < doomed.size(); ++i) {
    if (has_area(scene, scene.triangles[i])) continue;
    doomed[i] = true;
    ++degenerate;
  }
  DuplicateFinder finder(scene);
  for (const bool emitting : {true, false}) {
    for (const Part& part : scene.parts) {
      if (scene.materials[part.material].emits() != emitting) continue;
      constexpr std::uint32_t kAhead = 12;
      const std::uint32_t end = part.first_triangle + part.triangle_count;
      for (std::uint32_t i = part.first_triangle; i < end; ++i) {
        if (end - i > kAhead) finder.prefetch(i + kAhead);
        if (doomed[i] || !finder.seen_before(i)) continue;
        doomed[i] = true;
        ++duplicate;
      }
    }
  }
  if (degenerate > 0) notes.count("triangle without area was dropped", "triangles without area were dropped", degenerate);
  if (duplicate > 0)
    notes.count("triangle with the same corners as another one was dropped",
                "triangles with the same corners as another one were dropped", duplicate);
  return doomed;
}

}  // namespace

Normalisation normalise_geometry(SceneData& scene, std::vector<DVec3>&& world, Notes& notes) {
  Box box;
  const std::vector<bool> used = used_vertices(scene, world.size());
  for (std::size_t i = 0; i < world.size(); ++i) {
    if (used[i]) box.add(world[i]);
  }
  if (scene.triangles.empty()) box = {DVec3(0), DVec3(0)};

  Normalisation normalised{box.low, (box.high - box.low) * 0.5, 1};
  const double half_diagonal = std::hypot(normalised.half.x, normalised.half.y, normalised.half.z);
  if (half_diagonal > 0) normalised.unit = power_of_two_above(half_diagonal);
  scene.origin = normalised.low + normalised.half;
  scene.unit = normalised.unit;
  scene.positions.resize(world.size(), Vec3(0));
  for (std::size_t i = 0; i < world.size(); ++i) {
    if (used[i]) scene.positions[i] = normalised(world[i]);
  }
  world = {};

  const std::vector<bool> doomed = find_doomed(scene, notes);
  if (std::find(doomed.begin(), doomed.end(), true) != doomed.end()) remove_triangles(scene, doomed);
  remove_unused_vertices(scene);
  return normalised;
}

}  // namespace ln::gltf
