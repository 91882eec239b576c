"""Light paths as data for the templates: the automata that ln::PathLanguage walks through."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from lnc.network import Tag
from lnc.paths.automaton import Dfa
from lnc.paths.language import Alphabet
from lnc.reference import Reference


@dataclass(frozen=True)
class LanguageView:
    """`next[state][letter]` with letters in the alphabet's order; -1 where no path goes on."""

    text: str
    next: tuple[tuple[int, ...], ...]
    accepting: tuple[str, ...]


@dataclass(frozen=True)
class TagRuleView:
    bit: int
    name: str
    kind: str
    glob: str


def language_view(text: str, paths: Dfa, alphabet: Alphabet) -> LanguageView:
    rows: list[tuple[int, ...]] = []
    for edges in paths.edges:
        row = [-1] * alphabet.eye.bit_length()
        for letters, target in edges:
            while letters:
                lowest = letters & -letters
                row[lowest.bit_length() - 1] = target
                letters ^= lowest
        rows.append(tuple(row))
    return LanguageView(text, tuple(rows), tuple("true" if a else "false" for a in paths.accepting))


def tag_rules(tags: Iterable[Tag]) -> tuple[TagRuleView, ...]:
    """The globs of tags that are numbered in this order."""
    return tuple(TagRuleView(i, tag.name, kind, glob) for i, tag in enumerate(tags) for kind, glob in tag.globs)


@dataclass(frozen=True)
class ReferenceView:
    paths: LanguageView
    tag_count: int
    tags: tuple[TagRuleView, ...]


def reference_view(reference: Reference) -> ReferenceView:
    paths = language_view(reference.text, reference.paths, reference.alphabet)
    return ReferenceView(paths, len(reference.tags), tag_rules(reference.tags))
