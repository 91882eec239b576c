"""Files of macros alone, and mistakes in macros that are called in several places."""

from __future__ import annotations

from pathlib import Path

import pytest

from lnc.diagnostics import Diagnostic
from lnc.driver import compile_network
from lnc.library import Library
from lnc.network import PathValue
from lnc.source import SourceFile

MACROS = sorted((Path(__file__).parent.parent / "examples" / "macros").glob("*.ln"))


def check(text: str, library: Library, name: str = "macros.ln") -> list[Diagnostic]:
    return compile_network(SourceFile(name, text), library, macros=True).diagnostics


def places(found: list[Diagnostic]) -> list[tuple[str, str]]:
    return [(d.code, d.span.text) for d in found]


@pytest.mark.parametrize("path", MACROS, ids=lambda p: p.stem)
def test_shipped_macros_are_right(path: Path, library: Library) -> None:
    assert check(path.read_text(), library, str(path)) == []


def test_tags_are_those_of_whoever_uses_the_file(library: Library) -> None:
    text = """op Part(in: Points, where = wall, via = D@!floor) -> Points {
    out = PathTracer(in + out, to = !where, from = mirror, via = via | G@where)
}
"""
    assert check(text, library) == []
    found = check(text + "image Part(Direct(Lights()))\n", library)  # now it is a network, and has none of them
    assert {(d.code, d.message) for d in found} == {
        ("LN0102", f"no tag is called '{name}'") for name in ("wall", "floor", "mirror")
    }


@pytest.mark.parametrize(
    ("given", "inside", "path"),
    [
        ("D|G", "first S*", "(D|G) S*"),
        ("D", "first? S", "D? S"),
        ("DS", "(first|G)*", "(D S|G)*"),
        ("(D|S)*", "first@floor", "((D|S)*)@floor"),
    ],
)
def test_paths_inside_of_paths(given: str, inside: str, path: str, library: Library) -> None:
    network = 'tag floor\nlight = Lights()\ntap P(light) -> "p.ply"\n'
    by_macro = (
        f"op P(light: Emission, first = {given}) -> Photons {{\n    out = ParticleTracer(light, via = {inside})\n}}\n"
    )
    plain = f"op P(light: Emission) -> Photons {{\n    out = ParticleTracer(light, via = {path})\n}}\n"
    languages = []
    for macro in (by_macro, plain):
        typed = compile_network(SourceFile("n.ln", macro + network), library).typed
        assert typed is not None
        value = typed.network.nodes[-1].parameter("via")
        assert value is not None and isinstance(value.value, PathValue)
        languages.append((value.value.events.next, value.value.events.accepting, value.value.events.tags))
    assert languages[0] == languages[1]


def test_inputs_are_of_any_representation(library: Library) -> None:
    """Nothing is wrong with macros on private representations, nor with those that give them."""
    text = """op Tree(p: Photons) -> PhotonMap {
    out = KDPhotonTree(p)
}
op Kept(s: HemisphereSamples, file = "records.cache") -> IrradianceRecords {
    out = IGCache(s, file = file)
}
op Source() -> Emission {
    out = Lights()
}
"""
    assert check(text, library) == []


def test_one_mistake_is_one_message_however_often_its_macro_is_called(library: Library) -> None:
    wrong = "op Inner(in: Points) -> Points {\n    out = Scale(in, factor = 3m)\n}\n"
    twice = "op A(in: Points) -> Points {\n    b   = Inner(in)\n    out = Inner(b)\n}\n"
    once = "op B(in: Points) -> Points {\n    out = Inner(in)\n}\n"
    network = "direct = Direct(Lights())\nimage Inner(direct) + Inner(direct)\n"
    for text in (wrong, wrong + twice, twice + wrong + once, wrong + once + twice + network):
        assert places(check(text, library)) == [("LN0104", "3m")]


def test_macros_of_other_files_are_checked_where_they_are_called(library: Library, tmp_path: Path) -> None:
    (tmp_path / "others.ln").write_text(
        "op Wrong(in: Points) -> Points {\n    out = Scale(in, factor = 3m)\n}\n"
        "op Unused(in: Points) -> Points {\n    out = Scale(in, factor = 4m)\n}\n"
    )
    text = 'use "others.ln"\nop Calls(in: Points) -> Points {\n    out = Wrong(in)\n}\n'
    found = check(text, library, str(tmp_path / "macros.ln"))
    assert places(found) == [("LN0104", "3m")]
    assert [r.span.text for r in found[0].related] == ["Wrong"]


def test_a_mistake_in_a_call_hides_no_other(library: Library) -> None:
    text = """op Twice(in: Points, n = 2) -> Points {
    half = Scale(in, factor = 0.5)
    out  = Scale(half, factor = n)
}
direct  = Direct(Lights())
wrong   = Twice(direct, n = 5cm)
depends = Scale(wrong)
cells   = NNDensity(direct)
image direct + depends + cells
"""
    assert places(check(text, library)) == [("LN0104", "5cm"), ("LN0201", "direct")]


def test_a_mistake_in_a_macro_that_is_not_called_hides_none_in_the_network(library: Library) -> None:
    text = """op Wrong(in: Points) -> Points {
    out = Scale(elsewhere)
}
direct = Direct(Lights())
image NNDensity(direct)
"""
    assert places(check(text, library)) == [("LN0102", "elsewhere"), ("LN0201", "direct")]


def test_macros_that_call_each_other(library: Library) -> None:
    text = "".join(f"op {a}(in: Points) -> Points {{\n    out = {b}(in)\n}}\n" for a, b in ("PQ", "QP", "RR"))
    assert places(check(text, library)) == [("LN0111", "P"), ("LN0111", "R")]


@pytest.mark.parametrize(
    "macro",
    [
        "op Twice(in: Points, in: Points) -> Points {\n    out = in\n}\n",
        "op Twice(in: Points) -> Points {\n    a = in\n    a = Scale(in)\n    out = a\n}\n",
        "op NoResult(in: Points) -> Points {\n    a = in\n}\n",
        "op Unknown(in: Foetons) -> Points {\n    out = Scale(in)\n}\n",
        "op Unknown(in: Points) -> Foetons {\n    out = in\n}\n",
    ],
)
def test_what_is_wrong_with_the_macro_itself_is_said_once(macro: str, library: Library) -> None:
    assert len(check(macro, library)) == 1
