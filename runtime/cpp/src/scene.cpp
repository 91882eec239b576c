#include "ln/scene.hpp"

#include <fnmatch.h>

#include <numeric>

#include "ln/dielectric_table.hpp"
#include "ln/error.hpp"
#include "ln/material.hpp"

namespace ln {

namespace {

bool has_partial_coverage(const Material& m) {
  if (m.alpha_mode == AlphaMode::opaque) return false;
  return m.alpha < 1 || m.base_color_texture || m.alpha_mode == AlphaMode::mask;
}

/// Sorts the parts, and their triangles, so that those with partial coverage come last.
void sort_by_coverage(SceneData& data) {
  std::vector<std::uint32_t> order(data.parts.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto partial = [&](std::uint32_t i) {
    const Part& part = data.parts[i];
    return has_partial_coverage(data.materials[part.material]) ||
           (part.has_colors && data.materials[part.material].alpha_mode != AlphaMode::opaque);
  };
  const auto first_partial = std::stable_partition(order.begin(), order.end(), [&](std::uint32_t i) { return !partial(i); });

  std::vector<UVec3> triangles;
  triangles.reserve(data.triangles.size());
  std::vector<Part> parts;
  parts.reserve(data.parts.size());
  data.triangle_part.clear();
  for (auto i = order.begin(); i != order.end(); ++i) {
    if (i == first_partial) data.alpha_begin = static_cast<std::uint32_t>(triangles.size());
    Part& part = data.parts[*i];
    const auto begin = data.triangles.begin() + part.first_triangle;
    part.first_triangle = static_cast<std::uint32_t>(triangles.size());
    triangles.insert(triangles.end(), begin, begin + part.triangle_count);
    data.triangle_part.insert(data.triangle_part.end(), part.triangle_count, static_cast<std::uint32_t>(parts.size()));
    parts.push_back(std::move(part));
  }
  if (first_partial == order.end()) data.alpha_begin = static_cast<std::uint32_t>(triangles.size());
  data.triangles = std::move(triangles);
  data.parts = std::move(parts);
}

/// Are the part's vertex normals those of its triangles, so that nothing is to be interpolated?
bool is_flat(const SceneData& data, const Part& part) {
  constexpr float kTolerance = 1e-5f;
  for (std::uint32_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
    const UVec3 i = data.triangles[t];
    const Vec3 a = data.positions[i.x];
    const Vec3 ng = glm::normalize(glm::cross(data.positions[i.y] - a, data.positions[i.z] - a));
    for (int k = 0; k < 3; ++k)
      if (!(glm::distance(data.normals[i[k]], ng) < kTolerance)) return false;
  }
  return true;
}

bool matches(const char* glob, const std::string& name) { return fnmatch(glob, name.c_str(), 0) == 0; }

bool matches_any(const char* glob, const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return matches(glob, name); });
}

TagSet tags_of_part(const SceneData& data, const Part& part, std::span<const TagRule> rules) {
  const Material& material = data.materials[part.material];
  TagSet tags = 0;
  for (const TagRule& rule : rules) {
    bool match = false;
    switch (rule.kind) {
      case TagRule::Kind::material: match = matches(rule.glob, material.name); break;
      case TagRule::Kind::mesh: match = matches(rule.glob, part.mesh); break;
      case TagRule::Kind::node: match = matches(rule.glob, part.node); break;
      case TagRule::Kind::extras: match = matches_any(rule.glob, material.tags) || matches_any(rule.glob, part.tags); break;
    }
    if (match) tags |= TagSet{1} << rule.tag;
  }
  return tags;
}

TagSet tags_of_light(const PunctualLight& light, std::span<const TagRule> rules) {
  TagSet tags = 0;
  for (const TagRule& rule : rules) {
    const bool match = (rule.kind == TagRule::Kind::node && matches(rule.glob, light.node)) ||
                       (rule.kind == TagRule::Kind::extras && matches_any(rule.glob, light.tags));
    if (match) tags |= TagSet{1} << rule.tag;
  }
  return tags;
}

}  // namespace

Scene::Scene(SceneData data, std::span<const TagRule> tags, int threads, const Image* environment)
    : data_(std::move(data)), environment_(environment) {
  sort_by_coverage(data_);
  accel_ = Accel(data_, threads);

  dielectrics_.resize(data_.materials.size());
  for (std::size_t i = 0; i < data_.materials.size(); ++i) {
    const Material& m = data_.materials[i];
    const bool rough = m.metallic_roughness_texture || m.roughness >= kMinRoughness;
    if (m.transmission > 0 && m.solid && m.ior > 0 && rough && !m.unlit)
      dielectrics_[i] = std::make_unique<DielectricTable>(m.ior);
  }
  for (Part& part : data_.parts)
    if (part.has_normals && !data_.materials[part.material].normal_texture && is_flat(data_, part)) part.has_normals = false;
  baked_.resize(data_.parts.size());
  part_tags_.reserve(data_.parts.size());
  for (std::size_t i = 0; i < data_.parts.size(); ++i) {
    const Part& part = data_.parts[i];
    const Material& m = data_.materials[part.material];
    part_tags_.push_back(tags_of_part(data_, part, tags));
    const bool absorbs = m.solid && std::isfinite(m.attenuation_distance);
    baked_[i].uniform = m.unlit || (!m.has_texture() && !part.has_colors);
    baked_[i].plain = baked_[i].uniform && !part.has_normals && !absorbs;
    if (baked_[i].uniform && !m.unlit && part.triangle_count > 0) {
      const BsdfParameters p = bsdf_parameters(m, VertexAttributes(data_, part.first_triangle, 0, 0), false);
      for (int side = 0; side < 2; ++side) baked_[i].bsdf[side] = Bsdf(p, side == 0, dielectrics_[part.material].get());
    }
  }
  for (const PunctualLight& light : data_.lights) light_tags_.push_back(tags_of_light(light, tags));
  emitters_ = std::make_unique<Emitters>(data_, environment);
}

std::unique_ptr<Emitters> Scene::selected_emitters(const TagSelection& from) const {
  return std::make_unique<Emitters>(
      data_, from(0) ? environment_ : nullptr, [&](std::size_t part) { return from(part_tags_[part]); },
      [&](std::size_t light) { return from(light_tags_[light]); });
}

std::unique_ptr<Emitters> Scene::selected_emitters(const EmitterSelection& selection, bool with_environment) const {
  return std::make_unique<Emitters>(data_, with_environment ? environment_ : nullptr, selection);
}

int Scene::tag_matches(int t) const {
  const TagSet bit = TagSet{1} << t;
  const auto tagged = [&](TagSet tags) { return (tags & bit) != 0; };
  return static_cast<int>(std::count_if(part_tags_.begin(), part_tags_.end(), tagged) +
                          std::count_if(light_tags_.begin(), light_tags_.end(), tagged));
}

void Scene::shade(Interaction& x, const Ray& ray) const {
  const Part& part = data_.parts[x.part];
  const Material& material = data_.materials[part.material];
  const VertexAttributes attributes(data_, x.hit.triangle, x.hit.u, x.hit.v);

  // Find the shading normal on the front side.
  Vec3 n = x.at.ng;
  if (part.has_normals) {
    const Vec3 interpolated = attributes.normal();
    const float length = glm::length(interpolated);
    if (length > 1e-6f) n = interpolated / length;
    if (glm::dot(n, x.at.ng) < 0) n = -n;
  }
  n = mapped_normal(data_, material, attributes, x.hit.triangle, n);

  // Turn it to the side of the viewer; where that side cannot be seen from wo, bend it until it just can.
  const float side = x.front ? 1.0f : -1.0f;
  n *= side;
  constexpr float kMinCos = 1e-3f;
  const float cos_o = glm::dot(n, x.wo);
  if (cos_o < kMinCos) n = glm::normalize(n + (kMinCos - cos_o) * x.wo);
  x.frame = make_frame(n);

  if (!baked_[x.part].uniform) {
    x.own_ = Bsdf(bsdf_parameters(material, attributes, part.has_colors), x.front, dielectrics_[part.material].get());
    x.bsdf_ = &x.own_;
  }

  // A ray that meets the surface of a solid from behind has come through the solid.
  if (material.solid && !x.front && std::isfinite(material.attenuation_distance)) {
    const float distance = x.hit.t * glm::length(ray.direction) / material.attenuation_distance;
    for (int i = 0; i < 3; ++i) x.transmittance[i] = std::pow(material.attenuation_color[i], distance);
  }
}

}  // namespace ln
