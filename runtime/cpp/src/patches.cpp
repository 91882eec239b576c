#include "ln/patches.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>
#include <tuple>

namespace ln {

namespace {

/// Vertices at the same place, as written in the file under whatever index, get the same number.
std::vector<std::uint32_t> weld(const std::vector<Vec3>& positions) {
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::tie(positions[i].x, positions[i].y, positions[i].z); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    return std::tuple_cat(key(i), std::tie(i)) < std::tuple_cat(key(j), std::tie(j));
  });
  std::vector<std::uint32_t> ids(positions.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    ids[order[n]] = n > 0 && key(order[n - 1]) == key(order[n]) ? ids[order[n - 1]] : order[n];
  return ids;
}

/// A directed edge between two welded points.
struct Edge {
  std::uint32_t low, high;  // points, sorted
  std::uint32_t owner;      // triangle or patch
  std::uint8_t number;      // which of its edges
  bool forward;             // runs from low to high
};

Edge make_edge(std::uint32_t from, std::uint32_t to, std::uint32_t owner, int number) {
  return {std::min(from, to), std::max(from, to), owner, static_cast<std::uint8_t>(number), from < to};
}

/// Calls `use(edge, other)` for each edge between exactly two owners that run along it in opposite directions.
template <class Use>
void for_shared_edges(std::vector<Edge>& edges, Use&& use) {
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return std::tie(x.low, x.high, x.owner, x.number) < std::tie(y.low, y.high, y.owner, y.number);
  });
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    if (end - i == 2 && edges[i].forward != edges[i + 1].forward && edges[i].low != edges[i].high) use(edges[i], edges[i + 1]);
    i = end;
  }
}

}  // namespace

Patches::Patches(const SceneData& data) : data_(&data), point_id_(weld(data.positions)) {
  pair_triangles();
  find_neighbours();
}

SurfaceCell Patches::surface(std::uint32_t patch) const {
  const Patch& p = patches_[patch];
  const Vec3 o = vertex(p.triangle[0], p.first[0]), second = vertex(p.triangle[0], p.first[0] + 1u);
  const Vec3 last = quad(patch) ? vertex(p.triangle[1], p.first[1] + 2u) : vertex(p.triangle[0], p.first[0] + 2u);
  return {o, second - o, last - o, quad(patch)};
}

Hit Patches::hit(std::uint32_t patch, const Vec2& st) const {
  const Patch& p = patches_[patch];
  const unsigned i = quad(patch) && st.y > st.x ? 1 : 0;
  float bary[3];  // of the corner (0,0) and the next two
  bary[1] = st.x;
  bary[2] = st.y;
  if (quad(patch)) {
    bary[1] = i == 0 ? st.x - st.y : st.x;
    bary[2] = i == 0 ? st.y : st.y - st.x;
  }
  bary[0] = 1 - bary[1] - bary[2];
  Hit hit;
  hit.triangle = p.triangle[i];
  hit.u = bary[(4u - p.first[i]) % 3];
  hit.v = bary[(5u - p.first[i]) % 3];
  return hit;
}

/// Joins triangles to parallelograms, the most rectangular ones first.
void Patches::pair_triangles() {
  constexpr float kTolerance = 1e-4f;  // of the fourth corner's place, in diagonals
  const auto triangle_count = static_cast<std::uint32_t>(data_->triangles.size());
  std::vector<Edge> edges;
  edges.reserve(3 * std::size_t{triangle_count});
  for (std::uint32_t t = 0; t < triangle_count; ++t) {
    const UVec3 v = data_->triangles[t];
    for (int k = 0; k < 3; ++k)
      edges.push_back(
          make_edge(point_id_[v[static_cast<std::size_t>(k)]], point_id_[v[static_cast<std::size_t>((k + 1) % 3)]], t, k));
  }

  struct Pair {
    float skew;  // 0: a rectangle
    std::uint32_t triangle[2];
    std::uint8_t edge[2];
  };
  std::vector<Pair> pairs;
  for_shared_edges(edges, [&](const Edge& x, const Edge& y) {
    if (x.owner == y.owner || data_->triangle_part[x.owner] != data_->triangle_part[y.owner]) return;
    const Vec3 p = vertex(x.owner, x.number), q = vertex(x.owner, x.number + 1u);
    const Vec3 r = vertex(x.owner, x.number + 2u), s = vertex(y.owner, y.number + 2u);
    const float diagonal = glm::distance(p, q), other = glm::distance(r, s);
    if (glm::length(p + q - r - s) > kTolerance * std::min(diagonal, other)) return;
    pairs.push_back({std::abs(diagonal - other) / std::max(diagonal, other), {x.owner, y.owner}, {x.number, y.number}});
  });
  std::sort(pairs.begin(), pairs.end(), [](const Pair& x, const Pair& y) {
    const auto step = [](float skew) { return std::floor(skew * 1e3f); };  // rounding must not break up a regular grid
    return std::make_tuple(step(x.skew), x.triangle[0], x.triangle[1]) <
           std::make_tuple(step(y.skew), y.triangle[0], y.triangle[1]);
  });

  constexpr std::uint32_t kOpen = kNone;
  triangle_half_.assign(triangle_count, kOpen);
  std::vector<Patch> quad_of(triangle_count);
  for (const Pair& pair : pairs) {
    const auto [x, y] = pair.triangle;
    if (quad_of[x].triangle[1] != kNoTriangle || quad_of[y].triangle[1] != kNoTriangle) continue;
    // The shared edge is the diagonal from (0,0) to (1,1). `x` runs along it from p to q; with q as (0,0) `x` is q r p: (0,0),
    // (1,0), (1,1).
    Patch patch;
    patch.triangle[0] = x;
    patch.first[0] = static_cast<std::uint8_t>((pair.edge[0] + 1) % 3);
    patch.triangle[1] = y;
    patch.first[1] = pair.edge[1];  // `y` runs from q to p, then to s: (0,0), (1,1), (0,1)
    quad_of[x] = quad_of[y] = patch;
  }
  for (std::uint32_t t = 0; t < triangle_count; ++t) {
    if (triangle_half_[t] != kOpen) continue;
    Patch patch = quad_of[t];
    if (patch.triangle[1] == kNoTriangle) patch = {{t, kNoTriangle}, {0, 0}};
    const auto number = static_cast<std::uint32_t>(patches_.size());
    for (std::uint32_t i = 0; i < 2; ++i)
      if (patch.triangle[i] != kNoTriangle) triangle_half_[patch.triangle[i]] = 2 * number + i;
    patches_.push_back(patch);
  }
}

void Patches::find_neighbours() {
  neighbours_.assign(size(), {kNone, kNone, kNone, kNone});
  std::vector<Edge> edges;
  std::vector<Vec3> normals(size());
  for (std::uint32_t p = 0; p < size(); ++p) {
    const SurfaceCell cell = surface(p);
    normals[p] = glm::normalize(glm::cross(cell.a, cell.b));
    const Patch& patch = patches_[p];
    const auto point = [&](std::uint32_t i, unsigned k) {
      return point_id_[data_->triangles[patch.triangle[i]][(patch.first[i] + k) % 3]];
    };
    std::uint32_t corner[4] = {point(0, 0), point(0, 1), point(0, 2), 0};
    if (quad(p)) corner[3] = point(1, 2);
    const int n = cell.corner_count();
    for (int k = 0; k < n; ++k) edges.push_back(make_edge(corner[k], corner[(k + 1) % n], p, k));
  }
  for_shared_edges(edges, [&](const Edge& x, const Edge& y) {
    if (x.owner == y.owner || !(glm::dot(normals[x.owner], normals[y.owner]) >= kCreaseCos)) return;
    neighbours_[x.owner][x.number] = 4 * y.owner + y.number;
    neighbours_[y.owner][y.number] = 4 * x.owner + x.number;
  });
}

}  // namespace ln
