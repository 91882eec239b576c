"""Light path expressions of other renderers: what they mean, and where their mistakes are shown."""

from __future__ import annotations

import re
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lnc.diagnostics import Diagnostic, Reporter
from lnc.driver import compile_network
from lnc.library import Library
from lnc.paths.automaton import Dfa
from lnc.paths.language import Alphabet, path_dfa
from lnc.source import SourceFile
from lnc.syntax import ast
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_file

ALPHABET = Alphabet(("floor", "lamp"))


def read(path: str) -> tuple[ast.PathExpression, list[Diagnostic]]:
    reporter = Reporter()
    file = parse(SourceFile("a.ln", f"expect {path}\n"), reporter)
    (statement,) = file.statements
    assert isinstance(statement, ast.Expect)
    return statement.path, reporter.diagnostics


def language(path: str) -> Dfa:
    expression, faults = read(path)
    assert not faults, faults
    return path_dfa(expression, ALPHABET)


# The left side is quoted or adapted from the manuals of OSL, Arnold and RenderMan.
@pytest.mark.parametrize(
    ("lpe", "path"),
    [
        ("C.*L", "L (D|G|S)* E"),
        ("C.*[LO]", "L (D|G|S)* E"),
        ("C.*<L.>", "L .* E"),
        ("C<RD>.*<L.>", "L .* D E"),
        ("C<.D><L.>", "L D E"),
        ("CDL", "L D E"),
        ("C<RS>+<RD>L", "L D S+ E"),
        ("C[DG][LO]", "L (D|G) E"),
        ("C[<RD><RG>].+L", "L .+ (D|G) E"),
        ("C(<TS>|<RS>)*<RD>L", "L D S* E"),
        ("C[^S].*O", "L@area .* (D|G) E"),
        ("C<TS>{2}D{1,}G{0,3}O", "L@area G{0,3} D+ S{2} E"),
        ("C<R.>?<..>L", "L . .? E"),
        ("CRTL", "L . . E"),
        ("C D S L | C O", "L S D E | L@area E"),
        ("C<RD'floor'>.*<L.'lamp'>", "L@lamp .* D@floor E"),
        ("CD<L.'delta'>", "L@delta D E"),
    ],
)
def test_meaning(lpe: str, path: str) -> None:
    assert language(f'lpe "{lpe}"') == language(path)


# --- Against regular expressions of Python, which read the same words from the camera on ------------------------------

EVENTS = {"D": "D", "G": "G", "S": "S", ".": "[DGS]", "<RD>": "D", "<T.>": "[DGS]", "<.G>": "G", "R": "[DGS]"}
events = st.one_of(
    st.sampled_from(sorted(EVENTS.items())),
    st.sets(st.sampled_from(["D", "<TG>", "S"]), min_size=1).map(
        lambda some: (f"[{''.join(sorted(some))}]", f"[{''.join(sorted(some)).replace('<TG>', 'G')}]")
    ),
    st.sampled_from([("[^D]", "[GS]"), ("[^ GS ]", "D"), ("[^L<.D>]", "[GS]")]),
)
middles = st.recursive(
    events,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: (p[0][0] + p[1][0], p[0][1] + p[1][1])),
        st.tuples(inner, inner).map(lambda p: (f"({p[0][0]} |{p[1][0]})", f"({p[0][1]}|{p[1][1]})")),
        st.tuples(inner, st.sampled_from(["*", "+", "?", "{2}", "{0,2}", "{1,}"])).map(
            lambda p: (f"({p[0][0]}){p[1]}", f"({p[0][1]}){p[1]}")
        ),
    ),
    max_leaves=6,
)
emitters = st.sampled_from([("L", "[ad]"), ("<L.>", "[ad]"), ("O", "a"), ("[OL]", "[ad]")])


def accepts(dfa: Dfa, word: str) -> bool:
    """`word` from the emitter on: a (area) or d (delta), events, E."""
    letters = {"a": ALPHABET.emitters("area"), "d": ALPHABET.emitters("delta"), "E": ALPHABET.eye}
    state = 0
    for letter in word:
        wanted = letters.get(letter) or ALPHABET.events(letter)
        wanted &= -wanted  # on surfaces without tags
        following = [target for found, target in dfa.edges[state] if found & wanted]
        if not following:
            return False
        (state,) = following
    return bool(dfa.accepting[state])


@settings(max_examples=80, deadline=None)
@given(middles, emitters)
def test_words(middle: tuple[str, str], emitter: tuple[str, str]) -> None:
    dfa = language(f'lpe "C{middle[0]}{emitter[0]}"')
    pattern = re.compile(f"C{middle[1]}{emitter[1]}")
    for length in range(5):
        for inner in product("DGS", repeat=length):
            for end in "ad":
                word = "C" + "".join(inner) + end
                assert accepts(dfa, word[:0:-1] + "E") == bool(pattern.fullmatch(word)), (middle, word)


@settings(max_examples=200, deadline=None)
@given(st.text("CLDGSROTVB.<>[]^()|*+?{}0123,'abs \\", max_size=25))
def test_any_text_is_read_or_refused_once(text: str) -> None:
    text = text.replace("\\", "\\\\")
    path, faults = read(f'lpe "{text}"')
    assert len(faults) <= 1
    for fault in faults:
        assert fault.code in ("LN0101", "LN0104")
        assert len("expect lpe ") < fault.span.start <= fault.span.end <= len(f'expect lpe "{text}')
    printed = print_file(parse(SourceFile("a.ln", f'expect lpe "{text}"\n'), Reporter()))
    assert printed == f'expect lpe "{text}"\n'
    if not faults:
        assert read(f'lpe "{text}"')[0] == path


# --- In networks ------------------------------------------------------------------------------------------------------


def test_spans_lie_inside_of_the_text(library: Library) -> None:
    text = "image Direct(Lights())\nexpect lpe \"C<RD>(<RD'flor'>|<.G'flor'>)<L.'lmap'>\"\n"
    found = compile_network(SourceFile("a.ln", text), library).diagnostics
    assert [(d.code, d.span.text, d.span.line) for d in found] == [("LN0102", "flor", 2), ("LN0102", "lmap", 2)]


def test_a_path_parameter(library: Library) -> None:
    both = [
        compile_network(
            SourceFile("a.ln", f"light = Lights()\nimage NNDensity(ParticleTracer(light, via = {via}))\n"), library
        )
        for via in ('lpe "<RD><RS>+"', "S+ D")
    ]
    events = []
    for result in both:
        assert result.schedule is not None
        value = next(n for n in result.schedule.nodes if n.op.name == "ParticleTracer").parameter("via")
        assert value is not None
        events.append(value.value.events)  # type: ignore[union-attr]
    assert events[0] == events[1]


def test_nesting_is_limited() -> None:
    for text in ("(" * 100_000, "(" * 100 + "D" + ")" * 100):
        _, (fault,) = read(f'lpe "{text}"')
        assert fault.message == "brackets are nested more than 64 deep"
