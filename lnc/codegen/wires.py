"""The wires of a network as data for the template: what each is to carry, for --verify-paths."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from lnc.network import Schedule, ScheduledNode
from lnc.paths.language import Alphabet
from lnc.paths.weighted import CountTable


@dataclass(frozen=True)
class PathTable:
    """`next[state][letter]` as in LanguageView; at each state, how often paths are counted that end there, with signs
    (`counts`) and without (`routes`)."""

    name: str
    next: tuple[tuple[int, ...], ...]
    counts: tuple[int, ...]
    routes: tuple[int, ...]


@dataclass(frozen=True)
class WireView:
    """A wire that brings light to surfaces. `reason`: why its energy cannot be compared; empty if it can."""

    paths: PathTable
    receivers: str
    bias: str
    reason: str


def wire_views(
    schedule: Schedule, tables: Mapping[str, CountTable | None], alphabet: Alphabet, dark: Iterable[str]
) -> dict[str, WireView]:
    """The wires by name; equal paths share a table. `dark`: wires of which nothing is in the program."""
    views: dict[str, WireView] = {}
    shared: dict[CountTable, PathTable] = {}
    for node in schedule.nodes:
        if node.name not in tables:
            continue
        table = tables[node.name]
        upstream = _upstream(schedule, node)
        reason = ""
        if any(_scales(n) for n in upstream):
            reason = "its light is scaled on the way"
        elif table is None:
            reason = "its light paths are too many"
        elif node.name in dark:
            reason = "it is dark in the scene that the program is for"
        table = table or CountTable((), ((),), ((0, 0),))
        if table not in shared:
            shared[table] = _path_table(f"kPaths{len(shared) + 1}", table, alphabet)
        views[node.name] = WireView(
            paths=shared[table],
            receivers=f"ln::Events::{_receivers(node.contents)}",
            bias=f"{sum(n.op.bias for n in upstream)!r}f",
            reason=reason,
        )
    return views


def _path_table(name: str, table: CountTable, alphabet: Alphabet) -> PathTable:
    letters = alphabet.eye.bit_length()
    return PathTable(
        name=name,
        next=tuple(_row(row, table.blocks, letters) for row in table.next),
        counts=tuple(signed for signed, _ in table.counts),
        routes=tuple(unsigned for _, unsigned in table.counts),
    )


def _row(row: tuple[int, ...], blocks: tuple[int, ...], letters: int) -> tuple[int, ...]:
    """The targets of each letter instead of each block of letters."""
    targets = [-1] * letters
    for block, target in zip(blocks, row, strict=True):
        for letter in range(letters):
            if block >> letter & 1:
                targets[letter] = target
    return tuple(targets)


def _receivers(contents: tuple[str, ...]) -> str:
    if "irradiance" in contents:
        return "D"
    return "DG" if "samples" in contents else "all"


def _scales(node: ScheduledNode) -> bool:
    """Does the node change the energy of its input, which leaves its paths as they are?"""
    factor = node.parameter(node.op.scale_parameter) if node.op.scale_parameter else None
    return factor is not None and factor.value != 1


def _upstream(schedule: Schedule, node: ScheduledNode) -> list[ScheduledNode]:
    """The node and all that it reads, directly or not."""
    found = {node.name: node}
    queue = [node]
    for reader in queue:
        for term in (t for i in reader.inputs for t in i.terms):
            if term.node not in found:
                found[term.node] = schedule.node(term.node)
                queue.append(found[term.node])
    return list(found.values())
