#include "ln/ambient.hpp"

#include <algorithm>

#include "ln/diffuse_surface.hpp"
#include "ln/distribution.hpp"

namespace ln {

namespace {

/// A cell of a face on which no light arrives.
struct DarkCell {
  std::uint32_t face;
  DomainCell domain;
};

/// Is the side of the part's surfaces one that light may be meant for? Not what is behind a single-sided surface, the inside of
/// a thing, nor what does not scatter diffusely.
bool counts_when_dark(const Scene& scene, std::uint32_t part, bool front) {
  const SceneData& data = scene.data();
  return (front || data.materials[data.parts[part].material].double_sided) && scatters_diffusely(scene, part, front);
}

/// Does one of some walks from a point of the face, from surface to surface as diffuse light goes, come to where light arrives?
bool reaches_light(Tracer& tracer, NodeId node, const QuadTree& in, std::uint32_t face, const Vec2& st, std::uint32_t key) {
  constexpr std::uint32_t kWalks = 16, kSteps = 8;
  const Scene& scene = tracer.scene();
  for (std::uint32_t walk = 0; walk < kWalks; ++walk) {
    SurfacePosition at;
    scene.locate(in.patches().hit(face / 2, st), at);
    Vec3 normal = Patches::is_front(face) ? at.ng : -at.ng;
    for (std::uint32_t step = 0; step < kSteps; ++step) {
      const Vec3 direction = make_frame(normal).to_world(sample_cosine(sobol_point(key, step, walk)));
      const Hit hit = tracer.intersect(spawn_ray(at, direction), hash32(key, walk), node, RayKind::gather);
      if (!hit.found()) break;
      scene.locate(hit, at);
      const bool front = glm::dot(direction, at.ng) < 0;
      if (!is_black(in.irradiance(hit.triangle, hit.u, hit.v, front))) return true;
      if (!counts_when_dark(scene, scene.data().triangle_part[hit.triangle], front)) break;
      normal = front ? at.ng : -at.ng;
    }
  }
  return false;
}

}  // namespace

Color ambient_irradiance(PrepareContext& context, NodeId node, const QuadTree& in, const TagSelection& from) {
  if (in.empty()) return Color(0);
  const Scene& scene = context.scene();
  const Patches& patches = in.patches();
  DVec3 flux(0);
  double lit_area = 0;
  std::vector<DarkCell> dark;
  std::vector<double> dark_area;
  for (std::uint32_t face = 0; face < patches.face_count(); ++face) {
    const std::uint32_t part = patches.part(face / 2);
    if (!from(scene.part_tags(part))) continue;
    const SurfaceCell surface = patches.surface(face / 2);
    const auto add_dark = [&](const DomainCell& cell) {
      dark.push_back({face, cell});
      dark_area.push_back(static_cast<double>(area(surface_cell(surface, cell))));
    };
    in.for_each_leaf(face, [&](const DomainCell& cell, const Color& E) {
      if (is_black(E)) return add_dark(cell);
      const auto a = static_cast<double>(area(surface_cell(surface, cell)));
      flux += a * DVec3(E);
      lit_area += a;
    });
    if (!in.lit(face) && area(surface) > 0 && counts_when_dark(scene, part, Patches::is_front(face)))
      add_dark(patches.domain(face / 2));
  }
  if (!(lit_area > 0)) return Color(0);

  // Measure which share of what is dark light can reach, at points that are spread evenly over it.
  constexpr std::uint32_t kPoints = 4096;
  const Distribution by_area(dark_area);
  std::vector<std::uint8_t> reached(by_area.empty() ? 0 : kPoints);
  context.for_chunks(reached.size(), 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    tracer.enter(node);
    for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
      const DarkCell& cell = dark[by_area.sample((static_cast<float>(i) + 0.5f) / kPoints).index];
      reached[i] =
          reaches_light(tracer, node, in, cell.face, cell.domain.point(sobol_point(node, 1, i)), hash32(node, i)) ? 1 : 0;
    }
  });
  const auto count = std::count(reached.begin(), reached.end(), 1);
  const double shadow_area = by_area.total() * static_cast<double>(count) / kPoints;
  return Color(flux / (lit_area + shadow_area));
}

}  // namespace ln
