"""The parser's actions: one method per rule of the grammar, which makes the node of that rule."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from lnc.diagnostics import Reporter, quote
from lnc.paths.lpe import REPEAT_LIMIT, read_lpe
from lnc.source import SourceFile, Span
from lnc.syntax import ast
from lnc.syntax.tokens import END, Token, Tokens

Children = list[Any]
ESCAPES = {"n": "\n", "t": "\t", '"': '"', "\\": "\\"}


@dataclass(frozen=True)
class _Row:
    """Events written as one word, `LSD`: what follows applies to the last of them."""

    items: tuple[ast.PathExpression, ...]


class Builder:
    """Makes nodes; a comment goes to the statement that it stands before, inside, or behind on the same line."""

    def __init__(self, source: SourceFile, tokens: Tokens, reporter: Reporter) -> None:
        self.source = source
        self.tokens = tokens
        self.reporter = reporter

    # --- Comments -----------------------------------------------------------------------------------------------------

    def _comments(self, span: Span) -> ast.Comments:
        leading, blank = self.tokens.leading(span.start)
        inside = [c.text for c in self.tokens.between(span.start, span.end)]
        return ast.Comments(_moved_ahead(leading, inside), self.tokens.trailing(span.end), blank)

    def _block_comments(self, span: Span, head: Span, ports: tuple[ast.PortDeclaration, ...]) -> ast.Comments:
        """As `_comments`, but what stands inside the braces belongs to the statements there."""
        leading, blank = self.tokens.leading(span.start)
        inside = [c.text for c in self.tokens.between(span.start, head.end)]
        docs = {line for port in ports for line in _doc_lines(port.doc)}
        inside = [text for text in inside if text not in docs]
        brace = self.source.text.index("{", head.end)
        behind = self.tokens.trailing(brace + 1)
        inside += [behind] if behind else []
        return ast.Comments(_moved_ahead(leading, inside), self.tokens.trailing(span.end), blank)

    def _doc(self, start: int) -> str:
        """The `///` lines directly before a token, without the slashes."""
        lines, _ = self.tokens.leading(start)
        doc: list[str] = []
        for line in reversed(lines):
            if not line.startswith("///"):
                break
            doc.append(line[3:].removeprefix(" "))
        return "\n".join(reversed(doc))

    def _end_comments(self, brace: Token) -> tuple[str, ...]:
        lines, _ = self.tokens.leading(brace.start)
        return tuple(_without_last_blank(lines))

    def _span(self, token: Token) -> Span:
        return Span(self.source, token.start, token.end)

    # --- The file and its statements ----------------------------------------------------------------------------------

    def file(self, span: Span, children: Children) -> ast.File:
        end = self.tokens.items[-1]
        assert end.type == END
        lines, blank = self.tokens.leading(end.start)
        lines = _without_last_blank(lines)
        if blank and lines:
            lines.insert(0, "")
        return ast.File(tuple(children), tuple(lines), frozenset(self.tokens.broken), span)

    def name(self, span: Span, children: Children) -> Token:
        return children[0]  # type: ignore[no-any-return]

    def network(self, span: Span, children: Children) -> ast.NetworkName:
        return ast.NetworkName(children[0].text, self._comments(span), span)

    def tag(self, span: Span, children: Children) -> ast.TagStatement:
        name, *globs = children
        return ast.TagStatement(name.text, tuple(globs), self._comments(span), span, self._span(name))

    def glob(self, span: Span, children: Children) -> ast.TagGlob:
        return ast.TagGlob(children[0].text, self._unescape(children[1]), span)

    def annotation(self, span: Span, children: Children) -> Token:
        return children[0]  # type: ignore[no-any-return]

    def equation(self, span: Span, children: Children) -> ast.Equation:
        name, *annotation, wire = children
        representation = annotation[0].text if annotation else None
        return ast.Equation(name.text, representation, wire, self._comments(span), span, self._span(name))

    def expect(self, span: Span, children: Children) -> ast.Expect:
        wire = next((c for c in children[:-1] if isinstance(c, ast.WireName)), None)
        at_most = any(isinstance(c, Token) for c in children[:-1])
        name, where = (wire.name, wire.span) if wire else (None, None)
        return ast.Expect(name, children[-1], at_most, self._comments(span), span, where)

    def expected_wire(self, span: Span, children: Children) -> ast.WireName:
        return ast.WireName(children[0].text, self._span(children[0]))

    def image(self, span: Span, children: Children) -> ast.ImageStatement:
        return ast.ImageStatement(children[0], len(children) > 1, self._comments(span), span)

    def tap(self, span: Span, children: Children) -> ast.TapStatement:
        wire, file = children
        return ast.TapStatement(wire, self._unescape(file), self._comments(span), span, self._span(file))

    def lightmap(self, span: Span, children: Children) -> ast.LightmapStatement:
        return ast.LightmapStatement(children[0], self._unescape(children[1]), self._comments(span), span)

    def probe(self, span: Span, children: Children) -> ast.ProbeStatement:
        wire, sensors, file = children
        return ast.ProbeStatement(wire, self._unescape(sensors), self._unescape(file), self._comments(span), span)

    def use(self, span: Span, children: Children) -> ast.Use:
        return ast.Use(self._unescape(children[0]), self._comments(span), span)

    def macro(self, span: Span, children: Children) -> ast.Macro:
        name, *rest, brace = children
        inputs = tuple(c for c in rest if isinstance(c, ast.MacroInput))
        output = next(c for c in rest if isinstance(c, Token))
        body = tuple(c for c in rest if isinstance(c, ast.Equation))
        comments = self._block_comments(span, self._span(output), ())
        end = self._end_comments(brace)
        return ast.Macro(name.text, inputs, output.text, body, comments, end, span, self._span(name))

    def macro_wire(self, span: Span, children: Children) -> ast.MacroInput:
        return ast.MacroInput(children[0].text, children[1].text, None, span)

    def macro_parameter(self, span: Span, children: Children) -> ast.MacroInput:
        return ast.MacroInput(children[0].text, None, _as_value(children[1]), span)

    # --- Wires --------------------------------------------------------------------------------------------------------

    def wire_sum(self, span: Span, children: Children) -> ast.WireSum:
        first, *rest = children
        terms = [ast.SumTerm(False, first)]
        terms += [ast.SumTerm(sign == "-", wire) for sign, wire in zip(rest[::2], rest[1::2], strict=True)]
        return ast.WireSum(tuple(terms), span)

    def sign(self, span: Span, children: Children) -> str:
        return children[0].text  # type: ignore[no-any-return]

    def cast(self, span: Span, children: Children) -> ast.Cast:
        wire, representation, *arguments = children
        return ast.Cast(wire, representation.text, tuple(arguments), span, self._span(representation))

    def wire_name(self, span: Span, children: Children) -> ast.WireName:
        return ast.WireName(children[0].text, span)

    def wire_group(self, span: Span, children: Children) -> ast.WireExpression:
        return children[0]  # type: ignore[no-any-return]

    def call(self, span: Span, children: Children) -> ast.Call:
        name, *rest = children
        inputs = tuple(c for c in rest if not isinstance(c, ast.Argument))
        arguments = tuple(c for c in rest if isinstance(c, ast.Argument))
        seen_named = False
        for child in rest:
            if isinstance(child, ast.Argument):
                seen_named = True
            elif seen_named:
                self.reporter.error("LN0101", child.span, "wires by position come before parameters by name")
        return ast.Call(name.text, inputs, arguments, span, self._span(name))

    def argument(self, span: Span, children: Children) -> ast.Argument:
        return ast.Argument(children[0].text, _as_value(children[1]), span, self._span(children[0]))

    # --- Values -------------------------------------------------------------------------------------------------------

    def number(self, span: Span, children: Children) -> ast.NumberValue:
        return ast.NumberValue("".join(c.text for c in children), span)

    def text(self, span: Span, children: Children) -> ast.TextValue:
        return ast.TextValue(self._unescape(children[0]), span)

    def flag(self, span: Span, children: Children) -> ast.FlagValue:
        return ast.FlagValue(children[0].type == "TRUE", span)

    def _unescape(self, token: Token) -> str:
        def one(match: re.Match[str]) -> str:
            if match.group(1) not in ESCAPES:
                span = Span(self.source, token.start + 1 + match.start(), token.start + 1 + match.end())
                message = f"unknown escape {quote(match.group())} in a text"
                self.reporter.error("LN0101", span, message, help=r"known are \" \\ \n \t")
            return ESCAPES.get(match.group(1), match.group(1))

        return re.sub(r"\\(.)", one, token.text[1:-1])

    # --- Light paths --------------------------------------------------------------------------------------------------

    def path(self, span: Span, children: Children) -> ast.PathExpression:
        items = [i for child in children for i in (child.items if type(child) is ast.PathUnion else (child,))]
        return items[0] if len(items) == 1 else ast.PathUnion(tuple(items), span)

    def path_concat(self, span: Span, children: Children) -> ast.PathExpression:
        items = [i for child in children for i in (child.items if isinstance(child, _Row) else (child,))]
        items = [i for item in items for i in (item.items if isinstance(item, ast.PathConcat) else (item,))]
        return items[0] if len(items) == 1 else ast.PathConcat(tuple(items), span)

    def path_repeat(self, span: Span, children: Children) -> ast.PathExpression | _Row:
        if len(children) == 1:
            return children[0]  # type: ignore[no-any-return]
        item, (low, high) = children
        if isinstance(item, _Row):  # LSD+ is L S D+
            return _Row((*item.items[:-1], ast.PathRepeat(item.items[-1], low, high, span)))
        return ast.PathRepeat(item, low, high, span)

    def quantifier(self, span: Span, children: Children) -> tuple[int, int | None]:
        first = children[0]
        simple: dict[str, tuple[int, int | None]] = {"*": (0, None), "+": (1, None), "?": (0, 1)}
        if first.text in simple:
            return simple[first.text]
        numbers = [c for c in children if c.type == "NUMBER"]
        low = self._repeat_bound(numbers[0])
        if not any(c.type == "COMMA" for c in children):
            return low, low
        high = self._repeat_bound(numbers[1]) if len(numbers) > 1 else None
        if high is not None and high < low:
            self.reporter.error("LN0101", span, "the upper bound of a repetition is below the lower one")
            high = low
        return low, high

    def _repeat_bound(self, token: Token) -> int:
        if token.text.isdigit() and len(token.text) <= 4 and int(token.text) <= REPEAT_LIMIT:
            return int(token.text)
        message = f"a repetition is bounded by whole numbers up to {REPEAT_LIMIT}, not {quote(token.text)}"
        self.reporter.error("LN0101", self._span(token), message)
        return 1

    def path_tagged(self, span: Span, children: Children) -> ast.PathExpression | _Row:
        item, *rest = children
        if not rest:
            return item  # type: ignore[no-any-return]
        tag = ast.TagRef(rest[-1].text, len(rest) > 1, self._span(rest[-1]))
        if isinstance(item, _Row):
            return _Row((*item.items[:-1], _with_tag(item.items[-1], tag, span)))
        return _with_tag(item, tag, span)

    def path_letters(self, span: Span, children: Children) -> ast.PathExpression | _Row:
        events = [ast.PathEvents(letter, None, span) for letter in children[0].text]
        return events[0] if len(events) == 1 else _Row(tuple(events))

    def path_any(self, span: Span, children: Children) -> ast.PathExpression | _Row:
        count = len(children[0].text) if children else 1
        events = [ast.PathEvents("DGS", None, span)] * count
        return events[0] if count == 1 else _Row(tuple(events))

    def path_choice(self, span: Span, children: Children) -> ast.PathExpression:
        letters = {letter for token in children for letter in token.text}
        return ast.PathEvents("".join(c for c in "LDGSE" if c in letters), None, span)

    def path_name(self, span: Span, children: Children) -> ast.PathName:
        return ast.PathName(children[-1].text, None, span, len(children) > 1)

    def path_group(self, span: Span, children: Children) -> ast.PathExpression:
        return children[0] if children else ast.PathEmpty(span)

    def path_lpe(self, span: Span, children: Children) -> ast.PathLpe:
        (token,) = children
        inside = Span(self.source, token.start + 1, token.end - 1)
        return ast.PathLpe((read_lpe(inside, self.reporter),), span, inside.text)

    # --- Declarations -------------------------------------------------------------------------------------------------

    def representation(self, span: Span, children: Children) -> ast.RepresentationDeclaration:
        name, *rest = children
        pulled = bool(rest) and rest[0].type == "PULLED"
        taps = tuple(self._unescape(suffix) for suffix in rest[pulled:])
        doc, comments = self._doc(span.start), self._comments(span)
        return ast.RepresentationDeclaration(name.text, pulled, taps, doc, comments, span)

    def operator(self, span: Span, children: Children) -> ast.OperatorDeclaration:
        name, *rest, brace = children
        ports = tuple(c for c in rest if isinstance(c, ast.PortDeclaration))
        output = next(c for c in rest if isinstance(c, Token))
        body = tuple(c for c in rest if isinstance(c, ast.OperatorItem))
        return ast.OperatorDeclaration(
            name.text,
            ports,
            output.text,
            body,
            self._doc(span.start),
            self._block_comments(span, self._span(output), ports),
            self._end_comments(brace),
            span,
            self._span(name),
        )

    def port(self, span: Span, children: Children) -> ast.PortDeclaration:
        mode = children[0].text if children[0].type in ("COMPLETE", "SUBTRACTED") else ""
        variadic = children[-1].type == "ELLIPSIS"
        name, representation = children[bool(mode) : len(children) - variadic]
        return ast.PortDeclaration(name.text, representation.text, mode, variadic, self._doc(span.start), span)

    def parameter(self, span: Span, children: Children) -> ast.ParameterDeclaration:
        name, kind, *rest = children
        choices: tuple[str, ...] = ()
        default: ast.Value | None = None
        low = high = None
        for what, value in rest:
            if what == "choices":
                choices = value
            elif what == "default":
                default = value
            else:
                low, high = value
        doc = self._doc(span.start)
        return ast.ParameterDeclaration(
            name.text, kind.text, choices, default, low, high, doc, self._comments(span), span
        )

    def choices(self, span: Span, children: Children) -> tuple[str, object]:
        return "choices", tuple(c.text for c in children if c.type != "COMMA")

    def default(self, span: Span, children: Children) -> tuple[str, object]:
        return "default", _as_value(children[0])

    def bounds(self, span: Span, children: Children) -> tuple[str, object]:
        low, _, high = children
        return "bounds", (low, high)

    def paths(self, span: Span, children: Children) -> ast.PathsDeclaration:
        return ast.PathsDeclaration(children[0].text, children[1], self._comments(span), span)

    def bias(self, span: Span, children: Children) -> ast.BiasDeclaration:
        bound = ast.NumberValue(children[0].text, self._span(children[0]))
        return ast.BiasDeclaration(bound, self._comments(span), span)

    def converter(self, span: Span, children: Children) -> ast.ConverterDeclaration:
        cost = ast.NumberValue(children[0].text, self._span(children[0]))
        loss = self._unescape(children[1]) if len(children) > 1 else ""
        return ast.ConverterDeclaration(cost, loss, self._comments(span), span)

    def recursion(self, span: Span, children: Children) -> ast.RecursionDeclaration:
        bound = children[1].text if len(children) > 1 else None
        return ast.RecursionDeclaration(children[0].text, bound, self._comments(span), span)

    def equal(self, span: Span, children: Children) -> ast.EqualDeclaration:
        return ast.EqualDeclaration(tuple(c.text for c in children), self._comments(span), span)

    def prepare(self, span: Span, children: Children) -> ast.PrepareDeclaration:
        words = {child.text for child in children}
        return ast.PrepareDeclaration("cached" in words, "view" in words, self._comments(span), span)

    def overloads(self, span: Span, children: Children) -> ast.OverloadsDeclaration:
        return ast.OverloadsDeclaration(children[0].text, self._comments(span), span)

    def scales(self, span: Span, children: Children) -> ast.ScalesDeclaration:
        return ast.ScalesDeclaration(children[0].text, self._comments(span), span)


def _as_value(value: Any) -> ast.Value:
    """A path that is one plain word could be any name: leave that to the declared type."""
    if isinstance(value, ast.NumberValue | ast.TextValue | ast.FlagValue):
        return value
    if isinstance(value, ast.PathName) and value.tag is None and not value.negated:
        return ast.NameValue(value.name, value.span)
    if isinstance(value, ast.PathEvents) and value.tag is None and len(value.letters) == 1:
        return ast.NameValue(value.letters, value.span)
    if isinstance(value, ast.PathConcat) and value.span.text.isalpha():
        return ast.NameValue(value.span.text, value.span)
    return ast.PathLiteral(value, value.span)


def _with_tag(item: ast.PathExpression, tag: ast.TagRef, span: Span) -> ast.PathExpression:
    if isinstance(item, ast.PathEvents) and item.tag is None:
        return ast.PathEvents(item.letters, tag, span)
    if isinstance(item, ast.PathName) and item.tag is None:
        return item.changed(tag=tag, span=span)
    return ast.PathTagged(item, tag, span)


def _moved_ahead(leading: list[str], inside: list[str]) -> tuple[str, ...]:
    """The comments before a statement and those from inside of it, which become no part of its documentation."""
    if not inside:
        return tuple(leading)
    documented = len(leading)
    while documented > 0 and leading[documented - 1].startswith("///"):
        documented -= 1
    plain = [f"//{text.lstrip('/')}" if text.startswith("///") else text for text in inside]
    return (*leading[:documented], *plain, *leading[documented:])


def _doc_lines(doc: str) -> list[str]:
    return [f"/// {line}".rstrip() for line in doc.split("\n")]


def _without_last_blank(lines: list[str]) -> list[str]:
    return lines[:-1] if lines and lines[-1] == "" else lines
