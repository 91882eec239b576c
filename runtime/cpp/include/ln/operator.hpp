#pragma once
// What operator headers may use, and what they must offer.
//
// An operator is an aggregate: its node first, then its parameters under the names of its declaration, then what it has
// prepared (public, with initialisers, names ending in `_`). The generated program fills the parameters by name, so one that
// is missing or misspelt does not compile. Depending on its output:
//
//   Points       template <class Request, class In...> Color answer(Request&, const In&...) const
//                (an operator that bounds a recursion reads its input from a function marked LN_NOINLINE, all else is inlined)
//   pulled       the same for the representation's own kind of request, which names what is answered: Request::Answer
//   otherwise    an accessor that its consumers know, e.g. const Emitters& emission() const
//
// and, if it works before the picture, void prepare(PrepareContext&, const In&...), called once, in schedule order, with
// all ports that are marked `complete` (and those pulled) ready to be read.

#include <memory>
#include <utility>

#include "ln/prepare.hpp"
#include "ln/request.hpp"

namespace ln {

/// Is the request at a surface that `to` selects? Generated programs ask it for the parameter `to`, which no operator sees
/// itself. What is on no surface has no tags.
template <class Request>
bool reaches(Request& request, TagSelection to) {
  const std::uint32_t part = request.at().part;
  return to(part == kNoPart ? 0 : request.tracer().scene().part_tags(part));
}

/// A path expression of one event: the events that it allows on a surface. `Via` is a generated automaton:
/// next[state][event << tag_count | tags] with events in the order D, G, S and -1 for "no path", accepting[state]. Bit i of
/// `tags` is set where the surface has the tag Via::tags[i].
template <class Via>
constexpr Events single_step(Via, std::uint32_t tags = 0) {
  Events events = Events::none;
  constexpr Events kLetters[] = {Events::D, Events::G, Events::S};
  for (std::uint32_t e = 0; e < 3; ++e) {
    const int next = Via::next[0][e << Via::tag_count | tags];
    if (next >= 0 && Via::accepting[next]) events = events | kLetters[e];
  }
  return events;
}

/// Calls `work.operator()<events>()` with the events that `Via`, an expression of one event, allows on the part: there is
/// code for each set of events that occurs, and where there are no tags, no choice. Nothing allowed: the answer is black.
template <class Via, class Work>
LN_INLINE Color with_step(Via via, const Scene& scene, std::uint32_t part, Work&& work) {
  if constexpr (Via::tag_count == 0) {
    return work.template operator()<single_step(Via{})>();
  } else {
    const Events allowed = single_step(via, tag_mask(scene.part_tags(part), Via::tags, Via::tag_count));
    constexpr auto occurs = [](Events events) {
      for (std::uint32_t tags = 0; tags < 1u << Via::tag_count; ++tags)
        if (single_step(Via{}, tags) == events) return true;
      return false;
    };
    Color answer(0);
    const auto try_set = [&]<std::size_t kBits>() {
      constexpr auto kEvents = static_cast<Events>(kBits);
      if constexpr (any(kEvents) && occurs(kEvents))
        if (allowed == kEvents) answer = work.template operator()<kEvents>();
    };
    [&]<std::size_t... kBits>(std::index_sequence<kBits...>) {
      (try_set.template operator()<kBits>(), ...);
    }(std::make_index_sequence<8>{});
    return answer;
  }
}

}  // namespace ln
