#include "gltf_nodes.hpp"

#include <cmath>

#include "ln/text.hpp"

namespace ln::gltf {
namespace {

template <std::size_t N>
std::array<double, N> numbers(Json array, std::array<double, N> values) {
  std::size_t i = 0;
  for (const Json value : array) {
    if (i < N) values[i++] = value.number(0);
  }
  return values;
}

DVec3 vec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

Affine make_trs(const DVec3& translation, const std::array<double, 4>& rotation, const DVec3& scale) {
  double largest = 0;
  for (const double q : rotation) largest = std::max(largest, std::abs(q));
  const double x0 = rotation[0] / largest, y0 = rotation[1] / largest, z0 = rotation[2] / largest, w0 = rotation[3] / largest;
  const double norm = std::sqrt(x0 * x0 + y0 * y0 + z0 * z0 + w0 * w0);
  const double x = x0 / norm, y = y0 / norm, z = z0 / norm, w = w0 / norm;
  Affine result;
  result.linear[0] = DVec3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)) * scale.x;
  result.linear[1] = DVec3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)) * scale.y;
  result.linear[2] = DVec3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)) * scale.z;
  result.translation = translation;
  return result;
}

Affine make_affine(const std::array<double, 16>& m) {
  return {glm::dmat3(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]), DVec3(m[12], m[13], m[14])};
}

NodeForest::NodeForest(Model& model) : model_(model) {
  const auto count = static_cast<std::uint32_t>(model.nodes.size());
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::uint32_t> parent(count, kNone);
  for (std::uint32_t i = 0; i < count; ++i) {
    check_transform(model.nodes[i]);
    for (const Json child : model.nodes[i]["children"]) {
      std::uint32_t& known = parent[child.index()];
      if (known != kNone) {
        child.fail("nodes[" + std::to_string(child.index()) + "] is a child of nodes[" + std::to_string(known) +
                   "] already; nodes must form trees");
      }
      known = i;
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    if (parent[i] == kNone) roots_.push_back(i);
  }

  // Every node has one parent at most, so what cannot be reached from the roots lies on or below a cycle.
  std::vector<bool> reached(count, false);
  std::vector<std::uint32_t> open = roots_;
  while (!open.empty()) {
    const std::uint32_t node = open.back();
    open.pop_back();
    reached[node] = true;
    for (const Json child : model.nodes[node]["children"]) open.push_back(child.index());
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!reached[i]) model.nodes[i].fail("the node is its own descendant, or below one that is");
  }
}

std::vector<std::uint32_t> NodeForest::scene_roots() const {
  const JsonArray scenes(model_.root()["scenes"]);
  if (scenes.size() == 0) return roots_;
  const Json scene = scenes[static_cast<std::size_t>(model_.root()["scene"].integer(0))];
  std::vector<std::uint32_t> roots;
  std::vector<bool> listed(model_.nodes.size(), false);
  const std::vector<bool> is_root = [&] {
    std::vector<bool> flags(model_.nodes.size(), false);
    for (const std::uint32_t root : roots_) flags[root] = true;
    return flags;
  }();
  for (const Json node : scene["nodes"]) {
    const std::uint32_t index = node.index();
    if (listed[index]) node.fail("nodes[" + std::to_string(index) + "] is listed twice");
    if (!is_root[index])
      node.fail("nodes[" + std::to_string(index) + "] is the child of another node; a scene lists root nodes only");
    listed[index] = true;
    roots.push_back(index);
  }
  return roots;
}

void NodeForest::check_transform(Json node) const {
  const Json matrix = node["matrix"], rotation = node["rotation"];
  if (matrix) {
    const auto m = numbers<16>(matrix, {});
    constexpr double kSlack = 1e-6;
    const bool affine =
        std::abs(m[3]) <= kSlack && std::abs(m[7]) <= kSlack && std::abs(m[11]) <= kSlack && std::abs(m[15] - 1) <= kSlack;
    if (!affine) matrix.fail("the last row is not 0 0 0 1");
    const bool has_more = node["translation"] || rotation || node["scale"];
    if (has_more)
      model_.notes.count("node has a matrix and also translation, rotation or scale; the matrix is used",
                         "nodes have a matrix and also translation, rotation or scale; the matrix is used", 1);
    return;
  }
  if (!rotation) return;
  const auto q = numbers<4>(rotation, {0, 0, 0, 1});
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (norm == 0) rotation.fail("the quaternion is zero");
  if (std::abs(norm - 1) > 1e-2)
    model_.notes.count("rotation is not a unit quaternion and was normalised",
                       "rotations are not unit quaternions and were normalised", 1);
}

Affine NodeForest::local(Json node) const {
  if (const Json matrix = node["matrix"]) return make_affine(numbers<16>(matrix, {}));
  return make_trs(vec3(numbers<3>(node["translation"], {})), numbers<4>(node["rotation"], {0, 0, 0, 1}),
                  vec3(numbers<3>(node["scale"], {1, 1, 1})));
}

void NodeForest::walk(const std::vector<std::uint32_t>& roots,
                      const std::function<void(std::uint32_t, const Affine&)>& visit) const {
  struct Level {
    Affine world;
    Json::Iterator next, end;
  };
  std::vector<Level> levels;
  const auto enter = [&](std::uint32_t index, const Affine& parent) {
    const Json node = model_.nodes[index];
    const Affine world = parent * local(node);
    visit(index, world);
    const Json children = node["children"];
    if (children.size() > 0) levels.push_back({world, children.begin(), children.end()});
  };
  for (const std::uint32_t root : roots) {
    enter(root, Affine{});
    while (!levels.empty()) {
      Level& level = levels.back();
      if (level.next != level.end) {
        const std::uint32_t child = (*level.next).index();
        ++level.next;
        const Affine parent = level.world;
        enter(child, parent);
      } else {
        levels.pop_back();
      }
    }
  }
}

}  // namespace ln::gltf
