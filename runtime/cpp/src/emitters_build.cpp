// Emitters: which light sources a scene has.

#include "ln/emitters.hpp"

namespace ln {

namespace {

constexpr double kPiDouble = 3.14159265358979323846;

/// Does the radiance differ from place to place on this part?
bool emission_varies(const Part& part, const Material& material) {
  if (material.unlit) return material.base_color_texture || part.has_colors;
  return static_cast<bool>(material.emissive_texture);
}

/// A triangle of the scene as a light; size 0: it has no area that float can express.
AreaLight triangle_light(const SceneData& scene, std::uint32_t triangle) {
  const UVec3 i = scene.triangles[triangle];
  const Vec3 a = scene.positions[i.x];
  AreaLight light(a, DVec3(scene.positions[i.y]) - DVec3(a), DVec3(scene.positions[i.z]) - DVec3(a), false);
  light.triangle = triangle;
  return light;
}

/// Two triangles with a common edge that make up a parallelogram, as one light; size 0: they do not.
AreaLight parallelogram_light(const SceneData& scene, std::uint32_t first, std::uint32_t second) {
  const auto corners = [&](std::uint32_t triangle, int k) { return scene.positions[scene.triangles[triangle][k % 3]]; };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      // The common edge is opposite to corner i of the first and to corner j of the second, which runs along it backwards.
      const Vec3 y = corners(first, i + 1), z = corners(first, i + 2);
      if (corners(second, j + 1) != z || corners(second, j + 2) != y) continue;
      const Vec3 x = corners(first, i), w = corners(second, j);
      const Vec3 gap = glm::abs(Vec3((glm::dvec3(y) - glm::dvec3(x)) + (glm::dvec3(z) - glm::dvec3(w))));
      const Vec3 tolerance = 0x1p-21f * (glm::abs(x) + glm::abs(y) + glm::abs(z));
      const float extent = std::max(glm::distance(x, y), glm::distance(x, z));
      if (glm::any(glm::greaterThan(gap, tolerance)) || max_component(gap) > 1e-4f * extent) return {};
      AreaLight light(x, DVec3(y) - DVec3(x), DVec3(z) - DVec3(x), true);
      light.triangle = first;
      return light;
    }
  }
  return {};
}

/// Sphere around a light.
void bound(const AreaLight& light, LightBounds& bounds) {
  const Vec3 b = light.a + light.e1, c = light.a + light.e2, d = light.quad ? b + light.e2 : light.a;
  const Vec3 corners[] = {light.a, b, c, d};
  bounds.center = 0.5f * (glm::min(glm::min(light.a, b), glm::min(c, d)) + glm::max(glm::max(light.a, b), glm::max(c, d)));
  for (const Vec3& corner : corners) bounds.radius = std::max(bounds.radius, glm::distance(bounds.center, corner));
}

double mean_power(const Color& c) { return (static_cast<double>(c.x) + c.y + c.z) / 3; }

}  // namespace

Emitters::Emitters(const SceneData& scene, const Image* environment, const EmitterSelection& selection) : scene_(&scene) {
  add_surfaces(selection);
  add_lights(selection);
  if (environment) {
    environment_ = std::make_unique<Environment>(*environment);
    if (environment_->is_black()) environment_.reset();
  }
  area_count_ = static_cast<std::uint32_t>(area_.size());
  finite_count_ = static_cast<std::uint32_t>(area_.size() + punctual_.size());
  size_ = finite_count_ + distant_.size() + (has_environment() ? 1 : 0);
  build_tree();
  build_power();
}

void Emitters::add_surfaces(const EmitterSelection& selection) {
  // Texture look-ups to spend on a triangle, along each side.
  double varying = 1;
  for (const Part& part : scene_->parts)
    if (emission_varies(part, scene_->materials[part.material])) varying += part.triangle_count;
  const int samples = std::clamp(static_cast<int>(std::sqrt(4e6 / varying)), 4, 64);

  for (std::size_t p = 0; p < scene_->parts.size(); ++p) {
    const Part& part = scene_->parts[p];
    const Material& material = scene_->materials[part.material];
    if (!(selection.parts.empty() || selection.parts[p]) || !material.emits() || part.triangle_count == 0) continue;
    if (!has_surfaces_) surfaces_.resize(scene_->parts.size());
    has_surfaces_ = true;

    Surface& surface = surfaces_[p];
    surface.emits = true;
    surface.varies = emission_varies(part, material);
    surface.double_sided = material.double_sided;
    surface.first_triangle = part.first_triangle;
    surface.first_slot = static_cast<std::uint32_t>(light_of_triangle_.size());
    surface.radiance = material.emission;
    light_of_triangle_.resize(surface.first_slot + part.triangle_count, kNone);

    for (std::uint32_t k = 0; k < part.triangle_count; ++k) {
      const std::uint32_t triangle = part.first_triangle + k;
      AreaLight light;
      if (!surface.varies && k + 1 < part.triangle_count) light = parallelogram_light(*scene_, triangle, triangle + 1);
      if (light.size == 0) light = triangle_light(*scene_, triangle);
      if (light.size == 0) continue;
      light.double_sided = material.double_sided;
      light.varies = surface.varies;
      light.radiance = surface.varies ? mean_radiance(triangle, samples) : material.emission;
      if (is_black(light.radiance)) continue;
      const auto index = static_cast<std::uint32_t>(area_.size());
      light_of_triangle_[surface.first_slot + k] = index;
      if (light.quad) light_of_triangle_[surface.first_slot + ++k] = index;
      area_.push_back(light);
    }
  }
}

void Emitters::add_lights(const EmitterSelection& selection) {
  for (std::size_t i = 0; i < scene_->lights.size(); ++i) {
    const PunctualLight& light = scene_->lights[i];
    if (!(selection.lights.empty() || selection.lights[i]) || !(max_component(light.intensity) > 0)) continue;
    switch (light.kind) {
      case PunctualKind::point: punctual_.push_back({light.position, light.direction, light.intensity}); break;
      case PunctualKind::spot:
        punctual_.push_back(
            PunctualSource::spot(light.position, light.direction, light.intensity, light.cos_inner, light.cos_outer));
        break;
      case PunctualKind::directional: distant_.push_back({light.direction, light.intensity}); break;
    }
  }
}

void Emitters::build_tree() {
  if (size() < 2 || finite_count_ == 0) return;
  std::vector<LightBounds> bounds;
  bounds.reserve(finite_count_);
  for (const AreaLight& light : area_) {
    LightBounds b;
    bound(light, b);
    b.axis = light.n;
    b.phi = mean_power(light.radiance) * light.area();
    b.two_sided = light.double_sided;
    bounds.push_back(b);
  }
  for (const PunctualSource& light : punctual_) {
    LightBounds b;
    b.center = light.position;
    b.phi = mean_power(light.intensity);
    b.axis = light.direction;
    if (light.scale == 0) {
      b.cos_o = -1;
    } else {
      const float outer = std::acos(std::clamp(light.cos_outer, -1.0f, 1.0f));
      const float inner = std::acos(std::clamp(light.cos_outer + 1 / light.scale, -1.0f, 1.0f));
      b.cos_o = std::cos(inner);
      b.cos_e = std::cos(outer - inner);
    }
    bounds.push_back(b);
  }
  tree_ = LightBvh(bounds);
  distant_scale_ = static_cast<float>(std::min(1 / tree_.scale(), 1e30));
}

void Emitters::build_power() {
  if (!distant_.empty() || environment_) {
    float radius2 = 0;
    for (const Vec3& p : scene_->positions) radius2 = std::max(radius2, glm::dot(p, p));
    scene_radius_ = radius2 > 0 ? std::sqrt(radius2) * (1 + 0x1p-12f) : 1.0f;
  }
  std::vector<double> weights;
  weights.reserve(size());
  glm::dvec3 total(0);
  const auto add = [&](const Color& c, double factor) {
    weights.push_back(mean_power(c) * factor);
    total += glm::dvec3(c) * factor;
  };
  const double disk = kPiDouble * scene_radius_ * scene_radius_;
  for (const AreaLight& light : area_) add(light.radiance, kPiDouble * light.area() * (light.double_sided ? 2 : 1));
  for (const PunctualSource& light : punctual_) add(light.intensity, light.effective_solid_angle());
  for (const DistantLight& light : distant_) add(light.irradiance, disk);
  if (environment_) add(environment_->mean(), 4 * kPiDouble * disk);
  power_ = Distribution(weights);
  total_power_ = Color(total);
}

Color Emitters::mean_radiance(std::uint32_t triangle, int most_samples) const {
  const Part& part = scene_->parts[scene_->triangle_part[triangle]];
  const Material& material = scene_->materials[part.material];

  // As many samples a side as the triangle covers texels, within reason.
  const TextureRef& ref = material.unlit ? material.base_color_texture : material.emissive_texture;
  float texels = 0;
  if (ref && !scene_->uvs[ref.uv_set].empty()) {
    const auto& uvs = scene_->uvs[ref.uv_set];
    const UVec3 i = scene_->triangles[triangle];
    const Image& image = scene_->images[ref.image];
    const auto texel = [&](std::uint32_t k) {
      const Vec3 uv(uvs[k], 1);
      return Vec2(glm::dot(ref.row0, uv) * static_cast<float>(image.width),
                  glm::dot(ref.row1, uv) * static_cast<float>(image.height));
    };
    const Vec2 a = texel(i.x), b = texel(i.y), c = texel(i.z);
    const Vec2 extent = glm::max(a, glm::max(b, c)) - glm::min(a, glm::min(b, c));
    texels = std::max(extent.x, extent.y);
  }
  const int n = texels < static_cast<float>(most_samples) ? std::max(4, static_cast<int>(texels) + 1) : most_samples;
  glm::dvec3 sum(0);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(n),
            v = (static_cast<float>(y) + 0.5f) / static_cast<float>(n);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      sum += glm::dvec3(varying_radiance(triangle, u, v));
    }
  }
  // A little more than nothing: samples may miss what the texture shows.
  return glm::max(Color(sum / static_cast<double>(n * n)), 1e-3f * material.emission);
}

}  // namespace ln
