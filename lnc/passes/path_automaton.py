"""The network as one weighted automaton over light paths.

    pt = PathTracer(direct + pt)    (direct.radiance) --silent--> [via] --D|G|S--> (pt.radiance) --silent--> [via] ...
    image direct + pt               (direct.radiance) --silent, "image"--> [closing] --D|G--> [S*] --E--> end

States are (wire, content, where the next event may lie, how many more steps of recursion are allowed). An operator adds
the edges that its `paths` declare; a term of a sum becomes a silent edge with its weight, marked with the hop that it
is. A result closes it: the picture by the event that each content allows at the surface that is seen, then S* E.
L@delta S* E carries no light and is left out.

On entry: a network with converters and sound cycles.
"""

from __future__ import annotations

from collections.abc import Iterable

from lnc.diagnostics import Hop
from lnc.library import SCATTERED, PathRule
from lnc.network import Network, Node, PathValue, Term
from lnc.paths.automaton import Dfa, Nfa, determinise
from lnc.paths.language import EMITTERS, Alphabet, path_dfa
from lnc.paths.weighted import Graph
from lnc.source import Span
from lnc.syntax import ast

State = tuple[str, str, int, int | None]
"""Wire, content, letters that may come next (for emission: the emitters that may begin), and steps left (None: any)."""

DEPTH_LIMIT = 1000
"""A recursion that is allowed to be deeper than this counts as unbounded."""


class PathAutomaton:
    """The automaton of a network. `graph` holds it; wires and results are sets of accepting states of it.

    Unless `bounded`, bounds on the depth of recursions are left out: a program may be started with others.
    """

    def __init__(self, network: Network, alphabet: Alphabet, bounded: bool = True) -> None:
        self.alphabet = alphabet
        self._bounded = bounded
        self.nodes = network.by_name()
        self.graph: Graph[Hop] = Graph()
        self.index: dict[State, int] = {}
        self._by_wire: dict[str, list[State]] = {name: [] for name in self.nodes}
        self._fresh: list[State] = []
        self._ends: dict[int, int] = {}  # emission states -> where their letter leads to
        self._parts: dict[tuple[str, PathRule], Dfa] = {}
        self._entries: dict[tuple[str, PathRule, str, int, int | None], int] = {}
        self._readers: dict[str, list[tuple[Node, PathRule, Term]]] = {name: [] for name in self.nodes}
        for node in network.nodes:
            for rule in node.op.paths:
                given = node.input(rule.port) if rule.port else None
                for term in given.terms if given else ():
                    self._readers[term.node].append((node, rule, term))
        for node in network.nodes:
            for rule in node.op.paths:
                if rule.port is None:
                    self._begin(node, rule)
        self._grow()

    # --- Wires and results --------------------------------------------------------------------------------------------

    def contents_of(self, wire: str) -> set[str]:
        return {content for _, content, _, _ in self._by_wire[wire]}

    def states_of(self, wire: str, content: str | None = None) -> list[int]:
        """The states of a wire; an emission's letter L is still to come there."""
        return [self.index[state] for state in self._by_wire[wire] if content in (None, state[1])]

    def arriving(self, wire: str, content: str) -> list[tuple[int, int]]:
        """The states of a wire with one content, and the events that may come next."""
        return [(self.index[key], key[2]) for key in self._by_wire[wire] if key[1] == content]

    def wire(self, wire: str, content: str | None = None) -> set[int]:
        """Accepting states for what a wire carries, with one content or with all together."""
        accepting: set[int] = set()
        for key in self._by_wire[wire]:
            state, (_, c, letters, _) = self.index[key], key
            if content not in (None, c):
                continue
            if c != "emission":
                accepting.add(state)
                continue
            if state not in self._ends:
                self._ends[state] = self.graph.state()
                self.graph.edge(state, letters, self._ends[state])
            accepting.add(self._ends[state])
        return accepting

    def surfaces(self, terms: Iterable[Term], result: str) -> set[int]:
        """Accepting states for the light that arrives at surfaces by a sum of wires (lightmap, probe)."""
        end = self.graph.state()
        for term in terms:
            for state in self.states_of(term.node):
                self.graph.skip(state, end, int(term.weight), Hop(result, term.span))
        return {end}

    def image(self, terms: Iterable[Term], span: Span, result: str = "image") -> set[int]:
        """Accepting states for a picture: emitters are seen (L S* E), and what arrives at surfaces."""
        start, specular, end = self.graph.state(), self.graph.state(), self.graph.state()
        self.graph.skip(0, start, mark=Hop(result, span))
        self.graph.edge(start, self.alphabet.emitters("area"), specular)
        self.graph.edge(specular, self.alphabet.events("S"), specular)
        self.graph.edge(specular, self.alphabet.eye, end)
        return {end} | self.seen(terms, result)

    def seen(self, terms: Iterable[Term], result: str = "image", baked: bool = False) -> set[int]:
        """Accepting states for what the eye sees of wires: scattered once as each content allows, then S* E.

        `baked`: as irradiance on the surfaces, scattered by D and seen at once.
        """
        specular, end = self.graph.state(), self.graph.state()
        if not baked:
            self.graph.edge(specular, self.alphabet.events("S"), specular)
        self.graph.edge(specular, self.alphabet.eye, end)
        closing: dict[int, int] = {}  # events that scatter towards the eye -> a state before them
        for term in terms:
            for key in self._by_wire[term.node]:
                _, content, letters, _ = key
                if content == "emission":
                    continue
                scattered = "".join(e for e in SCATTERED[content] if e in ("D" if baked else "DG"))
                seen = letters & self.alphabet.events(scattered)
                if seen not in closing:
                    closing[seen] = self.graph.state()
                    self.graph.edge(closing[seen], seen, specular)
                self.graph.skip(self.index[key], closing[seen], int(term.weight), Hop(result, term.span))
        return {end}

    def language(self, accepting: Iterable[int]) -> Dfa:
        """The set of words with a run of weight other than 0. Raises TooLarge."""
        graph, ends = self.graph, set(accepting)
        useful = sorted(graph.co_reachable(ends) | {0})
        number = {state: i for i, state in enumerate(useful)}
        edges = [[(letters, number[t]) for letters, t in graph.edges[s] if t in number] for s in useful]
        silent = [[number[e.target] for e in graph.silent[s] if e.weight and e.target in number] for s in useful]
        return determinise(Nfa(edges, silent, {number[s] for s in ends}))

    # --- Growing ------------------------------------------------------------------------------------------------------

    def _state(self, wire: str, content: str, letters: int, left: int | None) -> int:
        key = (wire, content, letters, left)
        if key not in self.index:
            self.index[key] = self.graph.state()
            self._by_wire[wire].append(key)
            self._fresh.append(key)
        return self.index[key]

    def _begin(self, node: Node, rule: PathRule) -> None:
        """Where the light starts: for emission, the letter L stays pending until it leaves."""
        emitters = self._emitters(node, rule)
        if rule.content == "emission":
            self.graph.skip(0, self._state(node.name, "emission", emitters, None))
            return
        middle = self.graph.state()
        self.graph.edge(0, emitters, middle)
        self._events(node, rule, rule.content, middle, "emission", self.alphabet.events(), None)

    def _grow(self) -> None:
        while self._fresh:
            state = self._fresh.pop()
            wire, content, letters, left = state
            for node, rule, term in self._readers[wire]:
                entry = self._entry(node, rule, content, letters, left)
                if entry is not None:
                    hop = None if node.op.output == "Emission" else Hop(node.name, term.span)
                    counted = self._counted(node, rule, content, letters)
                    self.graph.skip(self.index[state], entry, int(term.weight) if counted else 0, hop)

    def _counted(self, node: Node, rule: PathRule, content: str, letters: int) -> bool:
        """Of inputs that carry equal light, and of places where light arrives that is read as one, the first counts."""
        if rule.port in node.op.equal:
            return rule.port == node.op.equal[0]
        if not reads_places(rule, content):
            return True
        return bool(letters & self.places(node, rule)[0])

    def places(self, node: Node, rule: PathRule) -> list[int]:
        """For each tag combination on which a rule `in@from` reads its port, the events there."""
        assert rule.emitter is not None
        where = self._tagged(node, rule.emitter)
        return [self.alphabet.events("DGS", 1 << c) for c in range(self.alphabet.combinations) if where >> c & 1]

    def _entry(self, node: Node, rule: PathRule, content: str, letters: int, left: int | None) -> int | None:
        """Where light enters a rule of an operator; None where its recursion ends."""
        if node.op.recursion is not None and self._bounded:
            if left == 0:
                return None
            left = _fewest(None if left is None else left - 1, _steps_after(node))
        if node.op.prepares:
            left = None  # pulls begin anew
        key = (node.name, rule, content, letters, left)
        if key not in self._entries:
            self._entries[key] = self.graph.state()
            self._fill(node, rule, content, letters, left, self._entries[key])
        return self._entries[key]

    def _fill(self, node: Node, rule: PathRule, content: str, letters: int, left: int | None, entry: int) -> None:
        target = content if rule.content == "unchanged" else rule.content
        if content != "emission":
            if reads_places(rule, content):  # read there, and taken for what arrives anywhere
                letters = self.alphabet.events() if any(letters & p for p in self.places(node, rule)) else 0
            self._events(node, rule, target, entry, content, letters, left)
            return
        emitters = letters & self._emitters(node, rule)
        if target == "emission":
            if emitters:
                self.graph.skip(entry, self._state(node.name, "emission", emitters, left))
        elif emitters:
            middle = self.graph.state()
            self.graph.edge(entry, emitters, middle)
            self._events(node, rule, target, middle, "emission", self.alphabet.events(), left)

    def _events(
        self, node: Node, rule: PathRule, target: str, source: int, content: str, letters: int, left: int | None
    ) -> None:
        """The events of a rule behind `source`; the first of them is one of `letters` that `content` can scatter by."""
        receivers = self.alphabet.events("DGS", self._tagged(node, "to"))
        graph = self.graph
        if rule.tail is None:
            if letters & receivers:
                graph.skip(source, self._state(node.name, target, letters & receivers, left))
            return
        part = self._part(node, rule)
        first = first_tag_parameter(rule.tail)
        allowed = letters & self.alphabet.events(SCATTERED[content])
        if first:
            allowed &= self.alphabet.events("DGS", self._tagged(node, first))
        offset = [graph.state() for _ in part.edges]
        begin = graph.state()
        graph.skip(source, begin)
        for state, edges in enumerate(part.edges):
            for mask, to in edges:
                graph.edge(offset[state], mask, offset[to])
                if state == 0:
                    graph.edge(begin, mask & allowed, offset[to])
            if part.accepting[state]:
                graph.skip(offset[state], self._state(node.name, target, receivers, left))
        if part.accepting[0] and letters & receivers:
            graph.skip(begin, self._state(node.name, target, letters & receivers, left))

    def _part(self, node: Node, rule: PathRule) -> Dfa:
        """The automaton of a rule's events, its path parameters replaced by their values."""
        assert rule.tail is not None
        if (node.name, rule) not in self._parts:
            self._parts[node.name, rule] = path_dfa(_filled(node, rule.tail), self.alphabet)
        return self._parts[node.name, rule]

    def _emitters(self, node: Node, rule: PathRule) -> int:
        """The letters L that a rule lets through."""
        if rule.emitter is None or rule.emitter in EMITTERS:
            return self.alphabet.emitters(rule.emitter)
        return self.alphabet.emitters(None, self._tagged(node, rule.emitter))

    def _tagged(self, node: Node, parameter: str) -> int:
        """The tag combinations that a tags parameter selects."""
        return self.alphabet.where(tag_value(node, parameter))


def reads_places(rule: PathRule, content: str) -> bool:
    """Does a rule read light that has arrived on some surfaces only, as one, to give it to any?"""
    return rule.emitter not in (None, *EMITTERS) and content != "emission"


def _steps_after(node: Node) -> int | None:
    """How many more steps of recursion may follow one through this operator; None: any number."""
    value = node.parameter(node.op.depth_parameter) if node.op.depth_parameter else None
    bound = int(value.value) if value and isinstance(value.value, int | float) else 0
    return bound - 1 if 0 < bound <= DEPTH_LIMIT else None


def _fewest(a: int | None, b: int | None) -> int | None:
    return a if b is None else b if a is None else min(a, b)


def _filled(node: Node, tail: ast.PathExpression) -> ast.PathExpression:
    """The tail with path and tags parameters replaced by their values."""
    match tail:
        case ast.PathEvents(_, tag) if tag is not None:
            return tail.changed(tag=tag_value(node, tag.name))
        case ast.PathName(name):
            value = node.parameter(name)
            return value.value.expression if value and isinstance(value.value, PathValue) else tail
        case ast.PathConcat(items) | ast.PathUnion(items):
            return tail.changed(items=tuple(_filled(node, i) for i in items))
        case ast.PathRepeat(item):
            return tail.changed(item=_filled(node, item))
    return tail


def tag_value(node: Node, parameter: str) -> ast.TagRef | None:
    """What a tags parameter selects; None: everything."""
    given = node.parameter(parameter)
    return given.value if given and isinstance(given.value, ast.TagRef) else None


def first_tag_parameter(tail: ast.PathExpression | None) -> str | None:
    """The parameter that says where the first event of a rule lies, if there is one: `from` of `via@from`."""
    head = tail.items[0] if isinstance(tail, ast.PathConcat) else tail
    return head.tag.name if isinstance(head, ast.PathName) and head.tag else None
