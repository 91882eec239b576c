"""Syntax tree -> canonical text. Parsing the text gives the same tree; printing that gives the same text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lnc.syntax import ast

WIDTH = 100
ALIGN_LIMIT = 24  # names longer than this do not push their neighbours to the right
INDENT = "    "


def print_file(file: ast.File) -> str:
    """The whole file, with its comments."""
    lines = list(_block([_Line(s.comments, *_statement(s)) for s in file.statements]))
    lines += file.end_comments if lines else _without_leading_blank(file.end_comments)
    return "".join(f"{line}\n" for line in lines)


@dataclass(frozen=True)
class _Line:
    """A statement: its comments, what is aligned with its neighbours, the rest, and lines that follow."""

    comments: ast.Comments
    head: str
    body: str
    group: str  # only neighbours of one group are aligned
    more: tuple[str, ...] = ()


def _block(lines: list[_Line]) -> Iterator[str]:
    """Statements under each other; heads of direct neighbours are padded to the same width."""
    width = 0
    for i, line in enumerate(lines):
        if i == 0 or not _joined(lines[i - 1], line):
            width = _group_width(lines, i)
        if line.comments.blank and i > 0:
            yield ""
        yield from line.comments.leading
        head = line.head if len(line.head) > ALIGN_LIMIT or line.more else line.head.ljust(width)
        text = f"{head} {line.body}".rstrip()
        trailing = f"  {line.comments.trailing}" if line.comments.trailing else ""
        if line.more:
            yield text
            yield from line.more[:-1]
            yield line.more[-1] + trailing
        else:
            yield text + trailing


def _joined(before: _Line, line: _Line) -> bool:
    return before.group == line.group != "" and not (line.comments.blank or line.comments.leading or before.more)


def _group_width(lines: list[_Line], start: int) -> int:
    width = 0
    for i in range(start, len(lines)):
        if i > start and not _joined(lines[i - 1], lines[i]):
            break
        if len(lines[i].head) <= ALIGN_LIMIT and not lines[i].more:
            width = max(width, len(lines[i].head))
    return width


def _statement(statement: ast.Statement | ast.OperatorItem) -> tuple[str, str, str, tuple[str, ...]]:
    """Head, body, group and further lines of a statement."""
    match statement:
        case ast.NetworkName(name):
            return "network", name, "", ()
        case ast.TagStatement(name, globs):
            alternatives = " | ".join(f"{g.kind} {_text(g.glob)}" for g in globs)
            return f"tag {name}", f"= {alternatives}" if globs else "", "tag", ()
        case ast.Equation():
            return _equation(statement)
        case ast.Expect(wire, path, at_most):
            body = ("<= " if at_most else "") + print_path(path)
            return ("expect", body, "result", ()) if wire is None else (f"expect {wire}:", body, "result", ())
        case ast.ImageStatement(wire, layers):
            return "image", print_wire(wire) + (" layers" if layers else ""), "result", ()
        case ast.TapStatement(wire, file):
            return "tap", f"{print_wire(wire)} -> {_text(file)}", "result", ()
        case ast.LightmapStatement(wire, file):
            return "lightmap", f"{print_wire(wire)} -> {_text(file)}", "result", ()
        case ast.ProbeStatement(wire, sensors, file):
            return "probe", f"{print_wire(wire)} at {_text(sensors)} -> {_text(file)}", "result", ()
        case ast.Use(file):
            return "use", _text(file), "", ()
        case ast.Macro():
            return _macro(statement)
        case ast.RepresentationDeclaration(name, pulled, taps):
            written = name + (" pulled" if pulled else "")
            written += f" tap {', '.join(_text(suffix) for suffix in taps)}" if taps else ""
            return "representation", written, "", ()
        case ast.OperatorDeclaration():
            return _operator(statement)
    return _item(statement)


def _equation(equation: ast.Equation) -> tuple[str, str, str, tuple[str, ...]]:
    """One line, or one line per argument where that is too long."""
    head = f"{equation.name}: {equation.representation}" if equation.representation else equation.name
    text = f"= {print_wire(equation.wire)}"
    if len(head) + 1 + len(text) > WIDTH and isinstance(equation.wire, ast.Call):
        parts = _arguments(equation.wire.inputs, equation.wire.arguments)
        if parts:
            commas = [f"{INDENT}{part}," for part in parts[:-1]]
            return head, f"= {equation.wire.op}(", "equation", (*commas, f"{INDENT}{parts[-1]}", ")")
    return head, text, "equation", ()


def _macro(macro: ast.Macro) -> tuple[str, str, str, tuple[str, ...]]:
    inputs = ", ".join(
        f"{i.name}: {i.representation}" if i.default is None else f"{i.name} = {print_value(i.default)}"
        for i in macro.inputs
    )
    head = f"{macro.name}({inputs}) -> {macro.output} {{"
    body = list(_block([_Line(e.comments, *_statement(e)) for e in macro.body]))
    return "op", head, "", (*_indent([*body, *macro.end_comments]), "}")


def _operator(operator: ast.OperatorDeclaration) -> tuple[str, str, str, tuple[str, ...]]:
    body = list(_block([_Line(i.comments, *_item(i)) for i in operator.body]))
    more = (*_indent([*body, *operator.end_comments]), "}")
    ports = [
        f"{p.mode} {p.name}".lstrip() + f": {p.representation}{'...' if p.variadic else ''}" for p in operator.ports
    ]
    tail = f") -> {operator.output} {{"
    if not any(p.doc for p in operator.ports):
        return "operator", f"{operator.name}({', '.join(ports)}{tail}", "", more
    lines: list[str] = []
    for i, (port, text) in enumerate(zip(operator.ports, ports, strict=True)):
        lines += [f"/// {line}".rstrip() for line in port.doc.split("\n")] if port.doc else []
        lines.append(text + ("," if i + 1 < len(ports) else ""))
    return "operator", f"{operator.name}(", "", (*_indent(lines), tail, *more)


def _item(item: ast.Statement | ast.OperatorItem) -> tuple[str, str, str, tuple[str, ...]]:
    match item:
        case ast.ParameterDeclaration(name, kind, choices, default, low, high):
            text = f"{name}: {kind}" + (f"({', '.join(choices)})" if choices else "")
            text += f" = {print_value(default)}" if default is not None else ""
            text += f" in {low.text}..{high.text}" if low and high else ""
            return text, "", "", ()
        case ast.PathsDeclaration(content, path):
            return f"paths {content}", f"= {print_path(path)}", "paths", ()
        case ast.BiasDeclaration(bound):
            return "bias", bound.text, "", ()
        case ast.ConverterDeclaration(cost, loss):
            return "converter", f"cost {cost.text}" + (f" loss {_text(loss)}" if loss else ""), "", ()
        case ast.RecursionDeclaration(kind, bound):
            return "recursion", kind if bound is None else f"{kind} {bound}", "", ()
        case ast.EqualDeclaration(ports):
            return "equal", ", ".join(ports), "", ()
        case ast.PrepareDeclaration(cached, for_view):
            return "prepare", " ".join(["cached"] * cached + ["for view"] * for_view), "", ()
        case ast.OverloadsDeclaration(name):
            return "overloads", name, "", ()
        case ast.ScalesDeclaration(parameter):
            return "scales", parameter, "", ()
    raise AssertionError(item)


def print_wire(wire: ast.WireExpression) -> str:
    match wire:
        case ast.WireName(name):
            return name
        case ast.Call(op, inputs, arguments):
            return f"{op}({', '.join(_arguments(inputs, arguments))})"
        case ast.Cast(inner, representation, arguments):
            text = f"({print_wire(inner)})" if isinstance(inner, ast.WireSum | ast.Cast) else print_wire(inner)
            return f"{text} as {representation}" + (f"({', '.join(_arguments((), arguments))})" if arguments else "")
    parts: list[str] = []
    for i, term in enumerate(wire.terms):
        text = f"({print_wire(term.wire)})" if isinstance(term.wire, ast.WireSum) else print_wire(term.wire)
        parts.append(text if i == 0 else f"{'-' if term.negative else '+'} {text}")
    return " ".join(parts)


def _arguments(inputs: Sequence[ast.WireExpression], arguments: Sequence[ast.Argument]) -> list[str]:
    return [print_wire(w) for w in inputs] + [f"{a.name} = {print_value(a.value)}" for a in arguments]


def print_value(value: ast.Value) -> str:
    match value:
        case ast.NumberValue(text):
            return text
        case ast.TextValue(text):
            return _text(text)
        case ast.FlagValue(flag):
            return "true" if flag else "false"
        case ast.NameValue(name):
            return name
    return print_path(value.path)


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return f'"{escaped}"'


# --- Light paths ------------------------------------------------------------------------------------------------------

_UNION, _CONCAT, _REPEAT = range(3)


def print_path(path: ast.PathExpression) -> str:
    return _path(path, _UNION)


def _path(path: ast.PathExpression, within: int) -> str:
    """With brackets where `within` binds more tightly."""
    match path:
        case ast.PathEvents(letters, tag):
            known = {"DGS": "."}.get(letters)
            return (known or (letters if len(letters) == 1 else f"[{letters}]")) + _tag(tag)
        case ast.PathName(name, tag, negated=negated):
            return "!" * negated + name + _tag(tag)
        case ast.PathEmpty():
            return "()"
        case ast.PathTagged(item, tag):
            return f"({_path(item, _UNION)}){_tag(tag)}"
        case ast.PathLpe(text=text):
            return f'lpe "{text}"'
        case ast.PathUnion(items):
            text = " | ".join(_path(i, _CONCAT) for i in items)
            if all(len(i) == 1 for i in text.split(" | ")):
                text = text.replace(" ", "")
            return text if within == _UNION else f"({text})"
        case ast.PathConcat(items):
            text = " ".join(_path(i, _REPEAT) for i in items)
            return text if within <= _CONCAT else f"({text})"
    item = path.item
    inner = _path(item, _REPEAT)
    if isinstance(item, ast.PathRepeat):
        inner = f"({inner})"
    return inner + _quantifier(path.low, path.high)


def _quantifier(low: int, high: int | None) -> str:
    short = {(0, None): "*", (1, None): "+", (0, 1): "?"}.get((low, high))
    if short:
        return short
    return f"{{{low}}}" if low == high else f"{{{low},{'' if high is None else high}}}"


def _tag(tag: ast.TagRef | None) -> str:
    return f"@{tag.text}" if tag else ""


def _indent(lines: Sequence[str]) -> list[str]:
    return [INDENT + line if line else "" for line in lines]


def _without_leading_blank(lines: tuple[str, ...]) -> tuple[str, ...]:
    return lines[1:] if lines and lines[0] == "" else lines
