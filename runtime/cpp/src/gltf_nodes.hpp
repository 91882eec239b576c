#pragma once
// The node hierarchy: transforms in double precision, and a walk that does not recurse.

#include <functional>
#include <vector>

#include "gltf_model.hpp"
#include "ln/math.hpp"

namespace ln::gltf {

/// x -> linear * x + translation.
struct Affine {
  glm::dmat3 linear{1.0};
  DVec3 translation{0.0};

  DVec3 point(const DVec3& p) const { return linear * p + translation; }
  friend Affine operator*(const Affine& a, const Affine& b) { return {a.linear * b.linear, a.point(b.translation)}; }
};

/// Translation * rotation * scale; the quaternion (x, y, z, w) is of any length but 0.
Affine make_trs(const DVec3& translation, const std::array<double, 4>& rotation, const DVec3& scale);
/// From the 16 numbers of a column-major matrix, whose last row is (0, 0, 0, 1).
Affine make_affine(const std::array<double, 16>& matrix);

/// The nodes of a file: trees, or it is refused.
class NodeForest {
 public:
  /// Throws Error if a node is listed as a child twice, the nodes form a cycle, or a transform makes no sense.
  explicit NodeForest(Model& model);

  /// The nodes without parent, in file order.
  const std::vector<std::uint32_t>& roots() const { return roots_; }
  /// The roots of the default scene; else of the first scene; without scenes all roots.
  std::vector<std::uint32_t> scene_roots() const;

  /// Calls visit(node, its transform to the world) for `roots` and all nodes below, parents first.
  void walk(const std::vector<std::uint32_t>& roots, const std::function<void(std::uint32_t, const Affine&)>& visit) const;

 private:
  void check_transform(Json node) const;
  Affine local(Json node) const;

  Model& model_;
  std::vector<std::uint32_t> roots_;
};

}  // namespace ln::gltf
