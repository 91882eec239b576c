#pragma once
// Sets of whole light paths, L (D|G|S)* E, as deterministic automata.

#include <bitset>
#include <span>

#include "ln/scene.hpp"

namespace ln {

/// A regular language of light paths, from the light to the eye. A letter is an emitter (area, delta) or an event (D, G, S),
/// each with the tags of the surface or light, or the eye. State 0 is the start; every state lies on the way to an accepted
/// word.
class PathLanguage {
 public:
  static constexpr int kMaxStates = 256;
  /// States, as a set: what the language looks like from the eye. A path whose rest is known is accepted if its
  /// beginning leads to one of them. For languages of up to kMaxStates states.
  using States = std::bitset<kMaxStates>;

  /// `next[state][letter]`, -1: no such path. `tags`: numbers of the network's tags that letters tell apart.
  template <std::size_t kStates, std::size_t kLetters>
  constexpr PathLanguage(const int (&next)[kStates][kLetters], const bool (&accepting)[kStates], std::span<const int> tags = {})
      : next_(&next[0][0]), accepting_(accepting, kStates), tags_(tags), letters_(static_cast<int>(kLetters)) {}
  /// Without accepting states: to walk through only.
  template <std::size_t kStates, std::size_t kLetters>
  constexpr explicit PathLanguage(const int (&next)[kStates][kLetters], std::span<const int> tags = {})
      : next_(&next[0][0]), tags_(tags), letters_(static_cast<int>(kLetters)) {}

  // Letters, in the order of lnc/paths/language.py.
  int emitter(bool delta, TagSet tags) const { return (delta ? 1 : 0) * combinations() + combination(tags); }
  /// `event`: 0 to 2 for D, G, S.
  int event(int event, TagSet tags) const { return event_at(event, combination(tags)); }
  /// On surfaces with a combination of tags.
  int event_at(int event, int combination) const { return (2 + event) * combinations() + combination; }
  int eye() const { return letters_ - 1; }

  /// The state after a letter; -1: no path goes on.
  int after(int state, int letter) const { return next_[state * letters_ + letter]; }
  bool accepts(int state) const { return accepting_[static_cast<std::size_t>(state)]; }

  /// Number of combinations of tags that letters tell apart, and the one that `tags` belongs to.
  int combinations() const { return 1 << tags_.size(); }
  int combination(TagSet tags) const {
    int result = 0;
    for (std::size_t i = 0; i < tags_.size(); ++i) result |= static_cast<int>(tags >> tags_[i] & 1u) << i;
    return result;
  }
  /// Numbers of the network's tags, in the order of the bits of a combination.
  std::span<const int> tags() const { return tags_; }

  /// The states that accept the empty rest.
  States ends() const {
    States states;
    for (std::size_t s = 0; s < accepting_.size(); ++s) states[s] = accepting_[s];
    return states;
  }
  /// The states that a letter leads from to one of `states`.
  States before(const States& states, int letter) const {
    States result;
    for (std::size_t s = 0; s < accepting_.size(); ++s) {
      const int target = after(static_cast<int>(s), letter);
      result[s] = target >= 0 && states[static_cast<std::size_t>(target)];
    }
    return result;
  }

 private:
  const int* next_;
  std::span<const bool> accepting_;
  std::span<const int> tags_;
  int letters_;
};

}  // namespace ln
