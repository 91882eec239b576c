"""Diagnostics as SARIF 2.1.0 (Static Analysis Results Interchange Format, OASIS), which code hosts and editors read."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

import lnc
from lnc.diagnostics import Diagnostic, Hop, Witness
from lnc.diagnostics.codes import PAGES
from lnc.diagnostics.format import as_json, witness_headline
from lnc.source import Span

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"

Json = dict[str, object]


def as_sarif(diagnostics: Sequence[Diagnostic]) -> Json:
    """One log with one run: a rule per code that was found, a result per diagnostic."""
    codes = sorted({d.code for d in diagnostics})
    driver = {"name": "lnc", "version": lnc.__version__, "rules": [_rule(code) for code in codes]}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(d, codes.index(d.code)) for d in diagnostics],
    }
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(code: str) -> Json:
    page = PAGES[code]
    text = " ".join(page.text.split())
    return {
        "id": code,
        "shortDescription": {"text": page.title},
        "fullDescription": {"text": text},
        "help": {"text": f"{text}\n\n{page.provoked_by}".strip()},
    }


def _result(diagnostic: Diagnostic, rule: int) -> Json:
    help = "".join(f"\nhelp: {text}" for text in diagnostic.help)
    result: Json = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity,
        "message": {"text": diagnostic.message + help},
        "locations": [_location(diagnostic.span)],
    }
    if diagnostic.related:
        result["relatedLocations"] = [
            {"id": i, **_location(related.span, related.message)} for i, related in enumerate(diagnostic.related, 1)
        ]
    if diagnostic.witness is not None:
        result["codeFlows"] = [_code_flow(diagnostic.witness, i) for i in range(len(diagnostic.witness.routes))]
        result["properties"] = {"witness": as_json(diagnostic)["witness"]}
    return result


def _code_flow(witness: Witness, index: int) -> Json:
    """One route: a flow of its own, as readers take the threads of one flow to run at the same time."""
    count = len(witness.routes)
    return {
        "message": {"text": f"{witness_headline(witness)}: route {index + 1} of {count}"},
        "threadFlows": [{"locations": [_flow_location(hop) for hop in witness.routes[index]]}],
    }


def _flow_location(hop: Hop) -> Json:
    return {"location": _location(hop.span, hop.wire)}


def _location(span: Span, message: str | None = None) -> Json:
    line, column = span.source.line_column(span.start)
    end_line, end_column = span.source.line_column(span.end)
    region = {"startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column}
    physical = {"artifactLocation": {"uri": file_uri(span.source.name)}, "region": region}
    location: Json = {"physicalLocation": physical}
    if message is not None:
        location["message"] = {"text": message}
    return location


def file_uri(name: str) -> str:
    """Relative to the working folder where the file lies in it, as code hosts want it; else absolute.

    A name that is no UTF-8 keeps its bytes, percent-encoded.
    """
    path = os.path.relpath(name)
    if not os.path.isabs(name) or not path.startswith(os.pardir):
        return quote(Path(path).as_posix(), errors="surrogateescape")
    return "file://" + quote(Path(name).as_posix(), errors="surrogateescape")
