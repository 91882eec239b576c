"""A deterministic automaton -> a short regular expression that people can read.

State elimination in a few orders, with the usual identities applied as the expressions are built; the shortest wins.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

from lnc.paths.automaton import Dfa, Nfa, TooLarge, determinise
from lnc.paths.language import EMITTERS, EVENTS, Alphabet

SIZE_LIMIT = 600  # symbols in an expression that is still worth printing
STATE_LIMIT = 60


class TooLong(Exception):
    """The expression would be longer than anybody reads."""


@dataclass(frozen=True)
class Expr:
    """`leaf` (a set of letters), `cat`, `alt`, `star`, `plus`, `opt`, or `empty` (the empty word)."""

    kind: str
    letters: int = 0
    items: tuple[Expr, ...] = ()
    size: int = 1


EMPTY = Expr("empty", size=0)


def leaf(letters: int) -> Expr:
    return Expr("leaf", letters)


def _make(kind: str, items: tuple[Expr, ...]) -> Expr:
    size = sum(i.size for i in items)
    if size > SIZE_LIMIT:
        raise TooLong
    return Expr(kind, 0, items, size)


def nullable(e: Expr) -> bool:
    if e.kind in ("cat", "plus"):
        return all(nullable(i) for i in e.items)
    if e.kind == "alt":
        return any(nullable(i) for i in e.items)
    return e.kind != "leaf"


def _factors(e: Expr) -> tuple[Expr, ...]:
    return e.items if e.kind == "cat" else () if e.kind == "empty" else (e,)


def cat(*items: Expr) -> Expr:
    """In a row: `x x*` is x+, `x* x*` is x*, `x? x*` is x*."""
    row: list[Expr] = []
    for factor in (f for item in items for f in _factors(item)):
        row.append(factor)
        while _join_last(row):
            pass
    if not row:
        return EMPTY
    return row[0] if len(row) == 1 else _make("cat", tuple(row))


def _join_last(row: list[Expr]) -> bool:
    """Simplify the end of a row in place; True if something changed."""
    last = row[-1]
    if last.kind in ("star", "plus"):
        body = _factors(last.items[0])
        count = len(body)
        if last.kind == "star" and count < len(row) and tuple(row[-1 - count : -1]) == body:
            row[-1 - count :] = [_make("plus", last.items)]
            return True
    if len(row) < 2:
        return False
    before = row[-2]
    if before.kind in ("star", "plus", "opt") and last.kind in ("star", "plus", "opt") and before.items == last.items:
        kinds = {before.kind, last.kind}
        if "star" in kinds or kinds == {"plus", "opt"}:
            row[-2:] = [_make("plus" if "plus" in kinds else "star", last.items)]
            return True
    if before.kind in ("star", "plus") and last == before.items[0] and before.kind == "star":
        row[-2:] = [_make("plus", before.items)]
        return True
    if before.kind == "star" and before.items[0].kind == "cat":  # (a b)* a b
        body = before.items[0].items
        if len(row) > len(body) and tuple(row[-len(body) :]) == body and row[-1 - len(body)] == before:
            row[-1 - len(body) :] = [_make("plus", before.items)]
            return True
    return False


def star(e: Expr) -> Expr:
    if e.kind == "empty":
        return EMPTY
    if e.kind in ("star", "plus", "opt"):
        return star(e.items[0]) if e.kind != "star" else e
    if e.kind == "alt":
        inner = alt(*(i.items[0] if i.kind in ("star", "plus", "opt") else i for i in e.items))
        if inner != e:
            return star(inner)
    return _make("star", (e,))


def opt(e: Expr) -> Expr:
    if nullable(e):
        return e
    return _make("star" if e.kind == "plus" else "opt", e.items if e.kind == "plus" else (e,))


def alt(*items: Expr) -> Expr:
    """Alternatives: letters are merged, what another one includes is dropped, common ends are factored out."""
    flat: list[Expr] = []
    letters = 0
    empty = False
    for item in (i for e in items for i in (e.items if e.kind == "alt" else (e,))):
        if item.kind == "empty":
            empty = True
        elif item.kind == "leaf":
            letters |= item.letters
        elif item.kind == "opt":
            empty = True
            flat += item.items[0].items if item.items[0].kind == "alt" else item.items
        else:
            flat.append(item)
    for item in flat:  # letters that stood inside x?
        letters |= item.letters
    flat = [i for i in dict.fromkeys(flat) if i.kind != "leaf"]
    if letters:
        flat.insert(0, leaf(letters))
    flat = [i for i in flat if not any(j != i and _includes(j, i) for j in flat)]
    flat.sort(key=_order)
    result = _factored(flat)
    return opt(result) if empty and result.kind != "empty" else result


def _includes(big: Expr, small: Expr) -> bool:
    if big.kind == "star":
        inside = small.items[0] if small.kind in ("plus", "star", "opt") else small
        body = big.items[0]
        return inside == body or (body.kind == "leaf" == inside.kind and inside.letters & ~body.letters == 0)
    if big.kind == "plus":
        return small == big.items[0]
    return False


def _factored(items: list[Expr]) -> Expr:
    """`a b | a c` as a (b|c), `a c | b c` as (a|b) c."""
    if not items:
        return EMPTY
    if len(items) == 1:
        return items[0]
    for side in (0, -1):
        groups: dict[Expr, list[Expr]] = {}
        for item in items:
            groups.setdefault(_factors(item)[side], []).append(item)
        if len(groups) == len(items):
            continue
        parts: list[Expr] = []
        for shared, members in groups.items():
            if len(members) == 1:
                parts.append(members[0])
                continue
            rests = [_factors(m)[1:] if side == 0 else _factors(m)[:-1] for m in members]
            rest = alt(*(cat(*r) for r in rests))
            parts.append(cat(shared, rest) if side == 0 else cat(rest, shared))
        return alt(*parts) if len(parts) > 1 else parts[0]
    return _make("alt", tuple(items))


def _order(e: Expr) -> tuple[int, str]:
    return (e.size, repr(_key(e)))


def _key(e: Expr) -> tuple[object, ...]:
    return (e.kind, e.letters, tuple(_key(i) for i in e.items))


def eliminate(dfa: Dfa, order: list[int]) -> Expr:
    """The expression of a non-empty automaton, its states removed in the given order."""
    begin, end = len(dfa.edges), len(dfa.edges) + 1
    arcs: dict[int, dict[int, Expr]] = {s: {} for s in range(end + 1)}
    for state, edges in enumerate(dfa.edges):
        for letters, target in edges:
            arcs[state][target] = leaf(letters)
        if dfa.accepting[state]:
            arcs[state][end] = EMPTY
    arcs[begin][0] = EMPTY
    for state in order:
        loop = arcs[state].pop(state, None)
        around = star(loop) if loop is not None else EMPTY
        out = arcs.pop(state)
        for row in arcs.values():
            into = row.pop(state, None)
            if into is None:
                continue
            for target, rest in out.items():
                new = cat(into, around, rest)
                row[target] = alt(row[target], new) if target in row else new
    return arcs[begin][end]


@dataclass(frozen=True)
class Renderer:
    """Writes expressions with the letters of an alphabet."""

    alphabet: Alphabet

    def text(self, dfa: Dfa) -> str:
        """The simplest expression found; "nothing" for the empty language."""
        return self.scored(dfa)[1]

    def scored(self, dfa: Dfa) -> tuple[int, str]:
        """As `text`, with a score to compare by: letters and repetitions count, less is simpler."""
        if dfa.is_empty:
            return 0, "nothing"
        best = (SIZE_LIMIT, f"an automaton of {len(dfa.edges)} states")
        candidates = [(dfa, False)]
        with suppress(TooLarge):
            candidates.append((reverse(dfa), True))
        for candidate, backwards in candidates:
            states = range(len(candidate.edges))
            if len(states) > STATE_LIMIT:
                continue
            for order in (list(states), list(reversed(states)), _by_degree(candidate)):
                with suppress(TooLong):
                    found = eliminate(candidate, order)
                    found = mirrored(found) if backwards else found
                    text = self._write(found, "alt")
                    best = min(best, (self._score(found), text), key=lambda b: (b[0], len(b[1]), b[1]))
        return best

    def _score(self, e: Expr) -> int:
        if e.kind == "leaf":
            return len(self.letter_names(e.letters))
        return (e.kind in ("star", "plus")) + sum(map(self._score, e.items))

    def _write(self, e: Expr, within: str) -> str:
        match e.kind:
            case "empty":
                return "()"
            case "leaf":
                parts = self.letter_names(e.letters)
                return parts[0] if len(parts) == 1 else f"({'|'.join(parts)})"
            case "cat":
                text = " ".join(self._write(i, "cat") for i in e.items)
                return f"({text})" if within == "repeat" else text
            case "alt":
                text = " | ".join(self._alternative(i) for i in e.items)
                return text if within == "alt" else f"({text})"
        return self._write(e.items[0], "repeat") + {"star": "*", "plus": "+", "opt": "?"}[e.kind]

    def _alternative(self, e: Expr) -> str:
        return " | ".join(self.letter_names(e.letters)) if e.kind == "leaf" else self._write(e, "alt")

    def letter_names(self, letters: int) -> list[str]:
        """`L@area`, `D`, `S@mirror`, ... for a set of letters."""
        count = self.alphabet.combinations
        every = (1 << count) - 1
        where = [letters >> (i * count) & every for i in range(2 + len(EVENTS))]
        names: list[str] = []
        area, delta = where[:2]
        if area == delta:
            names += [f"L{self.where(area)}"] if area else []
        else:
            for kind, part in zip(EMITTERS, (area, delta), strict=True):
                names += [f"L@{kind}" + self.where(part).replace("@", "&")] if part else []
        names += [f"{event}{self.where(part)}" for event, part in zip(EVENTS, where[2:], strict=True) if part]
        if letters & self.alphabet.eye:
            names.append("E")
        return names

    def where(self, combinations: int) -> str:
        """`@t`, `@!t`, `@(t&!u)`, ... or nothing where every combination of tags is meant."""
        if combinations not in self._named:
            self._named[combinations] = self._cover(combinations)
        return self._named[combinations]

    def noun(self, letters: int) -> str:
        """What a scene has that has one of the letters: `specular surface tagged mirror`, `emitter`, ..."""
        count = self.alphabet.combinations
        every = (1 << count) - 1
        area, delta, *events = (letters >> (i * count) & every for i in range(2 + len(EVENTS)))
        found: dict[int, list[str]] = {}  # combinations of tags -> what is on them
        if area == delta:
            found[area] = ["emitter"]
        else:
            found[area] = ["area emitter"]
            found[delta] = ["point, spot or directional light"]
        surfaces: dict[int, list[str]] = {}
        for word, where in zip(("diffuse", "glossy", "specular"), events, strict=True):
            surfaces.setdefault(where, []).append(word)
        parts = [f"{what[0]}{self._tagged(where)}" for where, what in found.items() if where]
        for where, words in surfaces.items():
            if where:
                kind = " or ".join(words) if len(words) < len(EVENTS) else "scattering"
                parts.append(f"{kind} surface{self._tagged(where)}")
        return " or ".join(parts)

    def _tagged(self, combinations: int) -> str:
        text = self.where(combinations).removeprefix("@")
        if text.startswith("!"):
            return f" not tagged {text[1:]}"
        return f" tagged {text}" if text else ""

    def _cover(self, combinations: int) -> str:
        """Few conjunctions of tags that together give the combinations: the largest that fit, one after the other."""
        chosen: list[str] = []
        left = combinations
        for text, inside in self._conjunctions:
            if inside & left and inside & ~combinations == 0:
                chosen.append(text)
                left &= ~inside
            if not left:
                break
        if chosen in ([""], []):
            return ""
        alone = len(chosen) == 1 and "&" not in chosen[0]
        return f"@{chosen[0]}" if alone else f"@({'|'.join(chosen)})"

    @cached_property
    def _named(self) -> dict[int, str]:
        return {}

    @cached_property
    def _conjunctions(self) -> list[tuple[str, int]]:
        """All conjunctions of tags and negated tags with their combinations, those of few tags first."""
        alphabet = self.alphabet
        found: list[tuple[int, str, int]] = []
        for signs in product((None, False, True), repeat=len(alphabet.tags)):
            named = [(tag, negated) for tag, negated in zip(alphabet.tags, signs, strict=True) if negated is not None]
            inside = alphabet.combinations_with(None)
            for tag, negated in named:
                inside &= alphabet.combinations_with(tag, negated)
            found.append((len(named), "&".join(f"{'!' if negated else ''}{tag}" for tag, negated in named), inside))
        return [(text, inside) for _, text, inside in sorted(found)]


def reverse(dfa: Dfa) -> Dfa:
    """The minimal automaton of the words read backwards."""
    nfa = Nfa()
    states = [nfa.state() for _ in dfa.edges]
    for state, edges in enumerate(dfa.edges):
        for letters, target in edges:
            nfa.edge(states[target], letters, states[state])
        if dfa.accepting[state]:
            nfa.skip(0, states[state])
    nfa.accepting = {states[0]}
    return determinise(nfa)


def mirrored(e: Expr) -> Expr:
    """The expression of the words read backwards."""
    items = tuple(mirrored(i) for i in e.items)
    if e.kind == "cat":
        return cat(*reversed(items))
    if e.kind == "alt":
        return alt(*items)
    return replace(e, items=items)


def _by_degree(dfa: Dfa) -> list[int]:
    """States with few ways through them first."""
    into = [0] * len(dfa.edges)
    for edges in dfa.edges:
        for _, target in edges:
            into[target] += 1
    return sorted(range(len(dfa.edges)), key=lambda s: (into[s] * (len(dfa.edges[s]) + dfa.accepting[s]), s))
