// Taps of irradiance that is stored on surfaces: coloured triangles.

#include <string>

#include "glb_writer.hpp"
#include "ln/progress.hpp"
#include "ln/quad_tree.hpp"
#include "ln/tap.hpp"
#include "ln/tri_mesh.hpp"

namespace ln {

namespace {

/// Triangles with irradiance [W/m^2] at their vertices, in normalised coordinates.
struct ColouredMesh {
  std::vector<Vec3> positions;
  std::vector<Color> irradiance;
  std::vector<std::uint32_t> indices;
  double luminance = 0, area = 0;  // integral of the luminance, and of 1

  std::uint32_t vertex(const Vec3& position, const Color& value) {
    positions.push_back(position);
    irradiance.push_back(value);
    return static_cast<std::uint32_t>(positions.size() - 1);
  }

  void triangle(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    indices.insert(indices.end(), {i, j, k});
    const auto size =
        static_cast<double>(0.5f * glm::length(glm::cross(positions[j] - positions[i], positions[k] - positions[i])));
    area += size;
    luminance += size * static_cast<double>(ln::luminance((irradiance[i] + irradiance[j] + irradiance[k]) / 3.0f));
  }
};

/// How far backs are moved off their fronts, so that neither hides the other [normalised units].
constexpr float kLift = 2e-5f;

/// Fronts and backs as two meshes with colours that any viewer shows, and the irradiance itself beside them.
void write_glb(const TapFile& tap, const ColouredMesh (&sides)[2]) {
  const double area = sides[0].area + sides[1].area;
  const float exposure = gltf::exposure_of(area > 0 ? (sides[0].luminance + sides[1].luminance) / area : 0);
  gltf::GlbWriter writer({{"network", tap.network},
                          {"wire", tap.info.wire},
                          {"lightPaths", tap.info.light_paths},
                          {"exposure", exposure},
                          {"colours", "irradiance * exposure, cut off at 1; _IRRADIANCE holds it uncut"},
                          {"unit", "W/m^2"}});
  if (area == 0) note(std::string(tap.info.file) + ": nothing on this wire is lit, so the file is empty");
  const int material = area > 0 ? writer.add_unlit_material("irradiance") : 0;
  for (const ColouredMesh& mesh : sides) {
    if (mesh.indices.empty()) continue;
    std::vector<Color> colours;
    colours.reserve(mesh.irradiance.size());
    for (const Color& value : mesh.irradiance) colours.push_back(glm::clamp(value * exposure, 0.0f, 1.0f));
    writer.add_mesh(&mesh == sides ? "front" : "back",
                    {{"attributes",
                      {{"POSITION", writer.add_positions(mesh.positions)},
                       {"COLOR_0", writer.add(std::span<const Color>(colours))},
                       {"_IRRADIANCE", writer.add(std::span<const Color>(mesh.irradiance))}}},
                     {"indices", writer.add_indices(mesh.indices)},
                     {"material", material}},
                    tap.scene);
  }
  writer.write(tap.info.file);
}

Vec3 lift(const SurfaceCell& patch, bool front) {
  return front ? Vec3(0) : -kLift * glm::normalize(glm::cross(patch.a, patch.b));
}

}  // namespace

void write_tap(const TapFile& tap, const QuadTree& tree) {
  ColouredMesh sides[2];
  for (std::uint32_t face = 0; !tree.empty() && face < tree.patches().face_count(); ++face) {
    const bool front = Patches::is_front(face);
    const SurfaceCell patch = tree.patches().surface(face / 2);
    const Vec3 off = lift(patch, front);
    ColouredMesh& mesh = sides[face % 2];
    tree.for_each_leaf(face, [&](const DomainCell& cell, const Color& irradiance) {
      const SurfaceCell place = surface_cell(patch, cell);
      std::uint32_t corners[4] = {};
      for (int k = 0; k < place.corner_count(); ++k) corners[k] = mesh.vertex(place.corner(k) + off, irradiance);
      for (int k = 2; k < place.corner_count(); ++k)
        front ? mesh.triangle(corners[0], corners[k - 1], corners[k]) : mesh.triangle(corners[0], corners[k], corners[k - 1]);
    });
  }
  write_glb(tap, sides);
}

void write_tap(const TapFile& tap, const TriMesh& triangles) {
  ColouredMesh sides[2];
  for (std::uint32_t face = 0; !triangles.empty() && face < triangles.patches().face_count(); ++face) {
    const bool front = Patches::is_front(face);
    const SurfaceCell patch = triangles.patches().surface(face / 2);
    const Vec3 off = lift(patch, front);
    ColouredMesh& mesh = sides[face % 2];
    for (const MeshTriangle& t : triangles.triangles(face)) {
      std::uint32_t corners[3];
      for (int k = 0; k < 3; ++k)
        corners[k] =
            mesh.vertex(patch.o + t.corner[k].x * patch.a + t.corner[k].y * patch.b + off, triangles.vertices()[t.vertex[k]]);
      const Vec2 a = t.corner[1] - t.corner[0], b = t.corner[2] - t.corner[0];
      const bool counter_clockwise = a.x * b.y - a.y * b.x > 0;
      counter_clockwise == front ? mesh.triangle(corners[0], corners[1], corners[2])
                                 : mesh.triangle(corners[0], corners[2], corners[1]);
    }
  }
  write_glb(tap, sides);
}

}  // namespace ln
