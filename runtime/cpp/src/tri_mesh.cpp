#include "ln/tri_mesh.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <tuple>

namespace ln {

namespace {

/// How far a point may lie outside of all triangles, in barycentric coordinates, and still belong to the nearest: rounding.
constexpr float kSlack = 1e-4f;

float cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }

Vec2 center(const MeshTriangle& t) { return (t.corner[0] + t.corner[1] + t.corner[2]) * (1.0f / 3); }

}  // namespace

void TriMesh::add_triangles(std::uint32_t face, std::span<const MeshTriangle> triangles) {
  faces_[face].begin = static_cast<std::uint32_t>(triangles_.size());
  faces_[face].count = static_cast<std::uint32_t>(triangles.size());
  triangles_.insert(triangles_.end(), triangles.begin(), triangles.end());
}

void TriMesh::finish(Workers& workers) {
  // A run of n triangles has at most n boxes, so each face's place is known beforehand.
  std::uint32_t count = 0;
  for (Face& face : faces_) {
    face.tree = count;
    if (face.count > kLeaf) count += face.count;
  }
  boxes_.resize(count);
  workers.parallel_for(faces_.size(), 64, [&](std::size_t i) {
    const Face& face = faces_[i];
    if (face.count <= kLeaf) return;
    std::vector<Box> boxes;
    boxes.reserve(face.count);
    build(boxes, face.begin, face.begin + face.count);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      boxes[k].right += face.tree;
      boxes_[face.tree + k] = boxes[k];
    }
  });
}

/// Sorts a run of triangles into halves along the longer side of its box; the position of its box.
std::uint32_t TriMesh::build(std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end) {
  const auto here = static_cast<std::uint32_t>(boxes.size());
  Vec2 low(kInfinity), high(-kInfinity);
  for (std::uint32_t i = begin; i < end; ++i) {
    for (const Vec2& corner : triangles_[i].corner) {
      low = glm::min(low, corner);
      high = glm::max(high, corner);
    }
  }
  boxes.push_back({low - Vec2(kSlack * (high - low)), high + Vec2(kSlack * (high - low)), 0});
  if (end - begin <= kLeaf) return here;
  const std::size_t axis = high.x - low.x >= high.y - low.y ? 0 : 1;
  std::sort(triangles_.begin() + begin, triangles_.begin() + end, [&](const MeshTriangle& x, const MeshTriangle& y) {
    const Vec2 p = center(x), q = center(y);
    return std::tie(p[axis], p[1 - axis], x.vertex[0], x.vertex[1]) < std::tie(q[axis], q[1 - axis], y.vertex[0], y.vertex[1]);
  });
  const std::uint32_t middle = begin + (end - begin) / 2;
  build(boxes, begin, middle);
  boxes[here].right = build(boxes, middle, end);
  return here;
}

/// The triangle around a point, or the one nearest to it.
struct TriMesh::Search {
  const TriMesh& mesh;
  Vec2 st;
  float best = -kSlack;  // least barycentric coordinate
  Color found{0};

  void look_at(std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end && best < 0; ++i) {
      const MeshTriangle& t = mesh.triangles_[i];
      const Vec2 a = t.corner[1] - t.corner[0], b = t.corner[2] - t.corner[0], p = st - t.corner[0];
      const float whole = cross(a, b);
      const float u = cross(p, b) / whole, v = cross(a, p) / whole, w = 1 - u - v;
      const float least = std::min(u, std::min(v, w));
      if (!(least > best)) continue;
      best = least;
      Vec3 bary = glm::max(Vec3(w, u, v), Vec3(0));
      bary /= bary.x + bary.y + bary.z;
      found =
          bary.x * mesh.vertices_[t.vertex[0]] + bary.y * mesh.vertices_[t.vertex[1]] + bary.z * mesh.vertices_[t.vertex[2]];
    }
  }

  void descend(std::uint32_t box, std::uint32_t begin, std::uint32_t end) {
    const Box& b = mesh.boxes_[box];
    if (best >= 0 || st.x < b.low.x || st.y < b.low.y || st.x > b.high.x || st.y > b.high.y) return;
    if (end - begin <= kLeaf) return look_at(begin, end);
    const std::uint32_t middle = begin + (end - begin) / 2;
    descend(box + 1, begin, middle);
    descend(b.right, middle, end);
  }
};

Color TriMesh::irradiance(std::uint32_t face, const Vec2& st) const {
  const Face& f = faces_[face];
  Search search{*this, st};
  if (f.count <= kLeaf) {
    search.look_at(f.begin, f.begin + f.count);
  } else {
    search.descend(f.tree, f.begin, f.begin + f.count);
  }
  return search.found;
}

}  // namespace ln
