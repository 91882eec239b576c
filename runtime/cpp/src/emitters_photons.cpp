// Emitters: light into the scene.

#include "ln/emitters.hpp"

namespace ln {

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

PhotonEmission Emitters::emit(float u_pick, const Vec2& u_position, const Vec2& u_direction, const PhotonAim* aim) const {
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
    photon.position = light.at(st.x, st.y);
    photon.triangle = light.triangle;
    const Color radiance = light.varies ? varying_radiance(light.triangle, st.x, st.y) : light.radiance;
    if (aim && aim->solid_angle(photon.position.p) < kPi) {
      const PhotonAim::Direction aimed = aim->direction(photon.position.p, u_direction);
      const float cosine = glm::dot(aimed.w, light.n);
      photon.direction = aimed.w;
      photon.cos_theta = std::abs(cosine);
      if (cosine > 0 || light.double_sided)
        photon.flux = radiance * (photon.cos_theta * aimed.solid_angle * light.area() * inverse);
      return photon;
    }
    const bool back = light.double_sided && pick.u >= 0.5f;
    const float r = std::sqrt(u_direction.x), phi = 2 * kPi * u_direction.y;
    photon.cos_theta = std::sqrt(1 - u_direction.x);
    photon.direction = make_frame(back ? -light.n : light.n).to_world({r * std::cos(phi), r * std::sin(phi), photon.cos_theta});
    if (aim && aim->met(photon.position.p, photon.direction) == 0) return photon;
    photon.flux = radiance * (kPi * light.area() * (light.double_sided ? 2.0f : 1.0f) * inverse);
    return photon;
  }
  index -= area_.size();

  if (index < punctual_.size()) {
    const PunctualSource& light = punctual_[index];
    photon.position = {light.position, 0, Vec3(0)};
    photon.delta = true;
    if (aim && aim->solid_angle(light.position) < light.effective_solid_angle()) {
      const PhotonAim::Direction aimed = aim->direction(light.position, u_direction);
      photon.direction = aimed.w;
      photon.flux = light.intensity * (light.attenuation(glm::dot(aimed.w, light.direction)) * aimed.solid_angle * inverse);
      return photon;
    }
    const float cosine = light.sample_cos(u_direction.x), sine = safe_sqrt(1 - cosine * cosine), phi = 2 * kPi * u_direction.y;
    photon.direction = make_frame(light.direction).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine});
    if (aim && aim->met(light.position, photon.direction) == 0) return photon;
    photon.flux = light.intensity * (light.effective_solid_angle() * inverse);
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
  const float whole = kPi * sqr(scene_radius_);
  if (aim && aim->cross_section() < whole) {
    const PhotonAim::Origin origin = aim->origin(photon.direction, u_position);
    photon.position = {origin.p - scene_radius_ * photon.direction, 0, Vec3(0)};
    photon.flux *= origin.area;
    return photon;
  }
  photon.flux *= whole;
  const Frame frame = make_frame(photon.direction);
  const float r = scene_radius_ * std::sqrt(u_position.x), phi = 2 * kPi * u_position.y;
  photon.position = {frame.to_world({r * std::cos(phi), r * std::sin(phi), -scene_radius_}), 0, Vec3(0)};
  if (aim && aim->met(photon.position.p, photon.direction) == 0) photon.flux = Color(0);
  return photon;
}

}  // namespace ln
