"""What must hold for every text, whoever makes it up: the target of `fuzz.py`, and of `test_corpus.py`."""

from __future__ import annotations

import json

from lnc.diagnostics import Reporter
from lnc.diagnostics.format import as_github, as_json, human
from lnc.diagnostics.sarif import as_sarif
from lnc.driver import compile_network, describe_paths
from lnc.library import Library
from lnc.library_reader import load_library
from lnc.source import SourceFile
from lnc.syntax.explicit import explicit
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_file

LIBRARY: Library = load_library()[0]


def check(text: str) -> None:
    """Raises if the compiler does, if a message is malformed, or if the canonical layout is not stable."""
    source = SourceFile("fuzz.ln", text)
    result = compile_network(source, LIBRARY)
    for diagnostic in result.diagnostics:
        shown = human(diagnostic)
        assert all(c == "\n" or c.isprintable() for c in shown), shown
        assert as_github(diagnostic).isprintable()
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(diagnostic.span.source.text)
        json.dumps(as_json(diagnostic))
    json.dumps(as_sarif(result.diagnostics))
    if result.typed is not None:
        describe_paths(result.typed)
        assert print_file(parse(SourceFile("explicit.ln", explicit(result.file, result.typed.network)), Reporter()))
    check_layout(source)


def check_layout(source: SourceFile) -> None:
    reporter = Reporter()
    file = parse(source, reporter)
    if reporter.failed:
        return
    printed = print_file(file)
    again = parse(SourceFile("printed.ln", printed), reporter)
    assert not reporter.failed and again == file and print_file(again) == printed
