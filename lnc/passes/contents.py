"""What each wire can be asked for: its angular contents; and whether every `via` can be followed.

    direct = Direct(light)                          direct: radiance (L@area), samples (L@delta)
    soft   = NNDensity(photons)                     soft: irradiance
    bad    = PathTracer(soft, via = S)              LN0305: irradiance cannot be scattered by S

On entry: a network with converters and sound cycles. On exit: contents per wire, in the order of library.CONTENTS.
"""

from __future__ import annotations

from lnc.diagnostics import Related, Reporter
from lnc.library import CONTENTS, SCATTERED, PathRule
from lnc.network import Network, Node, PathValue
from lnc.paths.language import EVENTS
from lnc.syntax import ast


def contents(network: Network, reporter: Reporter) -> dict[str, tuple[str, ...]]:
    """The least solution of the rules that the operators declare."""
    nodes = network.by_name()
    readers: dict[str, list[str]] = {name: [] for name in nodes}
    for node in network.nodes:
        for given in node.inputs:
            for term in given.terms:
                if term.node in readers:
                    readers[term.node].append(node.name)
    found: dict[str, set[str]] = {name: set() for name in nodes}
    queue = list(nodes)
    queued = set(queue)
    while queue:
        name = queue.pop()
        queued.discard(name)
        fresh = {c for rule in nodes[name].op.paths for c in _answers(nodes[name], rule, found)}
        if fresh != found[name]:
            found[name] = fresh
            for reader in readers[name]:
                if reader not in queued:
                    queued.add(reader)
                    queue.append(reader)
    for node in network.nodes:
        _check_events(node, found, reporter)
    return {name: tuple(c for c in CONTENTS if c in found[name]) for name in nodes}


def port_contents(node: Node, port: str, found: dict[str, set[str]]) -> set[str]:
    given = node.input(port)
    return set().union(*(found.get(t.node, set()) for t in given.terms)) if given else set()


def _answers(node: Node, rule: PathRule, found: dict[str, set[str]]) -> set[str]:
    if rule.port is None:
        return {rule.content}
    arriving = port_contents(node, rule.port, found)
    if rule.content == "unchanged":
        return arriving
    return {rule.content} if arriving else set()


def _check_events(node: Node, found: dict[str, set[str]], reporter: Reporter) -> None:
    """LN0305 where a path that the user wrote begins with an event that no content of the input allows."""
    for rule in node.op.paths:
        name = first_parameter(rule.tail)
        value = node.parameter(name) if name else None
        if rule.port is None or value is None or value.given is None or not isinstance(value.value, PathValue):
            continue
        arriving = port_contents(node, rule.port, found)
        if not arriving:
            continue
        allowed = {event for content in arriving for event in SCATTERED[content]}
        table = value.value.events
        width = 1 << len(table.tags)
        starts = {e for i, e in enumerate(EVENTS) if any(t >= 0 for t in table.next[0][i * width : (i + 1) * width])}
        wrong = [event for event in EVENTS if event in starts - allowed]
        if wrong:
            what = " and ".join(c for c in CONTENTS if c in arriving)
            message = f"'{node.name}' is to follow {' and '.join(wrong)}, but '{rule.port}' carries {what} only"
            arrives = Related(node.input(rule.port).span, f"{what} arrives here")  # type: ignore[union-attr]
            help = f"{what} can be scattered by {' and '.join(e for e in EVENTS if e in allowed)}"
            reporter.error("LN0305", value.given.span, message, related=[arrives], help=help)


def first_parameter(tail: ast.PathExpression | None) -> str | None:
    """The path parameter that a rule's tail begins with."""
    head = tail.items[0] if isinstance(tail, ast.PathConcat) else tail
    return head.name if isinstance(head, ast.PathName) else None
