"""Diagnostics as text for people, with source lines and carets, and as JSON for scripts."""

from __future__ import annotations

from lnc.diagnostics import Diagnostic, Related, Witness
from lnc.source import Span

LINE_WIDTH = 140


def printable(text: str) -> str:
    """The text with everything escaped that could move a terminal's cursor or reorder what it shows."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escaped(c) for c in text)


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{{{code:x}}}"


def human(diagnostic: Diagnostic) -> str:
    """A diagnostic in several lines, ended by a newline."""
    lines = [f"{diagnostic.severity}[{diagnostic.code}]: {printable(diagnostic.message)}"]
    lines += _snippet(diagnostic.span, "^", diagnostic.label)
    for related in diagnostic.related:
        lines.append(f"note: {printable(related.message)}")
        lines += _snippet(related.span, "-", "")
    lines += [f"help: {printable(help)}" for help in diagnostic.help]
    return "\n".join(lines) + "\n"


def _snippet(span: Span, mark: str, label: str) -> list[str]:
    """file:line:column, the line, and a caret under each character that is meant."""
    source = span.source
    line, column = source.line_column(span.start)
    where = f"  --> {printable(source.name)}:{line}:{column}"
    if not source.text:
        return [where]
    text = source.line_text(line)
    start = column - 1
    end = min(max(start + span.end - span.start, start + 1), max(len(text), start + 1))
    cut = max(0, start - LINE_WIDTH // 2) if len(text) > LINE_WIDTH else 0
    shown, before = text[cut : cut + LINE_WIDTH], text[cut:start]
    marked = text[start : min(end, cut + LINE_WIDTH)]
    gutter = " " * len(str(line))
    dots = "..." if cut else ""
    carets = " " * len(dots + _tabless(before)) + mark * max(1, len(_tabless(marked)))
    return [
        where,
        f"{gutter} |",
        f"{line} | {dots}{_tabless(shown)}".rstrip(),
        f"{gutter} | {carets} {printable(label)}".rstrip(),
    ]


def _tabless(text: str) -> str:
    return printable(text.replace("\t", "    "))


def as_json(diagnostic: Diagnostic) -> dict[str, object]:
    """A diagnostic as the contract describes it."""
    source = diagnostic.span.source
    line, column = source.line_column(diagnostic.span.start)
    end_line, end_column = source.line_column(diagnostic.span.end)
    notes = [f"{_place(r)}: {r.message}" for r in diagnostic.related]
    notes += [f"help: {help}" for help in diagnostic.help]
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        "file": source.name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
        "notes": notes,
        "witness": _witness(diagnostic.witness),
    }


def _witness(witness: Witness | None) -> dict[str, object] | None:
    if witness is None:
        return None
    routes = [[hop.wire for hop in route] for route in witness.routes]
    return {"path": witness.path, "count": witness.count, "expected": witness.expected, "routes": routes}


def _place(related: Related) -> str:
    return str(related.span)
