#include "ln/emitters.hpp"

#include "ln/material.hpp"

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

float PunctualSource::effective_solid_angle() const {
  if (scale == 0) return 4 * kPi;
  const float ramp_end = cos_outer + 1 / scale, top = std::min(ramp_end, 1.0f);
  return 2 * kPi * (std::max(0.0f, 1 - ramp_end) + (top - cos_outer) * sqr((top - cos_outer) * scale) / 3);
}

float PunctualSource::sample_cos(float u) const {
  if (scale == 0) return 1 - 2 * u;
  const float ramp_end = cos_outer + 1 / scale, top = std::min(ramp_end, 1.0f);
  const float cap = std::max(0.0f, 1 - ramp_end), ramp = (top - cos_outer) * sqr((top - cos_outer) * scale) / 3;
  const float x = u * (cap + ramp);
  if (x < cap) return 1 - x;
  return cos_outer + (top - cos_outer) * std::cbrt(std::min((x - cap) / ramp, 1.0f));
}

// ---- Construction ---------------------------------------------------------------------------------------------------

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

// ---- Light at a receiver --------------------------------------------------------------------------------------------

float Emitters::distant_importance(const DistantLight& light, const Vec3& n) const {
  constexpr float kFloor = 1e-3f;
  const float cos_i = n == Vec3(0) ? 1.0f : -glm::dot(n, light.direction);
  if (cos_i <= 0) return 0;
  return std::min(mean_component(light.irradiance) * distant_scale_, 1e30f) * std::max(cos_i, kFloor);
}

Emitters::Choice Emitters::choose(const Vec3& p, const Vec3& n) const {
  Choice choice;
  if (finite_count_ > 0) {
    choice.root = tree_.root(p, n);
    choice.finite = choice.root.total();
  }
  if (distant_.empty() && !environment_) {
    choice.finite = choice.finite > 0 ? 1.0f : 0.0f;
    return choice;
  }
  for (const DistantLight& light : distant_) choice.distant += distant_importance(light, n);
  choice.distant_importance = choice.distant;
  if (environment_) choice.environment = std::min(kPi * mean_component(environment_->mean()) * distant_scale_, 1e30f);

  // In proportion to what they may contribute, but never less than a tenth: each may be hidden, which is not known here.
  constexpr float kShare = 0.1f;
  float* const groups[] = {&choice.finite, &choice.distant, &choice.environment};
  float total = 0, count = 0;
  for (const float* group : groups) {
    total += *group;
    count += *group > 0 ? 1.0f : 0.0f;
  }
  if (count == 0) return choice;
  for (float* group : groups) {
    if (*group > 0) *group = count == 1 ? 1.0f : kShare + (1 - kShare * count) * (*group / total);
  }
  return choice;
}

LN_INLINE LightSample Emitters::sample_area(const SurfacePosition& at, const AreaLight& light, float pmf, const Vec2& u) const {
  LightSample result;
  const float height = light.height(at.p);
  if (!light.seen_from(height)) return result;
  const AreaSample s = sample_solid_angle(light, at.p, height, u);
  result.position = light.at(s.s, s.t);
  const Vec3 d = result.position.p - at.p;
  result.distance = glm::length(d);
  if (!(s.pdf_w > 0 && s.pdf_w < kInfinity && result.distance > 0)) return result;
  result.wi = d / result.distance;
  result.radiance = light.varies ? varying_radiance(light.triangle, s.s, s.t) : light.radiance;
  result.pdf_w = pmf * s.pdf_w;
  return result;
}

LightSample Emitters::sample(const SurfacePosition& at, const Vec3& n, float u_pick, const Vec2& u) const {
  if (size_ == 1 && area_count_ == 1) return sample_area(at, area_[0], 1, u);
  return sample_several(at, n, u_pick, u);
}

LN_NOINLINE LightSample Emitters::sample_several(const SurfacePosition& at, const Vec3& n, float u_pick, const Vec2& u) const {
  if (size_ == 1) {
    if (finite_count_ == 1) return sample_finite(at, 0, 1, u);
    return environment_ ? sample_environment(n, 1, u) : sample_distant(n, u_pick, 1, distant_importance(distant_[0], n));
  }
  if (empty()) return {};
  const Choice choice = choose(at.p, n);
  if (u_pick < choice.finite) {
    const float rest = std::min(u_pick / choice.finite, kOneMinusEpsilon);
    const LightBvh::Pick pick = tree_.sample(choice.root, at.p, n, rest);
    return pick.pmf > 0 ? sample_finite(at, pick.index, pick.pmf * choice.finite, u) : LightSample{};
  }
  // Rounding may leave u behind the last group that has light.
  if (choice.environment == 0 || u_pick < choice.finite + choice.distant) {
    if (choice.distant == 0) return {};
    return sample_distant(n, std::min((u_pick - choice.finite) / choice.distant, kOneMinusEpsilon), choice.distant,
                          choice.distant_importance);
  }
  return sample_environment(n, choice.environment, u);
}

LightSample Emitters::sample_finite(const SurfacePosition& at, std::uint32_t index, float pmf, const Vec2& u) const {
  if (index < area_count_) return sample_area(at, area_[index], pmf, u);
  const PunctualSource& light = punctual_[index - area_count_];
  LightSample result;
  const Vec3 d = light.position - at.p;
  const float d2 = glm::dot(d, d);
  if (!(d2 > 1e-30f)) return result;
  result.position = {light.position, 0, Vec3(0)};
  result.distance = std::sqrt(d2);
  result.wi = d / result.distance;
  result.radiance = light.intensity * (light.attenuation(-glm::dot(result.wi, light.direction)) / d2);
  result.pdf_w = pmf;
  result.delta = true;
  return result;
}

LightSample Emitters::sample_distant(const Vec3& n, float u, float pmf, float total) const {
  if (!(total > 0)) return {};
  float rest = u * total, importance = 0;
  const DistantLight* chosen = nullptr;
  for (const DistantLight& light : distant_) {
    const float i = distant_importance(light, n);
    if (!(i > 0)) continue;
    if (chosen) rest -= importance;
    chosen = &light;
    importance = i;
    if (rest < i) break;
  }
  LightSample result;
  result.wi = -chosen->direction;
  result.radiance = chosen->irradiance;
  result.pdf_w = pmf * (importance / total);
  result.delta = true;
  return result;
}

LightSample Emitters::sample_environment(const Vec3& n, float pmf, const Vec2& u) const {
  const Environment::Sample s = environment_->sample(n, u);
  LightSample result;
  if (!(s.pdf_w > 0)) return result;
  result.wi = s.w;
  result.radiance = environment_->radiance(s.w);
  result.pdf_w = pmf * s.pdf_w;
  return result;
}

float Emitters::environment_pdf_w(const SurfacePosition& at, const Vec3& n, const Vec3& w) const {
  if (!environment_) return 0;
  return environment_->pdf_w(n, w) * (size() == 1 ? 1.0f : choose(at.p, n).environment);
}

float Emitters::surface_pdf_w(const Surface& surface, const SurfacePosition& at, const Vec3& n, const Hit& hit) const {
  const std::uint32_t index = light_of_triangle_[surface.first_slot + hit.triangle - surface.first_triangle];
  if (index == kNone) return 0;
  const AreaLight& light = area_[index];
  const float height = light.height(at.p);
  if (!light.seen_from(height)) return 0;
  const float solid = solid_angle(light, at.p, height);
  if (!(solid > 0)) return 0;
  float pmf = 1;
  if (size() > 1) {
    const Choice choice = choose(at.p, n);
    pmf = choice.finite * tree_.pmf(choice.root, at.p, n, index);
  }
  return pmf / solid;
}

// ---- Emitted radiance -----------------------------------------------------------------------------------------------

Color Emitters::surface_radiance(const Surface& surface, const Hit& hit, const Vec3& w_out) const {
  if (!surface.double_sided) {
    const std::uint32_t index = light_of_triangle_[surface.first_slot + hit.triangle - surface.first_triangle];
    Vec3 n;
    if (index != kNone) {
      n = area_[index].n;
    } else {
      const UVec3 i = scene_->triangles[hit.triangle];
      n = glm::cross(scene_->positions[i.y] - scene_->positions[i.x], scene_->positions[i.z] - scene_->positions[i.x]);
    }
    if (!(glm::dot(n, w_out) > 0)) return Color(0);
  }
  return surface.varies ? varying_radiance(hit.triangle, hit.u, hit.v) : surface.radiance;
}

Color Emitters::varying_radiance(std::uint32_t triangle, float u, float v) const {
  const Part& part = scene_->parts[scene_->triangle_part[triangle]];
  const Material& material = scene_->materials[part.material];
  const VertexAttributes at(*scene_, triangle, u, v);
  Color radiance = material.emission;
  if (material.unlit) {
    if (material.base_color_texture) radiance *= Color(at.texture(material.base_color_texture));
    if (part.has_colors) radiance *= Color(at.color());
  } else if (material.emissive_texture) {
    radiance *= Color(at.texture(material.emissive_texture));
  }
  return glm::max(radiance, Color(0));
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

// ---- Light into the scene -------------------------------------------------------------------------------------------

PhotonEmission Emitters::emit(float u_pick, const Vec2& u_position, const Vec2& u_direction) const {
  const Distribution::Sample pick = power_.sample(u_pick);
  PhotonEmission photon;
  if (!(pick.pmf > 0)) return photon;
  std::size_t index = pick.index;
  const float inverse = 1 / pick.pmf;

  if (index < area_.size()) {
    const AreaLight& light = area_[index];
    Vec2 st = u_position;
    if (!light.quad) {
      const float root = std::sqrt(u_position.x);
      st = {root * (1 - u_position.y), root * u_position.y};
    }
    const bool back = light.double_sided && pick.u >= 0.5f;
    const float r = std::sqrt(u_direction.x), phi = 2 * kPi * u_direction.y;
    photon.cos_theta = std::sqrt(1 - u_direction.x);
    photon.direction = make_frame(back ? -light.n : light.n).to_world({r * std::cos(phi), r * std::sin(phi), photon.cos_theta});
    photon.position = light.at(st.x, st.y);
    photon.triangle = light.triangle;
    const Color radiance = light.varies ? varying_radiance(light.triangle, st.x, st.y) : light.radiance;
    photon.flux = radiance * (kPi * light.area() * (light.double_sided ? 2.0f : 1.0f) * inverse);
    return photon;
  }
  index -= area_.size();

  if (index < punctual_.size()) {
    const PunctualSource& light = punctual_[index];
    const float cosine = light.sample_cos(u_direction.x), sine = safe_sqrt(1 - cosine * cosine), phi = 2 * kPi * u_direction.y;
    photon.direction = make_frame(light.direction).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine});
    photon.position = {light.position, 0, Vec3(0)};
    photon.flux = light.intensity * (light.effective_solid_angle() * inverse);
    photon.delta = true;
    return photon;
  }
  index -= punctual_.size();

  if (index < distant_.size()) {
    photon.direction = distant_[index].direction;
    photon.flux = distant_[index].irradiance * inverse;
    photon.delta = true;
  } else {
    const Environment::Sample s = environment_->sample(u_direction);
    if (!(s.pdf_w > 0)) return photon;
    photon.direction = -s.w;
    photon.flux = environment_->radiance(s.w) * (inverse / s.pdf_w);
  }
  photon.distant = true;
  photon.flux *= kPi * sqr(scene_radius_);
  const Frame frame = make_frame(photon.direction);
  const float r = scene_radius_ * std::sqrt(u_position.x), phi = 2 * kPi * u_position.y;
  photon.position = {frame.to_world({r * std::cos(phi), r * std::sin(phi), -scene_radius_}), 0, Vec3(0)};
  return photon;
}

}  // namespace ln
