"""Every operator's folder is complete, and its declaration says everything that a user needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from lnc.library import Library, Operator
from lnc.library_reader import load_library
from lnc.source import SourceFile
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_file

ROOT = Path(__file__).parent.parent
OPS = ROOT / "ops_library"
FAMILIES = {"emit", "propagate", "convert", "combine", "sense"}
OPERATORS = sorted(load_library()[0].operators.values(), key=lambda op: op.name)
every_operator = pytest.mark.parametrize("op", OPERATORS, ids=lambda op: op.name)


@every_operator
def test_folder_is_complete(op: Operator) -> None:
    folder = Path(op.folder)
    assert folder == OPS / op.family / op.file_stem
    assert op.family in FAMILIES
    wanted = {f"{op.file_stem}.ln", f"{op.file_stem}.hpp", f"test_{op.file_stem}.py"}
    assert wanted <= {path.name for path in folder.iterdir()}


@every_operator
def test_everything_is_documented(op: Operator) -> None:
    assert op.doc.split("\n")[0].endswith("."), "the first line says what it is, in a sentence"
    for part in (*op.ports, *op.parameters):
        assert part.doc, f"{op.name}.{part.name} has no doc comment"
    for parameter in op.parameters:
        if parameter.type in ("count", "ratio", "length", "angle", "time", "number"):
            assert parameter.low is not None, f"{op.name}.{parameter.name} has no range"
            assert parameter.default is None or parameter.low <= parameter.default <= parameter.high


@every_operator
def test_names(op: Operator) -> None:
    names = [part.name for part in (*op.ports, *op.parameters)]
    assert len(names) == len(set(names))
    assert all(name == name.lower() for name in names)
    assert op.name not in ("image", "tap") and (op.name[0].isupper() or op.name == "mis")


@every_operator
def test_bias_and_paths_are_stated(op: Operator) -> None:
    text = (Path(op.folder) / f"{op.file_stem}.ln").read_text("utf-8")
    assert "\n    bias " in text, "an unbiased operator says: bias 0"
    assert op.paths
    assert not (op.output == "Points" and op.family != "sense") or op.parameter("to"), "Points are restricted by `to`"


@pytest.mark.parametrize("path", sorted(OPS.rglob("*.ln")), ids=lambda p: p.stem)
def test_layout_is_canonical(path: Path) -> None:
    from lnc.diagnostics import Reporter

    text = path.read_text("utf-8")
    assert print_file(parse(SourceFile(path.name, text), Reporter())) == text


def test_no_folder_without_a_declaration() -> None:
    declared = {Path(op.folder) for op in OPERATORS}
    folders = {path.parent for path in OPS.rglob("*.hpp")} | {path.parent for path in OPS.rglob("test_*.py")}
    assert folders <= declared


def test_every_representation_is_used_and_documented(library: Library) -> None:
    used = {op.output for op in OPERATORS} | {p.representation for op in OPERATORS for p in op.ports}
    assert used == set(library.representations)
    assert all(r.doc for r in library.representations.values())
