"""What holds for every text: diagnostics and nothing else, layout that is stable, explicit text that means the same."""

from __future__ import annotations

import string
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lnc.diagnostics import Reporter
from lnc.diagnostics.format import as_json, human
from lnc.driver import Result, compile_network, describe_paths
from lnc.library import Library
from lnc.library_reader import load_library
from lnc.passes.schedule import print_schedule
from lnc.paths.automaton import Nfa, determinise
from lnc.paths.language import Alphabet, add_path, path_dfa
from lnc.paths.regex import Renderer
from lnc.source import SourceFile
from lnc.syntax import ast
from lnc.syntax.explicit import explicit
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_file

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.ln"))
WORDS = """network tag expect image tap lightmap probe use op operator representation layers at as in complete paths
    bias converter cost loss recursion prepare true false light direct pt Lights Direct PathTracer ParticleTracer
    NNDensity KDPhotonTree Sum Scale WireTap Points Photons PhotonMap samples via to from factor L D G S E LSDE
    ( ) [ ] { } + - * ? | = , : -> <= .. ... . @ ! 1 200k 1% 5cm 0.5 "a" "*.exr" //""".split()
relaxed = settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))

texts = st.text(max_size=200)
soups = st.lists(st.sampled_from([*WORDS, *["\n"] * 12]), max_size=60).map(" ".join)


@st.composite
def mutants(draw: st.DrawFn) -> str:
    """An example with a few characters changed, dropped or doubled."""
    text = draw(st.sampled_from(EXAMPLES)).read_text("utf-8")
    for _ in range(draw(st.integers(1, 4))):
        at, length = draw(st.integers(0, len(text))), draw(st.integers(0, 8))
        text = (
            text[:at] + draw(st.one_of(st.just(text[at : at + length] * 2), st.text(max_size=4))) + text[at + length :]
        )
    return text


def compiled(text: str, name: str = "random.ln") -> Result:
    return compile_network(SourceFile(name, text), load_library()[0])


@relaxed
@given(st.one_of(texts, soups, mutants()))
def test_no_text_raises(text: str) -> None:
    result = compiled(text)
    for diagnostic in result.diagnostics:
        shown = human(diagnostic)
        assert all(c == "\n" or c.isprintable() for c in shown), shown
        assert as_json(diagnostic)["line"]
        assert diagnostic.span.start <= diagnostic.span.end <= len(text)
    if result.typed is not None:
        describe_paths(result.typed)


@relaxed
@given(st.one_of(soups, mutants()))
def test_layout_is_stable(text: str) -> None:
    reporter = Reporter()
    file = parse(SourceFile("a.ln", text), reporter)
    if reporter.failed:
        return
    printed = print_file(file)
    again = parse(SourceFile("b.ln", printed), Reporter())
    assert again == file
    assert print_file(again) == printed


# --- Well-formed networks ---------------------------------------------------------------------------------------------

tags = st.sampled_from(["t", "u"])
letters = st.sampled_from(["D", "G", "S", "[DG]", ".", "D@t", "S@!u", "t", "!u", "(D|G)@u", "()"])
via = st.recursive(
    letters,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: f"({p[0]} {p[1]})"),
        st.tuples(inner, inner).map(lambda p: f"({p[0]} | {p[1]})"),
        st.tuples(inner, st.sampled_from(["*", "+", "?", "{2}", "{1,3}", "{0,}"])).map(lambda p: f"({p[0]}){p[1]}"),
    ),
    max_leaves=6,
)


@st.composite
def networks(draw: st.DrawFn) -> str:
    """A network that may well be right: wires refer to each other in any order."""
    points = [f"p{i}" for i in range(draw(st.integers(1, 6)))]
    lines = [
        'tag t = material "T*"',
        "tag u",
        "light = Lights()",
        f"photons = ParticleTracer(light, via = {draw(via)})",
    ]
    term = st.sampled_from(points)
    wire = st.one_of(
        term,
        st.tuples(term, st.sampled_from(["+", "-"]), term).map(" ".join),
        st.just("Direct(light, to = t)"),
        st.just("Direct(light, to = !u)"),
        st.just("NNDensity(photons)"),
        st.just("NNDensity(photons as PhotonMap, neighbours = 9)"),
    )
    for name in points:
        inner = draw(wire)
        lines.append(
            f"{name} = "
            + draw(
                st.sampled_from(
                    [inner, f"PathTracer({inner})", f"PathTracer({inner}, from = u)", f"Scale({inner}, factor = 2)"]
                )
            )
        )
    lines.append(f"image {' + '.join(points)}" + draw(st.sampled_from(["", " layers"])))
    return "\n".join(draw(st.permutations(lines))) + "\n"


def assert_explicit_means_the_same(text: str) -> None:
    result = compiled(text)
    if result.typed is None or result.schedule is None:
        return
    written = explicit(result.file, result.typed.network)
    again = compiled(written)
    assert again.typed is not None and again.schedule is not None, (written, again.diagnostics)
    assert all(node.origin == "equation" for node in again.typed.network.nodes)
    assert sorted_plan(again) == sorted_plan(result)
    assert explicit(again.file, again.typed.network) == written


def sorted_plan(result: Result) -> list[str]:
    """A schedule without the order of independent nodes, which follows the order of the text."""
    assert result.schedule is not None
    text = print_schedule(result.schedule).replace(" [head]", "").replace("\n    ", " ; ")
    return sorted(line for line in text.splitlines() if not line.startswith(("prepare ", "cycle ")))


@relaxed
@given(networks())
def test_explicit_text_means_the_same(text: str) -> None:
    assert_explicit_means_the_same(text)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_explicit_example_means_the_same(path: Path) -> None:
    assert_explicit_means_the_same(path.read_text("utf-8"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_examples_are_right_and_in_canonical_layout(path: Path, library: Library) -> None:
    text = path.read_text("utf-8")
    result = compile_network(SourceFile(str(path), text), library)
    assert result.schedule is not None and not result.diagnostics
    assert print_file(parse(SourceFile(str(path), text), Reporter())) == text
    assert result.schedule.network == path.stem


# --- Light paths ------------------------------------------------------------------------------------------------------


def parsed_path(text: str) -> ast.PathExpression:
    reporter = Reporter()
    file = parse(SourceFile("path.ln", f"expect {text}\n"), reporter)
    assert not reporter.diagnostics, (text, reporter.diagnostics)
    (statement,) = file.statements
    assert isinstance(statement, ast.Expect)
    return statement.path


def same_language(a: ast.PathExpression, b: ast.PathExpression, alphabet: Alphabet) -> bool:
    return path_dfa(a, alphabet) == path_dfa(b, alphabet)


@relaxed
@given(via)
def test_printed_paths_denote_the_same(text: str) -> None:
    alphabet = Alphabet(("t",))
    text = text.replace("u", "t")
    path = parsed_path(f"L {text} E")
    dfa = path_dfa(path, alphabet)
    printed = Renderer(alphabet).text(dfa)
    if printed == "nothing":
        assert dfa.is_empty
    elif "automaton" not in printed:
        assert path_dfa(parsed_path(printed), alphabet) == dfa


def test_automata_are_minimal() -> None:
    alphabet = Alphabet()
    nfa = Nfa()
    nfa.accepting = {add_path(nfa, parsed_path("L (D|G|S)* (D|G|S)? E | L . . E"), 0, alphabet)}
    assert len(determinise(nfa).edges) == 3


# --- Size and hostility -----------------------------------------------------------------------------------------------


def chain(count: int) -> str:
    wires = "".join(f"w{i} = Scale(w{i - 1}, factor = 0.5)\n" for i in range(1, count))
    return f"light = Lights()\nw0 = Direct(light)\n{wires}image w{count - 1}\n"


HUGE = {
    "brackets": "image " + "(" * 100_000,
    "balanced": "image " + "(" * 50_000 + "a" + ")" * 50_000,
    "sum": "light = Lights()\nd = Direct(light)\nimage " + "d + " * 15_000 + "d\n",
    "nested calls": "image " + "Scale(" * 60 + "Direct(Lights())" + ")" * 60,
    "calls": "light = Lights()\nimage " + " + ".join(["Direct(light)"] * 2_000) + "\n",
    "aliases": "a0 = Lights()\n" + "".join(f"a{i} = a{i - 1}\n" for i in range(1, 5_000)) + "image Direct(a4999)\n",
    "garbage": "= " * 100_000,
    "lines of garbage": "= =\n" * 20_000,
    "repetitions": "light = Lights()\nimage NNDensity(ParticleTracer(light, via = ((D{900}){900}){900}))\n",
    "subsets": "light = Lights()\nimage NNDensity(ParticleTracer(light, via = (D|G)* D (D|G){40}))\n",
    "stars": "expect " + "S" + "*" * 100_000,
    "name": "a" * 200_000 + " = Lights()\n",
    "number": "light = Lights(from = " + "9" * 200_000 + ")\n",
    "macros": "op M0(in: Points) -> Points {\n    out = Scale(in)\n}\n"
    + "".join(f"op M{i}(in: Points) -> Points {{\n    out = M{i - 1}(M{i - 1}(in))\n}}\n" for i in range(1, 30))
    + "image M29(Direct(Lights()))\n",
    "comments": "// comment\n" * 20_000,
    "unknown": "".join(f"wire{i} = Scale(wier{i})\n" for i in range(5_000)),
    "chain": chain(1_000),
}


@pytest.mark.parametrize("name", HUGE)
def test_large_input_takes_little_time(name: str) -> None:
    begin = time.process_time()
    compiled(HUGE[name][: 256 * 1024])
    assert time.process_time() - begin < 4


def test_a_long_chain_is_explained() -> None:
    result = compiled(chain(150))
    assert result.typed is not None
    assert describe_paths(result.typed).image == "L (D|G)? S* E"


def test_hostile_names_and_texts_stay_inside_their_quotes() -> None:
    """Names are identifiers by grammar; texts keep every character, and the writer of C++ has to escape them."""
    for hostile in ('"); system("x', "*/ int x;", 'R"(', "%s%n", "\\", "a\nb", "${x}", "{{ x }}", "/*", "//", "??/"):
        quoted = '"' + hostile.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
        text = f"tag t = mesh {quoted}\nimage Direct(Lights(from = t))\n"
        result = compiled(text)
        assert result.schedule is not None, result.diagnostics
        assert result.schedule.tags[0].globs == (("mesh", hostile),)
        for node in result.schedule.nodes:
            assert node.identifier.isidentifier() and set(node.identifier) <= set(string.ascii_letters + "_0123456789")
            assert "\n" not in node.text


def test_identifiers_avoid_what_cpp_keeps_for_itself() -> None:
    text = "int = Lights()\n_x = Direct(int)\na__b = Direct(int)\nwire_int = Direct(int)\nimage _x + a__b + wire_int\n"
    result = compiled(text)
    assert result.schedule is not None
    identifiers = {node.name: node.identifier for node in result.schedule.nodes}
    assert identifiers == {"int": "wire_int_2", "_x": "wire_x", "a__b": "wire_a_b", "wire_int": "wire_int"}
