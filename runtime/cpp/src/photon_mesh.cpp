#include "ln/photon_mesh.hpp"

#include <algorithm>
#include <bit>
#include <optional>
#include <unordered_map>

#include "ln/disjoint_sets.hpp"
#include "ln/surface_density.hpp"

namespace ln {

namespace {

/// Edges are halved so many times at most: far below what photons can tell, and domain coordinates remain exact.
constexpr int kMaxLevels = 20;

/// A surface with more photons than this is sorted by all threads together.
constexpr std::size_t kManyPhotons = 1 << 16;

/// A point of a face's domain.
struct Place {
  std::uint32_t face;
  Vec2 st;

  bool operator==(const Place&) const = default;
};
struct PlaceHash {
  std::size_t operator()(const Place& p) const {
    return hash32(hash32(p.face, std::bit_cast<std::uint32_t>(p.st.x)), std::bit_cast<std::uint32_t>(p.st.y));
  }
};

/// A vertex of the mesh. Where faces meet, each knows it by a place of its own.
struct Vertex {
  Neighbourhood around;
  std::uint32_t surface;
  KernelRadii radii{};
};

/// A triangle of a face, to be split or done.
struct Piece {
  std::uint32_t face;
  MeshTriangle triangle;
};

/// Does a point of the domain lie on its edge `k`?
bool lies_on(bool quad, int k, const Vec2& st) {
  if (k == 0) return st.y == 0;
  if (k == 1) return quad ? st.x == 1 : st.x + st.y == 1;
  return quad && k == 2 ? st.y == 1 : st.x == 0;
}

/// Where a point of an edge lies between its ends, and the inverse. Exact for what halving makes of them.
float along_edge(bool quad, int k, const Vec2& st) {
  if (k == 0) return st.x;
  if (k == 1) return st.y;
  return quad && k == 2 ? 1 - st.x : 1 - st.y;
}
Vec2 on_edge(bool quad, int k, float t) {
  if (k == 0) return {t, 0};
  if (k == 1) return quad ? Vec2(1, t) : Vec2(1 - t, t);
  return quad && k == 2 ? Vec2(1 - t, 1) : Vec2(0, 1 - t);
}

class MeshBuilder {
 public:
  MeshBuilder(PrepareContext& context, const SortedPhotons& sorted, const PhotonMeshOptions& options)
      : context_(context),
        sorted_(sorted),
        patches_(*sorted.patches),
        options_(options),
        area_(context, context.scene().data()),
        surfaces_(sorted.surface_count()) {
    normals_.resize(patches_.size());
    for (std::uint32_t p = 0; p < patches_.size(); ++p) {
      const SurfaceCell cell = patches_.surface(p);
      normals_[p] = glm::normalize(glm::cross(cell.a, cell.b));
    }
  }

  TriMesh build() {
    sort_photons();
    std::vector<Piece> pieces = whole_faces();
    for (int level = 0; !pieces.empty(); ++level) {
      choose_radii();
      std::vector<Piece> next;
      for (const Piece& piece : pieces) split(piece, level < kMaxLevels, next);
      pieces.swap(next);
    }
    return estimate();
  }

 private:
  void sort_photons() {
    const auto sort = [&](std::size_t i) {
      surfaces_[i].emplace(context_, area_, sorted_, static_cast<std::uint32_t>(i), options_.neighbours, options_.max_radius);
    };
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
      if (sorted_.on(i).size() > kManyPhotons) sort(i);
    context_.parallel_for(surfaces_.size(), [&](Tracer&, std::size_t i) {
      if (!sorted_.on(i).empty() && !surfaces_[i]) sort(i);
    });
  }

  /// The triangles of all lit faces, whose corners are the first vertices: one where faces of a surface meet.
  std::vector<Piece> whole_faces() {
    std::vector<Place> corners;
    std::unordered_map<Place, std::uint32_t, PlaceHash> number;
    for (std::uint32_t face = 0; face < patches_.face_count(); ++face) {
      if (!surfaces_[sorted_.surface_of_face(face)]) continue;
      const DomainCell domain = patches_.domain(face / 2);
      for (int k = 0; k < domain.corner_count(); ++k) {
        number[{face, domain.corner(k)}] = static_cast<std::uint32_t>(corners.size());
        corners.push_back({face, domain.corner(k)});
      }
    }
    DisjointSets sets(corners.size());
    for (std::uint32_t i = 0; i < corners.size(); ++i)
      for (int k = 0; k < 4; ++k)
        if (const std::optional<Place> there = across(corners[i], k)) sets.join(i, number.at(*there));
    std::uint32_t count = 0;
    const std::vector<std::uint32_t> vertex = sets.labels(count);
    std::vector<Vec3> normals(count, Vec3(0));
    for (std::uint32_t i = 0; i < corners.size(); ++i) normals[vertex[i]] += normals_[corners[i].face / 2];
    for (std::uint32_t i = 0; i < corners.size(); ++i)
      if (vertex[i] == vertices_.size()) add_vertex(corners[i], normals[vertex[i]]);

    std::vector<Piece> pieces;
    for (std::uint32_t i = 0; i < corners.size();) {
      const std::uint32_t face = corners[i].face;
      const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        pieces.push_back({face, {{corners[a].st, corners[b].st, corners[c].st}, {vertex[a], vertex[b], vertex[c]}}});
      };
      const bool quad = patches_.quad(face / 2);
      add(i, i + 1, i + 2);
      if (quad) add(i, i + 2, i + 3);
      i += quad ? 4 : 3;
    }
    return pieces;
  }

  /// `normal`: of the front, of any length.
  std::uint32_t add_vertex(const Place& at, const Vec3& normal) {
    const SurfaceCell cell = patches_.surface(at.face / 2);
    const bool front = Patches::is_front(at.face);
    const Vec3 p = cell.o + at.st.x * cell.a + at.st.y * cell.b, n = glm::normalize(normal);
    vertices_.push_back({{p, front ? n : -n, front}, sorted_.surface_of_face(at.face)});
    return static_cast<std::uint32_t>(vertices_.size() - 1);
  }

  /// A place on edge `k` of its face, as the neighbour behind it knows it; none, if it is not on the edge or nothing is behind.
  std::optional<Place> across(const Place& at, int k) const {
    const std::uint32_t patch = at.face / 2;
    const bool quad = patches_.quad(patch);
    if (k >= (quad ? 4 : 3) || !lies_on(quad, k, at.st)) return {};
    const std::uint32_t neighbour = patches_.neighbour(patch, k);
    if (neighbour == Patches::kNone) return {};
    const Vec2 st = on_edge(patches_.quad(neighbour / 4), static_cast<int>(neighbour % 4), 1 - along_edge(quad, k, at.st));
    return Place{Patches::face(neighbour / 4, Patches::is_front(at.face)), st};
  }

  /// Chooses the kernels of the vertices that are new.
  void choose_radii() {
    const std::size_t begin = chosen_;
    chosen_ = vertices_.size();
    context_.for_chunks(chosen_ - begin, 64, [&](std::size_t from, std::size_t to, Tracer&) {
      for (std::size_t i = begin + from; i < begin + to; ++i)
        vertices_[i].radii = surfaces_[vertices_[i].surface]->radii(vertices_[i].around);
    });
  }

  /// Is an edge longer than the kernels at its ends allow? Both sides of it agree, so there are no cracks.
  bool too_long(std::uint32_t a, std::uint32_t b) const {
    const Vertex& p = vertices_[a];
    const Vertex& q = vertices_[b];
    return glm::distance(p.around.point, q.around.point) > options_.spacing * 0.5f * (p.radii.mean() + q.radii.mean());
  }

  /// The vertex in the middle of an edge.
  std::uint32_t middle(const Place& at) {
    Place owner = at;
    Vec3 normal = normals_[at.face / 2];
    for (int k = 0; k < 4; ++k) {
      const std::optional<Place> there = across(at, k);
      if (!there) continue;
      normal += normals_[there->face / 2];
      if (there->face < owner.face) owner = *there;
    }
    const auto [found, is_new] = middle_at_.try_emplace(owner, 0);
    if (is_new) found->second = add_vertex(owner, normal);
    return found->second;
  }

  /// Splits a triangle at the middles of its edges that are too long, or is done with it.
  void split(const Piece& piece, bool may_split, std::vector<Piece>& next) {
    const MeshTriangle& t = piece.triangle;
    bool is_long[3];
    int count = 0;
    for (int k = 0; k < 3; ++k) count += is_long[k] = may_split && too_long(t.vertex[k], t.vertex[(k + 1) % 3]);
    if (count == 0) {
      done_.push_back(piece);
      return;
    }
    // Corners a, b, c such that, of one or two long edges, the one unlike the others is ab.
    int first = 0;
    while (count < 3 && is_long[first] != (count == 1)) ++first;
    struct Node {
      Vec2 st;
      std::uint32_t vertex;
    };
    const auto corner = [&](int k) { return Node{t.corner[(first + k) % 3], t.vertex[(first + k) % 3]}; };
    const auto between = [&](const Node& p, const Node& q) {
      const Vec2 st = 0.5f * (p.st + q.st);
      return Node{st, middle({piece.face, st})};
    };
    const auto add = [&](const Node& p, const Node& q, const Node& r) {
      next.push_back({piece.face, {{p.st, q.st, r.st}, {p.vertex, q.vertex, r.vertex}}});
    };
    const Node a = corner(0), b = corner(1), c = corner(2);
    if (count == 1) {
      const Node ab = between(a, b);
      add(a, ab, c);
      add(ab, b, c);
      return;
    }
    const Node bc = between(b, c), ca = between(c, a);
    add(ca, bc, c);
    if (count == 2) {
      add(a, b, bc);
      add(a, bc, ca);
      return;
    }
    const Node ab = between(a, b);
    add(a, ab, ca);
    add(ab, b, bc);
    add(ab, bc, ca);
  }

  /// Does something solid stand on the point? Then rays from there hit backs of surfaces.
  bool buried(Tracer& tracer, const Neighbourhood& around) const {
    constexpr int kRays = 8, kMost = 1;  // of them, so many may hit something else
    const Frame frame = make_frame(around.normal);
    const SurfacePosition from{around.point, position_error(glm::abs(around.point)), around.normal};
    int others = 0;
    for (int i = 0; i < kRays && others <= kMost; ++i) {
      const float phi = 2 * kPi / kRays * static_cast<float>(i), z = 0.5f, r = std::sqrt(1 - z * z);
      const Vec3 direction = frame.to_world({r * std::cos(phi), r * std::sin(phi), z});
      const Hit hit = tracer.intersect(spawn_ray(from, direction), 0, options_.node, RayKind::gather);
      SurfacePosition at;
      if (hit.found()) tracer.scene().locate(hit, at);
      if (!hit.found() || glm::dot(at.ng, direction) < 0) ++others;
    }
    return others <= kMost;
  }

  TriMesh estimate() {
    std::vector<Color> irradiances(vertices_.size());
    std::vector<std::uint8_t> is_buried(vertices_.size(), 0);
    context_.for_chunks(vertices_.size(), 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vertex& v = vertices_[i];
        irradiances[i] = surfaces_[v.surface]->irradiance(v.around, v.radii);
        is_buried[i] = is_black(irradiances[i]) && buried(tracer, v.around) ? 1 : 0;
      }
    });

    // The light goes on below what stands on a surface, as far as triangles reach: no dark rims.
    std::vector<Vec4> beside(vertices_.size(), Vec4(0));
    for (const Piece& piece : done_)
      for (const std::uint32_t v : piece.triangle.vertex)
        for (const std::uint32_t w : piece.triangle.vertex)
          if (is_buried[v] && !is_buried[w]) beside[v] += Vec4(irradiances[w], 1);
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      if (beside[i].w > 0) irradiances[i] = Color(beside[i]) / beside[i].w;

    TriMesh mesh(sorted_.patches);
    for (const Color& E : irradiances) mesh.add_vertex(E);

    std::stable_sort(done_.begin(), done_.end(), [](const Piece& x, const Piece& y) { return x.face < y.face; });
    std::vector<MeshTriangle> triangles;
    for (std::size_t i = 0; i < done_.size(); ++i) {
      triangles.push_back(done_[i].triangle);
      if (i + 1 < done_.size() && done_[i + 1].face == done_[i].face) continue;
      mesh.add_triangles(done_[i].face, triangles);
      triangles.clear();
    }
    mesh.finish(context_.workers());
    return mesh;
  }

  PrepareContext& context_;
  const SortedPhotons& sorted_;
  const Patches& patches_;
  const PhotonMeshOptions options_;
  SurfaceArea area_;
  std::vector<std::optional<SurfaceDensity>> surfaces_;  // none: without photons
  std::vector<Vec3> normals_;                            // by patch, of its front
  std::vector<Vertex> vertices_;
  std::size_t chosen_ = 0;                                         // vertices that have their radii
  std::unordered_map<Place, std::uint32_t, PlaceHash> middle_at_;  // vertices that halved an edge
  std::vector<Piece> done_;
};

}  // namespace

TriMesh photon_mesh(PrepareContext& context, const SortedPhotons& sorted, const PhotonMeshOptions& options) {
  return MeshBuilder(context, sorted, options).build();
}

}  // namespace ln
