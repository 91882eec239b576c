"""What the compiler says about a network: a diagnostic, and the reporter that collects them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches

from lnc.source import SourceFile, Span


class InternalError(Exception):
    """A fault of the compiler, never of the network."""


@dataclass(frozen=True)
class Related:
    """A second place that belongs to a diagnostic: the other end of a wire, a first definition."""

    span: Span
    message: str


@dataclass(frozen=True)
class Hop:
    """One step of a route: the wire (or result) that the light passes, and where the text says so."""

    wire: str
    span: Span


@dataclass(frozen=True)
class Witness:
    """A light path that proves a fault, counted exactly: `path` as text with adjacent letters, e.g. `LSD@floorE`."""

    path: str
    count: int
    expected: int
    routes: tuple[tuple[Hop, ...], ...]  # how the network carries it; each ends at the result


@dataclass(frozen=True)
class Diagnostic:
    """One message about one mistake; `code` has a page in `lnc.diagnostics.codes`."""

    code: str
    severity: str  # "error" or "warning"
    message: str
    span: Span
    label: str = ""  # a few words under the carets
    related: tuple[Related, ...] = ()
    help: tuple[str, ...] = ()
    witness: Witness | None = None


@dataclass
class Reporter:
    """Collects diagnostics. Passes report and go on; the driver asks `failed` between passes."""

    diagnostics: list[Diagnostic] = field(default_factory=list)
    limit: int = 100

    def error(
        self,
        code: str,
        span: Span,
        message: str,
        *,
        label: str = "",
        related: Iterable[Related] = (),
        help: str | None = None,
        witness: Witness | None = None,
        severity: str = "error",
    ) -> None:
        self.add(Diagnostic(code, severity, message, span, label, tuple(related), _tuple(help), witness))

    def warning(self, code: str, span: Span, message: str, *, label: str = "", help: str | None = None) -> None:
        self.error(code, span, message, label=label, help=help, severity="warning")

    def add(self, diagnostic: Diagnostic) -> None:
        same = any(  # also in another call of a macro
            (d.code, d.message, str(d.span)) == (diagnostic.code, diagnostic.message, str(diagnostic.span))
            for d in self.diagnostics
        )
        if len(self.diagnostics) < self.limit and not same:
            self.diagnostics.append(diagnostic)

    @property
    def full(self) -> bool:
        """No further message will be kept."""
        return len(self.diagnostics) >= self.limit

    @property
    def failed(self) -> bool:
        return any(d.severity == "error" for d in self.diagnostics)

    def sorted(self) -> list[Diagnostic]:
        """In the order of the text, file by file."""
        files = {d.span.source.name: None for d in self.diagnostics}
        order = {name: i for i, name in enumerate(files)}
        return sorted(self.diagnostics, key=lambda d: (order[d.span.source.name], d.span.start, d.span.end, d.code))


def unreadable(path: str, message: str) -> Diagnostic:
    """A file that could not be read, as a diagnostic."""
    return Diagnostic("LN0100", "error", message, Span(SourceFile(path, ""), 0, 0))


def did_you_mean(word: str, known: Iterable[str]) -> str | None:
    """A help text with the closest known spelling, or None."""
    if len(word) > 60:
        return None
    names = sorted(known)
    folded = {name.lower(): name for name in reversed(names)}
    if word.lower() in folded and folded[word.lower()] != word:
        return f"did you mean '{folded[word.lower()]}'?"
    similar = [name for name in names if abs(len(name) - len(word)) <= 3][:100]  # comparing takes its time
    close = get_close_matches(word, similar, n=1, cutoff=0.6)
    return f"did you mean '{close[0]}'?" if close else None


def quote(text: str, limit: int = 40) -> str:
    """A piece of the user's text for a message, cut to a readable length."""
    return f"'{text}'" if len(text) <= limit else f"'{text[: limit - 3]}...'"


def _tuple(help: str | None) -> tuple[str, ...]:
    return (help,) if help else ()
