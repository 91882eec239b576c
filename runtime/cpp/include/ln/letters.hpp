#pragma once
// Which letters of light paths a scene has, and which operators can carry light in it.
//
// A letter is a kind (an area or a delta emitter; a diffuse, glossy or specular event) on something with a combination of
// the network's tags. A wire can carry light only where the scene has all letters of one of its light paths; what the
// compiler knows of that is a rule for each operator, tested once after loading.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace ln {

class Scene;

/// A set of letters: for each kind a bit for each combination of tags, a number whose bit i is the i-th tag told apart.
struct LetterSet {
  enum Kind : std::uint8_t { area_emitter, delta_emitter, diffuse, glossy, specular };

  std::array<std::uint64_t, 5> kinds{};

  constexpr bool meets(const LetterSet& other) const {
    for (std::size_t k = 0; k < kinds.size(); ++k)
      if (kinds[k] & other.kinds[k]) return true;
    return false;
  }
};

/// The letters that the scene may have: never too few. `tags`: numbers of the network's tags that its paths tell apart.
LetterSet letters_of(const Scene& scene, std::span<const int> tags);

/// As a line of numbers, kind by kind.
std::string letters_text(const LetterSet& letters);

/// One of several letters that a light path needs.
struct LetterNeed {
  LetterSet letters;
  const char* noun;  // what the scene lacks without them: "specular surface"
};

/// When an operator carries no light: if the scene meets all needs of none of the alternatives.
struct SkipRule {
  std::uint16_t node;
  bool* skipped;  // set if the operator carries no light
  std::span<const LetterNeed> needs = {};
  std::span<const std::uint64_t> alternatives = {};  // bit i: needs[i]
};

/// Why the operator carries no light in a scene with these letters; nothing if it may.
std::optional<std::string> skip_reason(const SkipRule& rule, const LetterSet& scene);

}  // namespace ln
