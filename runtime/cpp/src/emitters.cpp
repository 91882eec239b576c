// Emitters: light at a receiver, and what surfaces emit.

#include "ln/emitters.hpp"
#include "ln/material.hpp"

namespace ln {

namespace {

/// Does the light shine towards `at`, which is `height` above it? Not if that is within the error of the position: on its own
/// surface and on its back, a light would find directions to itself in what rounding leaves of distances.
bool shines_on(const AreaLight& light, const SurfacePosition& at, float height) {
  return std::abs(height) > at.error && light.seen_from(height);
}

}  // namespace

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
  if (!shines_on(light, at, height)) return result;
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
  if (!shines_on(light, at, height)) return 0;
  const float solid = solid_angle(light, at.p, height);
  if (!(solid > 0)) return 0;
  float pmf = 1;
  if (size() > 1) {
    const Choice choice = choose(at.p, n);
    pmf = choice.finite * tree_.pmf(choice.root, at.p, n, index);
  }
  return pmf / solid;
}

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

}  // namespace ln
