"""Path expressions -> automata, over the letters that a network tells apart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from lnc.paths.automaton import STATE_LIMIT, Dfa, EventTable, Nfa, TooLarge, determinise
from lnc.source import SourceFile, Span
from lnc.syntax import ast

EVENTS = "DGS"
EMITTERS = ("area", "delta")
TAG_LIMIT = 6  # 64 combinations


@dataclass(frozen=True)
class Alphabet:
    """Letters as bits: an emitter (area, delta) or an event (D, G, S), each per combination of tags, and E.

    A combination of tags is a number whose bit i is set where the surface has `tags[i]`.
    """

    tags: tuple[str, ...] = ()

    @property
    def combinations(self) -> int:
        return 1 << len(self.tags)

    def combinations_with(self, tag: str | None, negated: bool = False) -> int:
        """The tag combinations that hold a tag, as a bit set; all of them for None."""
        every = (1 << self.combinations) - 1
        if tag is None:
            return every
        bit = 1 << self.tags.index(tag)
        inside = sum(1 << c for c in range(self.combinations) if c & bit)
        return every & ~inside if negated else inside

    def emitters(self, kinds: str | None = None, where: int | None = None) -> int:
        """`L` of the given kinds ("area" or "delta"; None is both), for a set of tag combinations."""
        where = self.combinations_with(None) if where is None else where
        return sum(where << (i * self.combinations) for i, kind in enumerate(EMITTERS) if kinds in (None, kind))

    def events(self, letters: str = EVENTS, where: int | None = None) -> int:
        where = self.combinations_with(None) if where is None else where
        return sum(where << ((2 + i) * self.combinations) for i, event in enumerate(EVENTS) if event in letters)

    @property
    def eye(self) -> int:
        return 1 << (5 * self.combinations)

    def letters(self, event: str, tag: ast.TagRef | None) -> int:
        """The set that `D@t`, `L@delta`, ... stands for."""
        if event == "E":
            return self.eye
        if event == "L":
            if tag is None or tag.name not in EMITTERS:
                return self.emitters(None, self.where(tag))
            kind = tag.name if not tag.negated else EMITTERS[1 - EMITTERS.index(tag.name)]
            return self.emitters(kind)
        return self.events(event, self.where(tag))

    def where(self, tag: ast.TagRef | None) -> int:
        """The tag combinations that are meant, as a bit set; all of them for None."""
        return self.combinations_with(None) if tag is None else self.combinations_with(tag.name, tag.negated)


_NOWHERE = Span(SourceFile("", ""), 0, 0)


def _events(letters: str, tag: str | None = None) -> ast.PathEvents:
    return ast.PathEvents(letters, ast.TagRef(tag, False, _NOWHERE) if tag else None, _NOWHERE)


def _any_number(letters: str) -> ast.PathRepeat:
    return ast.PathRepeat(_events(letters), 0, None, _NOWHERE)


ALL_LIGHT: ast.PathExpression = ast.PathConcat((_events("L"), _any_number("DGS"), _events("E")), _NOWHERE)
"""L (D|G|S)* E"""
ALL_ARRIVING: ast.PathExpression = ast.PathConcat((_events("L"), _any_number("DGS")), _NOWHERE)
"""L (D|G|S)*"""
DARK: ast.PathExpression = ast.PathConcat((_events("L", "delta"), _any_number("S"), _events("E")), _NOWHERE)
"""L@delta S* E, which carries no light"""


def tags_in(path: ast.PathExpression) -> set[str]:
    """Tags that a path expression of a network names (its bare names included)."""
    match path:
        case ast.PathEvents(letters, tag):
            return {tag.name} if tag and not (letters == "L" and tag.name in EMITTERS) else set()
        case ast.PathName(name, tag):
            return {name} | ({tag.name} if tag else set())
        case ast.PathTagged(item, tag):
            return tags_in(item) | {tag.name}
        case ast.PathConcat(items) | ast.PathUnion(items):
            return set().union(*map(tags_in, items))
        case ast.PathRepeat(item):
            return tags_in(item)
    return set()


def add_path(nfa: Nfa, path: ast.PathExpression | None, start: int, alphabet: Alphabet, within: int = -1) -> int:
    """Add the path's automaton behind `start` and return its end. Letters outside of `within` are left out."""
    if len(nfa.edges) > STATE_LIMIT:
        raise TooLarge
    match path:
        case None | ast.PathEmpty():
            return start
        case ast.PathEvents(letters, tag):
            end = nfa.state()
            nfa.edge(start, within & sum(alphabet.letters(letter, tag) for letter in letters), end)
            return end
        case ast.PathName(name, tag, negated=negated):
            end = nfa.state()
            named = alphabet.events(EVENTS, alphabet.combinations_with(name, negated))
            if tag is not None:
                named &= alphabet.events(EVENTS, alphabet.combinations_with(tag.name, tag.negated))
            nfa.edge(start, within & named, end)
            return end
        case ast.PathTagged(item, tag):
            every = alphabet.events(EVENTS, alphabet.combinations_with(tag.name, tag.negated))
            return add_path(nfa, item, start, alphabet, within & every)
        case ast.PathConcat(items):
            for item in items:
                start = add_path(nfa, item, start, alphabet, within)
            return start
        case ast.PathUnion(items):
            end = nfa.state()
            for item in items:
                branch = nfa.state()
                nfa.skip(start, branch)
                nfa.skip(add_path(nfa, item, branch, alphabet, within), end)
            return end
    for _ in range(path.low):
        start = add_path(nfa, path.item, _fresh(nfa, start), alphabet, within)
    if path.high is None:
        loop = _fresh(nfa, start)
        nfa.skip(add_path(nfa, path.item, loop, alphabet, within), loop)
        return _fresh(nfa, loop)
    end = nfa.state()
    nfa.skip(start, end)
    for _ in range(path.high - path.low):
        start = add_path(nfa, path.item, _fresh(nfa, start), alphabet, within)
        nfa.skip(start, end)
    return end


def _fresh(nfa: Nfa, start: int) -> int:
    """A state of its own after `start`, so that loops do not leak into what stands before."""
    state = nfa.state()
    nfa.skip(start, state)
    return state


@lru_cache(4096)
def path_dfa(path: ast.PathExpression | None, alphabet: Alphabet) -> Dfa:
    """The minimal automaton of a path expression. Raises TooLarge."""
    nfa = Nfa()
    nfa.accepting = {add_path(nfa, path, 0, alphabet)}
    return determinise(nfa)


def event_table(path: ast.PathExpression) -> EventTable:
    """The table of a path that consists of events only. Raises TooLarge."""
    alphabet = Alphabet(tuple(sorted(tags_in(path))))
    dfa = path_dfa(path, alphabet)
    rows: list[tuple[int, ...]] = []
    for edges in dfa.edges:
        row = [-1] * (len(EVENTS) << len(alphabet.tags))
        for event in range(len(EVENTS)):
            for combination in range(alphabet.combinations):
                bit = 1 << ((2 + event) * alphabet.combinations + combination)
                for letters, target in edges:
                    if letters & bit:
                        row[event << len(alphabet.tags) | combination] = target
        rows.append(tuple(row))
    return EventTable(alphabet.tags, tuple(rows), dfa.accepting)
