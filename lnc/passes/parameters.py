"""A value in the text -> the value of a declared parameter, checked. Faults are LN0104, unknown tags LN0102."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import lru_cache

from lnc.diagnostics import Related, Reporter, did_you_mean, quote
from lnc.library import Parameter, Scalar
from lnc.network import ParameterValue, PathValue
from lnc.paths.automaton import STATE_LIMIT, Dfa, EventTable, TooLarge
from lnc.paths.language import EVENTS, TAG_LIMIT, Alphabet, event_table, path_dfa, tags_in
from lnc.source import Span
from lnc.syntax import ast
from lnc.syntax.printer import print_path
from lnc.values import UNITS, ValueFault, number

WANTED = {
    "flag": "true or false",
    "text": "a text in quotation marks",
    "path": "a light path such as (D|G|S)*",
    "tags": "a tag such as floor or !floor",
    "count": "a whole number such as 200k",
    "number": "a number",
    "ratio": "a ratio such as 1%",
    "length": "a length such as 5cm",
    "angle": "an angle such as 30deg",
    "time": "a time such as 10s",
}


def parameter_value(
    parameter: Parameter,
    value: ast.Value | None,
    tags: Collection[str],
    reporter: Reporter,
    broken: frozenset[str] = frozenset(),
    place: Span | None = None,
) -> ParameterValue | None:
    """The parameter with `value`, or with its default where that is None; None if it is wrong and reported.

    Tags in `broken` have been reported where they are defined. `place`: where a macro hands the value on.
    """
    if value is None:
        if parameter.type == "path" and parameter.default is not None:
            return ParameterValue(parameter, _path_value(parameter.default), None)  # type: ignore[arg-type]
        return ParameterValue(parameter, parameter.default, None)  # type: ignore[arg-type]
    try:
        return ParameterValue(parameter, _convert(parameter, value, tags, reporter, broken), value)
    except ValueFault as fault:
        if str(fault):
            help = _help(parameter, value)
            related = [Related(place, "inside of the macro it is used here")] if place else []
            reporter.error("LN0104", value.span, f"'{parameter.name}': {fault}", related=related, help=help)
        return None


def _help(parameter: Parameter, value: ast.Value) -> str | None:
    match parameter.type, value:
        case "text", ast.NameValue() | ast.PathLiteral():
            return f'write: "{value.span.text}"'
        case kind, ast.TextValue(text) if kind != "text":
            return f"write it without quotation marks: {text}"
        case "tags", ast.PathLiteral(ast.PathUnion()):
            return 'give both a tag of their own: tag NAME = material "A*" | material "B*"'
        case _, ast.NameValue(name):
            return did_you_mean(name, parameter.choices)
    return None


def _convert(
    parameter: Parameter, value: ast.Value, tags: Collection[str], reporter: Reporter, broken: frozenset[str]
) -> Scalar | PathValue | ast.TagRef:
    match parameter.type, value:
        case kind, ast.NumberValue(text) if kind in UNITS:
            return _in_range(parameter, number(text, kind), text)
        case "flag", ast.FlagValue(flag):
            return flag
        case "choice", ast.NameValue(name) if name in parameter.choices:
            return name
        case "text", ast.TextValue(text):
            if not text or len(text) > 200 or not text.isprintable():
                raise ValueFault("a text of 1 to 200 printable characters is wanted")
            return text
        case "tags", ast.NameValue(name, span):
            return _known_tag(ast.TagRef(name, False, span), tags, reporter, broken)
        case "tags", ast.PathLiteral(ast.PathName(name, None, span, negated)):
            return _known_tag(ast.TagRef(name, negated, span), tags, reporter, broken)
        case "path", ast.NameValue(name):
            return _path(parameter, letters_or_tag(name, value.span), tags, reporter, broken)
        case "path", ast.PathLiteral(path):
            return _path(parameter, path, tags, reporter, broken)
    wanted = f"one of {', '.join(parameter.choices)}" if parameter.type == "choice" else WANTED[parameter.type]
    raise ValueFault(f"{wanted} is wanted, not {quote(value.span.text)}")


def _known_tag(tag: ast.TagRef, tags: Collection[str], reporter: Reporter, broken: frozenset[str]) -> ast.TagRef:
    if tag.name in tags:
        return tag
    if tag.name not in broken:
        help = did_you_mean(tag.name, tags) or f'define it: tag {tag.name} = material "..."'
        reporter.error("LN0102", tag.span, f"no tag is called {quote(tag.name)}", help=help)
    raise ValueFault("")


def _in_range(parameter: Parameter, value: Scalar, text: str) -> Scalar:
    low, high = parameter.low, parameter.high
    if isinstance(value, str) or low is None or high is None or low <= value <= high:
        return value
    bounds = f"{_plain(low, parameter.type)} to {_plain(high, parameter.type)}"
    raise ValueFault(f"{quote(text)} is outside of its range {bounds}")


def _plain(value: float, type: str) -> str:
    if type == "ratio":
        return f"{value * 100:g}%"
    for factor, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")) if type in ("count", "number") else ():
        if abs(value) >= factor and value % factor == 0:
            return f"{value / factor:g}{suffix}"
    return f"{value:g}" + {"length": "m", "angle": "rad", "time": "s"}.get(type, "")


def letters_or_tag(name: str, span: Span) -> ast.PathExpression:
    """The path that a plain word is: events, or a tag."""
    if set(name) <= set("LDGSE"):
        events: list[ast.PathExpression] = [ast.PathEvents(letter, None, span) for letter in name]
        return ast.PathConcat(tuple(events), span) if len(events) > 1 else events[0]
    return ast.PathName(name, None, span)


def _path(
    parameter: Parameter,
    path: ast.PathExpression,
    tags: Collection[str],
    reporter: Reporter,
    broken: frozenset[str],
) -> PathValue:
    used = tags_in(path)
    if report_unknown_tags(path, tags, reporter, broken):
        raise ValueFault("")
    if len(used) > TAG_LIMIT:
        raise ValueFault(f"a path may name {TAG_LIMIT} tags at most")
    for letters in sorted(letters_in(path)):
        if not set(letters) <= set(EVENTS):
            raise ValueFault("it lists scattering events only: D, G and S, without L and E")
    try:
        value = _path_value(path)
        dfa, _ = _automata(path)
    except TooLarge:
        raise ValueFault(f"this path needs more than {STATE_LIMIT} states") from None
    if dfa.is_empty:
        raise ValueFault("no path fits this expression")
    shortest, longest = dfa.length_bounds()
    if parameter.low is None or parameter.high is None:
        return value
    if shortest < parameter.low or longest is None or longest > parameter.high:
        one = parameter.low == parameter.high == 1
        wanted = "exactly one event is" if one else f"{parameter.low:g} to {parameter.high:g} events are"
        raise ValueFault(f"{wanted} wanted")
    return value


def report_unknown_tags(
    path: ast.PathExpression, tags: Collection[str], reporter: Reporter, broken: frozenset[str]
) -> bool:
    """LN0102 for each tag of a path that the network does not define; True if there is one, also one in `broken`."""
    unknown = tags_in(path) - set(tags)
    reported = set(broken)
    for name, span in _tag_places(path):
        if name in unknown and name not in reported:
            reporter.error("LN0102", span, f"no tag is called {quote(name)}", help=did_you_mean(name, tags))
            reported.add(name)
    return bool(unknown)


def _tag_places(path: ast.PathExpression) -> Iterator[tuple[str, Span]]:
    """Every name of a tag with its place, in the order of the text but for `lpe`, which is read backwards."""
    match path:
        case ast.PathName(name=name, span=span, tag=tag):
            yield name, span if tag is None else Span(span.source, span.start, span.start + len(name))
        case ast.PathConcat(items) | ast.PathUnion(items):
            for item in items:
                yield from _tag_places(item)
        case ast.PathRepeat(item) | ast.PathTagged(item):
            yield from _tag_places(item)
    match path:
        case ast.PathEvents(tag=ast.TagRef() as tag) | ast.PathName(tag=ast.TagRef() as tag) | ast.PathTagged(tag=tag):
            yield tag.name, tag.span


def letters_in(path: ast.PathExpression) -> set[str]:
    match path:
        case ast.PathEvents(letters):
            return {letters}
        case ast.PathConcat(items) | ast.PathUnion(items):
            return set().union(*map(letters_in, items))
        case ast.PathRepeat(item) | ast.PathTagged(item):
            return letters_in(item)
    return set()


def _path_value(path: ast.PathExpression) -> PathValue:
    return PathValue(print_path(path), path, _automata(path)[1])


@lru_cache(maxsize=256)
def _automata(path: ast.PathExpression) -> tuple[Dfa, EventTable]:
    """A path's automaton and its table; networks repeat the same few paths. Raises TooLarge."""
    return path_dfa(path, Alphabet(tuple(sorted(tags_in(path))))), event_table(path)
