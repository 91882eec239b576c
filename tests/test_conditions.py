"""Conditions under which operators carry light, against a search for words in every possible scene."""

from __future__ import annotations

import random

import pytest

from lnc.driver import compile_network, describe_conditions
from lnc.library import Library
from lnc.passes import conditions as module
from lnc.passes.conditions import conditions, holds, merged
from lnc.paths.automaton import Nfa
from lnc.paths.regex import Renderer
from lnc.source import SourceFile

LETTERS = 5
FREE = 1 << LETTERS


def random_automaton(rng: random.Random) -> tuple[Nfa, dict[str, set[int]]]:
    nfa = Nfa()
    states = [0] + [nfa.state() for _ in range(rng.randint(1, 6))]
    for _ in range(rng.randint(1, 12)):
        source, target = rng.choice(states), rng.choice(states)
        if rng.random() < 0.2:
            nfa.skip(source, target)
        else:
            nfa.edge(source, rng.randrange(1, 2 * FREE), target)
    nfa.accepting = set(rng.sample(states, rng.randint(0, 2)))
    return nfa, {str(i): set(rng.sample(states, rng.randint(1, 2))) for i in range(3)}


def carries(nfa: Nfa, states: set[int], scene: int) -> bool:
    """Does some accepted word of the scene's letters run through one of the states?"""

    def reached(starts: set[int], steps: list[set[int]]) -> set[int]:
        seen, stack = set(starts), list(starts)
        while stack:
            for target in steps[stack.pop()] - seen:
                seen.add(target)
                stack.append(target)
        return seen

    steps = [
        {t for letters, t in edges if letters & (scene | FREE)} | set(silent)
        for edges, silent in zip(nfa.edges, nfa.silent, strict=True)
    ]
    back: list[set[int]] = [set() for _ in steps]
    for source, targets in enumerate(steps):
        for target in targets:
            back[target].add(source)
    return bool(states & reached({0}, steps) & reached(nfa.accepting, back))


@pytest.mark.parametrize("seed", range(60))
def test_conditions_are_exact(seed: int) -> None:
    nfa, wires = random_automaton(random.Random(seed))
    for wire, formula in conditions(nfa, wires, FREE).items():
        for scene in range(FREE):
            assert holds(formula, scene) == carries(nfa, wires[wire], scene), (wire, formula, bin(scene))


@pytest.mark.parametrize("seed", range(20))
def test_beyond_the_limit_nothing_is_skipped_wrongly(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LIMIT", 1)
    nfa, wires = random_automaton(random.Random(seed))
    for wire, formula in conditions(nfa, wires, FREE).items():
        for scene in range(FREE):
            assert holds(formula, scene) or not carries(nfa, wires[wire], scene)


def test_alternatives_that_differ_in_one_set_are_one() -> None:
    ways = [frozenset({0b001, 0b100}), frozenset({0b010, 0b100})]
    assert merged(ways) == ((0b011, 0b100),)


NETWORK = """
tag mirror = material "Mirror"
tag lamp   = node "Lamp"
light   = Lights()
direct  = Direct(light)
lamps   = Direct(Lights(from = lamp))
photons = ParticleTracer(light, via = S@mirror)
caustic = NNDensity(photons)
glossy  = PathTracer(direct, via = G@!mirror)
never   = PathTracer(Direct(light, to = lamp), via = D@!lamp)
pt      = PathTracer(direct + pt)
expect <= L (D|G|S)* E
image direct + lamps + caustic + glossy + never + pt
"""


def test_what_a_network_tests(library: Library) -> None:
    """Only operators whose light the scene may lack; what others need whole stays with them."""
    result = compile_network(SourceFile("test.ln", NETWORK), library)
    assert result.typed is not None, result.diagnostics
    renderer = Renderer(result.typed.alphabet)
    found = {
        node: sorted(" and ".join(sorted(map(renderer.noun, way))) for way in formula)
        for node, formula in describe_conditions(result).items()
    }
    caustic = ["diffuse surface and emitter and specular surface tagged mirror"]
    lamps = ["diffuse or glossy surface and emitter tagged lamp"]
    assert found == {
        "lamps_lights": lamps,
        "lamps": lamps,
        "photons": caustic,
        "photons_tree": caustic,
        "caustic": caustic,
        "glossy": ["emitter and glossy surface not tagged mirror"],
        "never_direct": [],
        "never": [],
    }
