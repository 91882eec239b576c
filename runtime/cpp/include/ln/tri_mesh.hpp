#pragma once
// The TriMesh wire: irradiance at the vertices of triangles that lie in the parameter domains of patches, linear inside.
//
// To make one:   TriMesh mesh(patches);                          patches: std::make_shared<const Patches>(scene.data())
//                const uint32_t v = mesh.add_vertex(E);          irradiance [W/m^2]; any number of triangles, also those of
//                                                                neighbouring faces, may share a vertex
//                mesh.add_triangles(face, triangles);            once a face; Patches::face(patch, front)
//                mesh.finish(workers);                           sorts the triangles of each face for look-up
// To read it:    mesh.irradiance(hit.triangle, hit.u, hit.v, front)
//                for (const MeshTriangle& t : mesh.triangles(face)) ...  positions: patches.surface(patch), o + s a + t b
// A face without triangles is dark. Where the triangles of a face do not cover its domain, it is dark too.

#include <memory>
#include <span>
#include <vector>

#include "ln/parallel.hpp"
#include "ln/patches.hpp"

namespace ln {

struct TapFile;

struct MeshTriangle {
  Vec2 corner[3];           // in the domain of the patch
  std::uint32_t vertex[3];  // whose irradiance is that of the corner
};

class TriMesh {
 public:
  TriMesh() = default;
  explicit TriMesh(std::shared_ptr<const Patches> patches) : patches_(std::move(patches)), faces_(patches_->face_count()) {}

  std::uint32_t add_vertex(const Color& irradiance) {
    vertices_.push_back(irradiance);
    return static_cast<std::uint32_t>(vertices_.size() - 1);
  }
  void add_triangles(std::uint32_t face, std::span<const MeshTriangle> triangles);
  void finish(Workers& workers);

  const Patches& patches() const { return *patches_; }
  const std::shared_ptr<const Patches>& shared_patches() const { return patches_; }
  bool empty() const { return triangles_.empty(); }
  const std::vector<Color>& vertices() const { return vertices_; }
  /// All of a face; all of all faces.
  std::span<const MeshTriangle> triangles(std::uint32_t face) const {
    return {triangles_.data() + faces_[face].begin, faces_[face].count};
  }
  std::span<const MeshTriangle> triangles() const { return triangles_; }

  /// Irradiance [W/m^2] on one side of a point of a scene's triangle (barycentric u, v).
  Color irradiance(std::uint32_t triangle, float u, float v, bool front) const {
    if (empty()) return Color(0);
    const Patches::Location at = patches_->locate(triangle, u, v);
    return irradiance(Patches::face(at.patch, front), at.st);
  }
  Color irradiance(std::uint32_t face, const Vec2& st) const;

 private:
  static constexpr std::uint32_t kLeaf = 4;  // triangles that are looked at one after the other

  struct Face {
    std::uint32_t begin = 0, count = 0;  // triangles
    std::uint32_t tree = 0;              // first box, if count > kLeaf
  };
  /// Bounds of a run of triangles; a run longer than kLeaf has two halves: the next box, and the one at `right`.
  struct Box {
    Vec2 low, high;
    std::uint32_t right;
  };
  struct Search;

  std::uint32_t build(std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end);

  std::shared_ptr<const Patches> patches_;
  std::vector<Color> vertices_;
  std::vector<MeshTriangle> triangles_;
  std::vector<Face> faces_;
  std::vector<Box> boxes_;
};

/// .glb: the triangles, coloured at their vertices. Throws Error.
void write_tap(const TapFile& tap, const TriMesh& mesh);

}  // namespace ln
