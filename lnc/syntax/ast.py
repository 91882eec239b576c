"""The syntax tree: one immutable record per rule of the grammar.

Spans and the place of comments do not count when trees are compared.
"""

from __future__ import annotations

from lnc.record import Record
from lnc.source import Span


class Comments(Record):
    """Comments that belong to a statement, as written; `blank`: an empty line stands before it."""

    leading: tuple[str, ...] = ()
    trailing: str = ""
    blank: bool = False


# --- Light paths ------------------------------------------------------------------------------------------------------


class TagRef(Record):
    """`@mirror`, `@!mirror`, `@delta`; the value of a tags parameter."""

    name: str
    negated: bool
    span: Span

    @property
    def text(self) -> str:
        return f"!{self.name}" if self.negated else self.name


class PathEvents(Record):
    """One event: a letter, or several to choose from. `.` is "DGS"."""

    letters: str
    tag: TagRef | None
    span: Span


class PathName(Record):
    """A name in a path: a tag, or with `negated` what has it not; in a declaration a port or a path parameter."""

    name: str
    tag: TagRef | None
    span: Span
    negated: bool = False


class PathTagged(Record):
    """`(D|G)@mirror`: the tag holds for every event inside."""

    item: PathExpression
    tag: TagRef
    span: Span


class PathConcat(Record):
    """Two or more paths in a row."""

    items: tuple[PathExpression, ...]
    span: Span


class PathUnion(Record):
    """Two or more alternatives."""

    items: tuple[PathExpression, ...]
    span: Span


class PathRepeat(Record):
    """`*` is (0, None), `+` (1, None), `?` (0, 1), `{m,n}` (m, n)."""

    item: PathExpression
    low: int
    high: int | None
    span: Span


class PathEmpty(Record):
    """`()`: no event at all."""

    span: Span


class PathLpe(PathUnion):
    """`lpe "C<RD>.*L"`: the text between the quotation marks; for every pass a union of the one path that it means."""

    items: tuple[PathExpression, ...]
    span: Span
    text: str


PathExpression = PathEvents | PathName | PathTagged | PathConcat | PathUnion | PathRepeat | PathEmpty

# --- Values of parameters ---------------------------------------------------------------------------------------------


class NumberValue(Record):
    """A number with its suffix or unit, as written: `-3`, `200k`, `1%`."""

    text: str
    span: Span


class TextValue(Record):
    """A string, unescaped."""

    text: str
    span: Span


class FlagValue(Record):
    value: bool
    span: Span


class NameValue(Record):
    """A single name: a choice, a tag, a wire or a path, as the declared type says."""

    name: str
    span: Span


class PathLiteral(Record):
    path: PathExpression
    span: Span


Value = NumberValue | TextValue | FlagValue | NameValue | PathLiteral

# --- Wires ------------------------------------------------------------------------------------------------------------


class WireName(Record):
    name: str
    span: Span


class Argument(Record):
    """`name = value` in a call."""

    name: str
    value: Value
    span: Span
    name_span: Span


class Call(Record):
    """`Op(wire, ..., parameter = value)`."""

    op: str
    inputs: tuple[WireExpression, ...]
    arguments: tuple[Argument, ...]
    span: Span
    op_span: Span


class Cast(Record):
    """`wire as QuadTree(error = 1%)`: converts here, with these parameters.

    `macro`: not written, but wanted by an input of the macro of this name; counts as inserted.
    """

    wire: WireExpression
    representation: str
    arguments: tuple[Argument, ...]
    span: Span
    representation_span: Span
    macro: str | None = None


class SumTerm(Record):
    negative: bool
    wire: WireExpression


class WireSum(Record):
    """`a + b - c`, two terms or more; the first is never negative."""

    terms: tuple[SumTerm, ...]
    span: Span


WireExpression = WireName | Call | Cast | WireSum

# --- Statements -------------------------------------------------------------------------------------------------------


class NetworkName(Record):
    name: str
    comments: Comments
    span: Span


class TagGlob(Record):
    kind: str
    glob: str
    span: Span


class TagStatement(Record):
    name: str
    globs: tuple[TagGlob, ...]
    comments: Comments
    span: Span
    name_span: Span


class Equation(Record):
    name: str
    representation: str | None
    wire: WireExpression
    comments: Comments
    span: Span
    name_span: Span


class Expect(Record):
    """`expect PATH`, `expect <= PATH`, `expect wire: PATH`."""

    wire: str | None
    path: PathExpression
    at_most: bool
    comments: Comments
    span: Span
    wire_span: Span | None


class ImageStatement(Record):
    wire: WireExpression
    layers: bool
    comments: Comments
    span: Span


class TapStatement(Record):
    wire: WireExpression
    file: str
    comments: Comments
    span: Span
    file_span: Span


class LightmapStatement(Record):
    wire: WireExpression
    file: str
    comments: Comments
    span: Span


class ProbeStatement(Record):
    wire: WireExpression
    sensors: str
    file: str
    comments: Comments
    span: Span


class Use(Record):
    file: str
    comments: Comments
    span: Span


class MacroInput(Record):
    """`in: Points`, or `n = 3`: a wire with its representation, or a parameter with its default."""

    name: str
    representation: str | None
    default: Value | None
    span: Span


class Macro(Record):
    """A LightOp made of others; the equation `out` is its result."""

    name: str
    inputs: tuple[MacroInput, ...]
    output: str
    body: tuple[Equation, ...]
    comments: Comments
    end_comments: tuple[str, ...]
    span: Span
    name_span: Span


# --- Declarations of the operator library -----------------------------------------------------------------------------


class RepresentationDeclaration(Record):
    name: str
    pulled: bool
    taps: tuple[str, ...]
    doc: str
    comments: Comments
    span: Span


class PortDeclaration(Record):
    name: str
    representation: str
    mode: str  # "complete", "minus" or nothing
    variadic: bool
    doc: str
    span: Span


class ParameterDeclaration(Record):
    name: str
    type: str
    choices: tuple[str, ...]
    default: Value | None
    low: NumberValue | None
    high: NumberValue | None
    doc: str
    comments: Comments
    span: Span


class PathsDeclaration(Record):
    content: str
    path: PathExpression
    comments: Comments
    span: Span


class BiasDeclaration(Record):
    bound: NumberValue
    comments: Comments
    span: Span


class ConverterDeclaration(Record):
    cost: NumberValue
    loss: str
    comments: Comments
    span: Span


class RecursionDeclaration(Record):
    """`recursion roulette max_depth`: how a recursion ends, and the count that may cut it."""

    kind: str
    bound: str | None
    comments: Comments
    span: Span


class EqualDeclaration(Record):
    """`equal a, b`: these ports must carry the same light paths."""

    ports: tuple[str, ...]
    comments: Comments
    span: Span


class PrepareDeclaration(Record):
    cached: bool
    for_view: bool
    comments: Comments
    span: Span


class OverloadsDeclaration(Record):
    name: str
    comments: Comments
    span: Span


class ScalesDeclaration(Record):
    """`scales factor`: this parameter multiplies the light, but not how often its paths are counted."""

    parameter: str
    comments: Comments
    span: Span


OperatorItem = (
    ParameterDeclaration
    | PathsDeclaration
    | BiasDeclaration
    | ConverterDeclaration
    | RecursionDeclaration
    | EqualDeclaration
    | PrepareDeclaration
    | OverloadsDeclaration
    | ScalesDeclaration
)


class OperatorDeclaration(Record):
    name: str
    ports: tuple[PortDeclaration, ...]
    output: str
    body: tuple[OperatorItem, ...]
    doc: str
    comments: Comments
    end_comments: tuple[str, ...]
    span: Span
    name_span: Span


Statement = (
    NetworkName
    | TagStatement
    | Equation
    | Expect
    | ImageStatement
    | TapStatement
    | LightmapStatement
    | ProbeStatement
    | Use
    | Macro
    | RepresentationDeclaration
    | OperatorDeclaration
)


class File(Record):
    statements: tuple[Statement, ...]
    end_comments: tuple[str, ...]  # after the last statement
    broken: frozenset[str]  # names that statements with a mistake would have defined
    span: Span
