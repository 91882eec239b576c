"""One name for several operators: which one a call means is decided by what its inputs are."""

from __future__ import annotations

import pytest

from lnc.driver import compile_network
from lnc.library import Library
from lnc.library_reader import read_library
from lnc.source import SourceFile

DECLARATIONS = {
    "/lib/kinds.ln": "/// a\nrepresentation A\n/// b\nrepresentation B\n/// c\nrepresentation C\n",
    "/lib/x/make/make.ln": "/// m\noperator Make() -> A {\n paths radiance = L\n}\n",
    "/lib/x/use/use.ln": "/// u\noperator Use(in: A) -> C {\n paths unchanged = in\n}\n",
}
OVERLOAD = "/// o\noperator Other(in: B) -> C {{\n overloads {name}\n paths unchanged = in\n}}\n"


def operators(text: str, library: Library) -> dict[str, str]:
    result = compile_network(SourceFile("n.ln", text), library)
    assert result.typed is not None, result.diagnostics
    return {node.name: node.op.name for node in result.typed.network.nodes}


@pytest.mark.parametrize("call", ["Direct({0})", "Direct(light = {0})", "Direct({0} + {0})", "Direct(Direct({0}))"])
def test_inputs_decide(library: Library, call: str) -> None:
    text = "light = Lights()\npoints = Direct(light)\nb = {}\nimage b\nexpect <= L(D|G|S)*E\n"
    assert operators(text.format(call.format("points")), library)["b"] == "Gather"
    assert operators(text.format("Direct(light = light)"), library)["b"] == "Direct"


def test_a_recursive_call(library: Library) -> None:
    text = "light = Lights()\nd = Direct(light)\nb = Direct(d + b)\nimage b\nexpect <= L(D|G|S)*E\n"
    assert operators(text, library) == {"light": "Lights", "d": "Direct", "b": "Gather"}


@pytest.mark.parametrize(
    ("overload", "message"),
    [
        (OVERLOAD.format(name="Nothing"), "which no file declares"),
        (OVERLOAD.format(name="Make"), "not named alike: () -> A"),
        (OVERLOAD.format(name="Use").replace("-> C", "-> B"), "not named alike: (in) -> C"),
        (OVERLOAD.format(name="Use").replace("(in:", "(it:").replace("= in", "= it"), "not named alike"),
        (OVERLOAD.format(name="Other"), "'Other' overloads 'Other'"),
    ],
)
def test_wrong_overloads(overload: str, message: str) -> None:
    _, faults = read_library({**DECLARATIONS, "/lib/x/other/other.ln": overload})
    assert [d.code for d in faults] == ["LN0112"]
    assert message in faults[0].message


def test_right_overload() -> None:
    found, faults = read_library({**DECLARATIONS, "/lib/x/other/other.ln": OVERLOAD.format(name="Use")})
    assert not faults
    assert [op.name for op in found.overloads["Use"]] == ["Other"]
