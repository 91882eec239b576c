"""Light path expressions of other renderers (OSL, Arnold, RenderMan) -> path expressions of networks.

    C<RD>.*L        from the camera to the light        =>        L .* D E        from the light to the eye

A network tells less apart than these renderers do: R and T, reflection and transmission, both become the event letter
that follows. What would change its meaning thereby, or stands for something that networks lack, is an error (LN0104).
What cannot be read is LN0101. docs/language.md has the table.
"""

from __future__ import annotations

import re

from lnc.diagnostics import Reporter, quote
from lnc.source import Span
from lnc.syntax import ast

REPEAT_LIMIT = 1000
NESTING_LIMIT = 64

SCATTERED = {"D": "D", "G": "G", "S": "S", ".": "DGS"}
LACKING = {
    "V": "volumes scatter no light here",
    "B": "the background is one of the emitters 'L@area', as emissive objects are; O stands for both",
    "s": "to pass straight through a surface is no event here",
}
KNOWN = "known are C, L, O, R, T, D, G, S, '.', <RD>, <L.'tag'>, [ ], [^ ], ( ), |, *, +, ? and {m,n}"
_LABEL = re.compile(r"'([A-Za-z_][A-Za-z0-9_]*)'")
_COUNTS = re.compile(r"\{ *([0-9]{1,4}) *(,? *)([0-9]{1,4})? *\}")
_QUANTIFIERS: dict[str, tuple[int, int | None]] = {"*": (0, None), "+": (1, None), "?": (0, 1)}


def read_lpe(text: Span, reporter: Reporter) -> ast.PathExpression:
    """The path that `text` means, with spans inside of it. A mistake is reported once, and then it means any event."""
    try:
        return _Reader(text).read()
    except _Fault as fault:
        reporter.error(fault.code, fault.span, fault.message, help=fault.help)
        return ast.PathEvents("DGS", None, text)


class _Fault(Exception):
    def __init__(self, code: str, span: Span, message: str, help: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.span = span
        self.message = message
        self.help = help


class _Reader:
    """Recursive descent over the characters; `at` is the next one."""

    def __init__(self, text: Span) -> None:
        self.source = text.source
        self.at = text.start
        self.end = text.end
        self.depth = 0

    def read(self) -> ast.PathExpression:
        path = self._union()
        if self._next():
            raise self._unexpected()
        return path

    # --- Structure ----------------------------------------------------------------------------------------------------

    def _union(self) -> ast.PathExpression:
        start = self._here()
        items = [self._concat()]
        while self._take("|"):
            items.append(self._concat())
        return items[0] if len(items) == 1 else ast.PathUnion(tuple(items), self._since(start))

    def _concat(self) -> ast.PathExpression:
        start = self._here()
        items: list[ast.PathExpression] = []
        while self._next() not in ("", "|", ")"):
            items.append(self._repeat())
        if not items:
            raise self._unexpected("a path")
        for item in items[1:]:
            if "E" in _letters(item):
                raise _Fault("LN0101", item.span, "C stands first: these paths run from the camera to the light")
        for item in items[:-1]:
            if "L" in _letters(item):
                raise _Fault("LN0101", item.span, "emitters stand last: these paths run from the camera to the light")
        return items[0] if len(items) == 1 else ast.PathConcat(tuple(reversed(items)), self._since(start))

    def _repeat(self) -> ast.PathExpression:
        start = self._here()
        item = self._atom()
        mark = self._next()
        if mark in _QUANTIFIERS:
            self.at += 1
            low, high = _QUANTIFIERS[mark]
        elif mark == "{":
            low, high = self._counts()
        else:
            return item
        return ast.PathRepeat(item, low, high, self._since(start))

    def _counts(self) -> tuple[int, int | None]:
        found = _COUNTS.match(self.source.text, self.at, self.end)
        if found is None or (found[3] and not found[2].strip()):
            raise self._unexpected(f"{{n}}, {{n,}} or {{n,m}} with whole numbers up to {REPEAT_LIMIT}")
        start, self.at = self.at, found.end()
        low = int(found[1])
        high = int(found[3]) if found[3] else None if found[2].strip() else low
        if max(low, high or 0) > REPEAT_LIMIT or (high is not None and high < low):
            raise _Fault("LN0101", self._since(start), f"a repetition counts from low to high, up to {REPEAT_LIMIT}")
        return low, high

    def _atom(self) -> ast.PathExpression:
        start = self._here()
        if not self._take("("):
            return self._choice() if self._next() == "[" else self._event(negated=False)
        self.depth += 1
        if self.depth > NESTING_LIMIT:
            raise _Fault("LN0101", self._since(start), f"brackets are nested more than {NESTING_LIMIT} deep")
        path = self._union()
        self._expect(")")
        self.depth -= 1
        return path

    # --- Events -------------------------------------------------------------------------------------------------------

    def _choice(self) -> ast.PathExpression:
        """`[<RD>G]`, one of several; `[^D]`, any event but these."""
        start = self._here()
        self._expect("[")
        negated = self._take("^")
        events = [self._event(negated)]
        while self._next() != "]":
            events.append(self._event(negated))
        self._expect("]")
        span = self._since(start)
        letters = {letter for event in events if event.tag is None for letter in event.letters}
        if negated:
            left = "".join(letter for letter in "DGS" if letter not in letters)
            if not left:
                raise _Fault("LN0104", span, "no event is left")
            return ast.PathEvents(left, None, span)
        tagged = dict.fromkeys(e for e in events if e.tag is not None and e.letters not in letters)
        items: list[ast.PathExpression] = list(tagged)
        if letters:
            items.insert(0, ast.PathEvents("".join(c for c in "LDGSE" if c in letters), None, span))
        return items[0] if len(items) == 1 else ast.PathUnion(tuple(items), span)

    def _event(self, negated: bool) -> ast.PathEvents:
        """One event: a letter, `.`, or `<...>` with its kind, how it scatters, and perhaps a label."""
        start = self._here()
        bracketed = self._take("<")
        kind, how = self._pop(), "."
        tag = None
        if bracketed:
            if self._next() not in ("'", ">"):
                how = self._pop()
            tag = self._label()
            self._expect(">")
        elif kind in SCATTERED:  # D stands for <.D>
            kind, how = ".", kind
        span = self._since(start)
        for letter in (kind, how):
            if letter in LACKING:
                raise _Fault("LN0104", span, f"{quote(letter)}: {LACKING[letter]}")
        if negated and (tag is not None or kind in ("R", "T")):
            message = "[^ ] cannot leave this out: reflection, transmission and labels are not told apart in it"
            raise _Fault("LN0104", span, message, "name the events that are meant: [DG]")
        if kind in (".", "R", "T") and how in SCATTERED:
            return ast.PathEvents(SCATTERED[how], tag, span)
        if kind == "L" and how == ".":
            return ast.PathEvents("L", tag, span)
        if (kind, how, tag) == ("O", ".", None):
            return ast.PathEvents("L", ast.TagRef("area", False, span), span)
        if (kind, how, tag) == ("C", ".", None):
            return ast.PathEvents("E", None, span)
        raise _Fault("LN0101", span, f"{quote(span.text)} is no event of a light path expression", KNOWN)

    def _label(self) -> ast.TagRef | None:
        """`'floor'`: the tag of the surface, or of the emitter."""
        if self._next() != "'":
            return None
        start = self.at
        found = _LABEL.match(self.source.text, start, self.end)
        if found is None:
            raise self._unexpected("the name of a tag in '...'")
        self.at = found.end()
        if self._next() == "'":
            raise _Fault("LN0104", self._since(start), "an event has one label at most: a tag of the network")
        return ast.TagRef(found[1], False, Span(self.source, start + 1, found.end() - 1))

    # --- Characters ---------------------------------------------------------------------------------------------------

    def _here(self) -> int:
        """Where the next character that is no blank stands."""
        while self.at < self.end and self.source.text[self.at] in " \t":
            self.at += 1
        return self.at

    def _next(self) -> str:
        at = self._here()
        return self.source.text[at] if at < self.end else ""

    def _pop(self) -> str:
        if not self._next():
            raise self._unexpected("an event")
        self.at += 1
        return self.source.text[self.at - 1]

    def _take(self, character: str) -> bool:
        found = self._next() == character
        self.at += found
        return found

    def _expect(self, character: str) -> None:
        if not self._take(character):
            raise self._unexpected(f"'{character}'")

    def _since(self, start: int) -> Span:
        return Span(self.source, start, max(self.at, start))

    def _unexpected(self, wanted: str = "an event, or the end of the expression") -> _Fault:
        found = self._next()
        message = f"expected {wanted}, found {quote(found) if found else 'the end of the expression'}"
        return _Fault("LN0101", Span(self.source, self.at, self.at + len(found)), message)


def _letters(path: ast.PathExpression) -> set[str]:
    match path:
        case ast.PathEvents(letters):
            return set(letters)
        case ast.PathConcat(items) | ast.PathUnion(items):
            return set().union(*map(_letters, items))
        case ast.PathRepeat(item):
            return _letters(item)
    return set()
