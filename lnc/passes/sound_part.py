"""What is left of a network without its mistakes, so that one run finds all that is wrong in it.

    a = Direct(light, sampels = 4)      LN0103
    b = PathTracer(a)                   left out, for it reads a
    c = Scale(c, factor = 0.5)          stays: LN0402 is found in the same run

On entry: a network in which mistakes were found. On exit: one without them and without what depends on them, whose
remaining mistakes are the user's own. Results are checked together or not at all: which `expect` belongs to them may
be among the mistakes.
"""

from __future__ import annotations

from dataclasses import replace

from lnc.diagnostics import Reporter
from lnc.network import Network, Term
from lnc.passes.expand_macros import Expanded
from lnc.syntax import ast

RESULTS = (ast.ImageStatement, ast.ProbeStatement, ast.LightmapStatement, ast.Expect)


def sound_part(network: Network, expanded: Expanded, reporter: Reporter) -> Network:
    """The part that no error reaches; nothing where one concerns more than a wire or a result.

    The mistakes of a statement that calls macros are also those of what comes from it. Syntax errors leave no statement
    behind: what they would have defined is in `file.broken`, "" for anything unnamed.
    """
    if not reporter.failed and not expanded.broken:
        return network
    file = expanded.file
    wrong: list[ast.Statement] = []
    places = [(s, s.span, expanded.origins.get(s.span)) for s in file.statements]
    for diagnostic in reporter.diagnostics:
        if diagnostic.severity != "error" or diagnostic.code == "LN0101":
            continue
        at = diagnostic.span
        inside = [s for s, span, origin in places if span.holds(at) or (origin is not None and origin.holds(at))]
        if not inside or not all(isinstance(s, (ast.Equation, ast.TapStatement, *RESULTS)) for s in inside):
            return replace(network, nodes=(), image=None, taps=(), probes=(), lightmaps=(), expectations=())
        wrong += inside
    spans = {s.span for s in wrong}
    names = {s.name for s in wrong if isinstance(s, ast.Equation)}
    nodes = {n.name: n for n in network.nodes if n.statement not in spans and n.name not in names}

    def is_sound(terms: tuple[Term, ...]) -> bool:
        return bool(terms) and all(term.node in nodes for term in terms)

    while lost := [n for n in nodes.values() if not all(is_sound(i.terms) for i in n.inputs)]:
        for node in lost:
            del nodes[node.name]
    results = [r.terms for r in (network.image, *network.probes, *network.lightmaps) if r is not None]
    complete = "" not in file.broken and not any(isinstance(s, RESULTS) for s in wrong) and all(map(is_sound, results))
    return replace(
        network,
        nodes=tuple(nodes.values()),
        image=network.image if complete else None,
        taps=tuple(t for t in network.taps if t.span not in spans and is_sound(t.terms)),
        probes=network.probes if complete else (),
        lightmaps=network.lightmaps if complete else (),
        expectations=tuple(e for e in network.expectations if (complete if e.wire is None else e.wire in nodes)),
    )
