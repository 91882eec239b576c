#include "mesh_sites.hpp"

#include <algorithm>
#include <tuple>
#include <unordered_set>

#include "ln/photon_bandwidth.hpp"

namespace ln {

namespace {

/// Sites are looked for in cells of this size [normalised units] first, one in each, then in smaller and smaller ones.
constexpr float kFirstCell = 0.25f;
constexpr int kRounds = 12;

/// Share of its reach within which a site speaks for a vertex alone.
constexpr float kCover = 0.5f;
/// Of a site at the end of its reach; 1 for one at the vertex.
constexpr float kLeastWeight = 1e-3f;
/// Variance of what is filled in, at most [that of a site's estimate].
constexpr float kMaxNoise = 2;

/// A kernel is narrow beside one of which it has less than this share of the radius; an irradiance is known much better with
/// less than this share of the standard error, and agrees if it is so many of them away, at most. At a border, errors are
/// larger with the same radius: there, the curve of the light would become a bias.
constexpr float kNarrow = 0.9f, kMuchBetter = 0.7f, kAgreement = 3;

/// A vertex within the reach of a site.
struct Reached {
  std::uint32_t vertex, site;
  bool covered;
};

/// Neighbours of each vertex of a mesh.
class Adjacency {
 public:
  Adjacency(std::size_t count, std::span<const std::pair<std::uint32_t, std::uint32_t>> edges) : first_(count + 1, 0) {
    for (const auto& [a, b] : edges) {
      ++first_[a + 1];
      ++first_[b + 1];
    }
    for (std::size_t v = 0; v < count; ++v) first_[v + 1] += first_[v];
    neighbour_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& [a, b] : edges) {
      neighbour_[next[a]++] = b;
      neighbour_[next[b]++] = a;
    }
  }

  std::span<const std::uint32_t> of(std::uint32_t v) const {
    return {neighbour_.data() + first_[v], first_[v + 1] - first_[v]};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> neighbour_;
};

/// The first vertex of each surface in each cell.
std::vector<std::uint32_t> one_in_each_cell(std::span<const MeshVertex> vertices, std::span<const std::uint32_t> among,
                                            float cell) {
  struct Key {
    std::uint32_t surface;
    int x, y, z;
    std::uint32_t vertex;
    auto place() const { return std::tie(surface, x, y, z); }
  };
  std::vector<Key> keys;
  keys.reserve(among.size());
  for (const std::uint32_t v : among) {
    const Vec3 p = vertices[v].around.point / cell;
    const auto at = [](float x) { return static_cast<int>(std::floor(x)); };
    keys.push_back({vertices[v].surface, at(p.x), at(p.y), at(p.z), v});
  }
  std::stable_sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.place() < b.place(); });
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (i == 0 || keys[i - 1].place() != keys[i].place()) chosen.push_back(keys[i].vertex);
  return chosen;
}

}  // namespace

KernelRadii median_radii(std::span<const MeshVertex> vertices, std::span<const std::uint32_t> of) {
  KernelRadii median;
  std::vector<float> radii(of.size());
  for (std::size_t half = 0; half < 2; ++half) {
    for (std::size_t i = 0; i < of.size(); ++i) radii[i] = vertices[of[i]].radii.half[half];
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    median.half[half] = *middle;
  }
  return median;
}

Color steadied(std::uint32_t v, std::span<const MeshVertex> vertices, std::span<const SurfaceIrradiance> irradiances,
               std::span<const std::uint32_t> neighbours) {
  const SurfaceIrradiance& own = irradiances[v];
  Color sum = own.E;
  float weights = 1;
  for (const std::uint32_t w : neighbours) {
    const SurfaceIrradiance& other = irradiances[w];
    const float radius = vertices[w].radii.mean();
    const Vec3 way = vertices[v].around.point - vertices[w].around.point;
    if (!(vertices[v].radii.mean() < kNarrow * radius && glm::length(way) < radius)) continue;
    if (!(other.sigma > 0 && other.sigma < kMuchBetter * own.sigma)) continue;
    const float there = mean_component(other.E), here = there + glm::dot(other.gradient, way);
    if (!(there > 0 && here > 0 && std::abs(here - mean_component(own.E)) < kAgreement * own.sigma)) continue;
    const float weight = sqr(own.sigma / other.sigma);
    sum += weight * here / there * other.E;
    weights += weight;
  }
  return sum / weights;
}

MeshSites::MeshSites(PrepareContext& context, std::span<MeshVertex> vertices,
                     std::span<const std::pair<std::uint32_t, std::uint32_t>> edges, float spacing,
                     FunctionRef<KernelRadii(const MeshVertex&)> radii, Sees sees)
    : spacing_(spacing), is_site_(vertices.size(), false) {
  const Adjacency adjacency(vertices.size(), edges);

  /// What a site reaches, by way of the mesh.
  const auto reach = [&](std::uint32_t site, std::vector<Reached>& found, Tracer& tracer) {
    const MeshVertex& from = vertices[site];
    const float limit = spacing * from.radii.mean();
    std::unordered_set<std::uint32_t> seen{site};
    std::vector<std::uint32_t> pending{site};
    while (!pending.empty()) {
      const std::uint32_t v = pending.back();
      pending.pop_back();
      for (const std::uint32_t w : adjacency.of(v)) {
        if (!seen.insert(w).second) continue;
        const MeshVertex& to = vertices[w];
        const float distance = glm::distance(from.around.point, to.around.point);
        if (!(distance < limit) || !(glm::dot(from.around.normal, to.around.normal) > Neighbourhood::kMinCos)) continue;
        if (!sees(from, to, tracer)) continue;
        found.push_back({w, site, distance < kCover * limit});
        pending.push_back(w);
      }
    }
  };

  std::vector<Reached> reached;
  std::vector<std::uint32_t> open(vertices.size());
  for (std::uint32_t v = 0; v < open.size(); ++v) open[v] = v;
  std::vector<bool> covered(vertices.size(), false);
  float cell = kFirstCell;
  for (int round = 0; !open.empty(); ++round, cell *= 0.5f) {
    const std::vector<std::uint32_t> sites = round < kRounds ? one_in_each_cell(vertices, open, cell) : open;
    std::vector<std::vector<Reached>> found(sites.size());
    context.for_chunks(sites.size(), 16, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) {
        vertices[sites[i]].radii = radii(vertices[sites[i]]);
        reach(sites[i], found[i], tracer);
      }
    });
    for (std::size_t i = 0; i < sites.size(); ++i) {
      is_site_[sites[i]] = covered[sites[i]] = true;
      for (const Reached& there : found[i])
        if (there.covered) covered[there.vertex] = true;
      reached.insert(reached.end(), found[i].begin(), found[i].end());
    }
    std::erase_if(open, [&](std::uint32_t v) { return covered[v]; });
  }

  first_.assign(vertices.size() + 1, 0);
  for (const Reached& there : reached) ++first_[there.vertex + 1];
  for (std::size_t v = 0; v < vertices.size(); ++v) first_[v + 1] += first_[v];
  site_.resize(reached.size());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (const Reached& there : reached) site_[next[there.vertex]++] = there.site;

  // Sites in a row, or all far to one side, do not tell what is at a vertex.
  std::vector<std::uint8_t> alone(vertices.size(), 0);
  context.for_chunks(vertices.size(), 64, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto v = static_cast<std::uint32_t>(i);
      if (is_site_[v]) continue;
      float noise = 0;
      for (const float weight : weights(v, vertices)) noise += sqr(weight);
      alone[v] = noise > 0 && noise <= kMaxNoise ? 0 : 1;
    }
  });
  context.for_chunks(vertices.size(), 64, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto v = static_cast<std::uint32_t>(i);
      if (alone[v] != 0)
        vertices[v].radii = radii(vertices[v]);
      else if (!is_site_[v])
        vertices[v].radii = median_radii(vertices, reaching(v));
    }
  });
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    if (alone[v] != 0) is_site_[v] = true;
}

std::vector<float> MeshSites::weights(std::uint32_t v, std::span<const MeshVertex> vertices) const {
  const Neighbourhood& around = vertices[v].around;
  const std::span<const std::uint32_t> sites = reaching(v);
  std::vector<float> weights(sites.size());
  if (!std::isfinite(vertices[sites[0]].radii.mean())) {  // the irradiance is the same everywhere
    weights[0] = 1;
    return weights;
  }
  float scale = 0;
  for (const std::uint32_t site : sites) scale = std::max(scale, glm::distance(around.point, vertices[site].around.point));
  const Frame frame = make_frame(around.normal);
  const auto place = [&](std::uint32_t site) {
    const Vec3 offset = (vertices[site].around.point - around.point) / scale;
    return Vec2(glm::dot(offset, frame.s), glm::dot(offset, frame.t));
  };
  SurfaceMoments moments;
  for (std::size_t i = 0; i < sites.size(); ++i) {
    const MeshVertex& site = vertices[sites[i]];
    const Vec2 at = place(sites[i]);
    const float share = glm::distance(around.point, site.around.point) / (spacing_ * site.radii.mean());
    weights[i] = std::max(1 - sqr(share), kLeastWeight);
    moments.one += weights[i];
    moments.x += weights[i] * at.x;
    moments.y += weights[i] * at.y;
    moments.xx += weights[i] * at.x * at.x;
    moments.xy += weights[i] * at.x * at.y;
    moments.yy += weights[i] * at.y * at.y;
  }
  const Vec3 linear = linear_weights(moments);
  if (linear.y == 0 && linear.z == 0) return {};
  for (std::size_t i = 0; i < sites.size(); ++i) {
    const Vec2 at = place(sites[i]);
    weights[i] *= linear.x + linear.y * at.x + linear.z * at.y;
  }
  return weights;
}

Color MeshSites::fill(std::uint32_t v, std::span<const MeshVertex> vertices, std::span<const Color> irradiances) const {
  const std::span<const std::uint32_t> sites = reaching(v);
  const std::vector<float> of_sites = weights(v, vertices);
  Color E(0);
  for (std::size_t i = 0; i < of_sites.size(); ++i) E += of_sites[i] * irradiances[sites[i]];
  return glm::max(E, Color(0));
}

}  // namespace ln
