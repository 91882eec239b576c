"""Which converters lead from one representation to another."""

from __future__ import annotations

import heapq

from lnc.library import Library, Operator

CHAIN_LIMIT = 8  # candidates that a message lists


def cheapest_chains(library: Library, source: str, target: str) -> list[tuple[Operator, ...]]:
    """All chains of converters with the least cost, sorted by name; [()] if nothing is to be done, [] if none leads."""
    if source == target:
        return [()]
    cost: dict[str, float] = {}
    queue: list[tuple[float, str]] = [(0.0, source)]
    while queue:
        so_far, name = heapq.heappop(queue)
        if name in cost:
            continue
        cost[name] = so_far
        for op in library.converters.get(name, ()):
            if op.output not in cost and op.converter is not None:
                heapq.heappush(queue, (so_far + op.converter.cost, op.output))
    if target not in cost:
        return []
    chains: list[tuple[Operator, ...]] = []
    _collect(library, source, target, cost, (), chains)
    return sorted(chains, key=lambda chain: [op.name for op in chain])


def _collect(
    library: Library,
    name: str,
    target: str,
    cost: dict[str, float],
    so_far: tuple[Operator, ...],
    chains: list[tuple[Operator, ...]],
) -> None:
    """Follow the converters that lie on a cheapest chain; each representation is passed once."""
    if name == target:
        chains.append(so_far)
        return
    for op in library.converters.get(name, ()):
        passed = {library.operators[o.name].ports[0].representation for o in so_far}
        on_the_way = op.converter is not None and cost[name] + op.converter.cost <= cost.get(op.output, -1.0)
        if on_the_way and op.output not in passed and len(chains) < CHAIN_LIMIT:
            _collect(library, op.output, target, cost, (*so_far, op), chains)
