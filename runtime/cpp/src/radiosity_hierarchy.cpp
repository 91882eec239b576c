#include "radiosity_hierarchy.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>

#include "ln/diffuse_surface.hpp"
#include "ln/disjoint_sets.hpp"

namespace ln::radiosity {

Hierarchy::Hierarchy(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options)
    : context_(context),
      node_(node),
      patches_(in.patches()),
      smallest_area_(4 * sqr(options.smallest > 0 ? options.smallest : 1.0f / 128)) {
  find_faces(in, options);
  if (faces.empty()) return;
  std::vector<std::uint32_t> order(faces.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<FlatCell> cells(faces.size());
  elements.resize(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i)
    elements[i].flat = make_flat_cell(patches_.surface(faces[i].id / 2), Patches::is_front(faces[i].id));
  if (faces.size() > 1) build(order, 0, static_cast<std::uint32_t>(faces.size()), kNoNode);
  add_elements(in);
  sum_up_lobes();
  measure_leaves(0);
}

/// Casts rays from each face, to learn which faces exchange light at all, and which see nothing but surfaces.
void Hierarchy::find_faces(const QuadTree& in, const RadiosityOptions& options) {
  constexpr std::uint32_t kFewest = 16, kMost = 8192, kMostLooks = 16;
  constexpr float kAreaOfRay = 1e-4f;
  const Scene& scene = context_.scene();
  const auto count = static_cast<std::uint32_t>(patches_.face_count());
  std::vector<std::vector<std::uint32_t>> seen(count);  // faces
  enclosed_.assign(count, 0);
  doubled_.assign(count, 0);
  context_.for_chunks(count, 16, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    tracer.enter(node_);
    for (auto face = static_cast<std::uint32_t>(begin); face < end; ++face) {
      const std::uint32_t patch = face / 2;
      const float size = ln::area(patches_.surface(patch));
      if (!(size > 0)) continue;
      const std::uint32_t rays = std::clamp(static_cast<std::uint32_t>(size / kAreaOfRay), kFewest, kMost);
      const std::uint32_t key = hash32(face, node_);
      enclosed_[face] = 1;
      for (std::uint32_t i = 0; i < std::min(rays / 4, kMostLooks) && !doubled_[face]; ++i)
        doubled_[face] = !outermost(tracer, node_, patches_.hit(patch, patches_.domain(patch).point(sobol_point(key, 2, i))),
                                    Patches::is_front(face), hash32(key, i));
      for (std::uint32_t i = 0; i < rays; ++i) {
        SurfacePosition at;
        scene.locate(patches_.hit(patch, patches_.domain(patch).point(sobol_point(key, 0, i))), at);
        const Frame frame = make_frame(Patches::is_front(face) ? at.ng : -at.ng);
        const Vec3 direction = frame.to_world(sample_cosine(sobol_point(key, 1, i)));
        const Hit hit = tracer.intersect(spawn_ray(at, direction), hash32(key, i), node_, RayKind::gather);
        if (!hit.found()) {
          enclosed_[face] = 0;
          continue;
        }
        SurfacePosition there;
        scene.locate(hit, there);
        const std::uint32_t other = patches_.locate(hit.triangle, hit.u, hit.v).patch;
        seen[face].push_back(Patches::face(other, glm::dot(direction, there.ng) < 0));
      }
      std::sort(seen[face].begin(), seen[face].end());
      seen[face].erase(std::unique(seen[face].begin(), seen[face].end()), seen[face].end());
    }
  });
  DisjointSets sets(count);
  for (std::uint32_t face = 0; face < count; ++face)
    for (const std::uint32_t other : seen[face]) sets.join(face, other);
  std::vector<std::uint8_t> lit(count);
  for (std::uint32_t face = 0; face < count; ++face)
    if (in.lit(face)) lit[sets.find(face)] = 1;
  for (std::uint32_t face = 0; face < count; ++face)
    if (lit[sets.find(face)] && ln::area(patches_.surface(face / 2)) > 0) add_face(face, options);
}

void Hierarchy::add_face(std::uint32_t id, const RadiosityOptions& options) {
  const Scene& scene = context_.scene();
  const std::uint32_t part = patches_.part(id / 2);
  Face face;
  face.id = id;
  const bool diffuse = scatters_diffusely(scene, part, Patches::is_front(id));
  face.scatters = diffuse && options.from(scene.part_tags(part));
  face.receives = face.scatters || (diffuse && options.to(scene.part_tags(part)));
  face.enclosed = enclosed_[id] != 0;
  face.doubled = doubled_[id] != 0;
  face.albedo_varies = face.scatters && albedo_varies(scene, part);
  if (face.scatters && !face.albedo_varies)
    face.albedo = diffuse_albedo(scene, patches_.hit(id / 2, patches_.domain(id / 2).center()), Patches::is_front(id));
  faces.push_back(face);
}

/// A cluster of the faces order[begin, end), at least two. Large faces are parted from small ones, so that no cluster is much
/// larger than its things; others are halved in space.
NodeRef Hierarchy::build(std::vector<std::uint32_t>& order, std::uint32_t begin, std::uint32_t end, NodeRef parent) {
  if (end - begin == 1) {
    faces[order[begin]].parent = parent;
    return begin;  // the place of the face from now on
  }
  const auto number = static_cast<std::uint32_t>(clusters.size());
  clusters.emplace_back();
  Vec3 low(kInfinity), high(-kInfinity), low_center(kInfinity), high_center(-kInfinity);
  float largest = 0;
  Cluster cluster;
  cluster.first = begin;
  cluster.count = end - begin;
  cluster.parent = parent;
  for (std::uint32_t i = begin; i < end; ++i) {
    const FlatCell& flat = elements[order[i]].flat;
    for (int k = 0; k < flat.cell.corner_count(); ++k) {
      low = glm::min(low, flat.cell.corner(k));
      high = glm::max(high, flat.cell.corner(k));
    }
    low_center = glm::min(low_center, flat.cell.center());
    high_center = glm::max(high_center, flat.cell.center());
    largest = std::max(largest, flat.radius);
    cluster.area += flat.area;
    cluster.receives = cluster.receives || faces[order[i]].receives;
  }
  cluster.center = 0.5f * (low + high);
  cluster.radius = 0.5f * glm::length(high - low);

  const auto first = order.begin() + begin, last = order.begin() + end;
  auto middle = first;
  if (4 * largest > cluster.radius) {
    middle = std::stable_partition(first, last, [&](std::uint32_t i) { return 4 * elements[i].flat.radius > cluster.radius; });
  }
  if (middle == first || middle == last) {
    const Vec3 extent = high_center - low_center;
    const std::size_t axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    middle = first + (last - first) / 2;
    std::nth_element(first, middle, last, [&](std::uint32_t i, std::uint32_t j) {
      const float x = elements[i].flat.cell.center()[axis], y = elements[j].flat.cell.center()[axis];
      return x != y ? x < y : i < j;
    });
    std::sort(first, middle);
    std::sort(middle, last);
  }
  const auto split = static_cast<std::uint32_t>(middle - order.begin());
  clusters[number] = cluster;
  const NodeRef self = number | kClusterBit;
  const NodeRef left = build(order, begin, split, self), right = build(order, split, end, self);
  clusters[number].child[0] = left;
  clusters[number].child[1] = right;
  if (parent == kNoNode) {
    std::vector<Face> sorted;
    for (const std::uint32_t i : order) sorted.push_back(faces[i]);
    faces = std::move(sorted);
  }
  return self;
}

/// Clusters of more faces than that are large: their faces are looked at together.
constexpr std::uint32_t kMostSingle = 32;

void Hierarchy::sum_up_lobes() {
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    const FlatCell& flat = elements[i].flat;
    area_normals.push_back(flat.area * flat.normal);
    lobe_of_face.push_back(static_cast<std::uint8_t>(lobe_of(flat.normal)));
  }
  for (std::uint32_t i = 0; i < clusters.size(); ++i) {
    Cluster& c = clusters[i];
    if (c.count <= kMostSingle) continue;
    c.lobes = static_cast<std::uint32_t>(lobes.size());
    lobes.push_back({.cluster = i});
  }
  context_.workers().parallel_for(lobes.size(), 1, [&](std::size_t k) {
    Lobes& sums = lobes[k];
    const Cluster& c = clusters[sums.cluster];
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) {
      sums.area_normal[lobe_of_face[i]] += area_normals[i];
      sums.area[lobe_of_face[i]] += elements[i].flat.area;
    }
  });
  context_.workers().parallel_for(clusters.size(), 16, [&](std::size_t i) {
    float& largest = clusters[i].largest_projected_area;
    for (std::uint32_t lobe = 0; lobe < kLobes; ++lobe)
      largest = std::max(largest, projected_area(static_cast<NodeRef>(i) | kClusterBit, lobe_axis(lobe)));
  });
}

float Hierarchy::projected_area(NodeRef n, const Vec3& direction) const {
  if (!is_cluster(n)) return std::max(0.0f, glm::dot(elements[n].flat.normal, direction)) * elements[n].flat.area;
  const Cluster& c = clusters[cluster_index(n)];
  float sum = 0;
  if (c.lobes != kNoNode) {
    for (const Vec3& lobe : lobes[c.lobes].area_normal) sum += std::max(0.0f, glm::dot(lobe, direction));
  } else {
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) sum += std::max(0.0f, glm::dot(area_normals[i], direction));
  }
  return sum;
}

/// Cells of the input, and the sums of areas.
void Hierarchy::add_elements(const QuadTree& in) {
  elements.clear();
  elements.resize(faces.size());
  area_before_.assign(1, 0);
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    Element& element = elements[i];
    element.flat = make_flat_cell(patches_.surface(faces[i].id / 2), Patches::is_front(faces[i].id));
    element.domain = patches_.domain(faces[i].id / 2);
    element.face = i;
    if (in.lit(faces[i].id)) element.source = in.nodes()[in.root(faces[i].id)].value;
    area_before_.push_back(area_before_.back() + static_cast<double>(element.flat.area));
  }
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    if (!in.lit(faces[i].id) || !faces[i].scatters) continue;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> open{{i, in.root(faces[i].id)}};  // element, node
    for (std::size_t k = 0; k < open.size(); ++k) {
      const auto [element, from] = open[k];
      const QuadTreeNode& cell = in.nodes()[from];
      if (cell.leaf()) continue;
      divide(element);
      for (std::uint32_t c = 0; c < 4; ++c) {
        elements[elements[element].children + c].source = in.nodes()[cell.children + c].value;
        open.emplace_back(elements[element].children + c, cell.children + c);
      }
    }
  }
}

void Hierarchy::divide(std::uint32_t element) {
  const auto first = static_cast<std::uint32_t>(elements.size());
  elements[element].children = first;
  const Element parent = elements[element];
  for (int c = 0; c < 4; ++c) {
    Element child;
    child.domain = parent.domain.child(c);
    child.flat = ln::child(parent.flat, c);
    child.face = parent.face;
    child.parent = element;
    child.depth = parent.depth + 1;
    child.source = parent.source;
    child.albedo = parent.albedo;
    elements.push_back(child);
  }
}

std::vector<Color> Hierarchy::uniform_shine() const {
  std::vector<Color> shine;
  shine.reserve(elements.size());
  for (const Element& element : elements) shine.emplace_back(element.outermost);
  return shine;
}

void Hierarchy::measure_leaves(std::size_t first) {
  constexpr std::uint32_t kSamples = 16;
  const Scene& scene = context_.scene();
  context_.for_chunks(elements.size() - first, 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    tracer.enter(node_);
    for (std::size_t i = first + begin; i < first + end; ++i) {
      Element& element = elements[i];
      const Face& face = faces[element.face];
      element.albedo = face.albedo;
      if (!element.leaf()) continue;
      std::uint32_t own = 0;
      Color sum(0);
      for (std::uint32_t k = 0; k < kSamples; ++k) {
        const Vec2 st = element.domain.point(sobol_point(1, 0, k));
        const Hit at = patches_.hit(face.id / 2, st);
        if (face.doubled && outermost(tracer, node_, at, Patches::is_front(face.id), hash32(static_cast<std::uint32_t>(i), k)))
          ++own;
        if (face.albedo_varies) sum += diffuse_albedo(scene, at, Patches::is_front(face.id));
      }
      if (face.albedo_varies) element.albedo = sum / static_cast<float>(kSamples);
      if (face.doubled) element.outermost = static_cast<float>(own) / static_cast<float>(kSamples);
      element.albedo *= element.outermost;
    }
  });
  for (std::size_t i = elements.size(); i-- > 0;) {
    Element& e = elements[i];
    if (e.leaf() || !faces[e.face].doubled) continue;
    e.outermost = 0;
    for (std::uint32_t c = e.children; c < e.children + 4; ++c) e.outermost += 0.25f * elements[c].outermost;
  }
}

Hierarchy::Place Hierarchy::place(NodeRef n, float pick, const Vec2& u) const {
  if (is_cluster(n)) {
    const Cluster& c = clusters[cluster_index(n)];
    const double begin = area_before_[c.first], end = area_before_[c.first + c.count];
    const auto from = area_before_.begin() + c.first + 1, to = area_before_.begin() + c.first + c.count;
    n = static_cast<NodeRef>(std::upper_bound(from, to, begin + static_cast<double>(pick) * (end - begin)) -
                             area_before_.begin()) -
        1;
  }
  return place(n, DomainCell{Vec2(0), Vec2(1, 0), Vec2(0, 1), elements[n].domain.quad}.point(u));
}

SurfacePosition Hierarchy::locate(const Place& place) const {
  const Element& e = elements[place.element];
  SurfacePosition at;
  context_.scene().locate(patches_.hit(faces[e.face].id / 2, e.domain.o + place.st.x * e.domain.a + place.st.y * e.domain.b),
                          at);
  return at;
}

}  // namespace ln::radiosity
