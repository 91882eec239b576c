"""Text -> tokens: comments are set aside, and newlines are kept only where they end a statement."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lnc.diagnostics import Reporter
from lnc.source import SourceFile, Span
from lnc.syntax.tables import Tables

NESTING_LIMIT = 64
NEWLINE = "_NL"
END = "$END"
CONTINUING = ("|", "+", "-", "->", ",")  # a line that begins so belongs to the one before
_BRACKETS = {")": "(", "]": "[", "}": "{"}


@dataclass(frozen=True)
class Token:
    type: str
    text: str
    start: int
    end: int


@dataclass(frozen=True)
class Comment:
    """A comment with its text as written, from `//` on."""

    text: str
    start: int
    own_line: bool  # nothing stands before it on its line


class Tokens:
    """The tokens of a file, and its comments by their place between tokens."""

    def __init__(self, source: SourceFile, items: list[Token], comments: list[Comment]) -> None:
        self.source = source
        self.items = items
        self.comments = comments
        self.broken: set[str] = set()  # names that statements with a mistake would have defined
        self._comment_starts = [c.start for c in comments]
        code = [token for token in items if token.type != NEWLINE]
        self._starts = [token.start for token in code]
        self._ends = [token.end for token in code]

    def between(self, start: int, end: int) -> list[Comment]:
        """The comments that begin in [start, end)."""
        return self.comments[bisect_left(self._comment_starts, start) : bisect_left(self._comment_starts, end)]

    def end_before(self, offset: int) -> int:
        """Where the last token before this one ends."""
        index = bisect_left(self._starts, offset)
        return self._ends[index - 1] if index > 0 else 0

    def start_after(self, offset: int) -> int:
        """Where the first token that begins here or later begins."""
        return self._starts[min(bisect_left(self._starts, offset), len(self._starts) - 1)]

    def leading(self, start: int) -> tuple[list[str], bool]:
        """The comment lines directly before a token ("" is an empty line), and whether an empty line precedes all."""
        at = self.end_before(start)
        lines: list[str] = []
        blank = False
        for comment in self.between(at, start):
            if not comment.own_line:
                continue
            gap = self.source.text.count("\n", at, comment.start) >= 2
            if gap and lines:
                lines.append("")
            elif gap:
                blank = True
            lines.append(comment.text)
            at = comment.start
        if self.source.text.count("\n", at, start) >= 2:
            if lines:
                lines.append("")
            else:
                blank = True
        return lines, blank and not self._opens(start)

    def _opens(self, start: int) -> bool:
        """Whether a token is the first of the file or of a block."""
        index = bisect_left(self._starts, start)
        return index == 0 or self.source.text[self._ends[index - 1] - 1] == "{"

    def trailing(self, end: int) -> str:
        """The comment behind a token, on its line."""
        return next((c.text for c in self.between(end, self.start_after(end)) if not c.own_line), "")


def tokenise(source: SourceFile, tables: Tables, reporter: Reporter) -> Tokens:
    """All tokens. A character that can begin none is reported, and its whole statement is left out."""
    raw, comments, bad = _scan(source, tables, reporter)
    open_forever = _unmatched(raw)
    items: list[Token] = []
    depth = 0
    pending = -1  # offset of the newline that waits for its successor
    for index, token in enumerate(raw):
        if token.type == NEWLINE:
            if depth == 0 and pending < 0 and items:
                pending = token.start
            continue
        if pending >= 0:
            if token.text not in CONTINUING:
                items.append(Token(NEWLINE, "\n", pending, pending + 1))
            pending = -1
        if token.text in ("(", "[") and index not in open_forever:
            depth += 1
        elif token.text in (")", "]") and index not in open_forever:
            depth -= 1
        items.append(token)
    broken: set[str] = set()
    items = _drop_statements(items, bad, broken)
    items = _check_nesting(source, items, broken, reporter)
    items.append(Token(END, "", len(source.text), len(source.text)))
    tokens = Tokens(source, items, comments)
    tokens.broken = broken
    return tokens


def defined_name(statement: Sequence[Token]) -> str | None:
    """The name that a statement defines, as far as its first words tell: `name =`, `tag name`, `op name`."""
    if len(statement) < 2:
        return None
    first, second = statement[:2]
    if second.text in ("=", ":"):
        return first.text
    return second.text if first.text in ("tag", "op") else None


def _scan(source: SourceFile, tables: Tables, reporter: Reporter) -> tuple[list[Token], list[Comment], list[int]]:
    """Raw tokens (a newline token per line break), comments, and the offsets of characters that fit nowhere."""
    text = source.text
    match: Callable[[str, int], re.Match[str] | None] = re.compile(
        rf"(?P<COMMENT>//[^\n]*)|(?P<SPACE>[ \t]+)|(?P<{NEWLINE}>\n)|{tables.pattern}"
    ).match
    raw: list[Token] = []
    comments: list[Comment] = []
    bad: list[int] = []
    at = 0
    while at < len(text):
        found = match(text, at)
        if found is None:
            if not bad or "\n" in text[bad[-1] : at]:  # one message a line
                _report_bad_character(source, at, reporter)
                bad.append(at)
            at += 1
            continue
        kind = found.lastgroup or ""
        end = found.end()
        if kind == "COMMENT":
            own_line = not raw or raw[-1].type == NEWLINE
            comments.append(Comment(found.group().rstrip(), at, own_line))
        elif kind != "SPACE":
            raw.append(Token(kind, found.group(), at, end))
        at = end
    return raw, comments, bad


def _report_bad_character(source: SourceFile, at: int, reporter: Reporter) -> None:
    character = source.text[at]
    if character == '"':
        end = source.text.find("\n", at)
        span = Span(source, at, end if end >= 0 else len(source.text))
        reporter.error("LN0101", span, "this string has no closing quotation mark on its line")
        return
    name = f"'{character}'" if character.isprintable() else "a control character"
    message = f"{name} (U+{ord(character):04X}) cannot stand here"
    help = "names are made of the letters A to Z, digits and _" if character.isalpha() else None
    if character == ">":
        help = 'a file is named behind an arrow: -> "FILE"'
    reporter.error("LN0101", Span(source, at, at + 1), message, help=help)


def _unmatched(raw: list[Token]) -> set[int]:
    """Indices of ( [ ) ] without a partner: these do not hold a statement together across lines."""
    unmatched: set[int] = set()
    stack: list[int] = []
    for index, token in enumerate(raw):
        if token.text in ("(", "[", "{"):
            stack.append(index)
        elif token.text in _BRACKETS:
            wanted = _BRACKETS[token.text]
            while stack and raw[stack[-1]].text != wanted:
                unmatched.add(stack.pop())
            if stack:
                stack.pop()
            else:
                unmatched.add(index)
    return unmatched | set(stack)


def _drop_statements(items: list[Token], bad: list[int], broken: set[str]) -> list[Token]:
    """Leave out the statements in which a fault was reported: one mistake, one message.

    With the head of a block goes the whole block; a brace that closes an outer block stays.
    """
    if not bad:
        return items
    kept: list[Token] = []
    statement: list[Token] = []
    start = 0
    dropping = 0  # braces that the dropped text has left open
    for token in [*items, Token(END, "", 1 << 62, 1 << 62)]:
        if token.type not in (NEWLINE, END):
            statement.append(token)
            continue
        faulty = bisect_left(bad, start) != bisect_left(bad, token.start)
        if faulty or dropping:
            broken.add(defined_name(statement) or "")
            dropping += sum((t.text == "{") - (t.text == "}") for t in statement)
            if dropping < 0:
                kept.append(next(t for t in reversed(statement) if t.text == "}"))
                dropping = 0
        else:
            kept += statement
        if kept and kept[-1].type != NEWLINE and token.type == NEWLINE:
            kept.append(token)
        statement = []
        start = token.end
    return kept


def _check_nesting(source: SourceFile, items: list[Token], broken: set[str], reporter: Reporter) -> list[Token]:
    """Cut the statements that nest too deeply for the passes, which walk expressions by recursion."""
    depth = 0
    bad: list[int] = []
    for token in items:
        if token.text in ("(", "["):
            depth += 1
            if depth == NESTING_LIMIT + 1:
                message = f"brackets are nested more than {NESTING_LIMIT} deep"
                reporter.error("LN0101", Span(source, token.start, token.end), message)
                bad.append(token.start)
        elif token.text in (")", "]"):
            depth -= 1
        elif token.type == NEWLINE:
            depth = 0
    return _drop_statements(items, bad, broken)
