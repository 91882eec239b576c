#pragma once
// How much surface lies around a point: what a sum over photons must be divided by.

#include <span>
#include <utility>
#include <vector>

#include "ln/photon_map.hpp"

namespace ln {

/// Weight of a photon at distance d of the kernel's radius r: 1, 1 - d/r, or 1 - (d/r)^2.
enum class PhotonKernel : std::uint8_t { constant, cone, parabola };

/// Integrals over a surface of a kernel times 1, x, y, x^2, xy, y^2. (x, y): direction in the tangent plane times distance
/// [radii].
struct SurfaceMoments {
  float one = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

/// A wall that stands on the surface around a point, as a line in the tangent plane [radii]: what is behind it does not count.
struct SurfaceBlocker {
  Vec2 a, b;
};

/// The surface within a ball around a point.
struct SurfaceCoverage {
  static constexpr int kMaxBlockers = 64;

  float radius = 0;        // of the kernel that was measured
  float area = 0;          // integral of the kernel over the visible surface of the neighbourhood
  SurfaceMoments moments;  // the same by powers of the place [radii]; for the parabola only
  int blockers = 0;
  SurfaceBlocker blocker[kMaxBlockers];
  Vec3 s, t;  // axes of the tangent plane, divided by the radius

  /// Is the point (x, y) of the tangent plane [radii] hidden behind a blocker? Of one point, or of eight.
  template <class Number>
  auto hides(const Number& x, const Number& y) const {
    decltype(x < y) hidden{};
    for (int i = 0; i < blockers; ++i) {
      Vec2 a = blocker[i].a, b = blocker[i].b;
      if (a.x * b.y < a.y * b.x) std::swap(a, b);
      const float c = a.x * b.y - a.y * b.x;
      // Between the rays to both ends, and beyond the line (by more than rounding).
      hidden |= (a.x * y >= a.y * x) & (x * b.y >= y * b.x) & (x * (b.y - a.y) - y * (b.x - a.x) > c + 1e-4f * c);
    }
    return hidden;
  }

  /// The same of a surface point at `offset` from the centre.
  bool hides(const Vec3& offset) const { return hides(glm::dot(offset, s), glm::dot(offset, t)); }
};

/// The triangles of a scene in a tree. What is small against the ball is taken for points, whole branches of the tree at once;
/// the rest is measured triangle by triangle.
class SurfaceArea {
 public:
  static constexpr std::uint32_t kEverything = 0xffffffffu;

  SurfaceArea() = default;
  /// `labels`: by triangle, for measuring parts of the scene; none are needed for all of it.
  SurfaceArea(PrepareContext& context, const SceneData& data, std::span<const std::uint32_t> labels = {});

  /// Measures the surface of a neighbourhood within `radius`, of the triangles with this label. Where more than `kMaxTriangles`
  /// of the neighbourhood are that near and not small, the radius is halved until they are not.
  void measure(const Neighbourhood& around, float radius, PhotonKernel kernel, SurfaceCoverage& coverage,
               std::uint32_t label = kEverything) const;

  static constexpr int kMaxTriangles = 2048;

 private:
  static constexpr std::uint32_t kLeaf = 4, kWidth = 8;
  /// Of a node whose triangles have several labels.
  static constexpr std::uint32_t kMixed = 0xfffffffeu;

  /// A triangle, or a branch of the tree.
  struct Piece {
    Vec3 low{kInfinity}, high{-kInfinity};                // bounds of places
    Vec3 normal_low{kInfinity}, normal_high{-kInfinity};  // and of unit normals on the front
    Vec3 center{0}, normal{0};                            // means by area; unit length
    float area = 0;
    float spread = 0;  // mean squared distance from the centre
    std::uint32_t label = kMixed;
  };
  /// Eight neighbours in a level of the tree.
  struct alignas(32) Node {
    float low[3][kWidth], high[3][kWidth], normal_low[3][kWidth], normal_high[3][kWidth];
    float center[3][kWidth], normal[3][kWidth], area[kWidth], spread[kWidth];
    std::uint32_t label[kWidth];

    Piece get(std::size_t lane) const;
    void set(std::size_t lane, const Piece& piece);
  };
  enum class Outcome : std::uint8_t { measured, too_many, too_fine, overlapping };

  static Piece merge(std::span<const Piece> pieces);
  Piece piece_of(std::uint32_t triangle) const;

  /// Calls `use_piece(piece)` for what is smaller than `piece_size`, and `use_triangle(triangle)` for what is not, of all that
  /// may be of the neighbourhood, or hide parts of it, within `radius`; until one returns false.
  template <class UsePiece, class UseTriangle>
  void for_near(const Neighbourhood& around, float radius, float piece_size, std::uint32_t label, UsePiece&& use_piece,
                UseTriangle&& use_triangle) const;
  template <PhotonKernel kernel>
  Outcome measure_with(const Neighbourhood& around, float radius, float piece_size, std::uint32_t label,
                       SurfaceCoverage& coverage) const;

  const SceneData* data_ = nullptr;
  std::vector<std::uint32_t> labels_;      // by triangle; or none
  std::vector<std::uint32_t> triangles_;   // in order of size class and position
  std::vector<std::vector<Node>> levels_;  // [0]: nodes of kLeaf triangles each; the last has one element
};

}  // namespace ln
