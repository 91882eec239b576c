#pragma once
// What operator headers may use, and what they must offer.
//
// An operator is an aggregate: its node first, then its parameters under the names of its declaration, then what it has
// prepared (public, with initialisers, names ending in `_`). The generated program fills the parameters by name, so one that
// is missing or misspelt does not compile. Depending on its output:
//
//   Points       template <class Request, class In...> Color answer(Request&, const In&...) const
//                (an operator that bounds a recursion reads its input from a function marked LN_NOINLINE, all else is inlined)
//   otherwise    an accessor that its consumers know, e.g. const Emitters& emission() const
//
// and, if it works before the picture, void prepare(PrepareContext&, const In&...), called once, in schedule order, with
// all ports that are marked `complete` (and those pulled) ready to be read.

#include <memory>

#include "ln/prepare.hpp"
#include "ln/request.hpp"

namespace ln {

/// Is the request at a surface with one of the tags `to`? Generated programs ask it for the parameter `to`, which no operator
/// sees itself.
template <class Request>
bool reaches(Request& request, TagSet to) {
  return to == kAnyTag || (request.tracer().scene().part_tags(request.at().part) & to);
}

/// A path expression of one event, as the set of events that it allows. `Via` is a generated automaton:
/// next[state][event] with events in the order D, G, S and -1 for "no path", accepting[state].
template <class Via>
constexpr Events single_step(Via) {
  Events events = Events::none;
  constexpr Events kLetters[] = {Events::D, Events::G, Events::S};
  for (int e = 0; e < 3; ++e) {
    const int next = Via::next[0][e];
    if (next >= 0 && Via::accepting[next]) events = events | kLetters[e];
  }
  return events;
}

}  // namespace ln
