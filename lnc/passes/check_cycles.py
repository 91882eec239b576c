"""Cycles: pulled ones must be bounded, and none may pass through a port that has to be complete first.

    pt = PathTracer(direct + pt)       allowed: the operator ends the recursion by Russian roulette
    a  = Scale(direct + a)             LN0402: nothing ends it

On entry: a network with converters. On exit: every cycle is pulled, and each loop of it passes an operator that
bounds recursion.
"""

from __future__ import annotations

from collections.abc import Iterable

from lnc.diagnostics import Related, Reporter
from lnc.graph import find_loop, strong_components
from lnc.network import Network, Node


def check_cycles(network: Network, reporter: Reporter) -> None:
    """Report one loop of each unsound cycle, hop by hop: LN0401 for preprocessing, LN0402 for unbounded recursion."""
    nodes = network.by_name()
    sources = {name: wire_sources(node) for name, node in nodes.items()}
    for component in strong_components(sources):
        members = set(component)
        inside = {name: [s for s in sources[name] if s in members] for name in component}
        if len(component) == 1 and not inside[component[0]]:
            continue
        pushed = _pushed_edge(nodes, component, members)
        if pushed is not None:
            consumer, source = pushed
            _report_push(nodes, find_loop(inside, consumer, source), reporter)
            continue
        unbounded = {n: inside[n] for n in component if nodes[n].op.recursion is None}
        unbounded = {n: [s for s in found if s in unbounded] for n, found in unbounded.items()}
        for rest in strong_components(unbounded):
            if len(rest) > 1 or rest[0] in unbounded[rest[0]]:
                first = min(rest, key=component.index)
                source = next(s for s in unbounded[first] if s in rest)
                _report_unbounded(nodes, find_loop(unbounded, first, source), reporter)


def wire_sources(node: Node) -> list[str]:
    """The wires that a node reads, each once, in order."""
    return list(dict.fromkeys(term.node for given in node.inputs for term in given.terms))


def _pushed_edge(nodes: dict[str, Node], component: Iterable[str], members: set[str]) -> tuple[str, str] | None:
    """An edge of the cycle into an operator that reads it before the picture.

    One that prepares and bounds recursion may read itself while it does, from a port that is pulled.
    """
    for name in component:
        node = nodes[name]
        prepares = node.op.prepares and node.op.recursion is None
        for given in node.inputs:
            if given.port.complete or (prepares and not any(p.complete for p in node.op.ports)):
                for term in given.terms:
                    if term.node in members:
                        return name, term.node
    return None


def _report_push(nodes: dict[str, Node], loop: list[str], reporter: Reporter) -> None:
    first = nodes[loop[0]]
    message = f"'{first.name}' must be complete before it is read, but it needs itself: {_arrows(loop)}"
    reporter.error("LN0401", first.span, message, related=_hops(nodes, loop))


def _report_unbounded(nodes: dict[str, Node], loop: list[str], reporter: Reporter) -> None:
    first = nodes[loop[0]]
    message = f"nothing ends this recursion: {_arrows(loop)}"
    help = "put an operator that bounds the recursion on the loop, such as PathTracer"
    reporter.error("LN0402", first.span, message, related=_hops(nodes, loop), help=help)


def _arrows(loop: list[str]) -> str:
    shown = loop if len(loop) <= 8 else [*loop[:4], "...", *loop[-3:]]
    return " -> ".join([*shown, loop[0]])


def _hops(nodes: dict[str, Node], loop: list[str]) -> list[Related]:
    following = [*loop[1:], loop[0]]
    return [
        Related(nodes[name].span, f"'{name}' flows into '{after}'")
        for name, after in list(zip(loop, following, strict=True))[:16]
    ]
