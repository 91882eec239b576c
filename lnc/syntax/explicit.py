"""A network with everything written out that the compiler added: legal text that inserts nothing when compiled.

caustic = NNDensity(photons)        photons_tree = KDPhotonTree(photons)
                                    caustic      = NNDensity(photons_tree)
"""

from __future__ import annotations

from dataclasses import replace

from lnc.network import Input, Network, Node, Term
from lnc.source import Span
from lnc.syntax import ast
from lnc.syntax.printer import print_file


def explicit(file: ast.File, network: Network) -> str:
    """The text of `file` with an equation for each node of `network`, added ones before the statement they serve."""
    added: dict[Span, list[Node]] = {}
    nodes = network.by_name()
    written = {statement.name for statement in file.statements if isinstance(statement, ast.Equation)}
    for node in network.nodes:
        if node.name not in written:
            added.setdefault(node.statement, []).append(node)
    statements: list[ast.Statement] = []
    taps, probes, lightmaps = iter(network.taps), iter(network.probes), iter(network.lightmaps)
    for statement in file.statements:
        statements += [_equation(node, ast.Comments()) for node in added.pop(statement.span, ())]
        match statement:
            case ast.Equation(name) if name in nodes:
                same = _equation(nodes[name], statement.comments)
                statements.append(same.changed(representation=statement.representation))
            case ast.ImageStatement() if network.image is not None:
                statements.append(statement.changed(wire=_wire(network.image.terms, statement.span)))
            case ast.TapStatement():
                statements.append(statement.changed(wire=_wire(next(taps).terms, statement.span)))
            case ast.ProbeStatement():
                statements.append(statement.changed(wire=_wire(next(probes).terms, statement.span)))
            case ast.LightmapStatement():
                statements.append(statement.changed(wire=_wire(next(lightmaps).terms, statement.span)))
            case _:
                statements.append(statement)
    return print_file(file.changed(statements=tuple(_tidy(statements))))


def _equation(node: Node, comments: ast.Comments) -> ast.Equation:
    inputs = tuple(_wire(_unsigned(given), node.span) for given in node.inputs)
    arguments = tuple(
        ast.Argument(p.name, p.given, node.span, node.span) for p in node.parameters if p.given is not None
    )
    wire: ast.WireExpression = ast.Call(node.op.name, inputs, arguments, node.span, node.span)
    plain_sum = node.op.name == "Sum" and not arguments and len(node.inputs[0].terms) > 1
    if plain_sum or (node.op.name == "Sum" and any(t.weight < 0 for t in node.inputs[0].terms)):
        wire = inputs[0]
    return ast.Equation(node.name, None, wire, comments, node.span, node.span)


def _unsigned(given: Input) -> tuple[Term, ...]:
    """The terms as they are written at their port."""
    sign = -1 if given.port.subtracted else 1
    return tuple(replace(term, weight=sign * term.weight) for term in given.terms)


def _wire(terms: tuple[Term, ...], span: Span) -> ast.WireExpression:
    if len(terms) == 1:
        return ast.WireName(terms[0].node, span)
    return ast.WireSum(tuple(ast.SumTerm(t.weight < 0, ast.WireName(t.node, span)) for t in terms), span)


def _tidy(statements: list[ast.Statement]) -> list[ast.Statement]:
    """An empty line before a statement moves ahead of the equations that were added for it."""
    tidy = list(statements)
    for i in range(len(tidy) - 1, 0, -1):
        before, here = tidy[i - 1], tidy[i]
        fresh = isinstance(before, ast.Equation) and before.comments == ast.Comments()
        if here.comments.blank and fresh and isinstance(here, ast.Statement) and _follows(before, here):
            tidy[i - 1] = before.changed(comments=ast.Comments((), "", True))
            tidy[i] = here.changed(comments=here.comments.changed(blank=False))
    return tidy


def _follows(before: ast.Statement, here: ast.Statement) -> bool:
    """Whether `before` was added for `here`: its place in the text lies inside of it."""
    return here.span.start <= before.span.start < here.span.end
