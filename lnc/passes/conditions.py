"""When an operator can carry light: which letters a scene must have, as a formula for each wire.

    caustic = NNDensity(ParticleTracer(light, via = S+))     (an emitter) and (S) and (D)
    direct  = Direct(light)                                  (an emitter) and (D or G)
    lit     = Direct(Lights(from = lamp))                    (an emitter tagged lamp) and (D or G)

A wire matters for a result if some accepted word runs through one of its states. Each edge of that way needs the scene
to have one of its letters. So the condition is a disjunction (ways) of conjunctions (edges) of letter sets, of which
only the weakest conjunctions are kept. It is found from the two halves of the ways: what it takes to get from the
start to a state, and from there to the end. Parameters that change when a program starts do not change paths, so
conditions are known when it is compiled.

Where there are too many conjunctions, the condition becomes "always": no operator is ever skipped wrongly.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations

from lnc.network import Network, Schedule
from lnc.passes.path_automaton import PathAutomaton
from lnc.paths.automaton import Nfa
from lnc.paths.language import Alphabet

Conjunction = frozenset[int]  # of letter sets: the scene has a letter of each
Formula = tuple[tuple[int, ...], ...]
"""A disjunction of conjunctions of letter sets (bits of an Alphabet). `()` is never, `((),)` always."""

ALWAYS: Formula = ((),)
LIMIT = 48  # conjunctions at one state, or of one wire


NOTHING = 0  # letters of a step that needs nothing of the scene


def light_conditions(network: Network, alphabet: Alphabet) -> dict[str, Formula]:
    """What a scene must have for each wire to carry light to some result."""
    automaton = PathAutomaton(network, alphabet, bounded=False)
    pictures = [network.image.terms] if network.image else []
    pictures += [tap.terms for tap in network.taps]
    accepting = automaton.seen(term for terms in pictures for term in terms)
    measured = [probe.terms for probe in network.probes] + [lightmap.terms for lightmap in network.lightmaps]
    for terms in measured:  # nobody sees it: light only arrives
        accepting |= automaton.surfaces(terms, "measured")
    silent = [[edge.target for edge in edges] for edges in automaton.graph.silent]
    states = {node.name: automaton.states_of(node.name) for node in network.nodes}
    return conditions(Nfa(automaton.graph.edges, silent, accepting), states, alphabet.eye)


def conditions(nfa: Nfa, wires: Mapping[str, Iterable[int]], free: int) -> dict[str, Formula]:
    """For each wire, given by its states: what the scene must have for an accepted word to run through one of them.

    A letter in `free` is there in every scene.
    """
    onward: list[list[tuple[int, int]]] = [[] for _ in nfa.edges]
    back: list[list[tuple[int, int]]] = [[] for _ in nfa.edges]
    for source, (edges, silent) in enumerate(zip(nfa.edges, nfa.silent, strict=True)):
        for letters, target in [*edges, *((NOTHING, t) for t in silent)]:
            needed = NOTHING if letters & free else letters
            onward[source].append((needed, target))
            back[target].append((needed, source))
    from_start, to_end = _needs(onward, {0}), _needs(back, nfa.accepting)
    found: dict[str, Formula] = {}
    for wire, states in wires.items():
        ways: list[Conjunction] = []
        for state in states:
            for begin in from_start[state]:
                for end in to_end[state]:
                    _add(ways, begin | end)
        found[wire] = merged(ways if len(ways) <= LIMIT else [frozenset()])
    return found


def skip_conditions(plan: Schedule, formulas: Mapping[str, Formula], alphabet: Alphabet) -> dict[str, Formula]:
    """The operators whose condition a program tests, sources first.

    What another operator reads whole must be there if that one works, and what a tap stores always. Operators that only
    pull are not worth a test if a scene can lack nothing but emitters, of which there always are some, or surfaces that
    are seen.
    """
    stored = {term.node for tap in plan.stored_taps for term in tap.terms}
    readers: dict[str, list[str]] = {node.name: [] for node in plan.nodes}  # those that read a wire whole
    for node in plan.nodes:
        for given in node.inputs:
            for term in given.terms if not given.port.pulled else ():
                readers[term.node].append(node.name)
    complete = {node.name: ALWAYS if node.name in stored else formulas[node.name] for node in plan.nodes}
    before: dict[str, Formula] = {}
    while before != complete:  # more than twice only where cycles are read whole
        before = dict(complete)
        for node in reversed(plan.nodes):
            complete[node.name] = union([complete[node.name], *(complete[reader] for reader in readers[node.name])])

    usual = (alphabet.emitters(), alphabet.events("DG"))
    rare = {name for name, formula in complete.items() if not implied_by(formula, usual)}
    tested = rare | {node.name for node in plan.nodes if node.prepares} - stored
    while idle := {name for name in tested - rare if not tested.issuperset(readers[name])}:
        tested -= idle
    return {node.name: complete[node.name] for node in plan.nodes if node.name in tested}


def union(formulas: Iterable[Formula]) -> Formula:
    """One of them holds."""
    ways: list[Conjunction] = []
    for formula in formulas:
        for way in formula:
            _add(ways, frozenset(way))
    return merged(ways)


def holds(formula: Formula, scene: int) -> bool:
    """Does it hold in a scene with these letters?"""
    return any(all(letters & scene for letters in way) for way in formula)


def implied_by(formula: Formula, sets: Iterable[int]) -> bool:
    """Does the formula hold in every scene that has a letter of each of these sets?"""
    return any(all(any(given & ~needed == 0 for given in sets) for needed in way) for way in formula)


def merged(ways: Iterable[Conjunction]) -> Formula:
    """The same with fewer conjunctions, in a fixed order: (a and x) or (a and y) is a and (x or y)."""
    left = set(ways)
    again = True
    while again:
        again = False
        for one, other in combinations(sorted(left, key=sorted), 2):
            if len(one) == len(other) and len(one - other) == 1:
                (x,), (y,) = one - other, other - one
                left -= {one, other}
                kept: list[Conjunction] = []
                for way in [*left, (one & other) | {x | y}]:
                    _add(kept, frozenset(way))
                left = set(kept)
                again = True
                break
    return tuple(sorted(tuple(sorted(way)) for way in left))


def _needs(steps: list[list[tuple[int, int]]], starts: Iterable[int]) -> list[list[Conjunction]]:
    """For each state: the weakest conjunctions that it takes to get there from a start."""
    needs: list[list[Conjunction]] = [[] for _ in steps]
    stack = list(starts)
    for state in stack:
        needs[state] = [frozenset()]
    while stack:
        state = stack.pop()
        for letters, target in steps[state]:
            changed = False
            for way in list(needs[state]):
                changed |= _add(needs[target], way | {letters} if letters != NOTHING else way)
            if len(needs[target]) > LIMIT:
                needs[target] = [frozenset()]
            if changed:
                stack.append(target)
    return needs


def _add(ways: list[Conjunction], way: Conjunction) -> bool:
    """Add a conjunction, unless a weaker one is there; remove those that it is weaker than."""
    way = frozenset(s for s in way if not any(other != s and other & ~s == 0 for other in way))
    if any(_weaker(given, way) for given in ways):
        return False
    ways[:] = [given for given in ways if not _weaker(way, given)]
    ways.append(way)
    return True


def _weaker(one: Conjunction, other: Conjunction) -> bool:
    """Does `one` hold wherever `other` does?"""
    return all(any(given & ~needed == 0 for given in other) for needed in one)
