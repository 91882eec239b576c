#pragma once
// Primitives to triangles in world space.

#include <array>
#include <vector>

#include "gltf_accessor.hpp"
#include "gltf_materials.hpp"
#include "gltf_nodes.hpp"

namespace ln::gltf {

/// A mesh where a node puts it: once, or several times (EXT_mesh_gpu_instancing).
struct Placement {
  Json node, mesh;
  std::vector<Affine> worlds;
  const std::vector<Affine>* joints = nullptr;  // of the node's skin at rest; they replace the worlds
};

/// How much a mesh will need, from its accessors' counts alone.
struct MeshSize {
  double triangles = 0, vertices = 0, bytes = 0;
};

/// Writes triangles into the SceneData, but for the positions: those stay in double precision until the box is known.
class MeshWriter {
 public:
  MeshWriter(Model& model, SceneData& scene) : model_(model), scene_(scene), materials_(model, scene) {}

  MeshSize measure(Json mesh) const;
  void add(const Placement& placement);
  /// Throws Error if a mesh that no node uses breaks the rules.
  void check(Json mesh);

  MaterialReader& materials() { return materials_; }
  /// Makes room for what is to come.
  void reserve(const MeshSize& size);
  /// World position of each vertex.
  std::vector<DVec3>& world() { return world_; }

 private:
  struct Target {
    double weight = 0;
    Accessor position, normal, tangent;
  };
  struct Attributes {
    Accessor position, normal, tangent, color;
    std::array<Accessor, 2> uv;
    std::vector<Accessor> joints, weights;
    std::vector<Target> targets;
  };

  void add_primitive(Json primitive, const Placement& placement);
  Attributes read_attributes(Json primitive, const Placement& placement, const UvSets& sets);
  void require_count(Json attributes, std::size_t wanted) const;
  Accessor attribute(Json attributes, std::string_view name, std::string_view types, unsigned formats,
                     unsigned quantized_formats);
  bool read_corners(Json primitive, std::size_t vertex_count);
  void number_vertices(std::size_t vertex_count);
  Affine skin_transform(const Attributes& attributes, const std::vector<Affine>& joints, const Affine& world,
                        std::size_t vertex) const;
  void append_part(Part part, const Attributes& attributes, const Affine& world, const std::vector<Affine>* joints,
                   bool is_strip);
  void append_vertex(const Attributes& attributes, const Part& part, const Affine& transform,
                     const glm::dmat3& normal_transform, std::size_t vertex);
  void append_triangles(const std::vector<bool>& mirrored, std::uint32_t first_vertex, bool is_strip);

  Model& model_;
  SceneData& scene_;
  MaterialReader materials_;
  std::vector<DVec3> world_;

  // Of the primitive at hand, kept to reuse their memory.
  std::vector<std::uint32_t> corners_;   // vertex of each triangle's corners: first the file's number, then ours
  std::vector<std::uint32_t> vertices_;  // the file's number of each vertex of ours
  std::vector<std::uint32_t> numbers_, stamps_;
  std::uint32_t stamp_ = 0;
};

}  // namespace ln::gltf
