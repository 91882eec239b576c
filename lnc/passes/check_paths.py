"""Is every light path counted exactly as often as expected?

    image direct + again + pt        LN0301: LDE is counted 2 times: direct -> image, again -> image
    expect L S* E | L D E            LN0302: LDE is missing
    image direct - twice             LN0303: LDE is counted -1 times
    PathTracer(smooth, from = a)     LN0304: can never carry light

A result without `expect` is checked against all light, and what it lacks is a warning. Each kind of fault at a result
is reported once, by a shortest path. `expect` is about the picture, or the other results where there is none.
On entry: a network that has passed every other check.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product

from lnc.diagnostics import Hop, Related, Reporter, Witness
from lnc.library import CONTENTS, PathRule
from lnc.network import Expectation, Input, Node, Term, TypedNetwork
from lnc.passes.path_automaton import PathAutomaton, reads_places, tag_value
from lnc.paths.automaton import Dfa, TooLarge, intersection
from lnc.paths.language import ALL_ARRIVING, ALL_LIGHT, DARK, EMITTERS, EVENTS, Alphabet, path_dfa
from lnc.paths.regex import Renderer
from lnc.paths.weighted import (
    Fault,
    SilentCycle,
    Weighted,
    common_blocks,
    find_faults,
    first_difference,
    runs,
    weighted_dfa,
    weighted_graph,
)
from lnc.source import Span

CODES = {"often": "LN0301", "missing": "LN0302", "negative": "LN0303"}
ROUTE_LIMIT = 4
SPELLING_LIMIT = 256  # words that may be counted to shorten the letters of one

Light = list[tuple[int, int]]
"""States of the automaton, with how often each counts."""


def check_paths(typed: TypedNetwork, reporter: Reporter, exact: bool = False, complete: bool = True) -> None:
    """Report what is wrong with the light paths of each result. `exact`: decide in rationals, not in a prime field.

    Unless `complete`, this is a part of a network that has other mistakes: what is merely absent is not reported.
    """
    with suppress(SilentCycle):  # which has been reported
        _Checker(typed, reporter, exact, complete).run()


@dataclass(frozen=True)
class _Target:
    """What is checked: a result or a wire, and how messages call it."""

    name: str  # "image", or the wire's name
    span: Span
    accepting: frozenset[int]
    closed: bool  # paths end at the eye
    beside: bool = False  # beside a picture, to which `expect` belongs: may lack what it wants


class _Checker:
    def __init__(self, typed: TypedNetwork, reporter: Reporter, exact: bool, complete: bool) -> None:
        self.complete = complete
        self.network = typed.network
        self.reporter = reporter
        self.alphabet = typed.alphabet
        self.automaton = PathAutomaton(typed.network, typed.alphabet)
        self.renderer = Renderer(typed.alphabet)
        self.exact = exact

    def run(self) -> None:
        network, automaton = self.network, self.automaton
        targets: list[tuple[_Target, Expectation | None]] = []
        given = [e for e in network.expectations if e.wire is None]
        if network.image is not None:
            span = network.image.span
            accepting = frozenset(automaton.image(network.image.terms, span))
            image = _Target("image", span, accepting, True)
            targets += [(image, e) for e in given] or (
                [] if self._is_difference(network.image.terms) else [(image, None)]
            )
            given = []
        for expectation in network.expectations:
            if expectation.wire is not None:
                accepting = frozenset(automaton.wire(expectation.wire))
                targets.append((_Target(expectation.wire, expectation.span, accepting, False), expectation))
        stored = [("probe", p.terms, p.span) for p in network.probes]
        stored += [("lightmap", m.terms, m.span) for m in network.lightmaps]
        for name, terms, span in stored:
            accepting = frozenset(automaton.surfaces(terms, name))
            target = _Target(name, span, accepting, False, network.image is not None)
            targets += [(target, e) for e in given] or [(target, None)]
        ends = {s for target, _ in targets for s in target.accepting}
        for tap in network.taps:
            ends |= {s for term in tap.terms for s in automaton.wire(term.node)}
        if self.complete:
            self._check_dead(ends)
        for node in network.nodes:
            self._check_equal(node)
            self._check_places(node)
        if not any(d.code == "LN0307" for d in self.reporter.diagnostics):  # else counts would tell of that again
            for target, expected in targets:
                self._check(target, expected)

    def _is_difference(self, terms: tuple[Term, ...]) -> bool:
        """Light paths of a picture of a difference have been taken away on purpose."""
        return len(terms) == 1 and self.network.by_name()[terms[0].node].op.name == "Difference"

    # --- Results ------------------------------------------------------------------------------------------------------

    def _check(self, target: _Target, expectation: Expectation | None) -> None:
        wanted = self._wanted(target, expectation)
        if wanted is None:
            return
        graph = self.automaton.graph
        blocks = common_blocks([graph.edges, wanted.edges])
        counts = self._weighted(target.accepting, blocks)
        expected = weighted_dfa(wanted, blocks)
        at_most = expectation.at_most if expectation else target.beside or not self.complete
        if not at_most and first_difference(counts, expected, self.exact) is None:
            return
        kinds = ("often", "negative") if at_most else tuple(CODES)
        for fault in find_faults(counts, expected, kinds):
            self._report(target, expectation, fault, counts, expected)

    def _wanted(self, target: _Target, expectation: Expectation | None) -> Dfa | None:
        """What is expected, without the dark L@delta S* E; None if it is no set of light paths, which is reported."""
        wanted = everything = path_dfa(ALL_LIGHT if target.closed else ALL_ARRIVING, self.alphabet)
        if expectation is not None:
            try:
                wanted = path_dfa(expectation.path, self.alphabet)
            except TooLarge:
                message = "this path expression is too complicated: its automaton has too many states"
                self.reporter.error("LN0104", expectation.path.span, message)
                return None
            if not self._well_formed(target, expectation, wanted, everything):
                return None
        return intersection(wanted, path_dfa(DARK, self.alphabet), negated=True) if target.closed else wanted

    def _weighted(self, accepting: Iterable[int], blocks: tuple[int, ...]) -> Weighted:
        try:
            return weighted_graph(self.automaton.graph, accepting, blocks)
        except SilentCycle as cycle:
            self._report_silent(cycle.states)
            raise

    def _well_formed(self, target: _Target, expectation: Expectation, wanted: Dfa, everything: Dfa) -> bool:
        """Can every expected word be a light path at all?"""
        wrong = intersection(wanted, everything, negated=True)
        if wrong.is_empty:
            return True
        word = wrong.shortest_word()
        end = ", then E: the eye" if target.closed else "; E is no part of what a wire carries"
        text = "".join(self._names(letters)[0] for letters in word) or "()"
        message = f"no light path reads {text}: it begins with L, then events D, G, S{end}"
        self.reporter.error("LN0104", expectation.span, message)
        return False

    def _report(
        self, target: _Target, expectation: Expectation | None, fault: Fault, counts: Weighted, expected: Weighted
    ) -> None:
        masks = [counts.blocks[b] for b in fault.word]
        names = self._spell(fault, counts, expected)
        path = "".join(names)
        routes = self._routes(target, masks, fault)
        times = f"{fault.count} time{'s' if fault.count != 1 else ''}"
        if fault.kind == "missing":
            message = f"{path} is missing"
            if fault.count:
                message = f"{path} is counted {times}, expected once"
        elif fault.expected or expectation is None or fault.kind == "negative":
            message = f"{path} is counted {times}"
        else:
            message = f"{path} is carried, but not expected (counted {times})"
        message += "" if target.name == "image" else f" on '{target.name}'"
        related = [Related(expectation.span, "expected here")] if expectation and target.closed else []
        help = self._help(target, expectation, fault, masks, names)
        severity = "warning" if fault.kind == "missing" and expectation is None else "error"
        witness = Witness(path, fault.count, fault.expected, routes)
        self.reporter.error(
            CODES[fault.kind], target.span, message, related=related, help=help, witness=witness, severity=severity
        )

    def _help(
        self, target: _Target, expectation: Expectation | None, fault: Fault, masks: list[int], names: list[str]
    ) -> str:
        if fault.kind == "often" and fault.expected:
            return "leave out one of the routes, or subtract one of them"
        if fault.kind == "often":
            return "add it to what is expected, or leave its route out"
        if fault.kind == "negative":
            return "subtract only what has been added before"
        lost = self._lost(masks, names)
        if expectation is not None:
            return lost
        return f"{lost}; if this is on purpose, say so: expect {self._picture(target)}"

    def _picture(self, target: _Target) -> str:
        try:
            return self.renderer.text(self.automaton.language(target.accepting))
        except TooLarge:
            return "EXPRESSION"

    def _lost(self, masks: list[int], names: list[str]) -> str:
        """How far the network follows a path that is missing, in words."""
        graph = self.automaton.graph
        wire_of = {state: wire for (wire, _, _, _), state in self.automaton.index.items()}
        at = _silently(graph.silent, {0})
        read, wires = 0, {wire_of[s] for s in at if s in wire_of}
        for letters in masks:
            following = {t for s in at for found, t in graph.edges[s] if found & letters}
            if not following:
                break
            at = _silently(graph.silent, following)
            read += 1
            wires = {wire_of[s] for s in at if s in wire_of} or wires
        shown = sorted(wires)[:3]
        if read == len(masks):
            return "what carries it is subtracted again"
        if not shown or not read:
            return "no operator begins such a path"
        return f"the network follows it as far as {''.join(names[:read])}, on {' and '.join(map(repr, shown))}"

    # --- Words and routes ---------------------------------------------------------------------------------------------

    def _routes(self, target: _Target, masks: list[int], fault: Fault) -> tuple[tuple[Hop, ...], ...]:
        """The wires that carry the path, route by route; for negative counts those that subtract come first."""
        found = runs(self.automaton.graph, target.accepting, masks, 4 * ROUTE_LIMIT)
        found.sort(key=lambda run: (run[0] > 0) == (fault.kind == "negative"))
        routes: list[tuple[Hop, ...]] = []
        for weight, hops in found:
            route = tuple(hops) if target.closed or not hops else (*hops,)
            routes += [route] * min(abs(weight), 2)
        return tuple(routes[: max(2, min(abs(fault.count), ROUTE_LIMIT))])

    def _spell(self, fault: Fault, counts: Weighted, expected: Weighted) -> list[str]:
        """The path as letters. One that stands for more, all counted alike, is written so: LDE for both kinds of L."""
        blocks = counts.blocks
        chosen: list[list[int]] = [[b] for b in fault.word]

        def alike(choice: list[list[int]]) -> bool:
            size = 1
            for options in choice:
                size *= len(options)
            return size <= SPELLING_LIMIT and all(
                counts.count(word) == fault.count and expected.count(word) == fault.expected
                for word in product(*choice)
            )

        names: list[str] = []
        for i, block in enumerate(fault.word):
            narrow = self._one_kind(blocks[block])
            for wide in self._wider(narrow):
                options = [b for b, letters in enumerate(blocks) if letters & wide]
                covered = sum(blocks[b] for b in options)
                if wide & ~covered == 0 and alike([*chosen[:i], options, *chosen[i + 1 :]]):
                    chosen[i] = options
                    narrow = wide
                    break
            names.append(self._names(narrow)[0])
        return names

    def _one_kind(self, letters: int) -> int:
        """The letters of the first kind (L@area, L@delta, D, G, S, E) among these."""
        for kind in self._kinds():
            if letters & kind:
                return letters & kind
        return letters

    def _wider(self, letters: int) -> list[int]:
        """Sets of letters that hold these and read better, the widest first."""
        wider = [kind for kind in self._kinds() if kind & letters]
        if letters & self.alphabet.emitters():
            wider.insert(0, self.alphabet.emitters())
        for tag in self.alphabet.tags:
            for negated in (False, True):
                inside = self.alphabet.combinations_with(tag, negated)
                wider += [k & _everywhere(self.alphabet, inside) for k in wider if k & letters]
        return [w for w in dict.fromkeys(wider) if letters & ~w == 0 and w != letters]

    def _kinds(self) -> list[int]:
        emitters = [self.alphabet.emitters(kind) for kind in EMITTERS]
        return [*emitters, *(self.alphabet.events(e) for e in EVENTS), self.alphabet.eye]

    def _names(self, letters: int) -> list[str]:
        return self.renderer.letter_names(self._one_kind(letters) if letters != self.alphabet.emitters() else letters)

    # --- Operators ----------------------------------------------------------------------------------------------------

    def _check_dead(self, ends: set[int]) -> None:
        """LN0304 for operators whose light is none, or never arrives at a result; the first of a chain only."""
        graph, automaton = self.automaton.graph, self.automaton
        ended = {name: automaton.wire(name) for name in automaton.nodes}
        reachable, useful = graph.reachable(), graph.co_reachable(ends)
        states = {name: found & reachable for name, found in ended.items()}
        needed = _upstream(automaton.nodes, self._result_wires())
        for name, node in automaton.nodes.items():
            if name not in needed:
                continue
            sources = {t.node for i in node.inputs for t in i.terms}
            if not states[name]:
                if all(states[s] for s in sources):
                    related = [
                        Related(automaton.nodes[s].span, f"'{s}' carries {self._carried(s)}") for s in sorted(sources)
                    ]
                    message = f"'{name}' can never carry light"
                    help = "no path that arrives can go on here: look at its via, from and to"
                    self.reporter.error("LN0304", node.span, message, related=related, help=help)
            elif not any(s in useful for s in automaton.states_of(name)):
                readers = [
                    n for n in automaton.nodes.values() if any(t.node == name for i in n.inputs for t in i.terms)
                ]
                if all(states[r.name] for r in readers) and any(useful & states[r.name] for r in readers):
                    message = f"'{name}' can never carry light to a result"
                    help = f"it carries {self._carried(name)}, which nothing that reads it can scatter"
                    related = [Related(r.span, f"'{r.name}' reads it") for r in readers[:4]]
                    self.reporter.error("LN0304", node.span, message, related=related, help=help)

    def _carried(self, wire: str) -> str:
        texts = []
        for content in CONTENTS:
            if self.automaton.states_of(wire, content):
                texts.append(
                    f"{self.renderer.text(self.automaton.language(self.automaton.wire(wire, content)))} as {content}"
                )
        return ", ".join(texts) or "nothing"

    def _result_wires(self) -> set[str]:
        network = self.network
        shown = {t.node for _, terms in network.results() for t in terms}
        return shown | {e.wire for e in network.expectations if e.wire is not None}

    def _check_equal(self, node: Node) -> None:
        """LN0307 where ports of an operator must carry equal light paths, everywhere, and do not.

        Each content is compared with its like, unless the operator makes one content of all.
        """
        ports = [given for given in map(node.input, node.op.equal) if given is not None]
        apart = any(rule.content == "unchanged" for rule in node.op.paths if rule.port in node.op.equal)
        where = self.alphabet.where(tag_value(node, "to"))
        places = [self.alphabet.events(EVENTS, 1 << c) for c in range(self.alphabet.combinations) if where >> c & 1]
        groups = [(content,) for content in CONTENTS] if apart else [CONTENTS]
        for other, contents in product(ports[1:], groups):
            pairs = [[self._light(given, contents, place) for given in (ports[0], other)] for place in places]
            anywhere = all(lights == pairs[0] for lights in pairs)
            for i, (place, lights) in enumerate(zip(places, pairs, strict=True)):
                found = self._unequal(*lights) if lights not in pairs[:i] else None
                if found is None:
                    continue
                path, *counts = found
                message = f"'{node.op.name}' takes wires of equal light paths, but {path} is counted"
                message += f" {counts[0]} and {counts[1]} times"
                message += "" if anywhere else f" before {self._names(place & self.alphabet.events('D'))[0]}"
                content = f", as {contents[0]}" if apart else ""
                related = [
                    Related(given.span, f"{count} times here{content}")
                    for given, count in zip((ports[0], other), counts, strict=True)
                ]
                witness = Witness(path, counts[1], counts[0], ())
                self.reporter.error("LN0307", node.span, message, related=related, witness=witness)
                return

    def _light(self, given: Input, contents: Sequence[str], place: int) -> Light:
        """What arrives by an input, with these contents, where the next event is one of `place`."""
        return [
            (state, int(term.weight))
            for term in given.terms
            for content in contents
            for state, letters in self.automaton.arriving(term.node, content)
            if letters & place
        ]

    def _check_places(self, node: Node) -> None:
        """LN0307 where an operator reads light all over a part of the scene, of which some has other light paths."""
        for rule in node.op.paths:
            given = node.input(rule.port) if rule.port else None
            if given is None:
                continue
            for content in CONTENTS:
                if reads_places(rule, content) and self._differs(node, rule, given, content):
                    return

    def _differs(self, node: Node, rule: PathRule, given: Input, content: str) -> bool:
        places = self.automaton.places(node, rule)
        lights = [self._light(given, (content,), place) for place in places]
        for place, light in zip(places, lights, strict=True):
            found = self._unequal(lights[0], light) if light != lights[0] else None
            if found is None:
                continue
            path, first, other = found
            diffuse = self.alphabet.events("D")
            where = [
                f"{count} time{'s' if count != 1 else ''} before {self._names(letters & diffuse)[0]}"
                for count, letters in ((first, places[0]), (other, place))
            ]
            message = f"'{node.op.name}' takes light that arrives alike all over what it reads, but {path}"
            message += f" is counted {' and '.join(where)}"
            help = f"read it where it arrives: {rule.emitter} = TAG"
            self.reporter.error("LN0307", given.span, message, help=help, witness=Witness(path, other, first, ()))
            return True
        return False

    def _unequal(self, one: Light, other: Light) -> tuple[str, int, int] | None:
        """A shortest path that sums of states with weights count differently, and both counts."""
        graph = self.automaton.graph
        ends = []
        for light in (one, other):
            end = graph.state()
            for state, weight in light:
                graph.skip(state, end, weight)
            ends.append({end})
        blocks = common_blocks([graph.edges])
        a, b = (self._weighted(end, blocks) for end in ends)
        word = first_difference(a, b, self.exact)
        if word is None:
            return None
        return "".join(self._names(a.blocks[i])[0] for i in word), a.count(word), b.count(word)

    def _report_silent(self, states: list[int]) -> None:
        """LN0402 for a cycle that adds no event."""
        names = {state: wire for (wire, _, _, _), state in self.automaton.index.items()}
        wires = list(dict.fromkeys(names[s] for s in states if s in names))
        first = self.automaton.nodes[wires[0]]
        message = f"this cycle adds no event: {' -> '.join([*wires, wires[0]])}"
        related = [Related(self.automaton.nodes[w].span, f"'{w}' is on it") for w in wires[1:9]]
        help = "its light paths would be counted infinitely often; let an operator on it scatter the light"
        self.reporter.error("LN0402", first.span, message, related=related, help=help)


def _everywhere(alphabet: Alphabet, where: int) -> int:
    """All letters but E, on a set of tag combinations."""
    return alphabet.emitters(None, where) | alphabet.events(EVENTS, where)


def _silently(silent: list[list], states: set[int]) -> set[int]:  # type: ignore[type-arg]
    """The states that silent edges lead to, these included."""
    seen, stack = set(states), list(states)
    while stack:
        for edge in silent[stack.pop()]:
            if edge.weight and edge.target not in seen:
                seen.add(edge.target)
                stack.append(edge.target)
    return seen


def _upstream(nodes: dict[str, Node], wires: set[str]) -> set[str]:
    """The nodes that these wires need."""
    seen, stack = set(wires), list(wires)
    while stack:
        for given in nodes[stack.pop()].inputs:
            for term in given.terms:
                if term.node not in seen:
                    seen.add(term.node)
                    stack.append(term.node)
    return seen
