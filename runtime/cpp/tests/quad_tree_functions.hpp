#pragma once
// QuadTrees of known functions.

#include "ln/quad_tree.hpp"

namespace ln::test {

/// Adds a cell and what is below it to `nodes`: `wanted(cell)`: is it to be cut? `mean(cell)`: the value of a leaf.
template <class Wanted, class Mean>
void grow(std::vector<QuadTreeNode>& nodes, std::size_t node, const DomainCell& cell, Wanted&& wanted, Mean&& mean) {
  if (!wanted(cell)) {
    nodes[node].value = mean(cell);
    return;
  }
  const auto first = static_cast<std::uint32_t>(nodes.size());
  nodes[node].children = first;
  nodes.resize(nodes.size() + 4);
  for (int i = 0; i < 4; ++i) grow(nodes, first + static_cast<std::uint32_t>(i), cell.child(i), wanted, mean);
}

/// The tree of a face.
template <class Wanted, class Mean>
void set_face(QuadTree& tree, std::uint32_t face, Wanted&& wanted, Mean&& mean) {
  std::vector<QuadTreeNode> nodes(1);
  grow(nodes, 0, tree.patches().domain(face / 2), wanted, mean);
  tree.set(face, std::move(nodes));
}

/// A cell of this many halvings.
inline bool larger_than(const DomainCell& cell, int depth) {
  return glm::length(cell.a) > 1.5f / static_cast<float>(1 << depth);
}

}  // namespace ln::test
