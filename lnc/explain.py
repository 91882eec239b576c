"""What `lnc explain` and `lnc ops` print."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from lnc.diagnostics.codes import Page
from lnc.diagnostics.format import printable
from lnc.driver import Result, describe_paths
from lnc.library import Library, Operator, Parameter, first_sentence
from lnc.network import Node, PathReport, ScheduledNode, TypedNetwork
from lnc.syntax.ast import TagRef


def print_page(page: Page) -> str:
    text = f"{page.code}: {page.title}\n\n{page.text}\n"
    return f"{text}\n{page.provoked_by}" if page.example else text


# --- A network --------------------------------------------------------------------------------------------------------


def explain_json(result: Result) -> dict[str, object]:
    """As the contract describes it; `light_paths` maps each angular content to its expression."""
    typed, plan = _compiled(result)
    paths = describe_paths(typed)
    wires = [
        {
            "name": node.name,
            "op": node.op.name,
            "representation": node.op.output,
            "angular": list(result.contents[node.name]),
            "light_paths": dict(paths.wires[node.name]),
            "tags": _tags(node),
            "inserted": node.origin == "converter",
            "reason": node.reason or None,
        }
        for node in typed.network.nodes
    ]
    steps = [
        {
            "name": node.name,
            "op": node.op.name,
            "mode": _mode(node),
            "recursive": node.recursive,
            "line": node.line,
        }
        for node in plan
    ]
    return {
        "network": typed.network.name,
        "wires": wires,
        "schedule": steps,
        "image_paths": paths.image,
        "missing": _missing(paths),
    }


def explain_text(result: Result) -> str:
    typed, plan = _compiled(result)
    paths = describe_paths(typed)
    rows = [("wire", "operator", "representation", "content", "light paths")]
    for node in typed.network.nodes:
        name, op, representation = node.name, node.op.name, node.op.output
        for content, expression in paths.wires[node.name] or (("none", "no light"),):
            rows.append((name, op, representation, content, expression))
            name = op = representation = ""
    lines = [f"network {typed.network.name}  ({printable(typed.network.file)})", "", *_table(rows)]
    inserted = [node for node in typed.network.nodes if node.origin == "converter"]
    if inserted:
        lines += ["", "inserted"]
        for node in inserted:
            converter = node.op.converter
            cost = f", cost {converter.cost:g}" if converter else ""
            loss = f", loses {converter.loss}" if converter and converter.loss else ""
            lines.append(f"  {node.name} = {node.op.name}(...): {node.reason}{cost}{loss}")
    lines += ["", "schedule"]
    for node_at in plan:
        cycle = ", recursive" if node_at.recursive else ""
        lines.append(f"  {_mode(node_at):8} {node_at.name} (line {node_at.line}{cycle})")
    if paths.image is not None:
        lines += ["", f"image: {paths.image}"]
        lines += [f"lacks: {paths.lacking}" if paths.lacking else "lacks: nothing"]
    return "\n".join(lines) + "\n"


def _compiled(result: Result) -> tuple[TypedNetwork, tuple[ScheduledNode, ...]]:
    assert result.typed is not None and result.schedule is not None
    return result.typed, result.schedule.nodes


def _missing(paths: PathReport) -> dict[str, object] | None:
    """A shortest path of all light that the picture lacks, as a witness."""
    if paths.missing is None:
        return None
    return {"path": paths.missing, "count": 0, "expected": 1, "routes": []}


def _mode(node: ScheduledNode) -> str:
    return "prepare" if node.prepares else "pull"


def _tags(node: Node) -> list[str]:
    """Where the wire is wanted: the tag of `to`, perhaps negated, or nothing for everywhere."""
    to = node.parameter("to")
    return [to.value.text] if to and isinstance(to.value, TagRef) else []


# --- The library ------------------------------------------------------------------------------------------------------


def list_operators(library: Library) -> str:
    rows = [("operator", "from -> to", "what it is")]
    for op in sorted(library.operators.values(), key=lambda o: (o.family, o.name)):
        rows.append((op.name, _signature(op), first_sentence(op.doc)))
    rows.append(("", "", ""))
    for representation in library.representations.values():
        rows.append((representation.name, "representation", first_sentence(representation.doc)))
    return "\n".join(_table(rows)) + "\n"


def describe_operator(op: Operator) -> str:
    """The operator's documentation, from its declaration."""
    lines = [f"{op.name}: {_signature(op)}", "", op.doc, "", "light paths"]
    for rule in op.paths:
        lines.append(f"  {rule.content} = {_rule_text(rule.port, rule.emitter, rule.tail)}")
    lines.append(f"bias: {f'up to {op.bias:.3g} of the mean' if op.bias else 'none'}")
    if op.prepares:
        lines.append("works before the picture")
    if op.overloads:
        lines.append(f"{op.overloads}({', '.join(p.representation for p in op.ports)}) stands for it, too")
    if op.scale_parameter:
        lines.append(f"multiplies the light by '{op.scale_parameter}', which its paths do not show")
    if op.converter:
        lines.append(
            f"inserted where needed, cost {op.converter.cost:g}"
            + (f"; {op.converter.loss}" if op.converter.loss else "")
        )
    for port in op.ports:
        complete = ", complete before it is read" if port.complete else ", subtracted" if port.subtracted else ""
        lines += ["", f"  {port.name}: {port.representation}{'...' if port.variadic else ''} (input{complete})"]
        lines.append(textwrap.indent(port.doc, "      "))
    for parameter in op.parameters:
        lines += ["", f"  {_parameter(parameter)}", textwrap.indent(parameter.doc, "      ")]
    return "\n".join(lines) + "\n"


def _signature(op: Operator) -> str:
    ports = ", ".join(p.representation + ("..." if p.variadic else "") for p in op.ports)
    return f"{ports} -> {op.output}" if ports else f"-> {op.output}"


def _rule_text(port: str | None, emitter: str | None, tail: object) -> str:
    from lnc.syntax.ast import PathConcat, PathUnion
    from lnc.syntax.printer import print_path

    head = (port or "L") + (f"@{emitter}" if emitter else "")
    if tail is None:
        return head
    text = print_path(tail)  # type: ignore[arg-type]
    return f"{head} ({text})" if isinstance(tail, PathUnion) and not isinstance(tail, PathConcat) else f"{head} {text}"


def _parameter(parameter: Parameter) -> str:
    text = f"{parameter.name}: {parameter.type}"
    if parameter.choices:
        text += f"({', '.join(parameter.choices)})"
    if parameter.default_text:
        text += f" = {parameter.default_text}"
    if parameter.low is not None and parameter.type != "path":
        text += f", {parameter.low:g} to {parameter.high:g}"
    return text


def _table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Columns of equal width; the last one is free."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    return [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[-1]]).rstrip()
        for row in rows
    ]
