#pragma once
// The surfaces of a scene as patches: planar pieces with a parameter domain, on which irradiance can be stored.
//
// Two triangles of one part that form a parallelogram are one patch with the domain [0,1]^2; every other triangle is a patch
// of its own with the domain s, t >= 0, s + t <= 1 (its barycentric u, v). Both are affine, so cells of equal size in the
// domain have equal area on the surface. A patch has two faces, its sides: face 2 p is the front of patch p, 2 p + 1 its back.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// A piece of an affine domain, or of a plane in space (V = Vec2 or Vec3): the parallelogram o, o+a, o+a+b, o+b or the triangle
/// o, o+a, o+b. Either is cut into four children of equal area and the same shape.
template <class V>
struct BasicCell {
  V o{0}, a{0}, b{0};
  bool quad = true;

  int corner_count() const { return quad ? 4 : 3; }
  /// Corners counter-clockwise, from `o` on.
  V corner(int k) const {
    if (quad) return k == 0 ? o : k == 1 ? o + a : k == 2 ? o + a + b : o + b;
    return k == 0 ? o : k == 1 ? o + a : o + b;
  }
  V center() const { return o + (quad ? 0.5f : 1.0f / 3) * (a + b); }

  /// Quads: the quarters at (0,0), (1,0), (0,1), (1,1). Triangles: those at the three corners, and the middle one, turned over.
  BasicCell child(int i) const {
    const V half_a = 0.5f * a, half_b = 0.5f * b;
    if (!quad && i == 3) return {o + half_a + half_b, -half_a, -half_b, false};
    return {o + (i & 1 ? half_a : V(0)) + (i & 2 ? half_b : V(0)), half_a, half_b, quad};
  }

  /// A point of the cell from a point of the unit square; preserves area. Triangles: Heitz 2019, "A Low-Distortion Map
  /// Between Triangle and Square".
  V point(Vec2 u) const {
    if (!quad) {
      if (u.y > u.x) {
        u.x *= 0.5f;
        u.y -= u.x;
      } else {
        u.y *= 0.5f;
        u.x -= u.y;
      }
    }
    return o + u.x * a + u.y * b;
  }
};
using DomainCell = BasicCell<Vec2>;
using SurfaceCell = BasicCell<Vec3>;

/// Area of a flat cell in space.
inline float area(const SurfaceCell& cell) { return (cell.quad ? 1.0f : 0.5f) * glm::length(glm::cross(cell.a, cell.b)); }

/// The child that the point `st`, relative to its cell, lies in; makes `st` relative to that child.
inline int descend(bool quad, Vec2& st) {
  st *= 2.0f;
  if (!quad && st.x < 1 && st.y < 1 && st.x + st.y > 1) {
    st = Vec2(1) - st;
    return 3;
  }
  const int right = st.x >= 1 ? 1 : 0, upper = st.y >= 1 && (quad || right == 0) ? 1 : 0;
  st -= Vec2(static_cast<float>(right), static_cast<float>(upper));
  return right + 2 * upper;
}

class Patches {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  Patches() = default;
  /// `data` must outlive the patches.
  explicit Patches(const SceneData& data);

  std::size_t size() const { return patches_.size(); }
  std::size_t face_count() const { return 2 * size(); }
  static std::uint32_t face(std::uint32_t patch, bool front) { return 2 * patch + (front ? 0 : 1); }
  static bool is_front(std::uint32_t face) { return face % 2 == 0; }

  bool quad(std::uint32_t patch) const { return patches_[patch].triangle[1] != kNoTriangle; }
  std::uint32_t part(std::uint32_t patch) const { return data_->triangle_part[patches_[patch].triangle[0]]; }
  /// The whole domain of a patch, and the patch in space [normalised units of the scene].
  DomainCell domain(std::uint32_t patch) const { return {Vec2(0), Vec2(1, 0), Vec2(0, 1), quad(patch)}; }
  SurfaceCell surface(std::uint32_t patch) const;

  struct Location {
    std::uint32_t patch;
    Vec2 st;  // in the domain
  };
  /// Where a point of a triangle (barycentric u, v) lies.
  Location locate(std::uint32_t triangle, float u, float v) const {
    const std::uint32_t half = triangle_half_[triangle];
    const std::uint32_t patch = half / 2, i = half % 2;
    const Patch& p = patches_[patch];
    const float bary[3] = {1 - u - v, u, v};
    const float second = bary[(p.first[i] + 1u) % 3], third = bary[(p.first[i] + 2u) % 3];
    Vec2 st(second, third);
    if (quad(patch)) st = i == 0 ? Vec2(second + third, third) : Vec2(second, second + third);
    st = {std::clamp(st.x, 0.0f, 1.0f), std::clamp(st.y, 0.0f, 1.0f)};
    if (!quad(patch) && st.x + st.y > 1) st /= st.x + st.y;
    return {patch, st};
  }
  /// The inverse; `t` is not set.
  Hit hit(std::uint32_t patch, const Vec2& st) const;

  /// The neighbour behind edge `k` (from corner k to the next) where the surface goes on without a crease, as 4 * patch + edge;
  /// kNone otherwise. Its edge runs the other way.
  std::uint32_t neighbour(std::uint32_t patch, int k) const { return neighbours_[patch][static_cast<std::size_t>(k)]; }
  /// Cosine of the largest angle between normals across an edge that is no crease.
  static constexpr float kCreaseCos = 0.9f;

 private:
  /// A triangle's vertex first[i] is the corner (0,0); further vertices are (1,0), (1,1) of triangle[0] and (1,1), (0,1) of
  /// triangle[1]; of a lone triangle (1,0), (0,1).
  struct Patch {
    std::uint32_t triangle[2] = {kNoTriangle, kNoTriangle};
    std::uint8_t first[2] = {0, 0};
  };

  void pair_triangles();
  void find_neighbours();
  Vec3 vertex(std::uint32_t triangle, unsigned i) const { return data_->positions[data_->triangles[triangle][i % 3]]; }

  const SceneData* data_ = nullptr;
  std::vector<Patch> patches_;
  std::vector<std::uint32_t> triangle_half_;  // by triangle: 2 * patch + which of its triangles
  std::vector<std::uint32_t> point_id_;       // by vertex: equal where positions are
  std::vector<std::array<std::uint32_t, 4>> neighbours_;
};

}  // namespace ln
