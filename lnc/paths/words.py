"""Single words of regular languages."""

from __future__ import annotations

from lnc.paths.automaton import Dfa
from lnc.paths.language import EMITTERS, EVENTS, Alphabet


def shortest_common(a: Dfa, b: Dfa) -> list[int] | None:
    """A shortest word that both accept, as numbers of letters; None if they have none in common."""
    if a.accepting[0] and b.accepting[0]:
        return []
    came_from: dict[tuple[int, int], tuple[tuple[int, int], int]] = {}
    queue = [(0, 0)]
    for state in queue:
        for letters_a, to_a in a.edges[state[0]]:
            for letters_b, to_b in b.edges[state[1]]:
                both, target = letters_a & letters_b, (to_a, to_b)
                if not both or target in came_from or target == (0, 0):
                    continue
                came_from[target] = (state, (both & -both).bit_length() - 1)
                if not (a.accepting[to_a] and b.accepting[to_b]):
                    queue.append(target)
                    continue
                word: list[int] = []
                while target != (0, 0):
                    target, letter = came_from[target]
                    word.append(letter)
                return word[::-1]
    return None


def word_text(word: list[int], alphabet: Alphabet) -> str:
    """Letters of a word, adjacent, with the tags that the surface has: `L@deltaSD@floorSE`."""
    return "".join(_letter_text(letter, alphabet) for letter in word)


def _letter_text(letter: int, alphabet: Alphabet) -> str:
    kind, combination = divmod(letter, alphabet.combinations)
    names = [tag for i, tag in enumerate(alphabet.tags) if combination >> i & 1]
    if kind < len(EMITTERS):
        return "L@" + "&".join((EMITTERS[kind], *names))
    if kind < len(EMITTERS) + len(EVENTS):
        where = names[0] if len(names) == 1 else f"({'&'.join(names)})"
        return EVENTS[kind - len(EMITTERS)] + (f"@{where}" if names else "")
    return "E"
