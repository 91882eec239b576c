"""Text in, text out: `tests/cases/<station>/*.ln`.

A case is a network, a line `// ---`, and what the station makes of it, each line as a comment. Write the first part,
run `pytest tests/test_cases.py --update-golden`, and read the difference before you commit it.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from lnc.diagnostics import Reporter
from lnc.driver import compile_network, describe_paths
from lnc.library import Library
from lnc.passes.schedule import print_schedule
from lnc.source import SourceFile
from lnc.syntax.explicit import explicit
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_file

CASES = Path(__file__).parent / "cases"
MARK = "// ---\n"


def run_station(station: str, source: SourceFile, library: Library) -> str:
    if station == "syntax":
        reporter = Reporter()
        file = parse(source, reporter)
        faults = [f"{d.span}: {d.code}: {d.message}\n" for d in reporter.sorted()]
        return print_file(file) + "".join(faults)
    result = compile_network(source, library)
    assert result.typed is not None and result.schedule is not None, result.diagnostics
    if station in ("insert_converters", "macros"):
        return explicit(result.file, result.typed.network)
    if station == "schedule":
        return print_schedule(result.schedule)
    assert station == "light_paths"
    paths = describe_paths(result.typed)
    lines = [f"{wire}.{content}: {text}" for wire, all_of in paths.wires.items() for content, text in all_of]
    return "\n".join([*lines, f"image: {paths.image}"]) + "\n"


def as_comments(text: str) -> str:
    return "".join(f"// {line}".rstrip() + "\n" for line in text.splitlines())


@pytest.mark.parametrize("path", sorted(CASES.glob("*/*.ln")), ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_case(path: Path, library: Library, update_golden: bool) -> None:
    text = path.read_text("utf-8")
    network = text.split(MARK)[0]
    found = as_comments(run_station(path.parent.name, SourceFile(path.name, network), library))
    if update_golden:
        path.write_text(network + MARK + found, "utf-8")
    assert network + MARK + found == path.read_text("utf-8")
