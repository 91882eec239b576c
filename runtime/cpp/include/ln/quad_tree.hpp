#pragma once
// The QuadTree wire: irradiance in the Haar basis over the parameter domain of each face of a scene's patches.
//
// A face has a tree of cells of equal area four to one. The tree keeps the scaling coefficients, i.e. the mean of each cell;
// the wavelet coefficients of a cell are the differences of its children's means from its own, and a leaf is a cell whose
// wavelets, and all below, are zero.
//
// To read all of it:   tree.for_each_leaf(face, [&](const DomainCell& cell, const Color& irradiance) { ... });
//                      corners in space: surface_cell(tree.patches().surface(face / 2), cell).corner(k), counter-clockwise
//                      seen from the front (even faces), in the scene's normalised units; area(...) of that
// or:                  tree.irradiance(hit.triangle, hit.u, hit.v, front)

#include <memory>
#include <span>
#include <vector>

#include "ln/patches.hpp"

namespace ln {

struct TapFile;

/// The cell in space that a cell of the domain of `patch` stands for.
inline SurfaceCell surface_cell(const SurfaceCell& patch, const DomainCell& cell) {
  return {patch.o + cell.o.x * patch.a + cell.o.y * patch.b, cell.a.x * patch.a + cell.a.y * patch.b,
          cell.b.x * patch.a + cell.b.y * patch.b, cell.quad};
}

struct QuadTreeNode {
  static constexpr std::uint32_t kLeaf = 0;

  Color value{0};                  // mean irradiance of the cell [W/m^2]
  std::uint32_t children = kLeaf;  // the first of four in a row
  bool leaf() const { return children == kLeaf; }
};

class QuadTree {
 public:
  /// Cells are cut at most this often.
  static constexpr int kMaxDepth = 14;

  QuadTree() = default;
  /// Dark everywhere.
  explicit QuadTree(std::shared_ptr<const Patches> patches)
      : patches_(std::move(patches)), roots_(patches_->face_count(), kDark) {}

  /// Sets the function on a face, once; `nodes[0]` is the root, `children` are indices of `nodes`. Means of inner nodes are
  /// computed from the leaves. What is black stays without nodes.
  void set(std::uint32_t face, std::vector<QuadTreeNode> nodes);

  /// Drops the wavelets that matter least, as long as the L2 norm over all surfaces of what is dropped is at most `error` times
  /// the norm of the function. `noise`, if given: by node, the energy that noise is expected to have put into the wavelets of
  /// the cell; that much is dropped for nothing.
  void compress(float error, std::span<const float> noise = {});

  const Patches& patches() const { return *patches_; }
  const std::shared_ptr<const Patches>& shared_patches() const { return patches_; }
  bool empty() const { return nodes_.empty(); }
  bool lit(std::uint32_t face) const { return roots_[face] != kDark; }
  /// Of a face that is lit.
  std::uint32_t root(std::uint32_t face) const { return roots_[face]; }
  const std::vector<QuadTreeNode>& nodes() const { return nodes_; }
  /// The nodes of a face that is lit, as `set` takes them.
  std::vector<QuadTreeNode> face_nodes(std::uint32_t face) const;

  /// Irradiance [W/m^2] on one side of a point of a scene's triangle (barycentric u, v).
  Color irradiance(std::uint32_t triangle, float u, float v, bool front) const {
    if (empty()) return Color(0);
    const Patches::Location at = patches_->locate(triangle, u, v);
    return irradiance(Patches::face(at.patch, front), at.st);
  }
  Color irradiance(std::uint32_t face, Vec2 st) const {
    if (!lit(face)) return Color(0);
    const bool quad = patches_->quad(face / 2);
    const QuadTreeNode* node = &nodes_[roots_[face]];
    while (!node->leaf()) node = &nodes_[node->children + static_cast<std::uint32_t>(descend(quad, st))];
    return node->value;
  }

  template <class Visit>
  void for_each_leaf(std::uint32_t face, Visit&& visit) const {
    if (lit(face)) visit_leaves(roots_[face], patches_->domain(face / 2), visit);
  }

  /// Integral of the irradiance over all surfaces, both sides [W / unit^2].
  DVec3 flux() const;

 private:
  static constexpr std::uint32_t kDark = 0xffffffffu;
  class Pruning;

  template <class Visit>
  void visit_leaves(std::uint32_t node, const DomainCell& cell, Visit&& visit) const {
    if (nodes_[node].leaf()) return visit(cell, nodes_[node].value);
    for (int i = 0; i < 4; ++i) visit_leaves(nodes_[node].children + static_cast<std::uint32_t>(i), cell.child(i), visit);
  }

  std::shared_ptr<const Patches> patches_;
  std::vector<std::uint32_t> roots_;  // by face
  std::vector<QuadTreeNode> nodes_;
};

/// .glb: the leaves as flat cells. Throws Error.
void write_tap(const TapFile& tap, const QuadTree& tree);

}  // namespace ln
