#include "ln/ambient.hpp"

#include <algorithm>

#include "ln/diffuse_surface.hpp"

namespace ln {

namespace {

/// Finds which share of a face's cells lies in lit space.
class LitSpace {
 public:
  LitSpace(const Scene& scene, NodeId node, const QuadTree& in) : scene_(scene), node_(node), in_(in) {}

  /// The face's tree: cells of `in` that are lit, and what is dark cut into cells that are all in lit space, or not at all, or
  /// small.
  std::vector<QuadTreeNode> nodes(Tracer& tracer, std::uint32_t face) const {
    std::vector<QuadTreeNode> nodes(1);
    grow(tracer, face, nodes, 0, in_.patches().domain(face / 2), in_.lit(face) ? &in_.nodes()[in_.root(face)] : nullptr);
    return nodes;
  }

 private:
  static constexpr float kSmall = 1.0f / 16;               // extent of cells that are not cut [normalised units]
  static constexpr std::uint32_t kWalks = 16, kSteps = 8;  // from each point

  /// `lit`: the node of the cell in `in`; null where that is dark.
  void grow(Tracer& tracer, std::uint32_t face, std::vector<QuadTreeNode>& nodes, std::size_t node, const DomainCell& cell,
            const QuadTreeNode* lit) const {
    const bool cut = lit && !lit->leaf();
    if (!cut && lit && !is_black(lit->value)) {
      nodes[node].value = Color(1);
      return;
    }
    if (!cut) {
      const SurfaceCell surface = surface_cell(in_.patches().surface(face / 2), cell);
      const float extent = std::max(glm::length(surface.a), glm::length(surface.b));
      const std::uint32_t points = extent < kSmall / 4 ? 1 : extent < kSmall ? 4 : 16;
      const std::uint32_t key = hash32(hash32(node_, face), static_cast<std::uint32_t>(node));
      const float share = share_of(tracer, face, cell, points, key);
      nodes[node].value = Color(share);
      if (extent < kSmall || share == 0 || share == 1) return;
    }
    const auto first = static_cast<std::uint32_t>(nodes.size());
    nodes[node].children = first;
    nodes.resize(nodes.size() + 4);
    for (std::uint32_t i = 0; i < 4; ++i)
      grow(tracer, face, nodes, first + i, cell.child(static_cast<int>(i)), cut ? &in_.nodes()[lit->children + i] : nullptr);
  }

  /// From which share of `count` points in a dark cell does light come to where it arrives?
  float share_of(Tracer& tracer, std::uint32_t face, const DomainCell& cell, std::uint32_t count, std::uint32_t key) const {
    std::uint32_t reached = 0;
    for (std::uint32_t i = 0; i < count; ++i)
      if (reaches_light(tracer, face, cell.point(sobol_point(key, 0, i)), hash32(key, i))) ++reached;
    return static_cast<float>(reached) / static_cast<float>(count);
  }

  /// Does one of some walks from a point of the face, from surface to surface as diffuse light goes, come to where light
  /// arrives? From the back of a single-sided surface, which may be the inside of a thing that stands on what is lit: do most
  /// of them, in one step?
  bool reaches_light(Tracer& tracer, std::uint32_t face, const Vec2& st, std::uint32_t key) const {
    const bool inside = !meant_to_be_seen(scene_, in_.patches().part(face / 2), Patches::is_front(face));
    const std::uint32_t steps = inside ? 1 : kSteps, wanted = inside ? kWalks / 2 + 1 : 1;
    std::uint32_t reached = 0;
    for (std::uint32_t walk = 0; reached < wanted && reached + kWalks - walk >= wanted; ++walk)
      if (walk_reaches_light(tracer, face, st, steps, key, walk)) ++reached;
    return reached == wanted;
  }

  bool walk_reaches_light(Tracer& tracer, std::uint32_t face, const Vec2& st, std::uint32_t steps, std::uint32_t key,
                          std::uint32_t walk) const {
    SurfacePosition at;
    scene_.locate(in_.patches().hit(face / 2, st), at);
    Vec3 normal = Patches::is_front(face) ? at.ng : -at.ng;
    for (std::uint32_t step = 0; step < steps; ++step) {
      const Vec3 direction = make_frame(normal).to_world(sample_cosine(sobol_point(key, step, walk)));
      const Hit hit = tracer.intersect(spawn_ray(at, direction), hash32(key, walk), node_, RayKind::gather);
      if (!hit.found()) return false;
      scene_.locate(hit, at);
      const bool front = glm::dot(direction, at.ng) < 0;
      if (!is_black(in_.irradiance(hit.triangle, hit.u, hit.v, front))) return true;
      const std::uint32_t part = scene_.data().triangle_part[hit.triangle];
      if (!meant_to_be_seen(scene_, part, front) || !scatters_diffusely(scene_, part, front)) return false;
      normal = front ? at.ng : -at.ng;
    }
    return false;
  }

  const Scene& scene_;
  NodeId node_;
  const QuadTree& in_;
};

}  // namespace

AmbientLight::AmbientLight(PrepareContext& context, NodeId node, const QuadTree& in, const TagSelection& from) {
  if (in.empty()) return;
  const Scene& scene = context.scene();
  const Patches& patches = in.patches();
  const LitSpace lit_space(scene, node, in);
  std::vector<std::vector<QuadTreeNode>> nodes(patches.face_count());
  context.for_chunks(nodes.size(), 16, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    tracer.enter(node);
    for (std::size_t face = begin; face < end; ++face)
      if (area(patches.surface(static_cast<std::uint32_t>(face / 2))) > 0)
        nodes[face] = lit_space.nodes(tracer, static_cast<std::uint32_t>(face));
  });

  space_ = QuadTree(in.shared_patches());
  DVec3 flux(0);
  double lit_area = 0;
  for (std::uint32_t face = 0; face < patches.face_count(); ++face) {
    if (!nodes[face].empty()) space_.set(face, std::move(nodes[face]));
    const std::uint32_t part = patches.part(face / 2);
    // What does not scatter diffusely holds no irradiance.
    const bool counts = in.lit(face) || scatters_diffusely(scene, part, Patches::is_front(face));
    if (!counts || !from(scene.part_tags(part))) continue;
    const SurfaceCell surface = patches.surface(face / 2);
    const auto area_of = [&](const DomainCell& cell) { return static_cast<double>(area(surface_cell(surface, cell))); };
    in.for_each_leaf(face, [&](const DomainCell& cell, const Color& E) { flux += area_of(cell) * DVec3(E); });
    space_.for_each_leaf(
        face, [&](const DomainCell& cell, const Color& share) { lit_area += area_of(cell) * static_cast<double>(share.x); });
  }
  if (lit_area > 0) mean_ = Color(flux / lit_area);
}

}  // namespace ln
