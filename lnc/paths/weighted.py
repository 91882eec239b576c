"""Weighted automata: how often each word is counted.

A `Graph` is the network as it stands: states, sets of letters on edges, whole numbers as weights on silent edges.
A `Weighted` is the same series of counts without silent edges, over blocks of letters that nothing tells apart.

    first_difference(a, b)   a shortest word that a and b count differently, or None: Tzeng's basis algorithm
    find_faults(a, b)        a shortest word of each kind: counted too often, not at all, negatively
    ambiguous(a)             a shortest word with two runs, by the product of the automaton with itself
    runs(graph, word)        the runs behind a count, as the marks that they pass
    count_table(series)      a deterministic automaton that counts, for programs

Sources: Schuetzenberger 1961; Tzeng 1992, "A polynomial-time algorithm for the equivalence of probabilistic automata".

**How sure is "equal"?** first_difference computes in the prime field of PRIMES[0] (with `exact`, in rationals). It
decides exactly whether the difference is zero there, so a wrong "equal" needs a difference that is a multiple of the
prime for every word. A shortest word that differs has fewer letters than a and b have states together, so its counts
are at most w^n, with w the largest sum of weights that leave a state by one letter, and n the number of states; where
that exceeds the prime, the second one is asked, too. A word that is returned has been counted in whole numbers.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Generic, TypeVar

from lnc.paths.automaton import Dfa, TooLarge, letter_blocks

PRIMES = ((1 << 61) - 1, (1 << 61) - 31)
FAULT_BUDGET = 4000  # vectors of counts that find_faults looks at

Vector = dict[int, int]
Word = tuple[int, ...]
"""Numbers of letter blocks."""
Mark = TypeVar("Mark", bound=Hashable)


class SilentCycle(Exception):
    """A cycle of silent edges: its words would be counted infinitely often. `states` lie on it."""

    def __init__(self, states: list[int]) -> None:
        super().__init__("a cycle without a letter")
        self.states = states


@dataclass(frozen=True)
class Silent(Generic[Mark]):
    """A silent edge; `mark` says what it stands for. Weight 0 is allowed: there, but not counted."""

    target: int
    weight: int = 1
    mark: Mark | None = None


@dataclass
class Graph(Generic[Mark]):
    """A nondeterministic automaton under construction; state 0 is the start."""

    edges: list[list[tuple[int, int]]] = field(default_factory=lambda: [[]])  # state -> (letters, target)
    silent: list[list[Silent[Mark]]] = field(default_factory=lambda: [[]])
    sources: list[list[int]] = field(default_factory=lambda: [[]])  # state -> states with an edge to it

    def state(self) -> int:
        self.edges.append([])
        self.silent.append([])
        self.sources.append([])
        return len(self.edges) - 1

    def edge(self, source: int, letters: int, target: int) -> None:
        if letters:
            self.edges[source].append((letters, target))
            self.sources[target].append(source)

    def skip(self, source: int, target: int, weight: int = 1, mark: Mark | None = None) -> None:
        self.silent[source].append(Silent(target, weight, mark))
        self.sources[target].append(source)

    def targets(self, state: int) -> list[int]:
        return [t for _, t in self.edges[state]] + [s.target for s in self.silent[state]]

    def reachable(self) -> set[int]:
        """States that the start leads to, weights of 0 included."""
        seen, stack = {0}, [0]
        while stack:
            for target in self.targets(stack.pop()):
                if target not in seen:
                    seen.add(target)
                    stack.append(target)
        return seen

    def co_reachable(self, accepting: Iterable[int]) -> set[int]:
        """States that lead to an accepting one."""
        seen = set(accepting)
        stack = list(seen)
        while stack:
            for source in self.sources[stack.pop()]:
                if source not in seen:
                    seen.add(source)
                    stack.append(source)
        return seen

    def unsigned(self) -> Graph[Mark]:
        """The same with the absolute values of its weights."""
        silent = [[Silent(s.target, abs(s.weight), s.mark) for s in row] for row in self.silent]
        return Graph(self.edges, silent, self.sources)


@dataclass(frozen=True)
class Weighted:
    """A series of counts: start vector, one matrix for each block of letters (`rows[state][block]`), final weights."""

    blocks: tuple[int, ...]  # disjoint sets of letters, by the lowest letter
    start: Vector
    rows: tuple[tuple[Vector, ...], ...]
    final: tuple[int, ...]

    def step(self, vector: Vector, block: int) -> Vector:
        out: Vector = {}
        for state, count in vector.items():
            for target, weight in self.rows[state][block].items():
                out[target] = out.get(target, 0) + count * weight
        return {state: count for state, count in out.items() if count}

    def value(self, vector: Vector) -> int:
        return sum(count * self.final[state] for state, count in vector.items())

    def count(self, word: Word) -> int:
        """How often the word is counted, exactly."""
        vector = self.start
        for block in word:
            vector = self.step(vector, block)
        return self.value(vector)

    @property
    def subtracts(self) -> bool:
        """Has it negative weights?"""
        found = [self.start.values(), self.final, *(v.values() for row in self.rows for v in row)]
        return any(weight < 0 for weights in found for weight in weights)


def common_blocks(graphs: Iterable[Iterable[Sequence[tuple[int, int]]]]) -> tuple[int, ...]:
    """The blocks of letters that no edge of the given automata tells apart."""
    return tuple(letter_blocks(letters for edges in graphs for row in edges for letters, _ in row if letters))


def weighted_graph(graph: Graph[Mark], accepting: Iterable[int], blocks: tuple[int, ...]) -> Weighted:
    """A graph's series without its silent edges, over states that are of use, equal ones merged. Raises SilentCycle."""
    ends = set(accepting)
    useful = graph.reachable() & graph.co_reachable(ends)
    closures: dict[int, Vector] = {}
    for state in _targets_first(graph, useful):
        closure: Vector = {state: 1} if graph.edges[state] or state in ends else {}
        for silent in graph.silent[state]:
            if silent.target in useful and silent.weight:
                for target, weight in closures[silent.target].items():
                    closure[target] = closure.get(target, 0) + silent.weight * weight
        closures[state] = {s: w for s, w in closure.items() if w}
    kept = sorted({s for closure in closures.values() for s in closure})
    number = {state: i for i, state in enumerate(kept)}
    rows: list[tuple[Vector, ...]] = []
    in_blocks: dict[int, list[int]] = {}  # letters -> the blocks that they hold
    for state in kept:
        row: list[Vector] = [{} for _ in blocks]
        for letters, end in graph.edges[state]:
            if end not in useful:
                continue
            if letters not in in_blocks:
                in_blocks[letters] = [i for i, block in enumerate(blocks) if letters & block]
            for i in in_blocks[letters]:
                vector = row[i]
                for target, weight in closures[end].items():
                    at = number[target]
                    vector[at] = vector.get(at, 0) + weight
        rows.append(tuple({s: w for s, w in v.items() if w} for v in row))
    start = {number[s]: w for s, w in closures.get(0, {}).items()}
    return reduced(Weighted(blocks, start, tuple(rows), tuple(int(s in ends) for s in kept)))


def weighted_dfa(dfa: Dfa, blocks: tuple[int, ...], weight: int = 1) -> Weighted:
    """The series that counts each word of a language `weight` times."""
    rows = [tuple({t: 1 for letters, t in edges if letters & block} for block in blocks) for edges in dfa.edges]
    return Weighted(blocks, {0: weight}, tuple(rows), tuple(int(a) for a in dfa.accepting))


def _targets_first(graph: Graph[Mark], useful: set[int]) -> list[int]:
    """The states, each after those that its silent edges lead to. Raises SilentCycle."""
    done: dict[int, bool] = {}  # False: on the way
    order: list[int] = []

    def following(state: int) -> Iterator[int]:
        return iter(dict.fromkeys(s.target for s in graph.silent[state] if s.target in useful))

    for root in sorted(useful):
        if root in done:
            continue
        done[root] = False
        stack = [(root, following(root))]
        while stack:
            state, rest = stack[-1]
            target = next(rest, None)
            if target is None:
                stack.pop()
                done[state] = True
                order.append(state)
            elif target not in done:
                done[target] = False
                stack.append((target, following(target)))
            elif not done[target]:
                way = [s for s, _ in stack]
                raise SilentCycle(way[way.index(target) :])
    return order


def reduced(a: Weighted) -> Weighted:
    """The same series with states merged that count every continuation alike (partition refinement)."""
    before: list[set[int]] = [set() for _ in a.rows]
    for state, row in enumerate(a.rows):
        for vector in row:
            for target in vector:
                before[target].add(state)
    part = [0] * len(a.rows)
    members: dict[int, set[int]] = {0: set(range(len(a.rows)))}
    signature_of: dict[int, Hashable] = {}
    fresh = 1
    dirty = set(range(len(a.rows)))
    while dirty:
        groups: dict[tuple[int, Hashable], list[int]] = {}
        for state in sorted(dirty):
            groups.setdefault((part[state], _signature(a, state, part)), []).append(state)
        touched = dirty
        dirty = set()
        by_part: dict[int, list[tuple[Hashable, list[int]]]] = {}
        for (old, signature), states in groups.items():
            by_part.setdefault(old, []).append((signature, states))
        for old, found in by_part.items():
            if members[old] <= touched:  # nobody keeps the old signature: the largest group keeps the number
                found.sort(key=lambda f: -len(f[1]))
                signature_of[old] = found.pop(0)[0]
            for signature, states in found:
                if signature == signature_of.get(old):
                    continue
                for state in states:
                    part[state] = fresh
                    dirty |= before[state]
                members[fresh] = set(states)
                members[old] -= members[fresh]
                signature_of[fresh] = signature
                fresh += 1
    return _merged(a, part)


def _signature(a: Weighted, state: int, part: list[int]) -> Hashable:
    """What a state counts, as far as the present classes tell."""
    vectors = [_by_class(vector, part) if vector else vector for vector in a.rows[state]]
    return a.final[state], tuple(tuple(sorted(v.items()) if len(v) > 1 else v.items()) for v in vectors)


def _by_class(vector: Vector, part: list[int]) -> Vector:
    if len(vector) == 1:  # most of them
        [(state, weight)] = vector.items()
        return {part[state]: weight} if weight else {}
    out: Vector = {}
    for state, weight in vector.items():
        out[part[state]] = out.get(part[state], 0) + weight
    return {s: w for s, w in out.items() if w}


def _merged(a: Weighted, part: list[int]) -> Weighted:
    number = {p: i for i, p in enumerate(dict.fromkeys(part))}
    part = [number[p] for p in part]
    first: dict[int, int] = {}
    for state, p in enumerate(part):
        first.setdefault(p, state)
    rows = tuple(tuple(_by_class(v, part) for v in a.rows[state]) for state in first.values())
    return Weighted(a.blocks, _by_class(a.start, part), rows, tuple(a.final[s] for s in first.values()))


# --- Tables -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CountTable:
    """Several series as one deterministic automaton: `next[state][block]`, -1 where nothing is counted any more, and
    what each series counts at a state."""

    blocks: tuple[int, ...]
    next: tuple[tuple[int, ...], ...]
    counts: tuple[tuple[int, ...], ...]


def count_table(series: Sequence[Weighted], limit: int) -> CountTable:
    """States are what the series have counted so far. All have the same blocks. Raises TooLarge."""
    queue: list[tuple[Vector, ...]] = []
    index: dict[Hashable, int] = {}

    def number(vectors: tuple[Vector, ...]) -> int:
        if not any(vectors):
            return -1
        key = tuple(frozenset(vector.items()) for vector in vectors)
        if key not in index:
            if len(index) >= limit:
                raise TooLarge
            index[key] = len(queue)
            queue.append(vectors)
        return index[key]

    number(tuple(a.start for a in series))
    blocks = series[0].blocks
    rows: list[tuple[int, ...]] = []
    for vectors in queue:
        steps = (tuple(a.step(v, i) for a, v in zip(series, vectors, strict=True)) for i in range(len(blocks)))
        rows.append(tuple(map(number, steps)))
    counts = tuple(tuple(a.value(v) for a, v in zip(series, vectors, strict=True)) for vectors in queue)
    return CountTable(blocks, tuple(rows) or ((-1,) * len(blocks),), counts or ((0,) * len(series),))


# --- Equality ---------------------------------------------------------------------------------------------------------


def difference(a: Weighted, b: Weighted) -> Weighted:
    """The series a - b. Both must have the same blocks."""
    offset = len(a.rows)
    start = a.start | {s + offset: -w for s, w in b.start.items()}
    shifted = tuple(tuple({s + offset: w for s, w in v.items()} for v in row) for row in b.rows)
    return reduced(Weighted(a.blocks, start, a.rows + shifted, a.final + b.final))


def first_difference(a: Weighted, b: Weighted, exact: bool = False) -> Word | None:
    """A shortest word that `a` and `b` count differently, or None."""
    both = difference(a, b)
    if exact:
        return nonzero_word(both, None)
    word = nonzero_word(both, PRIMES[0])
    if word is None and not _bounded(both, PRIMES[0]):
        word = nonzero_word(both, PRIMES[1])
    return word


def _bounded(a: Weighted, prime: int) -> bool:
    """Are the counts of all words with fewer letters than `a` has states smaller than the prime?"""
    total = sum(map(abs, a.start.values())) * max(map(abs, a.final), default=0)
    widest = max((sum(map(abs, v.values())) for row in a.rows for v in row), default=0)
    return total.bit_length() + len(a.rows) * widest.bit_length() < prime.bit_length() or widest <= 1


def nonzero_word(a: Weighted, prime: int | None) -> Word | None:
    """A shortest word whose count is not 0 in the prime field, or in the rationals for None.

    Breadth-first over words; a word whose vector depends on those before it leads to nothing new.
    """
    basis: dict[int, dict[int, int | Fraction]] = {}  # pivot -> a vector that is 1 there

    def independent(vector: Vector) -> bool:
        rest: dict[int, int | Fraction] = {s: (c % prime if prime else Fraction(c)) for s, c in vector.items()}
        while rest := {s: c for s, c in rest.items() if c}:
            pivot = min(rest)
            factor = rest[pivot]
            if pivot not in basis:
                inverse = pow(int(factor), -1, prime) if prime else 1 / Fraction(factor)
                basis[pivot] = {s: c * inverse % prime if prime else c * inverse for s, c in rest.items()}
                return True
            for state, c in basis[pivot].items():
                changed = rest.get(state, 0) - factor * c
                rest[state] = changed % prime if prime else changed
        return False

    queue: list[tuple[Word, Vector]] = [((), a.start)]
    if a.value(a.start):
        return ()
    independent(a.start)
    for word, vector in queue:
        for block in range(len(a.blocks)):
            following = a.step(vector, block)  # in whole numbers: a word that is found has been counted exactly
            if a.value(following):
                return (*word, block)
            if following and independent(following):
                queue.append(((*word, block), following))
    return None


# --- Kinds of faults --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fault:
    """A shortest word of one kind: `kind` is "often" (more than expected), "missing" or "negative"."""

    kind: str
    word: Word
    count: int
    expected: int


def find_faults(
    a: Weighted, expected: Weighted, kinds: Iterable[str] = ("often", "missing", "negative")
) -> list[Fault]:
    """A shortest word for each kind of fault, where there is one. `expected` is deterministic and counts 0 or 1.

    Without subtraction counts above 2 are as good as 2, so there are finitely many vectors of counts, and what is found
    is complete unless they outgrow FAULT_BUDGET. With subtraction nobody can decide every kind; then the shortest
    difference of all is found for sure, other kinds as far as the budget leads.
    """
    wanted = dict.fromkeys(kinds)
    found: dict[str, Fault] = {}
    complete = _search_faults(a, expected, wanted, found)
    if not complete:
        _decide_rest(a, expected, wanted, found)
    return [found[kind] for kind in wanted if kind in found]


def _kind(count: int, expected: int) -> str | None:
    if count < 0:
        return "negative"
    return None if count == expected else "often" if count > expected else "missing"


def _search_faults(a: Weighted, expected: Weighted, wanted: dict[str, None], found: dict[str, Fault]) -> bool:
    """Breadth-first over vectors of counts, each once. True: nothing was left out."""
    saturate = not a.subtracts
    blocks = range(len(a.blocks))
    queue: list[tuple[int, int, Vector, int | None]] = []  # parent, block, counts, state of the expectation
    seen: set[tuple[frozenset[tuple[int, int]], int | None]] = set()

    def visit(parent: int, block: int, vector: Vector, at: int | None) -> None:
        if saturate:
            vector = {s: min(c, 2) for s, c in vector.items()}
        key = (frozenset(vector.items()), at)
        if key in seen:
            return
        seen.add(key)
        queue.append((parent, block, vector, at))
        kind = _kind(a.value(vector), expected.final[at] if at is not None else 0)
        if kind in wanted and kind not in found:
            found[kind] = _recounted(a, expected, _word(queue), kind)

    visit(-1, -1, a.start, next(iter(expected.start), None))
    for parent, (_, _, vector, at) in enumerate(queue):
        if all(kind in found for kind in wanted):
            return True
        if len(queue) > FAULT_BUDGET:
            return False
        for block in blocks:
            following = a.step(vector, block)
            then = next(iter(expected.rows[at][block]), None) if at is not None else None
            if following or then is not None:
                visit(parent, block, following, then)
    return True


def _word(queue: list[tuple[int, int, Vector, int | None]]) -> Word:
    """The word that led to the last entry."""
    word: list[int] = []
    at = len(queue) - 1
    while queue[at][0] >= 0:
        word.append(queue[at][1])
        at = queue[at][0]
    return tuple(reversed(word))


def _recounted(a: Weighted, expected: Weighted, word: Word, kind: str) -> Fault:
    return Fault(kind, word, a.count(word), expected.count(word))


def _decide_rest(a: Weighted, expected: Weighted, wanted: dict[str, None], found: dict[str, Fault]) -> None:
    """What polynomial algorithms say about automata that are too large to be made deterministic."""
    candidates: list[Word | None] = []
    if not a.subtracts and "often" in wanted:
        candidates.append(unexpected(a, expected))
        candidates.append(ambiguous(a))
    if "missing" in wanted:
        candidates.append(first_difference(a, expected))
    elif a.subtracts:
        candidates.append(first_difference(product(a, a), a))  # a(w)^2 = a(w): counts are 0 or 1
        candidates.append(_outside(a, expected))
    for word in sorted((w for w in candidates if w is not None), key=len):
        kind = _kind(a.count(word), expected.count(word))
        if kind in wanted and kind not in found:
            found[kind] = _recounted(a, expected, word, kind)


def _outside(a: Weighted, expected: Weighted) -> Word | None:
    """A shortest word that `a` counts and that is not expected at all."""
    return first_difference(a, product(a, expected))


def unexpected(a: Weighted, expected: Weighted) -> Word | None:
    """A shortest word with a run in `a` that is not expected. For automata that do not subtract."""
    queue: list[tuple[Word, int, int | None]] = [((), s, next(iter(expected.start), None)) for s in sorted(a.start)]
    seen = {(s, at) for _, s, at in queue}
    for word, state, at in queue:
        if a.final[state] and not (at is not None and expected.final[at]):
            return word
        for block, vector in enumerate(a.rows[state]):
            then = next(iter(expected.rows[at][block]), None) if at is not None else None
            for target in vector:
                if (target, then) not in seen:
                    seen.add((target, then))
                    queue.append(((*word, block), target, then))
    return None


def ambiguous(a: Weighted) -> Word | None:
    """A shortest word that is counted at least twice: two runs in the product with itself, or an edge of weight 2.
    For automata that do not subtract."""
    queue: list[tuple[Word, int, int, bool]] = []  # word, states of both runs, have they differed?
    seen: set[tuple[int, int, bool]] = set()

    def visit(word: Word, p: int, q: int, differ: bool) -> None:
        key = (min(p, q), max(p, q), differ)
        if key not in seen:
            seen.add(key)
            queue.append((word, *key))

    for p, weight in a.start.items():
        for q in a.start:
            visit((), p, q, p != q or weight > 1)
    for word, p, q, differ in queue:
        if a.final[p] and a.final[q] and (differ or a.final[p] > 1):
            return word
        for block in range(len(a.blocks)):
            for t, weight in a.rows[p][block].items():
                for u in a.rows[q][block]:
                    visit((*word, block), t, u, differ or t != u or weight > 1)
    return None


def product(a: Weighted, b: Weighted) -> Weighted:
    """The series a(w) b(w)."""
    index: dict[tuple[int, int], int] = {}
    queue: list[tuple[int, int]] = []

    def number(p: int, q: int) -> int:
        if (p, q) not in index:
            index[p, q] = len(queue)
            queue.append((p, q))
        return index[p, q]

    start = {number(p, q): v * w for p, v in a.start.items() for q, w in b.start.items()}
    rows: list[tuple[Vector, ...]] = []
    for p, q in queue:
        rows.append(
            tuple(
                {number(t, u): v * w for t, v in a.rows[p][i].items() for u, w in b.rows[q][i].items()}
                for i in range(len(a.blocks))
            )
        )
    return Weighted(a.blocks, start, tuple(rows), tuple(a.final[p] * b.final[q] for p, q in queue))


# --- Runs -------------------------------------------------------------------------------------------------------------


def runs(graph: Graph[Mark], accepting: Iterable[int], word: Sequence[int], limit: int) -> list[tuple[int, list[Mark]]]:
    """Up to `limit` runs of a word (given as sets of letters) with their weights and the marks that they pass.

    Runs of weight 0 are left out.
    """
    ends = set(accepting)
    alive = _alive(graph, ends, word)
    found: list[tuple[int, list[Mark]]] = []
    stack: list[tuple[int, int, int, tuple[Mark, ...]]] = [(0, 0, 1, ())]  # letters read, state, weight, marks
    while stack and len(found) < limit:
        at, state, weight, marks = stack.pop()
        if at == len(word) and state in ends:
            found.append((weight, list(marks)))
        if at < len(word):
            for letters, target in reversed(graph.edges[state]):
                if letters & word[at] and target in alive[at + 1]:
                    stack.append((at + 1, target, weight, marks))
        for silent in reversed(graph.silent[state]):
            if silent.weight and silent.target in alive[at]:
                passed = marks if silent.mark is None else (*marks, silent.mark)
                stack.append((at, silent.target, weight * silent.weight, passed))
    return found


def _alive(graph: Graph[Mark], ends: set[int], word: Sequence[int]) -> list[set[int]]:
    """For each number of letters read, the states from which the rest of the word is accepted."""
    alive: list[set[int]] = [set() for _ in range(len(word) + 1)]
    quiet: list[list[int]] = [[] for _ in graph.edges]
    for state, row in enumerate(graph.silent):
        for silent in row:
            if silent.weight:
                quiet[silent.target].append(state)
    for at in range(len(word), -1, -1):
        if at == len(word):
            states = set(ends)
        else:
            states = {
                s
                for s, row in enumerate(graph.edges)
                if any(letters & word[at] and t in alive[at + 1] for letters, t in row)
            }
        stack = list(states)
        while stack:
            for source in quiet[stack.pop()]:
                if source not in states:
                    states.add(source)
                    stack.append(source)
        alive[at] = states
    return alive
