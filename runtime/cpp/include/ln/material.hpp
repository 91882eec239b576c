#pragma once
// Materials at a point: factors, textures and vertex colours put together.

#include "ln/bsdf.hpp"
#include "ln/scene_data.hpp"
#include "ln/texture.hpp"

namespace ln {

/// Texture coordinates, colour and whatever else is interpolated over a triangle.
class VertexAttributes {
 public:
  VertexAttributes(const SceneData& data, std::uint32_t triangle, float u, float v)
      : data_(data), i_(data.triangles[triangle]), b_(1 - u - v, u, v) {}

  Vec2 uv(int set) const { return data_.uvs[set].empty() ? Vec2(0) : mix(data_.uvs[set]); }
  Vec4 color() const { return data_.colors.empty() ? Vec4(1) : mix(data_.colors); }
  Vec3 normal() const { return data_.normals.empty() ? Vec3(0) : mix(data_.normals); }
  Vec4 tangent() const { return data_.tangents.empty() ? Vec4(0) : mix(data_.tangents); }
  Vec4 texture(const TextureRef& ref) const { return lookup(data_.images[ref.image], ref, uv(ref.uv_set)); }

 private:
  template <class T>
  T mix(const std::vector<T>& values) const {
    return b_.x * values[i_.x] + b_.y * values[i_.y] + b_.z * values[i_.z];
  }

  const SceneData& data_;
  UVec3 i_;
  Vec3 b_;
};

/// Coverage in [0, 1]: base colour's alpha times the vertex colour's; 0 or 1 with alphaMode MASK.
float coverage(const SceneData& data, std::uint32_t triangle, float u, float v);

/// Parameters of the BSDF at a point.
BsdfParameters bsdf_parameters(const Material& material, const VertexAttributes& at, bool has_colors);

/// Events that a material may scatter by somewhere, from the ranges of its textures: never too few.
Events possible_events(const SceneData& data, const Material& material);

/// The normal of KHR_materials normal maps in world space, or `normal` where there is none. `normal`: the interpolated
/// normal of the front side.
Vec3 mapped_normal(const SceneData& data, const Material& material, const VertexAttributes& at, std::uint32_t triangle,
                   const Vec3& normal);

}  // namespace ln
