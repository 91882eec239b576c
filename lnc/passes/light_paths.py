"""The light paths on every wire and in the picture, as regular expressions.

    direct = Direct(light)              direct.radiance: L@area    direct.samples: L@delta
    pt     = PathTracer(direct + pt)    pt.radiance: L@area (D|G|S)+ | L@delta (D|G) (D|G|S)*
    image  direct + pt                  L@area (D|G|S)* E | L@delta (D|G) (D|G|S)* E

The network is one automaton. Its states are (wire, content, where the next event may lie); an operator adds the
edges that its `paths` declare. A wire's language ends in its states; the picture's closes each of them by the event
that the content allows at the surface that is seen, then S* E.

On entry: a network with converters, its contents, its cycles sound. Only sets are kept here, not counts.
"""

from __future__ import annotations

from lnc.library import CONTENTS, SCATTERED, PathRule
from lnc.network import Network, Node, PathReport, PathValue, Term
from lnc.paths.automaton import Nfa, TooLarge, determinise
from lnc.paths.language import EMITTERS, Alphabet, add_path
from lnc.paths.regex import Renderer
from lnc.syntax import ast

State = tuple[str, str, int]  # wire, content, letters that may come next (for emission: the emitters that may begin)


def light_paths(network: Network, alphabet: Alphabet) -> PathReport:
    """Readable expressions; "too many to print" where an automaton outgrows its limit."""
    automaton = _NetworkAutomaton(network, alphabet)
    renderer = Renderer(alphabet)
    wires: dict[str, tuple[tuple[str, str], ...]] = {}
    for node in network.nodes:
        found = automaton.contents_of(node.name)
        wires[node.name] = tuple(
            (c, _render(automaton.wire(node.name, c), renderer)[1]) for c in CONTENTS if c in found
        )
    image = None
    if network.image is not None:
        # L@delta S* E carries no light, so the simpler of both is as true.
        image = min(_render(automaton.image(network.image.terms, emitters), renderer) for emitters in (None, "area"))[1]
    return PathReport(wires, image)


def seen_paths(network: Network, alphabet: Alphabet) -> dict[str, str]:
    """What the eye sees of each wire that has a picture of its own (a term of `image ... layers` or of a `tap`, or a
    `WireTap`): its paths, closed as the picture closes them, without the emitters that are seen."""
    automaton = _NetworkAutomaton(network, alphabet)
    renderer = Renderer(alphabet)
    terms = [t for tap in network.taps for t in tap.terms]
    if network.image is not None and network.image.layers:
        terms += network.image.terms
    shown = {t.node for t in terms} | {n.name for n in network.nodes if n.op.name == "WireTap"}
    return {name: _render(automaton.seen({name}), renderer)[1] for name in sorted(shown)}


def _render(nfa: Nfa, renderer: Renderer) -> tuple[int, str]:
    try:
        return renderer.scored(determinise(nfa))
    except TooLarge:
        return 1_000_000, "too many to print"


class _NetworkAutomaton:
    def __init__(self, network: Network, alphabet: Alphabet) -> None:
        self.alphabet = alphabet
        self.nodes = network.by_name()
        self.nfa = Nfa()
        self.index: dict[State, int] = {}
        self.fresh: list[State] = []
        self.readers: dict[str, list[tuple[Node, PathRule]]] = {name: [] for name in self.nodes}
        for node in network.nodes:
            for rule in node.op.paths:
                given = node.input(rule.port) if rule.port else None
                for wire in dict.fromkeys(term.node for term in given.terms) if given else ():
                    self.readers[wire].append((node, rule))
        for node in network.nodes:
            for rule in node.op.paths:
                if rule.port is None:
                    self._begin(node, rule)
        self._grow()

    def contents_of(self, wire: str) -> set[str]:
        return {content for name, content, _ in self.index if name == wire}

    def _state(self, wire: str, content: str, letters: int) -> int:
        key = (wire, content, letters)
        if key not in self.index:
            self.index[key] = self.nfa.state()
            self.fresh.append(key)
        return self.index[key]

    def _begin(self, node: Node, rule: PathRule) -> None:
        """Where the light starts: for emission, the letter L stays pending until it leaves."""
        emitters = self._emitters(node, rule)
        if rule.content == "emission":
            self.nfa.skip(0, self._state(node.name, "emission", emitters))
            return
        middle = self.nfa.state()
        self.nfa.edge(0, emitters, middle)
        self._tail(node, rule, rule.content, middle, "emission", self.alphabet.events())

    def _emitters(self, node: Node, rule: PathRule) -> int:
        """The letters L that a rule lets through."""
        if rule.emitter is None or rule.emitter in EMITTERS:
            return self.alphabet.emitters(rule.emitter)
        return self.alphabet.emitters(None, self._tagged(node, rule.emitter))

    def _tagged(self, node: Node, parameter: str) -> int:
        """The tag combinations that a tags parameter selects."""
        value = node.parameter(parameter)
        tag = value.value if value else None
        return self.alphabet.combinations_with(tag if isinstance(tag, str) else None)

    def _grow(self) -> None:
        while self.fresh:
            wire, content, letters = state = self.fresh.pop()
            source = self.index[state]
            for node, rule in self.readers[wire]:
                target = content if rule.content == "unchanged" else rule.content
                if content != "emission":
                    self._tail(node, rule, target, source, content, letters)
                    continue
                emitters = letters & self._emitters(node, rule)
                if target == "emission":
                    if emitters:
                        self.nfa.skip(source, self._state(node.name, "emission", emitters))
                    continue
                middle = self.nfa.state()
                self.nfa.edge(source, emitters, middle)
                if emitters:
                    self._tail(node, rule, target, middle, "emission", self.alphabet.events())

    def _tail(self, node: Node, rule: PathRule, target: str, source: int, content: str, letters: int) -> None:
        """The events of a rule behind `source`; the first of them is one of `letters` that `content` can scatter by."""
        receivers = self.alphabet.events("DGS", self._tagged(node, "to"))
        if rule.tail is None:
            left = letters & receivers
            if left:
                self.nfa.skip(source, self._state(node.name, target, left))
            return
        part = Nfa()
        end = add_path(part, self._filled(node, rule.tail), 0, self.alphabet)
        part.accepting = {end}
        dfa = determinise(part)
        first = first_tag_parameter(rule.tail)
        allowed = letters & self.alphabet.events(SCATTERED[content])
        if first:
            allowed &= self.alphabet.events("DGS", self._tagged(node, first))
        offset = [self.nfa.state() for _ in dfa.edges]
        begin = self.nfa.state()
        self.nfa.skip(source, begin)
        for state, edges in enumerate(dfa.edges):
            for mask, to in edges:
                self.nfa.edge(offset[state], mask, offset[to])
                if state == 0:
                    self.nfa.edge(begin, mask & allowed, offset[to])
            if dfa.accepting[state]:
                self.nfa.skip(offset[state], self._state(node.name, target, receivers))
        if dfa.accepting[0] and letters & receivers:
            self.nfa.skip(begin, self._state(node.name, target, letters & receivers))

    def _filled(self, node: Node, tail: ast.PathExpression) -> ast.PathExpression:
        """The tail with path parameters replaced by their values."""
        match tail:
            case ast.PathName(name):
                value = node.parameter(name)
                return value.value.expression if value and isinstance(value.value, PathValue) else tail
            case ast.PathConcat(items) | ast.PathUnion(items):
                return tail.changed(items=tuple(self._filled(node, i) for i in items))
            case ast.PathRepeat(item):
                return tail.changed(item=self._filled(node, item))
        return tail

    # --- Languages ----------------------------------------------------------------------------------------------------

    def wire(self, name: str, content: str) -> Nfa:
        """What a wire carries with one content."""
        nfa = Nfa(list(self.nfa.edges), list(self.nfa.silent), set())
        for (wire, kind, letters), state in self.index.items():
            if (wire, kind) != (name, content):
                continue
            if content == "emission":
                end = nfa.state()
                nfa.edges[state] = [*nfa.edges[state], (letters, end)]
                nfa.accepting.add(end)
            else:
                nfa.accepting.add(state)
        return nfa

    def image(self, terms: tuple[Term, ...], emitters: str | None) -> Nfa:
        """The picture of some wires: what is seen of them, and L S* E, the emitters that are seen."""
        nfa = self.seen({term.node for term in terms})
        specular = len(nfa.edges) - 2
        nfa.edges[0] = [*nfa.edges[0], (self.alphabet.emitters(emitters), specular)]
        return nfa

    def seen(self, wires: set[str]) -> Nfa:
        """What arrives on the wires, scattered once as its content allows, then S* E (the last two states)."""
        nfa = Nfa(list(self.nfa.edges), list(self.nfa.silent), set())
        specular, end = nfa.state(), nfa.state()
        nfa.accepting = {end}
        nfa.edge(specular, self.alphabet.events("S"), specular)
        nfa.edge(specular, self.alphabet.eye, end)
        for (wire, content, letters), state in self.index.items():
            if wire in wires and content != "emission":
                events = "".join(e for e in SCATTERED[content] if e != "S")
                nfa.edges[state] = [*nfa.edges[state], (letters & self.alphabet.events(events), specular)]
        return nfa


def first_tag_parameter(tail: ast.PathExpression | None) -> str | None:
    """`via@from` -> `from`."""
    head = tail.items[0] if isinstance(tail, ast.PathConcat) else tail
    return head.tag.name if isinstance(head, ast.PathName) and head.tag else None
