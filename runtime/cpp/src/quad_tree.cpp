#include "ln/quad_tree.hpp"

#include <queue>

namespace ln {

namespace {

float norm2(const Color& c) { return glm::dot(c, c); }

/// Means of inner nodes from their children's. Children stand behind their parents.
void pull(std::vector<QuadTreeNode>& nodes) {
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (nodes[i].leaf()) continue;
    const QuadTreeNode* child = &nodes[nodes[i].children];
    nodes[i].value = 0.25f * (child[0].value + child[1].value + child[2].value + child[3].value);
  }
}

}  // namespace

void QuadTree::set(std::uint32_t face, std::vector<QuadTreeNode> nodes) {
  pull(nodes);
  if (is_black(nodes[0].value)) return;
  const auto base = static_cast<std::uint32_t>(nodes_.size());
  roots_[face] = base;
  for (QuadTreeNode& node : nodes) {
    if (!node.leaf()) node.children += base;
    nodes_.push_back(node);
  }
}

DVec3 QuadTree::flux() const {
  DVec3 sum(0);
  for (std::uint32_t face = 0; face < roots_.size(); ++face)
    if (lit(face)) sum += static_cast<double>(area(patches_->surface(face / 2))) * DVec3(nodes_[roots_[face]].value);
  return sum;
}

/// Cuts twigs, nodes whose children are all leaves, the cheapest first.
class QuadTree::Pruning {
 public:
  Pruning(QuadTree& tree, std::span<const float> noise) : tree_(tree), noise_(noise), info_(tree.nodes_.size()) {
    for (std::uint32_t face = 0; face < tree.roots_.size(); ++face) {
      if (!tree.lit(face)) continue;
      const std::uint32_t root = tree.roots_[face];
      info_[root] = {area(tree.patches_->surface(face / 2)), kDark, 0};
      // The nodes of a face stand in a row, children behind their parents.
      std::uint32_t end = root + 1;
      for (std::uint32_t i = root; i < end; ++i) enter(i, end);
    }
  }

  void run(double budget) {
    while (!queue_.empty() && queue_.top().cost <= budget) {
      const Twig twig = queue_.top();
      queue_.pop();
      budget -= twig.cost;
      tree_.nodes_[twig.node].children = QuadTreeNode::kLeaf;
      const std::uint32_t parent = info_[twig.node].parent;
      if (parent != kDark && --info_[parent].inner == 0) add_twig(parent);
    }
  }

  double energy() const { return energy_; }

 private:
  struct Info {
    float area = 0;
    std::uint32_t parent = kDark;
    int inner = 0;  // children that are no leaves
  };
  struct Twig {
    double cost;
    std::uint32_t node;
    bool operator<(const Twig& other) const { return cost != other.cost ? cost > other.cost : node > other.node; }
  };

  void enter(std::uint32_t i, std::uint32_t& end) {
    const QuadTreeNode& node = tree_.nodes_[i];
    if (node.leaf()) {
      energy_ += static_cast<double>(info_[i].area) * static_cast<double>(norm2(node.value));
      return;
    }
    end = std::max(end, node.children + 4);
    for (std::uint32_t k = node.children; k < node.children + 4; ++k) {
      info_[k] = {info_[i].area / 4, i, 0};
      info_[i].inner += tree_.nodes_[k].leaf() ? 0 : 1;
    }
    if (info_[i].inner == 0) add_twig(i);
  }

  /// The energy of the wavelets of a node: the square of what the function changes without them.
  void add_twig(std::uint32_t i) {
    const QuadTreeNode& node = tree_.nodes_[i];
    double sum = 0;
    for (std::uint32_t k = node.children; k < node.children + 4; ++k)
      sum += static_cast<double>(norm2(tree_.nodes_[k].value - node.value));
    sum *= static_cast<double>(info_[i].area) / 4;
    if (!noise_.empty()) sum = std::max(0.0, sum - static_cast<double>(noise_[i]));
    queue_.push({sum, i});
  }

  QuadTree& tree_;
  std::span<const float> noise_;
  std::vector<Info> info_;
  std::priority_queue<Twig> queue_;
  double energy_ = 0;  // squared norm of the function
};

std::vector<QuadTreeNode> QuadTree::face_nodes(std::uint32_t face) const {
  std::vector<QuadTreeNode> nodes{nodes_[roots_[face]]};
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].leaf()) continue;
    const std::uint32_t from = nodes[i].children;
    nodes[i].children = static_cast<std::uint32_t>(nodes.size());
    nodes.insert(nodes.end(), nodes_.begin() + from, nodes_.begin() + from + 4);
  }
  return nodes;
}

void QuadTree::compress(float error, std::span<const float> noise) {
  {
    Pruning pruning(*this, noise);
    pruning.run(static_cast<double>(error) * static_cast<double>(error) * pruning.energy());
  }
  // Close the gaps.
  QuadTree packed(patches_);
  for (std::uint32_t face = 0; face < roots_.size(); ++face)
    if (lit(face)) packed.set(face, face_nodes(face));
  *this = std::move(packed);
}

}  // namespace ln
