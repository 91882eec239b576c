#pragma once
// Importance of many lights for a receiver (Conty & Kulla 2018; Pharr, Jakob & Humphreys, PBR 4th ed., section 12.6.3),
// with eight children a node, which are compared with each other in one go.

#include <vector>

#include "ln/math.hpp"

namespace ln {

/// What bounds the light that one or more finite emitters send out.
struct LightBounds {
  Vec3 center{0};
  float radius = 0;    // all emitters are within this sphere
  Vec3 axis{0, 0, 1};  // normals are within theta_o of it, light is within theta_e of a normal
  float cos_o = 1, cos_e = 0;
  double phi = 0;  // sum of radiance * area, or intensity: irradiance * distance^2 facing it
  bool two_sided = false;
};

class LightBvh {
 public:
  static constexpr int kWidth = 8;

  struct Pick {
    std::uint32_t index = 0;
    float pmf = 0;  // 0: no light can contribute
  };
  /// Importances of the children of a node, and their running sums.
  struct Lanes {
    float importance[kWidth];
    float sum[kWidth];
    float total() const { return sum[kWidth - 1]; }
  };

  LightBvh() = default;
  /// `lights`: phi must be positive. The result depends on nothing else.
  explicit LightBvh(const std::vector<LightBounds>& lights);

  /// Irradiance that the lights may cause at `p`, roughly, relative to scale(). `n` = 0: any side.
  Lanes root(const Vec3& p, const Vec3& n) const { return lanes(nodes_[0], p, n); }
  /// Chooses a light; `root`: of the same receiver.
  Pick sample(const Lanes& root, const Vec3& p, const Vec3& n, float u) const;
  /// Probability with which `sample` chooses light `index`.
  float pmf(const Lanes& root, const Vec3& p, const Vec3& n, std::uint32_t index) const;
  /// Importances are divided by this.
  double scale() const { return scale_; }

 private:
  static constexpr std::uint32_t kLeaf = 0x80000000u;

  using Float8 = float __attribute__((vector_size(kWidth * sizeof(float))));

  struct Node {
    Float8 cx, cy, cz;  // centres
    Float8 r, inv_r2;   // radii
    Float8 ax, ay, az;  // axes
    Float8 cos_o, sin_o, cos_e;
    Float8 phi;                   // 0: no child
    Float8 two_sided;             // 1 or -1
    std::uint32_t child[kWidth];  // a node, or kLeaf | light
  };

  static void square_root(Float8& x);
  static Lanes lanes(const Node& node, const Vec3& p, const Vec3& n);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_slot_;   // parent * kWidth + lane, by node
  std::vector<std::uint32_t> light_slot_;  // the same by light
  double scale_ = 1;
};

}  // namespace ln
