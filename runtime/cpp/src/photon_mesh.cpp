#include "ln/photon_mesh.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <tuple>
#include <unordered_map>

#include "ln/disjoint_sets.hpp"
#include "ln/error.hpp"
#include "ln/stats.hpp"
#include "ln/surface_density.hpp"
#include "ln/text.hpp"
#include "mesh_sites.hpp"

namespace ln {

namespace {

/// Edges are halved so many times at most: far below what photons can tell, and domain coordinates remain exact.
constexpr int kMaxLevels = 20;

/// A wall is what stands at this height [radii of the kernel] across the way between two points, not along it; at least so far
/// from both [distances between them].
constexpr float kWallHeight = 0.02f, kWallMinCos = 0.05f, kWallInset = 1e-3f;
/// Edges below a wall are halved down to this share of the length that others may have.
constexpr float kWallSpacing = 1.0f / 32;
/// Vertices below a wall are seen from points that are so far to its sides [radii; ways to the middle of a triangle, at most].
constexpr float kWallOffset = 0.02f, kWallMaxOffset = 0.25f;

/// Irradiances that differ by more [standard errors] are of different light.
constexpr float kDifferent = 4;

/// So much memory a triangle takes while the mesh is made, its share of vertices and edges included.
constexpr double kTriangleBytes = 256;

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

/// Of a triangle's edges, from corner k to the next: are they to be halved?
using LongEdges = std::array<bool, 3>;

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
        area_(context, context.scene().data(), sorted.sheet_of_triangle),
        surfaces_(sorted.surface_count()) {
    normals_.resize(patches_.size());
    for (std::uint32_t p = 0; p < patches_.size(); ++p) {
      const SurfaceCell cell = patches_.surface(p);
      normals_[p] = glm::normalize(glm::cross(cell.a, cell.b));
    }
  }

  TriMesh build() {
    sort_photons();
    check_size();
    std::vector<Piece> pieces = whole_faces();
    choose_sites(pieces);
    for (int level = 0; !pieces.empty(); ++level) {
      choose_radii();
      const std::vector<LongEdges> long_edges = find_long_edges(pieces, level);
      std::vector<Piece> next;
      for (std::size_t i = 0; i < pieces.size(); ++i) split(pieces[i], long_edges[i], next);
      pieces.swap(next);
    }
    part_at_walls();
    const std::vector<std::vector<std::uint32_t>> around = neighbours();
    pool_radii(around);
    return estimate(around);
  }

 private:
  void sort_photons() {
    const auto sort = [&](std::size_t i) {
      surfaces_[i].emplace(context_, area_, sorted_, static_cast<std::uint32_t>(i), options_.kernels);
    };
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
      if (sorted_.on(i).size() > kManyPhotons) sort(i);
    context_.parallel_for(surfaces_.size(), [&](Tracer&, std::size_t i) {
      if (!sorted_.on(i).empty() && !surfaces_[i]) sort(i);
    });
  }

  /// Narrow kernels that photons do not call for would make more triangles than there is memory for: an edge is as long as
  /// the widest allows, at most.
  void check_size() const {
    if (options_.kernels.max_radius == 0) return;
    const double edge = static_cast<double>(options_.spacing) * static_cast<double>(options_.kernels.max_radius);
    const double largest = std::sqrt(3.0) / 4 * edge * edge;  // area of a triangle
    double least = 0;
    for (std::uint32_t face = 0; face < patches_.face_count(); ++face) {
      const std::optional<SurfaceDensity>& surface = surfaces_[sorted_.surface_of_face(face)];
      if (surface && !surface->even()) least += static_cast<double>(area(patches_.surface(face / 2))) / largest;
    }
    const std::uint64_t limit = available_memory_bytes() / 3;
    if (least * kTriangleBytes > static_cast<double>(limit))
      throw Error("kernels of this 'radius' need a mesh that takes more than " + bytes_text(least * kTriangleBytes) +
                  " of memory, and only " + bytes_text(static_cast<double>(limit)) +
                  " may be used for it: raise 'radius' or 'spacing' of SurfaceDE");
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

  /// Chooses the kernels of whole faces' vertices, and which of these are estimated.
  void choose_sites(const std::vector<Piece>& pieces) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Piece& piece : pieces) {
      const std::uint32_t* const v = piece.triangle.vertex;
      for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(v[k], v[(k + 1) % 3]);
    }
    sites_ = MeshSites(
        context_, vertices_, edges, options_.spacing,
        [&](const MeshVertex& v) { return surfaces_[v.surface]->radii(v.around); },
        [&](const MeshVertex& p, const MeshVertex& q, Tracer& tracer) {
          const float radius = p.radii.mean();
          return !std::isfinite(radius) ||
                 !wall_between(p.around.point, q.around.point, p.around.normal, q.around.normal, kWallHeight * radius, tracer);
        });
    chosen_ = vertices_.size();
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

  /// Is an edge longer than the wider kernel at its ends allows, or a wall across it? Both sides of it agree, so there are no
  /// cracks. The wider one: a kernel that is narrow by chance is alone, and calls for no finer mesh. Where the light differs,
  /// the narrower one, which tells on which side of the difference its end is.
  bool too_long(std::uint32_t a, std::uint32_t b, Tracer& tracer) const {
    if (a > b) std::swap(a, b);
    const MeshVertex& p = vertices_[a];
    const MeshVertex& q = vertices_[b];
    const float noise = std::hypot(p.radii.sigma, q.radii.sigma), length = glm::distance(p.around.point, q.around.point);
    const auto [narrower, wider] = std::minmax({p.radii.mean(), q.radii.mean()});
    if (length > options_.spacing * (std::abs(p.radii.E - q.radii.E) > kDifferent * noise ? narrower : wider)) return true;
    if (!(length > kWallSpacing * options_.spacing * wider)) return false;
    return wall_between(p.around.point, q.around.point, p.around.normal, q.around.normal, kWallHeight * wider, tracer);
  }

  /// Does a wall stand between two points of a surface with these normals? What goes on from the first is none.
  bool wall_between(const Vec3& a, const Vec3& b, const Vec3& normal_a, const Vec3& normal_b, float height,
                    Tracer& tracer) const {
    const Vec3 start = a + height * normal_a, way = b + height * normal_b - start;
    const float length = glm::length(way);
    if (!(length > 0)) return false;
    const Vec3 direction = way / length;
    const Ray ray{start + kWallInset * way, direction, (1 - 2 * kWallInset) * length};
    const Hit hit = tracer.intersect(ray, 0, options_.node, RayKind::shadow);
    SurfacePosition wall;
    if (hit.found()) tracer.scene().locate(hit, wall);
    return hit.found() && std::abs(glm::dot(wall.ng, direction)) > kWallMinCos &&
           !(std::abs(glm::dot(wall.ng, normal_a)) > Neighbourhood::kMinCos);
  }

  /// By piece.
  std::vector<LongEdges> find_long_edges(const std::vector<Piece>& pieces, int level) {
    std::vector<LongEdges> found(pieces.size(), LongEdges{});
    if (level == kMaxLevels) return found;
    context_.for_chunks(pieces.size(), 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t* const v = pieces[i].triangle.vertex;
        for (std::size_t k = 0; k < 3; ++k) found[i][k] = too_long(v[k], v[(k + 1) % 3], tracer);
      }
    });
    return found;
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
  void split(const Piece& piece, const LongEdges& is_long, std::vector<Piece>& next) {
    const MeshTriangle& t = piece.triangle;
    const auto count = std::count(is_long.begin(), is_long.end(), true);
    if (count == 0) {
      done_.push_back(piece);
      return;
    }
    // Corners a, b, c such that, of one or two long edges, the one unlike the others is ab.
    std::size_t first = 0;
    while (count < 3 && is_long[first] != (count == 1)) ++first;
    struct Node {
      Vec2 st;
      std::uint32_t vertex;
    };
    const auto corner = [&](std::size_t k) { return Node{t.corner[(first + k) % 3], t.vertex[(first + k) % 3]}; };
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

  /// A point near a triangle's corner, inside of it.
  Vec3 inside(const Piece& piece, std::size_t k) const {
    const std::uint32_t* const v = piece.triangle.vertex;
    const MeshVertex& corner = vertices_[v[k]];
    const Vec3 middle = (vertices_[v[0]].around.point + vertices_[v[1]].around.point + vertices_[v[2]].around.point) / 3.0f;
    const Vec3 way = middle - corner.around.point;
    return corner.around.point + std::min(kWallMaxOffset, kWallOffset * corner.radii.mean() / glm::length(way)) * way;
  }

  /// An edge of a triangle: its vertices, the lesser first, and the triangle's corners there, 3 * piece + corner.
  struct Edge {
    std::uint32_t low, high, at_low, at_high;
  };

  /// Those of all triangles; the same edge of two triangles one after the other.
  std::vector<Edge> sorted_edges() const {
    std::vector<Edge> edges;
    edges.reserve(3 * done_.size());
    for (std::uint32_t i = 0; i < done_.size(); ++i) {
      const std::uint32_t* const v = done_[i].triangle.vertex;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t next = (k + 1) % 3;
        if (v[k] < v[next])
          edges.push_back({v[k], v[next], 3 * i + k, 3 * i + next});
        else
          edges.push_back({v[next], v[k], 3 * i + next, 3 * i + k});
      }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
      return std::tie(x.low, x.high, x.at_low) < std::tie(y.low, y.high, y.at_low);
    });
    return edges;
  }

  std::uint32_t& vertex_at(std::uint32_t corner) { return done_[corner / 3].triangle.vertex[corner % 3]; }

  /// Does a wall stand between two triangles beside their common corner?
  bool parted(std::uint32_t x, std::uint32_t y, Tracer& tracer) const {
    const MeshVertex& vertex = vertices_[done_[x / 3].triangle.vertex[x % 3]];
    const float radius = vertex.radii.mean();
    const Vec3 n = vertex.around.normal;
    return std::isfinite(radius) &&
           wall_between(inside(done_[x / 3], x % 3), inside(done_[y / 3], y % 3), n, n, kWallHeight * radius, tracer);
  }

  /// Numbers the sides of all vertices: corners of neighbouring triangles that see each other are on the same side of a vertex.
  std::vector<std::uint32_t> side_of_corner(std::uint32_t& count) {
    const std::vector<Edge> edges = sorted_edges();
    std::vector<std::array<bool, 2>> joined(edges.size(), {false, false});  // with the edge before: at `low`, at `high`
    context_.for_chunks(edges.size(), 256, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = std::max<std::size_t>(begin, 1); i < end; ++i) {
        const Edge &e = edges[i], &before = edges[i - 1];
        if (e.low != before.low || e.high != before.high) continue;
        joined[i] = {!parted(before.at_low, e.at_low, tracer), !parted(before.at_high, e.at_high, tracer)};
      }
    });
    DisjointSets sets(3 * done_.size());
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (joined[i][0]) sets.join(edges[i - 1].at_low, edges[i].at_low);
      if (joined[i][1]) sets.join(edges[i - 1].at_high, edges[i].at_high);
    }
    return sets.labels(count);
  }

  /// Gives a vertex below a wall one copy for each side of it, each seen from the middle of points on that side.
  void part_at_walls() {
    std::uint32_t count = 0;
    const std::vector<std::uint32_t> side = side_of_corner(count);
    std::vector<std::uint32_t> vertex_of_side(count, Patches::kNone);
    std::vector<Vec4> seen_from(vertices_.size(), Vec4(0));
    std::vector<bool> is_known(vertices_.size(), false), has_sides(vertices_.size(), false);
    for (std::uint32_t x = 0; x < side.size(); ++x) {
      const std::uint32_t v = vertex_at(x);
      std::uint32_t& mine = vertex_of_side[side[x]];
      if (mine == Patches::kNone && !is_known[v]) {
        mine = v;
        is_known[v] = true;
      } else if (mine == Patches::kNone) {
        mine = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(MeshVertex(vertices_[v]));
        seen_from.emplace_back(0);
        has_sides.push_back(true);
        has_sides[v] = true;
      }
      seen_from[mine] += Vec4(inside(done_[x / 3], x % 3), 1);
    }
    for (std::uint32_t x = 0; x < side.size(); ++x) vertex_at(x) = vertex_of_side[side[x]];
    context_.for_chunks(vertices_.size(), 64, [&](std::size_t begin, std::size_t end, Tracer&) {
      for (std::size_t v = begin; v < end; ++v) {
        if (!has_sides[v]) continue;
        vertices_[v].around.point = Vec3(seen_from[v]) / seen_from[v].w;
        vertices_[v].radii = surfaces_[vertices_[v].surface]->radii(vertices_[v].around);
      }
    });
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      if (has_sides[v]) sites_.set_site(v);
  }

  /// Of each vertex, itself included: sites at the ends of its edges, and those that reach it.
  std::vector<std::vector<std::uint32_t>> neighbours() const {
    std::vector<std::vector<std::uint32_t>> around(vertices_.size());
    const auto add = [&](std::uint32_t v, std::uint32_t w) {
      if (sites_.is_site(w)) around[v].push_back(w);
    };
    for (std::uint32_t v = 0; v < around.size(); ++v) {
      add(v, v);
      for (const std::uint32_t w : sites_.reaching(v)) add(v, w);
    }
    for (const Piece& piece : done_)
      for (std::size_t k = 0; k < 3; ++k) add(piece.triangle.vertex[k], piece.triangle.vertex[(k + 1) % 3]);
    context_.workers().parallel_for(around.size(), 1024, [&](std::size_t v) {
      std::sort(around[v].begin(), around[v].end());
      around[v].erase(std::unique(around[v].begin(), around[v].end()), around[v].end());
    });
    return around;
  }

  /// Gives each vertex the median of its radii and its neighbours': kernels that are narrow by chance are few and apart, those
  /// along an edge of the light have each other.
  void pool_radii(const std::vector<std::vector<std::uint32_t>>& around) {
    std::vector<KernelRadii> pooled(vertices_.size());
    context_.workers().parallel_for(pooled.size(), 1024,
                                    [&](std::size_t v) { pooled[v] = median_radii(vertices_, around[v]); });
    for (std::size_t v = 0; v < vertices_.size(); ++v) vertices_[v].radii = pooled[v];
  }

  TriMesh estimate(const std::vector<std::vector<std::uint32_t>>& around) {
    std::vector<SurfaceIrradiance> estimates(vertices_.size());
    context_.for_chunks(vertices_.size(), 64, [&](std::size_t begin, std::size_t end, Tracer&) {
      for (std::size_t i = begin; i < end; ++i) {
        const MeshVertex& v = vertices_[i];
        if (sites_.is_site(static_cast<std::uint32_t>(i))) estimates[i] = surfaces_[v.surface]->irradiance(v.around, v.radii);
      }
    });
    std::vector<Color> irradiances(vertices_.size());
    context_.workers().parallel_for(irradiances.size(), 1024, [&](std::size_t i) {
      irradiances[i] = steadied(static_cast<std::uint32_t>(i), vertices_, estimates, around[i]);
    });
    std::vector<std::uint8_t> is_buried(vertices_.size(), 0);
    context_.for_chunks(vertices_.size(), 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) {
        const MeshVertex& v = vertices_[i];
        const auto number = static_cast<std::uint32_t>(i);
        if (!sites_.is_site(number)) irradiances[i] = sites_.fill(number, vertices_, irradiances);
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
  std::vector<MeshVertex> vertices_;
  MeshSites sites_;
  std::size_t chosen_ = 0;                                         // vertices that have their radii
  std::unordered_map<Place, std::uint32_t, PlaceHash> middle_at_;  // vertices that halved an edge
  std::vector<Piece> done_;
};

}  // namespace

TriMesh photon_mesh(PrepareContext& context, const SortedPhotons& sorted, const PhotonMeshOptions& options) {
  return MeshBuilder(context, sorted, options).build();
}

}  // namespace ln
