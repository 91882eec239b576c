"""Diagnostics as text for people, with source lines and carets; as JSON for scripts; as commands for GitHub Actions."""

from __future__ import annotations

from lnc.diagnostics import Diagnostic, Witness
from lnc.source import Span

LINE_WIDTH = 140
HOP_LIMIT = 16  # hops of a route that are shown to people


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
    if diagnostic.witness is not None:
        lines += _witness_lines(diagnostic.witness)
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


# --- Witnesses --------------------------------------------------------------------------------------------------------


def witness_headline(witness: Witness) -> str:
    """`LSDE is counted 2 times instead of once`."""
    return f"{witness.path} is counted {_times(witness.count)} instead of {_times(witness.expected)}"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _witness_lines(witness: Witness) -> list[str]:
    """The path with its counts, and each route hop by hop: the place, the wire, and the line that makes it."""
    lines = [printable(f"witness: {witness_headline(witness)}")]
    for number, route in enumerate(witness.routes, 1):
        lines.append(f"  route {number} of {len(witness.routes)}")
        rows = [(str(hop.span), hop.wire, hop.span.source.line_text(hop.span.line).strip()) for hop in route]
        if len(rows) > HOP_LIMIT:
            left_out = ("...", f"{len(rows) - HOP_LIMIT} more", "")
            rows = [*rows[: HOP_LIMIT // 2], left_out, *rows[-HOP_LIMIT // 2 :]]
        place_width, wire_width = (max((len(printable(row[i])) for row in rows), default=0) for i in range(2))
        for place, wire, text in rows:
            shown = f"{printable(place):{place_width}}  {printable(wire):{wire_width}}  {_tabless(text[:LINE_WIDTH])}"
            lines.append(f"    {shown}".rstrip())
    return lines


# --- For programs -----------------------------------------------------------------------------------------------------


def as_json(diagnostic: Diagnostic) -> dict[str, object]:
    """A diagnostic as the contract describes it."""
    source = diagnostic.span.source
    line, column = source.line_column(diagnostic.span.start)
    end_line, end_column = source.line_column(diagnostic.span.end)
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        "file": source.name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
        "notes": _notes(diagnostic),
        "witness": _witness(diagnostic.witness),
    }


def _witness(witness: Witness | None) -> dict[str, object] | None:
    if witness is None:
        return None
    routes = [[hop.wire for hop in route] for route in witness.routes]
    return {"path": witness.path, "count": witness.count, "expected": witness.expected, "routes": routes}


def _notes(diagnostic: Diagnostic) -> list[str]:
    related = [f"{r.span}: {r.message}" for r in diagnostic.related]
    return related + [f"help: {help}" for help in diagnostic.help]


def as_github(diagnostic: Diagnostic) -> str:
    """A workflow command of GitHub Actions, which shows the diagnostic beside the line that it is about."""
    source = diagnostic.span.source
    line, column = source.line_column(diagnostic.span.start)
    end_line, end_column = source.line_column(diagnostic.span.end)
    properties = {
        "file": source.name,
        "line": line,
        "col": column,
        "endLine": end_line,
        "endColumn": end_column,
        "title": diagnostic.code,
    }
    listed = ",".join(f"{name}={_github_property(str(value))}" for name, value in properties.items())
    text = [diagnostic.message, *_notes(diagnostic)]
    if diagnostic.witness is not None:
        text += _witness_lines(diagnostic.witness)
    return f"::{diagnostic.severity} {listed}::{_github_text(chr(10).join(text))}"


def _github_text(text: str) -> str:
    """As the runner unescapes it; other control characters are made visible."""
    for character, code in (("%", "%25"), ("\r", "%0D"), ("\n", "%0A")):
        text = text.replace(character, code)
    return printable(text)


def _github_property(text: str) -> str:
    return _github_text(text).replace(":", "%3A").replace(",", "%2C")
