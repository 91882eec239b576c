"""Finite automata over sets of letters.

A letter is a bit of an integer and a transition carries a set of letters, so `D|G|S` is one transition. `determinise`
first splits the letters into blocks that no transition tells apart, which keeps the work independent of the number of
tag combinations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

STATE_LIMIT = 4096


class TooLarge(Exception):
    """An automaton would have more than STATE_LIMIT states."""


@dataclass
class Nfa:
    """A nondeterministic automaton under construction; state 0 is the start."""

    edges: list[list[tuple[int, int]]] = field(default_factory=lambda: [[]])  # state -> (letters, target)
    silent: list[list[int]] = field(default_factory=lambda: [[]])  # state -> targets reached without a letter
    accepting: set[int] = field(default_factory=set)

    def state(self) -> int:
        self.edges.append([])
        self.silent.append([])
        return len(self.edges) - 1

    def edge(self, source: int, letters: int, target: int) -> None:
        if letters:
            self.edges[source].append((letters, target))

    def skip(self, source: int, target: int) -> None:
        self.silent[source].append(target)


@dataclass(frozen=True)
class Dfa:
    """A trimmed, minimal, deterministic automaton; state 0 is the start, and no state is a dead end.

    The empty language is one state that does not accept. Equal languages have equal automata.
    """

    edges: tuple[tuple[tuple[int, int], ...], ...]  # state -> (letters, target), by the lowest letter
    accepting: tuple[bool, ...]

    @property
    def is_empty(self) -> bool:
        return not any(self.accepting)

    def shortest_word(self) -> list[int]:
        """A shortest word as sets of letters; the language must not be empty."""
        queue: list[tuple[int, list[int]]] = [(0, [])]
        seen = {0}
        for state, word in queue:
            if self.accepting[state]:
                return word
            for letters, target in self.edges[state]:
                if target not in seen:
                    seen.add(target)
                    queue.append((target, [*word, letters]))
        raise ValueError("the language is empty")

    def length_bounds(self) -> tuple[int, int | None]:
        """The shortest and the longest number of letters in a word; None is unbounded."""
        depth = {0: 0}
        queue = [0]
        for state in queue:
            for _, target in self.edges[state]:
                if target not in depth:
                    depth[target] = depth[state] + 1
                    queue.append(target)
        shortest = min((depth[s] for s in depth if self.accepting[s]), default=0)
        order = _topological(self)
        if order is None:
            return shortest, None
        longest = dict.fromkeys(depth, 0)
        for state in reversed(order):
            for _, target in self.edges[state]:
                longest[state] = max(longest[state], longest[target] + 1)
        return shortest, longest.get(0, 0)


def determinise(nfa: Nfa, limit: int = STATE_LIMIT) -> Dfa:
    """Subset construction, then minimisation. Raises TooLarge."""
    useful = _co_reachable(
        [[t for _, t in row] + silent for row, silent in zip(nfa.edges, nfa.silent, strict=True)],
        [s in nfa.accepting for s in range(len(nfa.edges))],
    )
    if 0 not in useful:
        return Dfa(((),), (False,))
    blocks = letter_blocks(letters for s in useful for letters, t in nfa.edges[s] if t in useful)
    closures: dict[int, frozenset[int]] = {}

    def closure(state: int) -> frozenset[int]:
        if state not in closures:
            seen = {state}
            stack = [state]
            while stack:
                for target in nfa.silent[stack.pop()]:
                    if target not in seen and target in useful:
                        seen.add(target)
                        stack.append(target)
            closures[state] = frozenset(seen)
        return closures[state]

    start = closure(0)
    index: dict[frozenset[int], int] = {start: 0}
    rows: list[list[int]] = []
    queue = [start]
    for subset in queue:
        row: list[int] = []
        moves = [edge for state in sorted(subset) for edge in nfa.edges[state] if edge[1] in useful]
        for block in blocks:
            reached: set[int] = set()
            for letters, target in moves:
                if letters & block:
                    reached |= closure(target)
            if not reached:
                row.append(-1)
                continue
            key = frozenset(reached)
            if key not in index:
                if len(index) >= limit:
                    raise TooLarge
                index[key] = len(queue)
                queue.append(key)
            row.append(index[key])
        rows.append(row)
    accepting = [any(s in nfa.accepting for s in subset) for subset in queue]
    return _minimise(rows, accepting, blocks)


def union(a: Dfa, b: Dfa) -> Dfa:
    """The words of either. Raises TooLarge."""
    return _combined(a, b, lambda in_a, in_b: in_a or in_b)


def intersection(a: Dfa, b: Dfa, negated: bool = False) -> Dfa:
    """The words of both; with `negated`, those of `a` that are not in `b`. Raises TooLarge."""
    return _combined(a, b, lambda in_a, in_b: in_a and in_b != negated)


def _combined(a: Dfa, b: Dfa, accepts: Callable[[bool, bool], bool]) -> Dfa:
    """The product automaton; state -1 of either is its dead end."""
    blocks = letter_blocks(letters for dfa in (a, b) for row in dfa.edges for letters, _ in row)
    index: dict[tuple[int, int], int] = {(0, 0): 0}
    queue = [(0, 0)]
    rows: list[list[int]] = []
    for pair in queue:
        row: list[int] = []
        for block in blocks:
            target = (_target(a, pair[0], block), _target(b, pair[1], block))
            if target == (-1, -1):
                row.append(-1)
                continue
            if target not in index:
                if len(index) >= STATE_LIMIT:
                    raise TooLarge
                index[target] = len(queue)
                queue.append(target)
            row.append(index[target])
        rows.append(row)
    accepting = [accepts(p >= 0 and a.accepting[p], q >= 0 and b.accepting[q]) for p, q in queue]
    return _minimise(rows, accepting, blocks)


def _target(dfa: Dfa, state: int, block: int) -> int:
    return next((t for letters, t in dfa.edges[state] if letters & block), -1) if state >= 0 else -1


def letter_blocks(masks: Iterable[int]) -> list[int]:
    """The coarsest partition of the letters in which every given set is a union of blocks."""
    blocks: list[int] = []
    for mask in sorted(set(masks)):
        fresh = mask
        split: list[int] = []
        for block in blocks:
            inside = block & mask
            fresh &= ~block
            if inside and inside != block:
                split += [inside, block & ~mask]
            else:
                split.append(block)
        if fresh:
            split.append(fresh)
        blocks = split
    return sorted(blocks)


def _minimise(rows: list[list[int]], accepting: list[bool], blocks: list[int]) -> Dfa:
    """Moore's partition refinement on the states that lead somewhere, renumbered breadth-first by letters:
    two automata of one language come out equal."""
    useful = _co_reachable(rows, accepting)
    if 0 not in useful:
        return Dfa(((),), (False,))
    rows = [[t if t in useful else -1 for t in row] for row in rows]
    part = [int(a) for a in accepting]
    count = -1
    while True:
        signatures: dict[tuple[int, ...], int] = {}
        fresh = list(part)
        for state in sorted(useful):
            signature = (part[state], *(part[t] if t >= 0 else -1 for t in rows[state]))
            fresh[state] = signatures.setdefault(signature, len(signatures))
        part = fresh
        if len(signatures) == count:
            break
        count = len(signatures)
    number: dict[int, int] = {part[0]: 0}
    queue = [0]
    edges: list[tuple[tuple[int, int], ...]] = []
    for state in queue:
        merged: dict[int, tuple[int, int]] = {}  # class -> letters, a state of it
        for block, target in zip(blocks, rows[state], strict=True):
            if target >= 0:
                merged[part[target]] = (merged.get(part[target], (0, 0))[0] | block, target)
        row: list[tuple[int, int]] = []
        for letters, target in sorted(merged.values(), key=lambda m: m[0] & -m[0]):
            if part[target] not in number:
                number[part[target]] = len(queue)
                queue.append(target)
            row.append((letters, number[part[target]]))
        edges.append(tuple(row))
    return Dfa(tuple(edges), tuple(accepting[s] for s in queue))


def _co_reachable(rows: list[list[int]], accepting: list[bool]) -> set[int]:
    """States from which a word can still be accepted."""
    back: list[list[int]] = [[] for _ in rows]
    for state, row in enumerate(rows):
        for target in row:
            if target >= 0:
                back[target].append(state)
    seen = {s for s, a in enumerate(accepting) if a}
    stack = list(seen)
    while stack:
        for source in back[stack.pop()]:
            if source not in seen:
                seen.add(source)
                stack.append(source)
    return seen


def _topological(dfa: Dfa) -> list[int] | None:
    """States with targets last, or None if there is a cycle."""
    indegree = [0] * len(dfa.edges)
    for row in dfa.edges:
        for _, target in row:
            indegree[target] += 1
    ready = [s for s, d in enumerate(indegree) if d == 0]
    for state in ready:
        for _, target in dfa.edges[state]:
            indegree[target] -= 1
            if indegree[target] == 0:
                ready.append(target)
    return ready if len(ready) == len(dfa.edges) else None


@dataclass(frozen=True)
class EventTable:
    """A path of scattering events as a table for a tracer.

    `tags` are the tags that it tells apart. `next[state][event << len(tags) | mask]` is the next state, or -1 where no
    accepted path goes on; `event` counts "DGS", and bit i of `mask` is set where the surface has `tags[i]`. The start
    is state 0. `accepting[state]`: the path may end here.
    """

    tags: tuple[str, ...]
    next: tuple[tuple[int, ...], ...]
    accepting: tuple[bool, ...]
