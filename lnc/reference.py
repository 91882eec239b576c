"""`lnc compile [FILE] --reference EXPR`: from a light path expression to the plain tracer that keeps only its paths."""

from __future__ import annotations

from dataclasses import dataclass

from lnc.diagnostics import Reporter, did_you_mean, quote
from lnc.network import Tag
from lnc.passes.resolve import define_tags
from lnc.paths.automaton import Dfa, TooLarge, intersection
from lnc.paths.language import TAG_LIMIT, Alphabet, path_dfa, tags_in
from lnc.paths.regex import Renderer
from lnc.source import SourceFile
from lnc.syntax import ast
from lnc.syntax.parse import parse
from lnc.syntax.printer import print_path

REFERENCE_STATES = 256  # ln::PathLanguage::kMaxStates
OUT_OF_REACH = "L@delta S+ ((D|G) S+)+ E"


@dataclass(frozen=True)
class Reference:
    """The paths that a reference tracer keeps: the expression as text, and as an automaton over `alphabet`.

    `tags`: definitions of the alphabet's tags, in its order. `lost`: the shortest word that carries light and that no
    particle and no eye path of the tracer can find, or None.
    """

    text: str
    paths: Dfa
    alphabet: Alphabet
    tags: tuple[Tag, ...]
    lost: str | None


def read_reference(text: str, network: ast.File | None, reporter: Reporter) -> Reference | None:
    """The reference for the expression `text`, with the tags that `network` defines; None if something is wrong."""
    known = define_tags(network.statements, reporter) if network else {}
    path = _parse_path(text, reporter)
    if path is None or reporter.failed:
        return None
    used = sorted(tags_in(path))
    for name in used:
        if name not in known:
            help = did_you_mean(name, known) or f'define it in FILE: tag {name} = material "..."'
            reporter.error("LN0102", path.span, f"no tag is called {quote(name)}", help=help)
    if len(used) > TAG_LIMIT:
        reporter.error("LN0104", path.span, f"a path may name {TAG_LIMIT} tags at most")
    if reporter.failed:
        return None
    alphabet = Alphabet(tuple(used))
    try:
        paths = path_dfa(path, alphabet)
    except TooLarge:
        paths = None
    if paths is None or len(paths.edges) > REFERENCE_STATES:
        reporter.error("LN0104", path.span, f"this path needs more than {REFERENCE_STATES} states")
        return None
    if paths.is_empty or not _from_light_to_eye(paths, alphabet):
        what = "no path fits this expression" if paths.is_empty else "not every path of this begins at L and ends at E"
        reporter.error("LN0104", path.span, what, help="a picture is made of paths such as L (D|G|S)* E")
        return None
    lost = intersection(paths, _out_of_reach(alphabet))
    return Reference(
        text=print_path(path),
        paths=paths,
        alphabet=alphabet,
        tags=tuple(known[name] for name in used),
        lost=None if lost.is_empty else _word_text(lost.shortest_word(), alphabet),
    )


def _parse_path(text: str, reporter: Reporter) -> ast.PathExpression | None:
    """The path of the statement `expect EXPR`, which messages show."""
    file = parse(SourceFile("--reference", f"expect {text}"), reporter)
    match file.statements:
        case (ast.Expect(None, path, False),):
            return path
    if not reporter.failed:
        reporter.error("LN0101", file.span, "a single light path is wanted, such as L (D|G|S)* E")
    return None


def _from_light_to_eye(paths: Dfa, alphabet: Alphabet) -> bool:
    """Does every word have the form L (D|G|S)* E?"""
    for state, edges in enumerate(paths.edges):
        allowed = alphabet.emitters() if state == 0 else alphabet.events() | alphabet.eye
        for letters, target in edges:
            if letters & ~allowed or target == 0:
                return False
            sees = letters & alphabet.eye
            if paths.accepting[target] and (sees != letters or paths.edges[target]):
                return False
            if sees and not paths.accepting[target]:
                return False
    return not paths.accepting[0]


def _out_of_reach(alphabet: Alphabet) -> Dfa:
    """What begins and ends with S at a delta emitter and the eye, with no two other surfaces in a row to connect."""
    path = _parse_path(OUT_OF_REACH, Reporter())
    assert path is not None
    return path_dfa(path, alphabet)


def _word_text(word: list[int], alphabet: Alphabet) -> str:
    """One path out of sets of letters, letters adjacent."""
    renderer = Renderer(alphabet)
    return "".join(renderer.letter_names(letters)[0] for letters in word)
