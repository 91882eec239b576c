#pragma once
// What radiosity exchanges light between: cells of faces, and clusters of faces.
//
// Only faces that can see, over however many others, one on which light arrives take part: not the inside of closed solids.
// They are numbered by their places in the tree of clusters, so that a cluster holds a run of them; face i has element i as its
// whole.

#include <cmath>
#include <vector>

#include "ln/form_factor.hpp"
#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"
#include "ln/radiosity.hpp"

namespace ln::radiosity {

/// An element, or with the highest bit set a cluster.
using NodeRef = std::uint32_t;
inline constexpr NodeRef kClusterBit = 0x80000000u, kNoNode = 0xffffffffu;
inline bool is_cluster(NodeRef n) { return (n & kClusterBit) != 0; }
inline std::uint32_t cluster_index(NodeRef n) { return n & ~kClusterBit; }

struct Face {
  std::uint32_t id = 0;      // of Patches
  NodeRef parent = kNoNode;  // cluster
  bool receives = false;     // what arrives here is wanted, or scattered
  bool scatters = false;
  bool albedo_varies = false;
  bool enclosed = false;  // all that it sees are surfaces
  Color albedo{0};        // where it does not vary
  bool doubled = false;   // another surface coincides with it, somewhere
};

/// A cell of a face. Elements stand behind their parents.
struct Element {
  FlatCell flat;
  DomainCell domain;
  std::uint32_t face = 0;  // number of the Face
  std::uint32_t parent = kNoNode;
  std::uint32_t children = 0;  // the first of four; 0: a leaf
  int depth = 0;
  Color source{0};      // irradiance that was there before [W/m^2]
  Color albedo{0};      // of a leaf, times its outermost
  float outermost = 1;  // share of it that rays meet; they miss the rest, for another surface coincides with it

  bool leaf() const { return children == 0; }
};

struct Cluster {
  Vec3 center{0};
  float radius = 0, area = 0;
  float largest_projected_area = 0;
  std::uint32_t first = 0, count = 0;  // faces
  NodeRef child[2] = {kNoNode, kNoNode};
  NodeRef parent = kNoNode;
  std::uint32_t lobes = kNoNode;  // number of its Lobes, if it is a large one
  bool receives = false;
};

/// Directions are told apart by their largest component and all signs.
inline constexpr std::uint32_t kLobes = 24;
inline std::uint32_t lobe_of(const Vec3& d) {
  const Vec3 size(std::abs(d.x), std::abs(d.y), std::abs(d.z));
  const std::uint32_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return axis * 8 + (d.x < 0 ? 4u : 0u) + (d.y < 0 ? 2u : 0u) + (d.z < 0 ? 1u : 0u);
}
/// A direction in the middle of them.
inline Vec3 lobe_axis(std::uint32_t lobe) {
  Vec3 d(0.41f);
  d[static_cast<int>(lobe / 8)] = 1;
  for (int axis = 0; axis < 3; ++axis)
    if (lobe & 4u >> axis) d[axis] = -d[axis];
  return glm::normalize(d);
}

/// The faces of a large cluster, summed up by the directions of their normals.
struct Lobes {
  std::uint32_t cluster = 0;
  Vec3 area_normal[kLobes] = {};  // sum of areas times normals
  float area[kLobes] = {};
};

class Hierarchy {
 public:
  Hierarchy(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options);

  bool empty() const { return faces.empty(); }
  NodeRef root() const { return clusters.empty() ? NodeRef{0} : kClusterBit; }

  Vec3 center(NodeRef n) const { return is_cluster(n) ? clusters[cluster_index(n)].center : elements[n].flat.cell.center(); }
  float radius(NodeRef n) const { return is_cluster(n) ? clusters[cluster_index(n)].radius : elements[n].flat.radius; }
  float area(NodeRef n) const { return is_cluster(n) ? clusters[cluster_index(n)].area : elements[n].flat.area; }
  /// Sum of the areas that are seen from far off in `direction`, also one behind the other.
  float projected_area(NodeRef n, const Vec3& direction) const;
  /// The same for the direction where it is largest, about.
  float largest_projected_area(NodeRef n) const {
    return is_cluster(n) ? clusters[cluster_index(n)].largest_projected_area : elements[n].flat.area;
  }
  bool receives(NodeRef n) const {
    return is_cluster(n) ? clusters[cluster_index(n)].receives : faces[elements[n].face].receives;
  }

  /// Are surfaces all that the face of an element sees?
  bool enclosed(std::uint32_t element) const { return faces[elements[element].face].enclosed; }

  /// May the element be cut?
  bool divisible(std::uint32_t element) const {
    return !elements[element].leaf() ||
           (elements[element].flat.area > smallest_area_ && elements[element].depth < QuadTree::kMaxDepth);
  }
  /// Cuts a leaf into four; the albedo of its children is to be measured.
  void divide(std::uint32_t element);
  /// What elements would shine if all surfaces had radiosity 1.
  std::vector<Color> uniform_shine() const;
  /// Albedos of leaves from `first` on, and how much of them is outermost.
  void measure_leaves(std::size_t first);

  /// A point of an element.
  struct Place {
    std::uint32_t element;
    Vec2 st;  // relative to its cell: o + st.x a + st.y b
    Vec3 p;
  };
  /// One of an element or of a cluster, from random numbers.
  Place place(NodeRef n, float pick, const Vec2& u) const;
  Place place(std::uint32_t element, const Vec2& st) const {
    const SurfaceCell& cell = elements[element].flat.cell;
    return {element, st, cell.o + st.x * cell.a + st.y * cell.b};
  }
  Place middle(std::uint32_t element) const {
    return place(element, elements[element].domain.quad ? Vec2(0.5f) : Vec2(1.0f / 3));
  }
  /// For rays from there.
  SurfacePosition locate(const Place& place) const;

  std::vector<Face> faces;
  std::vector<Element> elements;
  std::vector<Cluster> clusters;   // behind their parents
  std::vector<Vec3> area_normals;  // by face
  std::vector<std::uint8_t> lobe_of_face;
  std::vector<Lobes> lobes;  // of large clusters, in their order

 private:
  void find_faces(const QuadTree& in, const RadiosityOptions& options);
  void add_face(std::uint32_t id, const RadiosityOptions& options);
  NodeRef build(std::vector<std::uint32_t>& order, std::uint32_t begin, std::uint32_t end, NodeRef parent);
  void add_elements(const QuadTree& in);
  void sum_up_lobes();

  PrepareContext& context_;
  NodeId node_;
  const Patches& patches_;
  float smallest_area_;
  std::vector<std::uint8_t> enclosed_, doubled_;  // by face of Patches
  std::vector<double> area_before_;               // sum of the areas of the faces before
};

}  // namespace ln::radiosity
