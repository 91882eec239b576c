"""Inserted converters work only where what they make is read.

    indirect = Radiosity(direct, from = room)     direct_tree = PointsToQuadTree(direct, to = room)
                                                  indirect    = Radiosity(direct_tree, from = room)

An operator whose declared light paths go on behind a port with an event on a tag (`in D@from+`), or begin with the port
on a tag (`in@from`), reads that port on such surfaces only. If all readers of a converter do so for the same tag, its
parameter `to` says so, and surfaces that nobody asks about are not sampled. Points are left alone: they are asked where
they are needed, and nowhere else.

On entry: a network with converters. On exit: the same nodes; the light paths of results are unchanged.
"""

from __future__ import annotations

from dataclasses import replace

from lnc.library import POINTS
from lnc.network import Input, Node, TypedNetwork
from lnc.passes.path_automaton import tag_value
from lnc.syntax import ast


def narrow_converters(typed: TypedNetwork) -> TypedNetwork:
    """The network with `to` filled in at converters whose readers agree about it."""
    network = typed.network
    places: dict[str, set[ast.TagRef | None]] = {node.name: set() for node in network.nodes}
    for node in network.nodes:
        for given in node.inputs:
            for term in given.terms:
                places[term.node].add(_read_at(node, given))
    for _, terms in network.results():
        for term in terms:
            places[term.node].add(None)
    nodes = tuple(_narrowed(node, places[node.name]) for node in network.nodes)
    return replace(typed, network=replace(network, nodes=nodes))


def _read_at(node: Node, given: Input) -> ast.TagRef | None:
    """Where a node reads one of its inputs; None: anywhere."""
    found: set[ast.TagRef | None] = set()
    for rule in node.op.paths:
        if rule.port == given.port.name:
            head = rule.tail.items[0] if isinstance(rule.tail, ast.PathConcat) else rule.tail
            if isinstance(head, ast.PathRepeat) and head.low > 0:
                head = head.item
            # Not `via@from`, for `via` may be empty.
            name = rule.emitter
            if head is not None:
                name = head.tag.name if isinstance(head, ast.PathEvents) and head.tag else None
            found.add(tag_value(node, name) if name else None)
    return found.pop() if len(found) == 1 else None


def _narrowed(node: Node, places: set[ast.TagRef | None]) -> Node:
    """The node with `to`, if it is an inserted one that stores what is read at one place only."""
    if node.origin != "converter" or node.op.output == POINTS or node.parameter("to") is None or len(places) != 1:
        return node
    (place,) = places
    if place is None:
        return node
    written: ast.Value = ast.NameValue(place.name, place.span)
    if place.negated:
        written = ast.PathLiteral(ast.PathName(place.name, None, place.span, True), place.span)
    parameters = tuple(replace(p, value=place, given=written) if p.name == "to" else p for p in node.parameters)
    return replace(node, parameters=parameters, reason=f"{node.reason}; it is read on {place.text} only")
