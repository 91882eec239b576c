"""Tokens -> syntax tree: drives the LALR(1) table, and goes on after a mistake at the next statement.

The stack is explicit, so no text can exhaust Python's; `Builder` makes the nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from lnc.diagnostics import Related, Reporter, did_you_mean, quote
from lnc.source import SourceFile, Span
from lnc.syntax.ast import File
from lnc.syntax.build import Builder
from lnc.syntax.tables import Rule, Tables, load_tables
from lnc.syntax.tokens import END, NEWLINE, Token, Tokens, defined_name, tokenise

STATEMENT_WORDS = (
    "network",
    "tag",
    "expect",
    "image",
    "tap",
    "lightmap",
    "probe",
    "use",
    "op",
    "operator",
    "representation",
)
ITEM_WORDS = ("paths", "bias", "converter", "recursion", "equal", "prepare", "overloads", "scales")


def parse(source: SourceFile, reporter: Reporter) -> File:
    """The statements of a text that can be read; each of the others is reported once, as LN0101."""
    tables = load_tables()
    tokens = tokenise(source, tables, reporter)
    return _Parser(source, tables, tokens, reporter).run()


class _Stack:
    """The parser's stack: a state, a value and an extent for each symbol."""

    def __init__(self, start: int) -> None:
        self.states = [start]
        self.values: list[Any] = []
        self.extents: list[tuple[int, int]] = []

    def copy(self) -> _Stack:
        other = _Stack(self.states[0])
        other.states = self.states.copy()
        other.values = self.values.copy()
        other.extents = self.extents.copy()
        return other


class _Parser:
    def __init__(self, source: SourceFile, tables: Tables, tokens: Tokens, reporter: Reporter) -> None:
        self.source = source
        self.tables = tables
        self.tokens = tokens.items
        self.broken = tokens.broken
        self.reporter = reporter
        self.builder = Builder(source, tokens, reporter)
        self.misnamed = _letters_as_names(tokens.items)
        self.stack = _Stack(tables.start)

    def run(self) -> File:
        saved, saved_at = self.stack.copy(), 0
        at = 0
        while True:
            token = self.tokens[at]
            kind = self._kind(at)
            if self._feed(kind, token):
                if kind == END:
                    return self.stack.values[0]  # type: ignore[no-any-return]
                at += 1
                if kind == NEWLINE:
                    saved, saved_at = self.stack.copy(), at
                continue
            self._report(at, saved_at)
            self.broken.add(defined_name(self.tokens[saved_at : saved_at + 2]) or "")
            self.stack = saved.copy()
            at = self._skip(saved_at, at)
            if self.tokens[at].type == END and not self._accepts(END):
                self._close_blocks()
            saved, saved_at = self.stack.copy(), at

    def _kind(self, at: int) -> str:
        """The terminal of a token: a keyword only where the grammar asks for it and no `=` or `:` follows.

        `lpe` is one only before a text, since a tag of that name can stand in a path, too.
        """
        token = self.tokens[at]
        keyword = self.tables.keywords.get(token.text) if token.type == "NAME" else None
        if keyword is None:
            return token.type
        following = self.tokens[at + 1]
        if following.text in ("=", ":") or (keyword == "LPE" and following.type != "STRING"):
            return token.type
        return keyword if self._accepts(keyword) else token.type

    def _accepts(self, terminal: str) -> bool:
        """Whether a terminal fits here: the reductions that it causes, played through on the states alone."""
        states = self.stack.states
        base = len(states)  # states[:base], then `pushed`
        pushed: list[int] = []
        while True:
            state = pushed[-1] if pushed else states[base - 1]
            action = self.tables.actions[state].get(terminal)
            if action is None:
                return False
            if action >= 0:
                return True
            rule = self.tables.rules[-1 - action]
            for _ in rule.keep:
                if pushed:
                    pushed.pop()
                else:
                    base -= 1
            below = pushed[-1] if pushed else states[base - 1]
            pushed.append(self.tables.actions[below][rule.name])

    def _feed(self, kind: str, token: Token) -> bool:
        """Reduce and shift; False, with the stack spoilt, if the token does not fit."""
        states, values = self.stack.states, self.stack.values
        actions, rules = self.tables.actions, self.tables.rules
        while True:
            action = actions[states[-1]].get(kind)
            if action is None:
                return False
            if action >= 0:
                states.append(action)
                values.append(token if kind == token.type else replace(token, type=kind))
                self.stack.extents.append((token.start, token.end))
                return True
            rule = rules[-1 - action]
            if rule.inlined and len(rule.keep) == 1:  # most rules: the value stays where it is
                if type(values[-1]) is not list:
                    values[-1] = [values[-1]] if rule.keep[0] else []
                states[-1] = actions[states[-2]][rule.name]
            else:
                self._reduce(rule, token)
            if kind == END and states[-1] == self.tables.end:
                return True

    def _reduce(self, rule: Rule, token: Token) -> None:
        stack = self.stack
        children: list[Any] = []
        extent = (token.start, token.start)
        count = len(rule.keep)
        if count:
            extent = (stack.extents[-count][0], stack.extents[-1][1])
            for value, keep in zip(stack.values[-count:], rule.keep, strict=True):
                if type(value) is list:  # of an inlined rule: extended in place, or growing lists would cost squares
                    if children:
                        children.extend(value)
                    else:
                        children = value
                elif keep:
                    children.append(value)
            del stack.states[-count:], stack.values[-count:], stack.extents[-count:]
        result: Any = children
        if not rule.inlined:
            result = getattr(self.builder, rule.name)(Span(self.source, *extent), children)
        stack.values.append(result)
        stack.extents.append(extent)
        stack.states.append(self.tables.actions[stack.states[-1]][rule.name])

    # --- After a mistake ----------------------------------------------------------------------------------------------

    def _skip(self, saved_at: int, at: int) -> int:
        """The start of the next statement. The rest of a block whose head is wrong goes with it."""
        depth = 0
        for token in self.tokens[saved_at:at]:
            depth += (token.text == "{") - (token.text == "}")
        while self.tokens[at].type != END:
            token = self.tokens[at]
            if token.text == "{":
                depth += 1
            elif token.text == "}":
                depth -= 1
                if depth < 0 and self._accepts("RBRACE"):
                    return at
                depth = max(depth, 0)
            elif token.type == NEWLINE and depth <= 0:
                return at + 1
            at += 1
        return at

    def _close_blocks(self) -> None:
        """At the end of a text with an open block: close it, so that the rest of the tree survives."""
        for kind, text in (("RBRACE", "}"), (NEWLINE, "\n")):
            if self._accepts(kind):
                end = len(self.source.text)
                self._feed(kind, Token(kind, text, end, end))

    # --- What to say --------------------------------------------------------------------------------------------------

    def _report(self, at: int, statement_at: int) -> None:
        if self.reporter.full:
            return
        token = self.tokens[at]
        if token.text in self.misnamed and at != statement_at:
            return  # the statement that makes a name of this letter has its message
        end = min(max(token.end, token.start + 1), len(self.source.text))
        span = Span(self.source, token.start, end)
        if token.type == END and at > statement_at:  # behind the last word, not below it
            span = Span(self.source, self.tokens[at - 1].end, self.tokens[at - 1].end)
        expected = self._expected()
        bracket = self._open_bracket(statement_at, at)
        if token.type in (NEWLINE, END) and bracket is not None:
            opened = Span(self.source, bracket.start, bracket.end)
            self.reporter.error("LN0101", opened, f"'{bracket.text}' is never closed", label="opened here")
            return
        message = f"{self._describe(token)} cannot stand here"
        if expected:
            message = f"expected {expected}, found {self._describe(token)}"
        related: tuple[Related, ...] = ()
        if bracket is not None and self.source.line_column(bracket.start)[0] != span.line:
            opened = Span(self.source, bracket.start, bracket.end)
            related = (Related(opened, f"inside this '{bracket.text}'"),)
        help = self._hint(at, statement_at, expected)
        self.reporter.error("LN0101", span, message, related=related, help=help)

    def _expected(self) -> str:
        """What would fit, in words; empty if that is too much to be of help."""
        row = self.tables.actions[self.stack.states[-1]]
        fitting = {symbol for symbol in row if (symbol.isupper() or symbol in (NEWLINE, END)) and self._accepts(symbol)}
        words = {self._name(symbol) for symbol in fitting}
        if {"LETTER", "NAME", "DOT"} <= fitting:
            words -= {"an event letter", "a name", "'.'", "'..'", "'...'", "'['", "'('", "'lpe'"}
            words.add("a light path")
        if not 0 < len(words) <= 4:
            return ""
        *some, last = sorted(words, key=lambda w: (w.startswith("'"), w))
        return f"{', '.join(some)} or {last}" if some else last

    def _name(self, terminal: str) -> str:
        names = {
            NEWLINE: "the end of the line",
            END: "the end of the line",
            "NAME": "a name",
            "LETTERS": "a name",
            "LETTER": "an event letter",
            "NUMBER": "a number",
            "STRING": "a text in quotation marks",
        }
        return names.get(terminal) or f"'{self.tables.spelling[terminal]}'"

    def _describe(self, token: Token) -> str:
        if token.type == END:
            return "the end of the file"
        if token.type == NEWLINE:
            return "the end of the line"
        return quote(token.text)

    def _open_bracket(self, start: int, at: int) -> Token | None:
        """The innermost bracket of this statement that is still open."""
        stack: list[Token] = []
        for token in self.tokens[start:at]:
            if token.text in ("(", "[", "{"):
                stack.append(token)
            elif token.text in (")", "]", "}") and stack:
                stack.pop()
        if not stack and self.tokens[at].type == END:  # a block that began in an earlier statement
            for token in self.tokens[:at]:
                if token.text == "{":
                    stack.append(token)
                elif token.text == "}" and stack:
                    stack.pop()
        return stack[-1] if stack else None

    def _hint(self, at: int, statement_at: int, expected: str) -> str | None:
        token = self.tokens[at]
        first = self.tokens[statement_at]
        before = self.tokens[at - 1] if at > 0 else first
        if token.type == "LETTER" and "a name" in expected:
            return f"'{token.text}' is an event letter of light paths and cannot be a name"
        if first.type == "LETTER" and at == statement_at:
            return f"'{token.text}' is an event letter of light paths and cannot be a name"
        if before.type == "NUMBER" and token.type == "NAME" and before.end < token.start:
            return f"write a unit without a space: {quote(before.text + token.text)}"
        if at == statement_at + 1 and first.type == "NAME":
            block = self._block(at)
            if block == "op" and first.text in STATEMENT_WORDS:
                return "a macro is made of equations; tags, results and all else belong into the network"
            if token.text == "(":
                return f"give what it makes a name: {'out' if block == 'op' else 'NAME'} = {first.text}(...)"
            words = {"": STATEMENT_WORDS, "op": ()}.get(block, ITEM_WORDS)
            if first.text not in words:
                return did_you_mean(first.text, words)
        if first.text in ("tap", "lightmap", "probe") and "'->'" in expected:
            return 'say into which file: -> "FILE"'
        if first.text == "op":
            return _hint_in_macro_head(token, expected)
        if first.text == "tag" and token.type == "STRING":
            kinds = " or ".join(f"{kind} {token.text}" for kind in ("material", "mesh", "node"))
            return f"say of what this is the name: {kinds}"
        if first.text == "network" and token.text == "{":
            return "a network has no braces: its statements follow on lines of their own"
        if expected == self._name("STRING") and token.type not in (NEWLINE, END):
            words_left = self.source.text[token.start :].split(None, 1)[0].split(",")[0]
            return f'write: "{words_left.rstrip(")")}"'
        return self._hint_in_wire(at, statement_at, expected)

    def _hint_in_wire(self, at: int, statement_at: int, expected: str) -> str | None:
        """For a number or a tag where a wire is wanted."""
        token = self.tokens[at]
        bracket = self._open_bracket(statement_at, at)
        calls = bracket is not None and self.tokens[self.tokens.index(bracket) - 1].type == "NAME"
        if token.type == "NUMBER" and "a name" in expected and calls:
            return f"parameters are given by name: NAME = {token.text}"
        if token.text in ("*", "/") or (token.type == "NUMBER" and "a name" in expected):
            return "a wire is scaled by an operator: Scale(WIRE, factor = 0.5)"
        if token.text == "@":
            return "a tag restricts an operator by its parameters, such as to = TAG, or an event of a light path: D@TAG"
        return None

    def _block(self, at: int) -> str:
        """The word that the innermost open block begins with; empty outside of all blocks."""
        heads: list[str] = []
        word = ""
        for before, token in zip([None, *self.tokens[:at]], self.tokens[:at], strict=False):
            if before is None or before.type == NEWLINE or before.text in ("{", "}"):
                word = token.text
            if token.text == "{":
                heads.append(word)
            elif token.text == "}" and heads:
                heads.pop()
        return heads[-1] if heads else ""


def _hint_in_macro_head(token: Token, expected: str) -> str | None:
    if token.text in (",", ")") and "':'" in expected:
        return "an input has a representation (in: Points), a parameter a default (n = 2)"
    if token.text == "=":
        return "an input (in: Points) has no default, a parameter (n = 2) has the type of its default"
    if "'->'" in expected:
        return "say what the macro gives: op NAME(...) -> Points {"
    return None


def _letters_as_names(tokens: Sequence[Token]) -> set[str]:
    """The event letters that statements try to define: `L = Lights()`."""
    heads = ["", *(token.type for token in tokens)]
    following = [*(token.text for token in tokens[1:]), ""]
    return {
        token.text
        for token, before, after in zip(tokens, heads, following, strict=False)
        if token.type == "LETTER" and before in ("", NEWLINE) and after in ("=", ":")
    }
