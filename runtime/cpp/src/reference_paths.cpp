#include "ln/reference_paths.hpp"

#include <algorithm>
#include <map>

namespace ln {

EmitterClasses::EmitterClasses(const Scene& scene, const PathLanguage& letters) {
  const SceneData& data = scene.data();
  std::map<int, int> found;  // letter -> class; -1: no light
  const auto class_of = [&](bool delta, TagSet tags) {
    const int letter = letters.emitter(delta, tags);
    const auto [entry, is_new] = found.try_emplace(letter, -1);
    if (!is_new) return entry->second;
    EmitterSelection selection;
    for (std::uint32_t i = 0; i < data.parts.size(); ++i)
      selection.parts.push_back(letter == letters.emitter(false, scene.part_tags(i)));
    for (std::size_t i = 0; i < data.lights.size(); ++i)
      selection.lights.push_back(letter == letters.emitter(true, scene.light_tags(i)));
    std::unique_ptr<Emitters> emitters = scene.selected_emitters(selection, letter == letters.emitter(false, 0));
    if (emitters->empty()) return -1;
    entry->second = static_cast<int>(classes_.size());
    classes_.push_back({delta, letter, std::move(emitters)});
    return entry->second;
  };
  for (std::uint32_t i = 0; i < data.parts.size(); ++i) parts_.push_back(class_of(false, scene.part_tags(i)));
  for (std::size_t i = 0; i < data.lights.size(); ++i) class_of(true, scene.light_tags(i));
  environment_ = class_of(false, 0);
}

std::array<float, kEventCount> event_probabilities(const Interaction& at, const EventChoice& allowed) {
  constexpr float kLeast = 0.05f;  // albedos may be estimates
  std::array<float, kEventCount> probabilities{};
  float sum = 0;
  for (int e = 0; e < kEventCount; ++e) {
    if (!allowed[e] || !any(at.bsdf().events() & kEvents[e])) continue;
    probabilities[e] = std::max(max_component(at.bsdf().albedo(at.wo_local, kEvents[e])), kLeast);
    sum += probabilities[e];
  }
  for (float& p : probabilities)
    if (sum > 0) p /= sum;
  return probabilities;
}

Scattering scatter(const Interaction& at, const std::array<float, kEventCount>& probabilities, Carried carried,
                   Random& random) {
  Scattering result;
  float u = random.get1();
  int event = -1;
  for (int e = 0; e < kEventCount && u >= 0; ++e) {
    if (!(probabilities[e] > 0)) continue;
    event = e;
    u -= probabilities[e];
  }
  if (event < 0) return result;
  const float u_lobe = random.get1();
  BsdfSample sample;
  if (!at.bsdf().sample(at.wo_local, u_lobe, random.get2(), kEvents[event], carried, sample)) return result;
  result.direction = at.frame.to_world(sample.wi);
  if (!at.side_agrees(result.direction, sample.wi.z)) return result;
  result.event = event;
  result.weight = sample.weight / probabilities[event];
  result.pdf_w = sample.pdf_w * probabilities[event];
  return result;
}

Color scattered(const Interaction& at, const Vec3& w, int event, Carried carried) {
  const Vec3 local = at.frame.to_local(w);
  if (!at.side_agrees(w, local.z)) return Color(0);
  return at.bsdf().f_cos(at.wo_local, local, kEvents[event], carried);
}

float arrival_factor(const Interaction& at) { return at.wo_local.z / std::abs(glm::dot(at.wo, at.at.ng)); }

float departure_factor(const Interaction& at, const Vec3& w) {
  return std::abs(glm::dot(w, at.at.ng) / glm::dot(w, at.frame.n));
}

}  // namespace ln
