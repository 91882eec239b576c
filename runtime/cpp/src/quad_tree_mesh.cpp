#include "ln/quad_tree_mesh.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace ln {

namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// Points of the domains' lattice of the finest cells.
constexpr int kLatticeBits = QuadTree::kMaxDepth;
constexpr int kLattice = 1 << kLatticeBits;

struct Lattice {
  int x, y;
};

Lattice middle(const Lattice& a, const Lattice& b) { return {(a.x + b.x) / 2, (a.y + b.y) / 2}; }

/// Names points of faces such that what is one point of the surface has one name, on whichever patches it lies.
class PointNames {
 public:
  explicit PointNames(const Patches& patches) : patches_(patches), corner_(4 * patches.size()) {
    std::iota(corner_.begin(), corner_.end(), 0u);
    for (std::uint32_t p = 0; p < patches.size(); ++p) {
      const auto corners = static_cast<std::uint32_t>(patches.domain(p).corner_count());
      for (std::uint32_t k = 0; k < corners; ++k) {
        const std::uint32_t n = patches.neighbour(p, static_cast<int>(k));
        if (n == Patches::kNone) continue;
        const auto others = static_cast<std::uint32_t>(patches.domain(n / 4).corner_count());
        join(4 * p + k, n - n % 4 + (n + 1) % 4 % others);
        join(4 * p + (k + 1) % corners, n);
      }
    }
    for (std::uint32_t i = 0; i < corner_.size(); ++i) corner_[i] = find(i);
  }

  std::uint64_t operator()(std::uint32_t face, const Lattice& at) const {
    const std::uint32_t patch = face / 2;
    const std::uint64_t side = face % 2;
    const auto [edge, along] = place(patches_.quad(patch), at);
    if (edge == kInside) {
      const auto x = static_cast<std::uint64_t>(at.x), y = static_cast<std::uint64_t>(at.y);
      return std::uint64_t{2} << 62 | std::uint64_t{face} << (2 * kLatticeBits) | x << kLatticeBits | y;
    }
    if (along == 0) return side << 32 | corner_[4 * patch + static_cast<std::uint32_t>(edge)];
    const std::uint32_t mine = 4 * patch + static_cast<std::uint32_t>(edge), other = patches_.neighbour(patch, edge);
    const bool owned = mine < other;  // true where there is no neighbour
    const auto position = static_cast<std::uint64_t>(owned ? along : kLattice - along);
    return std::uint64_t{1} << 62 | (side << 32 | (owned ? mine : other)) << kLatticeBits | position;
  }

 private:
  static constexpr int kInside = -1;
  struct Place {
    int edge, along;  // 0 at the edge's first corner; edges are half open
  };

  static Place place(bool quad, const Lattice& at) {
    if (at.y == 0 && at.x < kLattice) return {0, at.x};
    if (quad) {
      if (at.x == kLattice && at.y < kLattice) return {1, at.y};
      if (at.y == kLattice && at.x > 0) return {2, kLattice - at.x};
      if (at.x == 0) return {3, kLattice - at.y};
    } else {
      if (at.x + at.y == kLattice && at.x > 0) return {1, at.y};
      if (at.x == 0) return {2, kLattice - at.y};
    }
    return {kInside, 0};
  }

  std::uint32_t find(std::uint32_t i) {
    while (corner_[i] != i) i = corner_[i] = corner_[corner_[i]];
    return i;
  }
  void join(std::uint32_t i, std::uint32_t j) {
    i = find(i);
    j = find(j);
    corner_[std::max(i, j)] = std::min(i, j);
  }

  const Patches& patches_;
  std::vector<std::uint32_t> corner_;  // by 4 * patch + corner: the first corner at the same point of the surface
};

class Reconstruction {
 public:
  Reconstruction(const QuadTree& tree, Workers& workers)
      : tree_(tree), patches_(tree.patches()), workers_(workers), name_(patches_), mesh_(tree.shared_patches()) {}

  TriMesh run() {
    collect_leaves();
    balance();
    find_outlines();
    find_gradients();
    find_vertex_values();
    triangulate();
    mesh_.finish(workers_);
    return std::move(mesh_);
  }

 private:
  /// A leaf of the tree, and the linear function on it.
  struct Source {
    SurfaceCell cell;
    Color value;
    Vec3 gradient[3] = {Vec3(0), Vec3(0), Vec3(0)};  // by channel, in the plane of the cell

    Color at(const Vec3& p) const {
      const Vec3 d = p - cell.center();
      return value + Color(glm::dot(gradient[0], d), glm::dot(gradient[1], d), glm::dot(gradient[2], d));
    }
  };

  /// A leaf, or a part of one that its neighbours have made to be cut.
  struct Leaf {
    std::uint32_t face;
    DomainCell domain;
    std::uint32_t source;
    bool split = false;  // replaced by its children
    std::uint32_t outline = 0, outline_count = 0;
  };

  using Neighbours = std::pair<std::uint32_t, std::uint32_t>;  // a source, and one beside it

  static Lattice lattice(const Vec2& st) {
    return {static_cast<int>(std::lround(st.x * kLattice)), static_cast<int>(std::lround(st.y * kLattice))};
  }
  Lattice corner(const Leaf& leaf, int k) const { return lattice(leaf.domain.corner(k % leaf.domain.corner_count())); }
  static Vec2 domain_point(const Lattice& at) {
    return Vec2(static_cast<float>(at.x), static_cast<float>(at.y)) / static_cast<float>(kLattice);
  }
  Vec3 position(std::uint32_t face, const Vec2& st) const {
    const SurfaceCell s = patches_.surface(face / 2);
    return s.o + st.x * s.a + st.y * s.b;
  }

  /// Leaves of lit faces, and dark faces beside them.
  void collect_leaves() {
    for (std::uint32_t face = 0; face < patches_.face_count(); ++face) {
      tree_.for_each_leaf(face, [&](const DomainCell& cell, const Color& value) { add_leaf(face, cell, value); });
      if (tree_.lit(face)) continue;
      for (int k = 0; k < patches_.domain(face / 2).corner_count(); ++k) {
        const std::uint32_t n = patches_.neighbour(face / 2, k);
        if (n == Patches::kNone || !tree_.lit(2 * (n / 4) + face % 2)) continue;
        add_leaf(face, patches_.domain(face / 2), Color(0));
        break;
      }
    }
  }

  void add_leaf(std::uint32_t face, const DomainCell& cell, const Color& value) {
    leaves_.push_back({face, cell, static_cast<std::uint32_t>(sources_.size())});
    sources_.push_back({surface_cell(patches_.surface(face / 2), cell), value});
  }

  bool exists(std::uint32_t face, const Lattice& at) const { return vertices_.count(name_(face, at)) != 0; }

  void add_corners(const Leaf& leaf) {
    for (int k = 0; k < leaf.domain.corner_count(); ++k)
      vertices_.emplace(name_(leaf.face, corner(leaf, k)), static_cast<std::uint32_t>(vertices_.size()));
  }

  /// Is an edge of the leaf cut into more than two by its neighbours?
  bool too_coarse(const Leaf& leaf) const {
    for (int k = 0; k < leaf.domain.corner_count(); ++k) {
      const Lattice a = corner(leaf, k), b = corner(leaf, k + 1);
      if (std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) < 4) continue;
      const Lattice m = middle(a, b);
      if (exists(leaf.face, m) && (exists(leaf.face, middle(a, m)) || exists(leaf.face, middle(m, b)))) return true;
    }
    return false;
  }

  void balance() {
    vertices_.reserve(2 * leaves_.size());
    for (const Leaf& leaf : leaves_) add_corners(leaf);
    for (std::size_t before = 0; before != leaves_.size();) {
      before = leaves_.size();
      std::vector<std::uint8_t> cut(before);
      workers_.parallel_for(before, 1024, [&](std::size_t i) { cut[i] = !leaves_[i].split && too_coarse(leaves_[i]) ? 1 : 0; });
      for (std::size_t i = 0; i < before; ++i) {
        if (!cut[i]) continue;
        leaves_[i].split = true;
        for (int c = 0; c < 4; ++c) {
          const Leaf child{leaves_[i].face, leaves_[i].domain.child(c), leaves_[i].source};
          add_corners(child);
          leaves_.push_back(child);
        }
      }
    }
    leaves_.erase(std::remove_if(leaves_.begin(), leaves_.end(), [](const Leaf& leaf) { return leaf.split; }), leaves_.end());
    std::stable_sort(leaves_.begin(), leaves_.end(), [](const Leaf& x, const Leaf& y) { return x.face < y.face; });
  }

  /// The vertices around each leaf, those in the middle of its edges included.
  void find_outlines() {
    for (Leaf& leaf : leaves_) {
      leaf.outline = static_cast<std::uint32_t>(outlines_.size());
      for (int k = 0; k < leaf.domain.corner_count(); ++k) {
        const Lattice a = corner(leaf, k), b = corner(leaf, k + 1);
        add_outline(leaf.face, a);
        const Lattice m = middle(a, b);
        if (std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) > 1 && exists(leaf.face, m)) add_outline(leaf.face, m);
      }
      leaf.outline_count = static_cast<std::uint32_t>(outlines_.size()) - leaf.outline;
    }
  }

  void add_outline(std::uint32_t face, const Lattice& at) {
    outlines_.push_back({domain_point(at), vertices_.at(name_(face, at))});
  }

  struct OutlinePoint {
    Vec2 st;
    std::uint32_t vertex;
  };
  std::span<const OutlinePoint> outline(const Leaf& leaf) const {
    return {outlines_.data() + leaf.outline, leaf.outline_count};
  }

  void find_gradients() {
    // Leaves that share a piece of an edge are neighbours.
    struct Piece {
      std::uint32_t low, high, source;
    };
    std::vector<Piece> pieces;
    pieces.reserve(outlines_.size());
    for (const Leaf& leaf : leaves_) {
      const auto points = outline(leaf);
      for (std::size_t k = 0; k < points.size(); ++k) {
        const std::uint32_t a = points[k].vertex, b = points[(k + 1) % points.size()].vertex;
        pieces.push_back({std::min(a, b), std::max(a, b), leaf.source});
      }
    }
    std::sort(pieces.begin(), pieces.end(), [](const Piece& x, const Piece& y) {
      return std::tie(x.low, x.high, x.source) < std::tie(y.low, y.high, y.source);
    });
    std::vector<Neighbours> pairs;
    for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
      const Piece &x = pieces[i], &y = pieces[i + 1];
      if (x.low != y.low || x.high != y.high || x.source == y.source) continue;
      pairs.emplace_back(x.source, y.source);
      pairs.emplace_back(y.source, x.source);
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    std::vector<std::size_t> first(sources_.size() + 1, 0);
    for (const Neighbours& pair : pairs) ++first[pair.first + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    const auto neighbours = [&](std::size_t i) { return std::span(pairs).subspan(first[i], first[i + 1] - first[i]); };
    std::vector<std::uint8_t> fitted(sources_.size());
    workers_.parallel_for(sources_.size(), 256,
                          [&](std::size_t i) { fitted[i] = fit_gradient(sources_[i], neighbours(i)) ? 1 : 0; });
    // At the tips of triangles, take the gradient from the one neighbour.
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      if (fitted[i]) continue;
      for (const Neighbours& pair : neighbours(i))
        if (fitted[pair.second]) std::copy_n(sources_[pair.second].gradient, 3, sources_[i].gradient);
    }
  }

  /// False if the neighbours lie in a row and so say nothing about the other direction, in which the gradient is 0 then.
  bool fit_gradient(Source& here, std::span<const Neighbours> neighbours) const {
    if (neighbours.empty()) return false;
    const Frame frame = make_frame(glm::normalize(glm::cross(here.cell.a, here.cell.b)));
    double xx = 0, xy = 0, yy = 0;
    DVec3 xf(0), yf(0);
    Color range(0);
    for (const Neighbours& pair : neighbours) {
      const Source& other = sources_[pair.second];
      const Vec3 d = frame.to_local(other.cell.center() - here.cell.center());
      const double x = static_cast<double>(d.x), y = static_cast<double>(d.y), w = 1 / (x * x + y * y);
      const Color f = other.value - here.value;
      xx += w * x * x;
      xy += w * x * y;
      yy += w * y * y;
      xf += w * x * DVec3(f);
      yf += w * y * DVec3(f);
      range = glm::max(range, glm::abs(f));
    }
    const bool spanned = xx * yy - xy * xy > 1e-2 * (xx + yy) * (xx + yy);
    const double ridge = spanned ? 0 : 1e-6 * (xx + yy);  // of the unit matrix
    xx += ridge;
    yy += ridge;
    const double determinant = xx * yy - xy * xy;
    const DVec3 gx = (yy * xf - xy * yf) / determinant, gy = (xx * yf - xy * xf) / determinant;
    // What is linear changes up to a corner by no more than to the farthest neighbour, or twice as much at borders of triangles
    // and beside small cells.
    range *= 2.0f;
    for (std::size_t c = 0; c < 3; ++c) {
      here.gradient[c] = static_cast<float>(gx[c]) * frame.s + static_cast<float>(gy[c]) * frame.t;
      float change = 0;
      for (int k = 0; k < here.cell.corner_count(); ++k)
        change = std::max(change, std::abs(glm::dot(here.gradient[c], here.cell.corner(k) - here.cell.center())));
      if (change > range[c]) here.gradient[c] *= range[c] / change;
    }
    return spanned;
  }

  void find_vertex_values() {
    std::vector<Color> sum(vertices_.size(), Color(0));
    std::vector<int> count(vertices_.size(), 0);
    for (const Leaf& leaf : leaves_) {
      for (const OutlinePoint& point : outline(leaf)) {
        sum[point.vertex] += sources_[leaf.source].at(position(leaf.face, point.st));
        ++count[point.vertex];
      }
    }
    for (std::size_t i = 0; i < sum.size(); ++i)
      mesh_.add_vertex(count[i] > 0 ? glm::max(sum[i] / static_cast<float>(count[i]), Color(0)) : Color(0));
  }

  /// Fans around the centers of the leaves; triangles without vertices on their edges stay as they are.
  void triangulate() {
    std::vector<MeshTriangle> triangles;
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      const Leaf& leaf = leaves_[i];
      const auto points = outline(leaf);
      if (points.size() == 3) {
        triangles.push_back(
            {{points[0].st, points[1].st, points[2].st}, {points[0].vertex, points[1].vertex, points[2].vertex}});
      } else {
        const Color value = sources_[leaf.source].at(position(leaf.face, leaf.domain.center()));
        const std::uint32_t center = mesh_.add_vertex(glm::max(value, Color(0)));
        for (std::size_t k = 0; k < points.size(); ++k) {
          const OutlinePoint &a = points[k], &b = points[(k + 1) % points.size()];
          triangles.push_back({{leaf.domain.center(), a.st, b.st}, {center, a.vertex, b.vertex}});
        }
      }
      if (i + 1 == leaves_.size() || leaves_[i + 1].face != leaf.face) {
        mesh_.add_triangles(leaf.face, triangles);
        triangles.clear();
      }
    }
  }

  const QuadTree& tree_;
  const Patches& patches_;
  Workers& workers_;
  PointNames name_;
  TriMesh mesh_;
  std::vector<Source> sources_;
  std::vector<Leaf> leaves_;                                   // in order of faces, once balanced
  std::unordered_map<std::uint64_t, std::uint32_t> vertices_;  // by name
  std::vector<OutlinePoint> outlines_;
};

}  // namespace

TriMesh reconstruct(const QuadTree& tree, Workers& workers) {
  if (tree.empty()) return {};
  return Reconstruction(tree, workers).run();
}

}  // namespace ln
