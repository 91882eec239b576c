#include "ln/mesh_reduction.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "ln/disjoint_sets.hpp"

namespace ln {

namespace {

/// Vertices are removed in rounds, first those that are missed least: shares of the tolerance.
constexpr float kRounds[] = {1.0f / 16, 1.0f / 8, 1.0f / 4, 1.0f / 2, 1.0f};

/// Of a new triangle: least height over its longest side, and the part of the area that rounding may cost.
constexpr float kLeastHeight = 0.05f, kAreaTolerance = 1e-4f;

float cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }

/// Twice the area.
float size(const Vec2 (&corner)[3]) { return cross(corner[1] - corner[0], corner[2] - corner[0]); }

float largest(const Color& c) { return max_component(glm::abs(c)); }

struct Triangle {
  MeshTriangle t;
  std::uint32_t face = 0;
  float error = 0;  // bound of what the irradiance inside differs by from the original
  bool alive = true;

  int place_of(std::uint32_t vertex) const {
    return t.vertex[0] == vertex ? 0 : t.vertex[1] == vertex ? 1 : t.vertex[2] == vertex ? 2 : -1;
  }
};

/// Takes vertices out of a mesh by moving them along an edge onto a neighbour (half-edge collapse).
class Reducer {
 public:
  Reducer(const TriMesh& mesh, float tolerance)
      : E_(mesh.vertices()), tolerance_(tolerance), around_(E_.size()), untried_(E_.size()) {
    for (std::uint32_t face = 0; face < mesh.patches().face_count(); ++face)
      for (const MeshTriangle& t : mesh.triangles(face)) triangles_.push_back({t, face});
    for (std::uint32_t i = 0; i < triangles_.size(); ++i)
      for (const std::uint32_t v : triangles_[i].t.vertex)
        if (around_[v].empty() || around_[v].back() != i) around_[v].push_back(i);
  }

  /// Groups of vertices that no triangle connects.
  std::vector<std::vector<std::uint32_t>> groups() const {
    DisjointSets sets(E_.size());
    for (const Triangle& triangle : triangles_) {
      sets.join(triangle.t.vertex[0], triangle.t.vertex[1]);
      sets.join(triangle.t.vertex[0], triangle.t.vertex[2]);
    }
    std::uint32_t count = 0;
    const std::vector<std::uint32_t> label = sets.labels(count);
    std::vector<std::vector<std::uint32_t>> members(count);
    for (std::uint32_t v = 0; v < E_.size(); ++v) members[label[v]].push_back(v);
    return members;
  }

  /// Removes what can be removed of a group. Groups do not touch each other's triangles.
  void reduce(const std::vector<std::uint32_t>& group) {
    for (const float share : kRounds) {
      for (const std::uint32_t u : group) untried_[u] = 1;
      for (bool changed = true; changed;) {
        changed = false;
        for (const std::uint32_t u : group) {
          if (!untried_[u] || around_[u].empty()) continue;
          untried_[u] = 0;
          changed |= remove(u, share * tolerance_);
        }
      }
    }
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  /// Moves `u` onto the neighbour that changes least; false: each changes more than the limit.
  bool remove(std::uint32_t u, float limit) {
    std::vector<std::uint32_t> neighbours;
    float before = 0;
    for (const std::uint32_t i : around_[u]) {
      before = std::max(before, triangles_[i].error);
      for (const std::uint32_t v : triangles_[i].t.vertex)
        if (v != u && std::find(neighbours.begin(), neighbours.end(), v) == neighbours.end()) neighbours.push_back(v);
    }
    std::uint32_t best = u;
    float least = limit - before;
    for (const std::uint32_t v : neighbours) {
      const float change = change_by_move(u, v, least);
      if (change < least || (change == least && best == u)) {
        least = change;
        best = v;
      }
    }
    if (best == u) return false;
    move(u, best, before + least);
    for (const std::uint32_t v : neighbours) untried_[v] = 1;
    return true;
  }

  /// Largest change of the irradiance if `u` moves onto `v`; infinite, if the triangles cannot be had, or beyond `limit`.
  float change_by_move(std::uint32_t u, std::uint32_t v, float limit) const {
    float change = 0;
    for (std::size_t begin = 0; begin < around_[u].size();) {
      // The triangles around u of one face: they stand together.
      std::size_t end = begin;
      const std::uint32_t face = triangles_[around_[u][begin]].face;
      while (end < around_[u].size() && triangles_[around_[u][end]].face == face) ++end;
      change = std::max(change, change_in_face({around_[u].data() + begin, end - begin}, u, v, limit));
      if (change > limit) return kInfinity;
      begin = end;
    }
    return change;
  }

  float change_in_face(std::span<const std::uint32_t> star, std::uint32_t u, std::uint32_t v, float limit) const {
    // Where u and v lie in this face.
    const Triangle& any = triangles_[star[0]];
    const Vec2 from = any.t.corner[any.place_of(u)];
    Vec2 to(0);
    bool found = false;
    for (const std::uint32_t i : star) {
      const Triangle& triangle = triangles_[i];
      if (triangle.t.corner[triangle.place_of(u)] != from) return kInfinity;  // two places of one vertex: leave it
      if (const int k = triangle.place_of(v); k >= 0) {
        to = triangle.t.corner[k];
        found = true;
      }
    }
    if (!found) return kInfinity;

    // The new triangles must cover what the old ones did.
    float old_size = 0, new_size = 0, change = kInfinity;
    for (const std::uint32_t i : star) {
      const Triangle& triangle = triangles_[i];
      const float before = size(triangle.t.corner);
      old_size += std::abs(before);
      if (triangle.place_of(v) >= 0) continue;
      MeshTriangle moved = triangle.t;
      moved.corner[triangle.place_of(u)] = to;
      const float after = size(moved.corner);
      float longest2 = 0;
      for (int k = 0; k < 3; ++k) {
        const Vec2 edge = moved.corner[(k + 1) % 3] - moved.corner[k];
        longest2 = std::max(longest2, glm::dot(edge, edge));
      }
      if (!(after * before > 0 && std::abs(after) > kLeastHeight * longest2)) return kInfinity;
      new_size += std::abs(after);
    }
    if (!(std::abs(new_size - old_size) <= kAreaTolerance * old_size)) return kInfinity;

    // The change is linear between the place of u and the crossings of old edges with new ones; at the rim it is zero.
    for (const std::uint32_t i : star) {
      const Triangle& triangle = triangles_[i];
      if (triangle.place_of(v) >= 0) continue;
      const int k = triangle.place_of(u);
      const Vec2 p = triangle.t.corner[(k + 1) % 3] - to, q = triangle.t.corner[(k + 2) % 3] - to, x = from - to;
      const float whole = cross(p, q), a = cross(x, q) / whole, b = cross(p, x) / whole;
      constexpr float kSlack = 1e-4f;
      if (a < -kSlack || b < -kSlack || a + b > 1 + kSlack) continue;
      const Color there = (1 - a - b) * E_[v] + a * E_[triangle.t.vertex[(k + 1) % 3]] + b * E_[triangle.t.vertex[(k + 2) % 3]];
      change = largest(there - E_[u]);
    }
    if (change > limit) return kInfinity;
    for (const std::uint32_t i : star) {
      const Triangle& old_one = triangles_[i];
      const int k = old_one.place_of(u);
      for (int side = 1; side <= 2; ++side) {
        const std::uint32_t w = old_one.t.vertex[(k + side) % 3];
        if (w == v) continue;
        for (const std::uint32_t j : star)
          for (int other = 1; other <= 2; ++other) {
            const Triangle& new_one = triangles_[j];
            const int m = (new_one.place_of(u) + other) % 3;
            const std::uint32_t z = new_one.t.vertex[m];
            if (z == w || z == v) continue;
            change = std::max(change,
                              change_at_crossing(from, old_one.t.corner[(k + side) % 3], to, new_one.t.corner[m], u, w, v, z));
          }
      }
    }
    return change;
  }

  /// Where the old edge from u to w crosses the new one from v to z; 0: nowhere.
  float change_at_crossing(const Vec2& at_u, const Vec2& at_w, const Vec2& at_v, const Vec2& at_z, std::uint32_t u,
                           std::uint32_t w, std::uint32_t v, std::uint32_t z) const {
    const Vec2 d = at_w - at_u, e = at_z - at_v, x = at_v - at_u;
    const float determinant = cross(d, e);
    const float s = cross(x, e) / determinant, t = cross(x, d) / determinant;
    if (!(s > 0 && s < 1 && t > 0 && t < 1)) return 0;
    return largest((1 - s) * E_[u] + s * E_[w] - (1 - t) * E_[v] - t * E_[z]);
  }

  void move(std::uint32_t u, std::uint32_t v, float error) {
    const std::vector<std::uint32_t> star = std::move(around_[u]);
    around_[u].clear();
    const auto place_in = [&](std::uint32_t face) {
      for (const std::uint32_t i : star)
        if (const int k = triangles_[i].place_of(v); triangles_[i].face == face && k >= 0) return triangles_[i].t.corner[k];
      return Vec2(0);  // never: change_in_face has found it
    };
    for (const std::uint32_t i : star) {
      Triangle& triangle = triangles_[i];
      if (triangle.place_of(v) >= 0) continue;
      const int k = triangle.place_of(u);
      triangle.t.corner[k] = place_in(triangle.face);
      triangle.t.vertex[k] = v;
      triangle.error = error;
      around_[v].insert(std::upper_bound(around_[v].begin(), around_[v].end(), i), i);
    }
    for (const std::uint32_t i : star) {
      if (triangles_[i].place_of(u) < 0) continue;
      triangles_[i].alive = false;
      for (const std::uint32_t w : triangles_[i].t.vertex)
        if (w != u) std::erase(around_[w], i);
    }
  }

  const std::vector<Color>& E_;
  const float tolerance_;
  std::vector<Triangle> triangles_;                 // face by face
  std::vector<std::vector<std::uint32_t>> around_;  // by vertex: its triangles, in order
  std::vector<std::uint8_t> untried_;               // by vertex: something around it has changed since it was looked at
};

}  // namespace

TriMesh reduce(const TriMesh& mesh, float error, Workers& workers) {
  // The mean, by area.
  const Patches& patches = mesh.patches();
  double sum = 0, whole = 0;
  for (std::uint32_t face = 0; face < patches.face_count(); ++face) {
    if (mesh.triangles(face).empty()) continue;
    const SurfaceCell cell = patches.surface(face / 2);
    const float scale = glm::length(glm::cross(cell.a, cell.b));
    for (const MeshTriangle& t : mesh.triangles(face)) {
      const Color E = (mesh.vertices()[t.vertex[0]] + mesh.vertices()[t.vertex[1]] + mesh.vertices()[t.vertex[2]]) * (1.0f / 3);
      const double weight = static_cast<double>(std::abs(size(t.corner)) * scale);
      sum += weight * static_cast<double>(mean_component(E));
      whole += weight;
    }
  }
  if (!(whole > 0)) return mesh;

  Reducer reducer(mesh, error * static_cast<float>(sum / whole));
  const std::vector<std::vector<std::uint32_t>> groups = reducer.groups();
  workers.parallel_for(groups.size(), 1, [&](std::size_t i) { reducer.reduce(groups[i]); });

  TriMesh reduced(mesh.shared_patches());
  std::vector<std::uint32_t> number(mesh.vertices().size(), Patches::kNone);
  std::vector<MeshTriangle> kept;
  const std::vector<Triangle>& triangles = reducer.triangles();
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (triangles[i].alive) {
      kept.push_back(triangles[i].t);
      for (std::uint32_t& v : kept.back().vertex) {
        if (number[v] == Patches::kNone) number[v] = reduced.add_vertex(mesh.vertices()[v]);
        v = number[v];
      }
    }
    if (i + 1 < triangles.size() && triangles[i + 1].face == triangles[i].face) continue;
    reduced.add_triangles(triangles[i].face, kept);
    kept.clear();
  }
  reduced.finish(workers);
  return reduced;
}

}  // namespace ln
