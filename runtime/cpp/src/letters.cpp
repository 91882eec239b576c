#include "ln/letters.hpp"

#include <bit>

#include "ln/material.hpp"
#include "ln/scene.hpp"

namespace ln {

LetterSet letters_of(const Scene& scene, std::span<const int> tags) {
  const SceneData& data = scene.data();
  const auto bit_of = [&](TagSet given) {
    return std::uint64_t{1} << tag_mask(given, tags.data(), static_cast<int>(tags.size()));
  };
  std::vector<Events> events;
  for (const Material& material : data.materials) events.push_back(possible_events(data, material));

  LetterSet letters;
  if (scene.emitters().has_environment()) letters.kinds[LetterSet::area_emitter] |= 1;  // it has no tags
  for (std::uint32_t i = 0; i < data.parts.size(); ++i) {
    const Part& part = data.parts[i];
    if (part.triangle_count == 0) continue;
    const std::uint64_t bit = bit_of(scene.part_tags(i));
    if (data.materials[part.material].emits()) letters.kinds[LetterSet::area_emitter] |= bit;
    const Events possible = events[part.material];
    if (any(possible & Events::D)) letters.kinds[LetterSet::diffuse] |= bit;
    if (any(possible & Events::G)) letters.kinds[LetterSet::glossy] |= bit;
    if (any(possible & Events::S)) letters.kinds[LetterSet::specular] |= bit;
  }
  for (std::uint32_t i = 0; i < data.lights.size(); ++i)
    if (max_component(data.lights[i].intensity) > 0) letters.kinds[LetterSet::delta_emitter] |= bit_of(scene.light_tags(i));
  return letters;
}

std::string letters_text(const LetterSet& letters) {
  std::string text;
  for (const std::uint64_t kind : letters.kinds) text += (text.empty() ? "" : " ") + std::to_string(kind);
  return text + "\n";
}

std::optional<std::string> skip_reason(const SkipRule& rule, const LetterSet& scene) {
  std::uint64_t missing = 0;
  for (std::size_t i = 0; i < rule.needs.size(); ++i)
    if (!rule.needs[i].letters.meets(scene)) missing |= std::uint64_t{1} << i;

  // Name the alternative that lacks least.
  std::optional<std::uint64_t> least;
  for (const std::uint64_t alternative : rule.alternatives) {
    const std::uint64_t lacks = alternative & missing;
    if (lacks == 0) return std::nullopt;
    if (!least || std::popcount(lacks) < std::popcount(*least)) least = lacks;
  }
  if (!least) return "no light path of the results leads through it";
  std::string reason;
  for (std::size_t i = 0; i < rule.needs.size(); ++i)
    if (*least >> i & 1) reason += std::string(reason.empty() ? "the scene has no " : " and no ") + rule.needs[i].noun;
  return reason;
}

}  // namespace ln
