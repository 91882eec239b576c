"""One tiny wrong network per file in `tests/errors`, the expected message as a comment on the offending line.

    direct = Direct(light, sampels = 4)  // error: LN0103: 'Direct' has no parameter 'sampels'

Every message must be expected: one mistake, one message. A folder of the same name holds further operators.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lnc.diagnostics import Reporter
from lnc.diagnostics.codes import PAGES
from lnc.diagnostics.format import human
from lnc.driver import compile_file, compile_network
from lnc.library import Library, snake_case
from lnc.library_reader import load_library, read_library
from lnc.scene_tags import check_tags, read_scene_names
from lnc.source import SourceFile

ERRORS = Path(__file__).parent / "errors"
NO_EXAMPLE = {"LN0100", "LN0112"}  # an unreadable file; a wrong declaration, in test_wrong_declarations
EXPECTED = re.compile(r"// (error|warning): (LN\d{4}): (.*?) *$")


@pytest.mark.parametrize("path", sorted(ERRORS.glob("*.ln")), ids=lambda p: p.stem)
def test_error(path: Path) -> None:
    expected = [
        (line, *match.groups())
        for line, text in enumerate(path.read_text("utf-8").splitlines(), 1)
        if (match := EXPECTED.search(text))
    ]
    folder = path.with_suffix("")
    result = compile_file(str(path), (str(folder),) if folder.is_dir() else ())
    found = [(d.span.line, d.severity, d.code, d.message) for d in result.diagnostics]
    assert found == expected
    assert path.name.startswith(tuple(d.code for d in result.diagnostics))


@pytest.mark.parametrize("code", sorted(PAGES))
def test_every_page_has_an_example_that_provokes_it(code: str, library: Library, tmp_path: Path) -> None:
    page = PAGES[code]
    assert page.code == code and page.text.strip() and page.title
    if page.example is None:
        assert code in NO_EXAMPLE
        return
    for declaration in page.operators:
        stem = snake_case(declaration.split()[1].partition("(")[0])
        (tmp_path / stem).mkdir()
        (tmp_path / stem / f"{stem}.ln").write_text(declaration)
    if page.operators:
        library, faults = load_library((str(tmp_path),))
        assert not faults
    result = compile_network(SourceFile("example.ln", page.example), library)
    reporter = Reporter(result.diagnostics)
    if page.scene is not None:
        (tmp_path / "scene.gltf").write_text(page.scene)
        check_tags(result.file, read_scene_names(str(tmp_path / "scene.gltf")), "scene.gltf", reporter)
    assert [d.code for d in reporter.diagnostics] == [code]


def test_every_code_is_provoked_by_a_file() -> None:
    provoked = {path.stem[:6] for path in ERRORS.glob("*.ln")}
    assert set(PAGES) - provoked == {*NO_EXAMPLE, "LN0501"}  # the last in test_scene_tags.py


def test_every_code_in_the_compiler_has_a_page() -> None:
    sources = Path(__file__).parent.parent / "lnc"
    used = {code for path in sources.rglob("*.py") for code in re.findall(r'"(LN\d{4})"', path.read_text("utf-8"))}
    assert used == set(PAGES)


def test_wrong_declarations() -> None:
    texts = {
        "/ops/a/wrong_name/other.ln": "representation Points\noperator Wrong() -> Points {\npaths radiance = L\n}\n",
        "/ops/a/bad/bad.ln": "operator Bad(in: Nothing) -> Points {\nn: count = 1%\nm: thing\n}\n",
        "/ops/a/scales/scales.ln": "operator Scales() -> Points {\nscales n\npaths radiance = L\nn: count = 1\n}\n",
        "/ops/a/paths/paths.ln": "operator Paths(in: Points) -> Points {\npaths light = in\npaths samples = D in\n}\n",
    }
    _, faults = read_library(texts)
    assert {d.code for d in faults} == {"LN0112"}
    assert len(faults) == 8


def test_carets_stand_under_the_text() -> None:
    source = SourceFile("a\x1b[31m.ln", "\tlight = Lights(form = x)\n")
    (diagnostic,) = compile_network(source, load_library()[0]).diagnostics
    lines = human(diagnostic).split("\n")
    assert lines[0] == "error[LN0103]: 'Lights' has no parameter 'form'"
    assert lines[1] == r"  --> a\x1b[31m.ln:1:17"
    assert lines[4].index("^") == lines[3].index("form")
    assert lines[4].count("^") == len("form")
    assert lines[5] == "help: did you mean 'from'?"


def test_a_wrong_value_for_a_macro_is_shown_at_both_places(library: Library) -> None:
    macro = "op Lit(light: Emission, rays = 1) -> Points {\n    out = Direct(light, samples = rays)\n}\n"
    source = SourceFile("macro.ln", f"{macro}image Lit(Lights(), rays = -1)\n")
    (found,) = compile_network(source, library).diagnostics
    assert (found.code, found.span.text) == ("LN0104", "-1")
    assert [related.span.text for related in found.related] == ["samples = rays"]


def test_a_mistake_in_a_macro_is_shown_at_the_calls_that_led_there(library: Library) -> None:
    text = """tag floor = mesh "Floor"
op Bounce(in: Points, at = floor) -> Points {
    out = PathTracer(in, from = at)
}
op Outer(in: Points, where = floor) -> Points {
    out = Bounce(in, at = where)
}
direct = Direct(Lights(), to = floor)
image direct + Outer(direct) + Outer(direct, where = !floor)
"""
    found = [d for d in compile_network(SourceFile("calls.ln", text), library).diagnostics if d.severity == "error"]
    assert [(d.code, d.span.line) for d in found] == [("LN0304", 3)]
    calls = [r.span for r in found[0].related if r.message == "in this call of the macro"]
    assert [(c.line, c.text) for c in calls] == [(6, "Bounce"), (9, "Outer")]
    assert calls[1].start == text.rindex("Outer")  # the second call, not the first


def test_a_mistake_in_a_macro_that_is_called_twice_is_one_mistake(library: Library) -> None:
    text = "op Dark(in: Emission) -> Points {\n    out = Direct(in, samples = 0)\n}\n"
    text += "light = Lights()\nimage Dark(light) + Dark(light)\n"
    found = compile_network(SourceFile("twice.ln", text), library).diagnostics
    assert [(d.code, d.span.text, len(d.related)) for d in found] == [("LN0104", "0", 1)]


@pytest.mark.parametrize(
    ("text", "code", "place", "help"),
    [
        ("a = Scale(direct, 0.5)", "LN0101", "0.5", "parameters are given by name: NAME"),
        ("a = 0.5 * direct", "LN0101", "0.5", "a wire is scaled by an operator: Scale(WIRE, factor = 0.5)"),
        ("a = direct * 0.5", "LN0101", "*", "a wire is scaled by an operator: Scale(WIRE, factor = 0.5)"),
        ("Scale(direct)", "LN0101", "(", "give what it makes a name: NAME = Scale(...)"),
        ("a = Scale(direct, factor = 50%)", "LN0104", "50%", None),
        ("a = Cache(direct)", "LN0102", "Cache", "there are: CachePhotonMap, CachePhotons, CacheQuadTree, "),
        ("a = CacheQuadTree(direct)", "LN0105", "CacheQuadTree(direct)", 'add: file = "..."'),
        ("a = CacheQuadTree(direct, file = a.cache)", "LN0104", "a.cache", 'write: "a.cache"'),
        ("a = WireTap(direct)", "LN0105", "WireTap(direct)", 'add: layer = "..."'),
        ("tap direct -> a.exr", "LN0101", "a", 'write: "a.exr"'),
        ("tap direct", "LN0101", "\n", 'say into which file: -> "FILE"'),
        ('tap direct > "a.exr"', "LN0101", ">", 'a file is named behind an arrow: -> "FILE"'),
        ("use macros.ln", "LN0101", "macros", 'write: "macros.ln"'),
        ('tag floor = "Floor"', "LN0101", '"Floor"', 'say of what this is the name: material "Floor" or mesh'),
        ("a = direct@floor", "LN0101", "@", "a tag restricts an operator by its parameters"),
        ("a = Scale(direct, to = floor|wall)", "LN0104", "floor|wall", "give both a tag of their own: tag NAME = "),
        ("p = ParticleTracer(light)\na = NNDensity(p - p)", "LN0201", "p", "add up what it is for: NNDensity(p) - "),
        ("op M(in) -> Points {\n    out = in\n}", "LN0101", ")", "an input has a representation"),
        ("op M(n: count = 2) -> Points {\n    out = in\n}", "LN0101", "=", "an input (in: Points) has no default"),
        ("op M(in: Points) {\n    out = in\n}", "LN0101", "{", "say what the macro gives: op NAME(...) -> Points {"),
        ("op M(in: Points) -> Points {\n    Scale(in)\n}", "LN0101", "(", "give what it makes a name: out = "),
        ("op M(in: Points) -> Points {\n    image in\n}", "LN0101", "in", "a macro is made of equations"),
        ('a = Scale(direct, factor = "2")', "LN0104", '"2"', "write it without quotation marks: 2"),
        ("network n {\n}", "LN0101", "{", "a network has no braces: its statements follow on lines of their own"),
    ],
)  # fmt: skip
def test_help_says_how_to_mend_it(text: str, code: str, place: str, help: str | None, library: Library) -> None:
    """One message for each of a beginner's mistakes, at its place, with what to write instead."""
    source = SourceFile("n.ln", f"light = Lights()\ndirect = Direct(light)\n{text}\nimage direct\n")
    found = [d for d in compile_network(source, library).diagnostics if d.severity == "error"]
    assert [(d.code, d.span.text) for d in found] == [(code, place)]
    assert found[0].help[0].startswith(help) if help else "write 0.5" in found[0].message, found[0]
