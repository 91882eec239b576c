"""Counting light paths: against brute force over all words up to a length, and against automata-lib.

The oracle for networks reads their text by itself: it follows a word backwards through the wires, from the rules of the
operators as a person would apply them, without any automaton. Path expressions become Python's `re`.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import product

import pytest

from lnc.diagnostics import Witness
from lnc.driver import compile_network
from lnc.library import Library
from lnc.paths.automaton import Dfa, TooLarge, intersection, union
from lnc.paths.language import Alphabet, path_dfa
from lnc.paths.weighted import (
    PRIMES,
    Graph,
    SilentCycle,
    Weighted,
    ambiguous,
    common_blocks,
    count_table,
    difference,
    find_faults,
    first_difference,
    nonzero_word,
    runs,
    unexpected,
    weighted_dfa,
    weighted_graph,
)
from lnc.paths.weighted import (
    product as word_product,
)
from lnc.source import SourceFile

# --- Automata by themselves -------------------------------------------------------------------------------------------

LETTERS = 3
LONGEST = 7


def random_graph(rng: random.Random, states: int, negative: bool) -> tuple[Graph[str], set[int]]:
    """Silent edges lead to higher states only, so there is no silent cycle."""
    graph: Graph[str] = Graph()
    for _ in range(states - 1):
        graph.state()
    for _ in range(rng.randint(states // 2, 2 * states)):
        graph.edge(rng.randrange(states), rng.randrange(1, 1 << LETTERS), rng.randrange(states))
    for i in range(rng.randint(0, states)):
        source = rng.randrange(states - 1)
        weight = rng.choice((-1, 1, 1, 2)) if negative else rng.choice((0, 1, 1, 1, 2))
        graph.skip(source, rng.randrange(source + 1, states), weight, f"s{i}")
    return graph, set(rng.sample(range(states), rng.randint(1, 2)))


def counted(graph: Graph[str], accepting: set[int], word: tuple[int, ...]) -> int:
    """Sum of the weights of all runs, one by one."""

    def rest(state: int, at: int) -> int:
        total = int(at == len(word) and state in accepting)
        if at < len(word):
            total += sum(rest(t, at + 1) for letters, t in graph.edges[state] if letters >> word[at] & 1)
        return total + sum(s.weight * rest(s.target, at) for s in graph.silent[state])

    return rest(0, 0)


def all_words(length: int) -> Iterator[tuple[int, ...]]:
    for n in range(length + 1):
        yield from product(range(LETTERS), repeat=n)


def in_blocks(a: Weighted, word: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(next(i for i, block in enumerate(a.blocks) if block >> letter & 1) for letter in word)


SINGLE = tuple(1 << i for i in range(LETTERS))


@pytest.mark.parametrize("seed", range(60))
def test_counts_and_routes_are_those_of_all_runs(seed: int) -> None:
    rng = random.Random(seed)
    graph, accepting = random_graph(rng, rng.randint(2, 7), negative=seed % 2 == 1)
    found = weighted_graph(graph, accepting, SINGLE)
    coarse = weighted_graph(graph, accepting, common_blocks([graph.edges]))
    known = set().union(*(_letters(block) for block in coarse.blocks))
    for word in all_words(5):
        count = counted(graph, accepting, word)
        assert found.count(word) == count
        if set(word) <= known:
            assert coarse.count(in_blocks(coarse, word)) == count
        ways = runs(graph, accepting, [1 << letter for letter in word], 20_000)
        assert sum(weight for weight, _ in ways) == count


@pytest.mark.parametrize("seed", range(60))
def test_a_table_counts_as_its_series_do(seed: int) -> None:
    """Signed and unsigned side by side; the counts of automata with ambiguous cycles may outgrow any table."""
    graph, accepting = random_graph(random.Random(seed), 2 + seed % 5, negative=True)
    series = [weighted_graph(g, accepting, SINGLE) for g in (graph, graph.unsigned())]
    try:
        table = count_table(series, 200)
    except TooLarge:
        return
    for word in all_words(5):
        state = 0
        for letter in word:
            state = table.next[state][letter] if state >= 0 else -1
        counts = table.counts[state] if state >= 0 else (0, 0)
        assert counts == (counted(graph, accepting, word), counted(graph.unsigned(), accepting, word))


def _letters(block: int) -> set[int]:
    return {i for i in range(LETTERS) if block >> i & 1}


@pytest.mark.parametrize("seed", range(150))
def test_differences_are_the_shortest(seed: int) -> None:
    """A random automaton against a random one, or against itself written differently."""
    rng = random.Random(seed)
    graphs = [random_graph(rng, rng.randint(2, 5), negative=True) for _ in range(2)]
    a, b = (weighted_graph(*g, SINGLE) for g in graphs)
    words = (w for w in all_words(LONGEST) if a.count(w) != b.count(w))
    shortest = next(words, None)
    for exact in (False, True):
        found = first_difference(a, b, exact)
        assert (found is None) == (shortest is None)
        if found is not None and shortest is not None:
            assert len(found) == len(shortest) and a.count(found) != b.count(found)
    twice = Weighted(a.blocks, {s: 2 * w for s, w in a.start.items()}, a.rows, a.final)
    assert first_difference(difference(twice, a), a) is None


@pytest.mark.parametrize("seed", range(150))
def test_polynomial_searches_agree_with_all_words(seed: int) -> None:
    """Ambiguity by the self-product, support outside of an expectation, and the pointwise product."""
    rng = random.Random(seed)
    graph, accepting = random_graph(rng, rng.randint(2, 5), negative=False)
    a = weighted_graph(graph, accepting, SINGLE)
    expected = weighted_dfa(random_language(rng), SINGLE)
    twice = next((w for w in all_words(LONGEST) if a.count(w) > 1), None)
    outside = next((w for w in all_words(LONGEST) if a.count(w) and not expected.count(w)), None)
    for found, wanted in ((ambiguous(a), twice), (unexpected(a, expected), outside)):
        assert found is None if wanted is None else found is not None and len(found) == len(wanted)
    squared = word_product(a, a)
    assert all(squared.count(w) == a.count(w) ** 2 for w in all_words(4))


def random_language(rng: random.Random) -> Dfa:
    """A language over the three events D, G, S, moved to the letters 0, 1, 2."""
    alphabet = Alphabet()
    dfa = path_dfa(parsed(random_expression(rng, 3)), alphabet)
    shift = (alphabet.events("D")).bit_length() - 1
    return Dfa(tuple(tuple((m >> shift, t) for m, t in row) for row in dfa.edges), dfa.accepting)


@pytest.mark.parametrize("seed", range(150))
def test_each_kind_of_fault_is_found_by_a_shortest_word(seed: int) -> None:
    rng = random.Random(seed)
    graph, accepting = random_graph(rng, rng.randint(2, 5), negative=seed % 3 == 0)
    a = weighted_graph(graph, accepting, SINGLE)
    expected = weighted_dfa(random_language(rng), SINGLE)
    faults = {f.kind: f for f in find_faults(a, expected)}
    for kind in ("often", "missing", "negative"):
        wrong = (w for w in all_words(LONGEST) if kind_of(a.count(w), expected.count(w)) == kind)
        shortest = next(wrong, None)
        if shortest is None:
            assert kind not in faults or len(faults[kind].word) > LONGEST
            continue
        fault = faults[kind]
        assert len(fault.word) == len(shortest)
        assert (fault.count, fault.expected) == (a.count(fault.word), expected.count(fault.word))
        assert kind_of(fault.count, fault.expected) == kind


def kind_of(count: int, expected: int) -> str | None:
    if count == expected and count >= 0:
        return None
    return "negative" if count < 0 else "often" if count > expected else "missing"


def test_a_large_automaton_is_decided_without_being_made_deterministic(monkeypatch: pytest.MonkeyPatch) -> None:
    """`(D|G)* D (D|G){n}` twice: 2^n sets of states, but a self-product of n^2."""
    monkeypatch.setattr("lnc.paths.weighted.FAULT_BUDGET", 50)
    graph: Graph[str] = Graph()
    states = [graph.state() for _ in range(14)]
    graph.edge(0, 0b11, 0)
    for source, target in zip([0, *states], states, strict=False):
        graph.edge(source, 0b01 if source == 0 else 0b11, target)
    a = weighted_graph(graph, {states[-1]}, SINGLE)
    assert ambiguous(a) is None
    again = Weighted(a.blocks, a.start, a.rows, tuple(2 * f for f in a.final))
    everything = weighted_dfa(path_dfa_of("(D|G|S)*"), SINGLE)
    kinds = {f.kind: f for f in find_faults(again, everything)}
    assert len(kinds["often"].word) == 14 and kinds["often"].count == 2


def path_dfa_of(text: str) -> Dfa:
    alphabet = Alphabet()
    shift = (alphabet.events("D")).bit_length() - 1
    dfa = path_dfa(parsed(text), alphabet)
    return Dfa(tuple(tuple((m >> shift, t) for m, t in row) for row in dfa.edges), dfa.accepting)


def test_a_silent_cycle_has_no_count() -> None:
    graph: Graph[str] = Graph()
    a, b = graph.state(), graph.state()
    graph.skip(0, a)
    graph.skip(a, b)
    graph.skip(b, a)
    graph.edge(b, 1, b)
    with pytest.raises(SilentCycle) as caught:
        weighted_graph(graph, {b}, SINGLE)
    assert set(caught.value.states) == {a, b}


def test_a_multiple_of_the_first_prime_is_seen_by_the_second() -> None:
    """A difference of exactly PRIMES[0] is zero in the first field, as the module says."""
    blocks = (1,)
    a = Weighted(blocks, {0: PRIMES[0]}, (({1: 1},), ({},)), (0, 1))
    b = Weighted(blocks, {}, (), ())
    assert all(pow(3, p - 1, p) == 1 for p in PRIMES)
    assert nonzero_word(a, PRIMES[0]) == (0,), "a word is recounted in whole numbers, so even this is found"
    assert first_difference(a, b) == (0,) == first_difference(a, b, exact=True)


# --- Expressions against automata-lib ---------------------------------------------------------------------------------


def random_expression(rng: random.Random, depth: int) -> str:
    """Over D, G, S, in the syntax that we and Python's `re` share."""
    if depth == 0 or rng.random() < 0.25:
        return rng.choice("DGS")
    inner = [random_expression(rng, depth - 1) for _ in range(2)]
    return rng.choice((f"({inner[0]}|{inner[1]})", f"{inner[0]}{inner[1]}", f"({inner[0]})*", f"({inner[0]})?"))


def parsed(text: str):  # type: ignore[no-untyped-def]
    from lnc.diagnostics import Reporter
    from lnc.syntax.parse import parse

    spaced = re.sub(r"(?<=[DGS)*?])(?=[DGSLE(])", " ", text)
    (statement,) = parse(SourceFile("path", f"expect {spaced}"), Reporter()).statements
    return statement.path  # type: ignore[union-attr]


@pytest.mark.parametrize("seed", range(60))
def test_languages_agree_with_automata_lib(seed: int) -> None:
    automata = pytest.importorskip("automata.fa.nfa")
    from automata.fa.dfa import DFA

    rng = random.Random(seed)
    texts = [random_expression(rng, 4) for _ in range(2)]
    ours = [path_dfa(parsed(text), Alphabet()) for text in texts]
    theirs = [DFA.from_nfa(automata.NFA.from_regex(text, input_symbols=set("DGS"))) for text in texts]
    pairs = [*zip(ours, theirs, strict=True), (union(*ours), theirs[0] | theirs[1])]
    pairs += [(intersection(*ours), theirs[0] & theirs[1]), (intersection(*ours, negated=True), theirs[0] - theirs[1])]
    for mine, other in pairs:
        assert exported(mine, DFA) == other


def exported(dfa: Dfa, kind):  # type: ignore[no-untyped-def]
    alphabet = Alphabet()
    transitions = {
        str(state): {e: str(t) for letters, t in row for e in "DGS" if letters & alphabet.events(e)}
        for state, row in enumerate(dfa.edges)
    }
    accepting = {str(s) for s, a in enumerate(dfa.accepting) if a}
    return kind(
        states=set(transitions),
        input_symbols=set("DGS"),
        transitions=transitions,
        initial_state="0",
        final_states=accepting,
        allow_partial=True,
    )


# --- Networks against brute force -------------------------------------------------------------------------------------

SCATTER = {"irradiance": "D", "samples": "DG", "radiance": "DGS"}
VIAS = ("S+", "(D|G|S)*", "S D", "(D|S)* G?", "D{1,2}")
EXPECTATIONS = (
    "L(D|G|S)*E",
    "L S*E|L (D|G)S*E",
    "L@area(D|G|S)*E|L@delta(D|G)(D|G|S)*E",
    "L S*E|L D S*E",
    "L (D|G|S){0,2}E",
)


@dataclass
class RandomNetwork:
    """A network that only uses what comes before, or itself through PathTracer; its own little syntax tree."""

    wires: dict[str, tuple] = field(default_factory=dict)  # type: ignore[type-arg]
    image: list[tuple[int, str]] = field(default_factory=list)
    expect: str | None = None
    at_most: bool = False

    def text(self) -> str:
        lines = ["light = Lights()"]
        for name, (op, inputs, extra) in self.wires.items():
            arguments = (
                [" ".join(f"{'-' if w < 0 else '+'} {i}" for w, i in inputs).lstrip("+ ")] if inputs else ["light"]
            )
            if op in ("ParticleTracer", "PathTracer"):
                arguments.append(f"via = {extra}")
            lines.append(f"{name} = {op}({', '.join(arguments)})")
        if self.expect:
            lines.append(f"expect {'<= ' if self.at_most else ''}{self.expect}")
        lines.append("image " + " ".join(f"{'-' if w < 0 else '+'} {i}" for w, i in self.image).lstrip("+ "))
        return "\n".join(lines) + "\n"

    def oracle(self):  # type: ignore[no-untyped-def]
        """word, a tuple of letters such as ("L@area", "D", "E") -> its count in the picture."""

        @cache
        def arrives(wire: str, content: str, word: tuple[str, ...]) -> int:
            op, inputs, extra = self.wires[wire]
            if op == "Direct":
                return int(word == ({"radiance": "L@area", "samples": "L@delta"}.get(content),))
            if op == "ParticleTracer":
                begins = len(word) > 0 and word[0].startswith("L")
                return int(content == "samples" and begins and bool(re.fullmatch(pattern(extra), "".join(word[1:]))))
            if op == "NNDensity":
                return content == "irradiance" and arrives(inputs[0][1], "samples", word)
            if op == "Scale":
                return sum(w * arrives(i, content, word) for w, i in inputs)
            assert op == "PathTracer"
            if content != "radiance" or len(word) < 2 or word[-1] not in events(extra):
                return 0
            before = [c for c, scattered in SCATTER.items() if word[-1] in scattered]
            return sum(w * arrives(i, c, word[:-1]) for w, i in inputs for c in before)

        def seen(word: tuple[str, ...]) -> int:
            if len(word) < 2 or word[-1] != "E" or not word[0].startswith("L"):
                return 0
            count = int(word[0] == "L@area" and set(word[1:-1]) <= {"S"})
            end = len(word) - 1
            while end > 1 and word[end - 1] == "S":
                end -= 1
            if end > 1:
                before = [c for c, scattered in SCATTER.items() if word[end - 1] in scattered]
                count += sum(w * arrives(i, c, word[: end - 1]) for w, i in self.image for c in before)
            return count

        return seen


def pattern(path: str) -> str:
    return path.replace(" ", "").replace("L@area", "a").replace("L@delta", "d").replace("L", "[ad]")


def events(via: str) -> str:
    return re.sub("[^DGS]", "", via)


def random_network(rng: random.Random) -> RandomNetwork:
    network = RandomNetwork()
    points: list[str] = []
    for i in range(rng.randint(1, 6)):
        name = f"w{i}"
        op = rng.choice(("Direct", "NNDensity", "Scale", "PathTracer", "PathTracer")) if points else "Direct"
        if op == "NNDensity":
            network.wires[f"p{i}"] = ("ParticleTracer", [], rng.choice(VIAS))
            network.wires[name] = (op, [(1, f"p{i}")], None)
        elif op == "Direct":
            network.wires[name] = (op, [], None)
        else:
            inputs = random_sum(rng, points + ([name] if op == "PathTracer" and rng.random() < 0.6 else []))
            network.wires[name] = (op, inputs, rng.choice(("D|G|S", "D|G|S", "D", "D|G", "S")))
        points.append(name)
    network.image = random_sum(rng, points)
    if rng.random() < 0.8:
        network.expect = rng.choice(EXPECTATIONS)
        network.at_most = rng.random() < 0.3
    return network


def random_sum(rng: random.Random, wires: list[str]) -> list[tuple[int, str]]:
    terms = [(rng.choice((1, 1, 1, 1, -1)), rng.choice(wires)) for _ in range(rng.randint(1, 3))]
    return [(1, terms[0][1]), *terms[1:]]


def spelled(path: str) -> list[tuple[str, ...]]:
    """The words that a witness stands for."""
    letters = re.findall(r"L@area|L@delta|[LDGSE]", path)
    assert "".join(letters) == path
    kinds = [("L@area", "L@delta") if letter == "L" else (letter,) for letter in letters]
    return list(product(*kinds))


def check_random_network(network: RandomNetwork, library: Library, longest: int) -> set[str]:
    """The kinds of faults of a network, which the compiler must have found by shortest words."""
    text = network.text()
    result = compile_network(SourceFile("random.ln", text), library)
    codes = {d.code for d in result.diagnostics}
    if codes & {"LN0305", "LN0402"}:  # the light paths are not looked at then
        return {"another error"}
    oracle = network.oracle()
    wanted = pattern(network.expect or "L(D|G|S)*E")

    def expected(word: tuple[str, ...]) -> int:
        dark = word[0] == "L@delta" and set(word[1:-1]) <= {"S"}
        letters = "".join(word).replace("L@area", "a").replace("L@delta", "d")
        return int(not dark and bool(re.fullmatch(wanted, letters)))

    shortest: dict[str, int] = {}
    for n in range(longest - 1):
        for middle in product("DGS", repeat=n):
            for emitter in ("L@area", "L@delta"):
                word = (emitter, *middle, "E")
                kind = kind_of(oracle(word), expected(word))
                if kind and not (network.at_most and kind == "missing"):
                    shortest.setdefault(kind, len(word))
    witnesses: dict[str, Witness] = {}
    for diagnostic in result.diagnostics:
        kind = {"LN0301": "often", "LN0302": "missing", "LN0303": "negative"}.get(diagnostic.code)
        if kind:
            assert diagnostic.witness is not None and kind not in witnesses
            witnesses[kind] = diagnostic.witness
            warned = kind == "missing" and network.expect is None
            assert diagnostic.severity == ("warning" if warned else "error")
    for kind, length in shortest.items():
        assert kind in witnesses, (text, kind)
        assert len(spelled(witnesses[kind].path)[0]) == length, (text, kind)
    for kind, witness in witnesses.items():
        words = spelled(witness.path)
        assert kind in shortest or len(words[0]) > longest, (text, kind)
        for word in words:
            assert (oracle(word), expected(word)) == (witness.count, witness.expected), (text, word)
        if witness.count > 0:
            assert all(route[-1].wire == "image" for route in witness.routes) and witness.routes
    return set(shortest)


@pytest.mark.parametrize("seed", range(8))
def test_random_networks_against_brute_force(seed: int, library: Library) -> None:
    rng = random.Random(seed)
    found = [check_random_network(random_network(rng), library, 6) for _ in range(30)]
    for kind in ("often", "missing", "negative"):
        assert any(kind in kinds for kinds in found) and any(kind not in kinds for kinds in found)


@pytest.mark.slow
def test_ten_thousand_random_networks(library: Library) -> None:
    rng = random.Random(1998)
    for _ in range(10_000):
        check_random_network(random_network(rng), library, 6)
