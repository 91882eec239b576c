#include "ln/material.hpp"

namespace ln {

float coverage(const SceneData& data, std::uint32_t triangle, float u, float v) {
  const Part& part = data.parts[data.triangle_part[triangle]];
  const Material& material = data.materials[part.material];
  if (material.alpha_mode == AlphaMode::opaque) return 1;
  const VertexAttributes at(data, triangle, u, v);
  float alpha = material.alpha;
  if (material.base_color_texture) alpha *= at.texture(material.base_color_texture).w;
  if (part.has_colors) alpha *= at.color().w;
  if (material.alpha_mode == AlphaMode::mask) return alpha >= material.alpha_cutoff ? 1.0f : 0.0f;
  return std::clamp(alpha, 0.0f, 1.0f);
}

BsdfParameters bsdf_parameters(const Material& material, const VertexAttributes& at, bool has_colors) {
  BsdfParameters p;
  p.base_color = material.base_color;
  if (material.base_color_texture) p.base_color *= Color(at.texture(material.base_color_texture));
  if (has_colors) p.base_color *= Color(at.color());
  p.base_color = glm::clamp(p.base_color, Color(0), Color(1));
  p.metallic = material.metallic;
  p.roughness = material.roughness;
  if (material.metallic_roughness_texture) {
    const Vec4 t = at.texture(material.metallic_roughness_texture);
    p.roughness *= t.y;
    p.metallic *= t.z;
  }
  p.specular = material.specular;
  if (material.specular_texture) p.specular *= at.texture(material.specular_texture).w;
  p.specular_color = material.specular_color;
  if (material.specular_color_texture) p.specular_color *= Color(at.texture(material.specular_color_texture));
  p.ior = material.ior;
  p.transmission = material.transmission;
  if (material.transmission_texture) p.transmission *= at.texture(material.transmission_texture).x;
  p.solid = material.solid;
  return p;
}

namespace {

/// What a texture can multiply a factor by. Interpolation rounds, so ranges are a little wider than texels say.
ColorRange texture_range(const SceneData& data, const TextureRef& ref) {
  constexpr float kRounding = 1e-5f;
  if (!ref) return {Vec4(1), Vec4(1)};
  const ColorRange texels = color_range(data.images[ref.image]);
  return {texels.low * (1 - kRounding), texels.high * (1 + kRounding)};
}

}  // namespace

Events possible_events(const SceneData& data, const Material& m) {
  if (m.unlit) return Events::none;
  if (!m.has_texture()) {
    BsdfParameters p;
    p.base_color = m.base_color;
    p.metallic = m.metallic;
    p.roughness = m.roughness;
    p.specular = m.specular;
    p.specular_color = m.specular_color;
    p.ior = m.ior;
    p.transmission = m.transmission;
    p.solid = m.solid;
    return Bsdf(p, true).events();
  }
  const ColorRange surface = texture_range(data, m.metallic_roughness_texture);
  const ColorRange transmission = texture_range(data, m.transmission_texture),
                   specular = texture_range(data, m.specular_texture);
  Events events = Events::none;
  if (m.metallic * surface.low.z < 1 && m.transmission * transmission.low.x < 1 && !is_black(m.base_color)) events = Events::D;
  if (m.metallic * surface.high.z > 0 || m.transmission * transmission.high.x > 0 || m.specular * specular.high.w > 0) {
    if (m.roughness * surface.low.y < kMinRoughness) events = events | Events::S;
    if (m.roughness * surface.high.y >= kMinRoughness) events = events | Events::G;
  }
  return events;
}

namespace {

/// The direction in which texture coordinate u grows over the triangle; zero if the mapping is degenerate.
Vec4 tangent_from_uvs(const SceneData& data, const TextureRef& ref, std::uint32_t triangle, const Vec3& normal) {
  const auto& uvs = data.uvs[ref.uv_set];
  if (uvs.empty()) return Vec4(0);
  const UVec3 i = data.triangles[triangle];
  const Vec3 e1 = data.positions[i.y] - data.positions[i.x], e2 = data.positions[i.z] - data.positions[i.x];
  const Vec2 d1 = uvs[i.y] - uvs[i.x], d2 = uvs[i.z] - uvs[i.x];
  const float determinant = d1.x * d2.y - d1.y * d2.x;
  if (determinant == 0) return Vec4(0);
  const Vec3 du = (e1 * d2.y - e2 * d1.y) / determinant;
  const Vec3 dv = (e2 * d1.x - e1 * d2.x) / determinant;
  const Vec3 t = du - glm::dot(du, normal) * normal;
  const float length = glm::length(t);
  if (!(length > 0) || !std::isfinite(length)) return Vec4(0);
  // Texture coordinate v grows downwards, the second axis of tangent space points upwards.
  return Vec4(t / length, glm::dot(glm::cross(normal, t), dv) > 0 ? -1.0f : 1.0f);
}

}  // namespace

Vec3 mapped_normal(const SceneData& data, const Material& material, const VertexAttributes& at, std::uint32_t triangle,
                   const Vec3& normal) {
  if (!material.normal_texture) return normal;
  Vec4 tangent = data.parts[data.triangle_part[triangle]].has_tangents ? at.tangent() : Vec4(0);
  const Vec3 given = Vec3(tangent) - glm::dot(Vec3(tangent), normal) * normal;
  const float length = glm::length(given);
  if (length > 1e-6f) {
    tangent = Vec4(given / length, tangent.w < 0 ? -1.0f : 1.0f);
  } else {
    tangent = tangent_from_uvs(data, material.normal_texture, triangle, normal);
    if (tangent.w == 0) return normal;
  }
  const Vec3 t(tangent), b = glm::cross(normal, t) * tangent.w;
  const Vec3 texel = 2.0f * Vec3(at.texture(material.normal_texture)) - 1.0f;
  const Vec3 n = texel.x * material.normal_scale * t + texel.y * material.normal_scale * b + texel.z * normal;
  const float n_length = glm::length(n);
  return n_length > 1e-6f ? n / n_length : normal;
}

}  // namespace ln
