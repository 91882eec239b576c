#pragma once
// What a glTF file says, as plain arrays: the loader writes it once, everything else only reads it.
//
// Coordinates are normalised: world position = origin + unit * position, where `origin` is the centre of the bounding box
// of all triangles and `unit` a power of two such that its half diagonal lies in (1/2, 1]. Radiances and directional
// intensities (irradiance) are independent of the unit; intensities of point and spot lights [W/sr] are stored divided
// by unit^2, attenuation distances divided by unit. A scene without triangles has origin 0 and unit 1; cameras and lights do
// not count for the box and may stand anywhere within kFarthest.

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "ln/math.hpp"

namespace ln {

/// So far from the middle, in normalised units, rays may begin; squares of such distances are still far from infinite.
constexpr float kFarthest = 1e12f;

inline bool within_reach(const Vec3& p) {
  return std::abs(p.x) <= kFarthest && std::abs(p.y) <= kFarthest && std::abs(p.z) <= kFarthest;
}

enum class Wrap : std::uint8_t { repeat, clamp, mirror };

/// Decoded image: `width * height * channels` values, row 0 at the top (v = 0). 8-bit data stays 8-bit; everything else is
/// float, linear and finite. Alpha is not premultiplied.
struct Image {
  int width = 0, height = 0, channels = 0;
  bool srgb = false;  // colour channels of 8-bit data are sRGB-encoded (alpha never is)
  std::vector<std::uint8_t> bytes;
  std::vector<float> floats;
};

/// A use of an image by a material; `image` < 0: none, the factor stands alone.
struct TextureRef {
  int image = -1;
  std::uint8_t uv_set = 0;  // index into SceneData::uvs
  Wrap wrap_s = Wrap::repeat, wrap_t = Wrap::repeat;
  bool nearest = false;
  /// KHR_texture_transform as rows of a 2x3 matrix: u' = dot(row0, (u, v, 1)).
  Vec3 row0{1, 0, 0}, row1{0, 1, 0};

  explicit operator bool() const { return image >= 0; }
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

struct Material {
  std::string name;
  std::vector<std::string> tags;  // `extras.tags`
  Color base_color{1};
  float alpha = 1;
  float metallic = 1, roughness = 1;
  float normal_scale = 1;
  Color emission{0};  // emissiveFactor * KHR_materials_emissive_strength [W/(m^2 sr)]; base colour if unlit
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
  bool unlit = false;  // emits only, black BSDF
  float ior = 1.5f;    // at least 1; the 0 that glTF allows for "reflects everything" is read as 1e4
  float transmission = 0;
  bool solid = false;  // KHR_materials_volume with thickness > 0: the surface bounds a solid; otherwise thin-walled
  Color attenuation_color{1};
  float attenuation_distance = kInfinity;
  float specular = 1;
  Color specular_color{1};
  TextureRef base_color_texture, metallic_roughness_texture, normal_texture, emissive_texture, transmission_texture,
      specular_texture, specular_color_texture;

  bool emits() const { return max_component(emission) > 0; }
  bool has_texture() const {
    return base_color_texture || metallic_roughness_texture || normal_texture || emissive_texture || transmission_texture ||
           specular_texture || specular_color_texture;
  }
};

/// A run of triangles of one glTF primitive under one node: the smallest thing that has a material and can be tagged.
struct Part {
  std::uint32_t first_triangle = 0, triangle_count = 0;
  std::uint32_t material = 0;
  bool has_normals = false, has_colors = false, has_tangents = false;
  std::string mesh, node;
  std::vector<std::string> tags;  // `extras.tags` of the node and the mesh
};

enum class PunctualKind : std::uint8_t { point, spot, directional };

struct PunctualLight {
  PunctualKind kind = PunctualKind::point;
  std::string name, node;
  std::vector<std::string> tags;
  Vec3 position{0};
  Vec3 direction{0, 0, -1};  // in which the light shines (spot, directional); unit length
  Color intensity{0};        // point, spot: radiant intensity / unit^2 [W/sr]; directional: irradiance [W/m^2]
  float cos_inner = 1, cos_outer = 0;
};

struct Camera {
  std::string name, node;
  bool orthographic = false;
  Vec3 position{0};
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  // unit length; without the node's scale
  float yfov = 0.8f;                                    // perspective [rad]
  float ymag = 1;                                       // orthographic: half the height, in normalised units
  float aspect = 0;                                     // width / height, 0: the picture's own
};

struct SceneData {
  DVec3 origin{0};
  double unit = 1;

  std::vector<Vec3> positions;
  std::vector<UVec3> triangles;              // front side: counter-clockwise, also under mirroring transforms
  std::vector<std::uint32_t> triangle_part;  // index into `parts`; parts come one after another
  // Vertex attributes, as long as `positions`, or empty where no part has them.
  std::vector<Vec3> normals;   // unit length; zero: the part or the vertex has none, use the triangle's own
  std::vector<Vec4> tangents;  // w: handedness; zero: none
  std::vector<Vec2> uvs[2];
  std::vector<Vec4> colors;  // linear; (1, 1, 1, 1) where a part has none

  std::uint32_t alpha_begin = 0;  // triangles from here on have partial coverage (set by Scene, which sorts them so)

  std::vector<Part> parts;
  std::vector<Material> materials;  // at least one; glTF's default material is appended where used
  std::vector<Image> images;        // only those that some used material refers to
  std::vector<PunctualLight> lights;
  std::vector<Camera> cameras;  // in node order of the default scene; may be empty

  std::vector<std::string> notes;  // to be said on stderr: what was ignored, repaired or dropped
};

}  // namespace ln
