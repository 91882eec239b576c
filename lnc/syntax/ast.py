"""The syntax tree: one frozen dataclass per rule of the grammar.

Spans and the place of comments do not count when trees are compared.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from lnc.source import Span


def _span() -> Span:
    return field(compare=False, repr=False)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Comments:
    """Comments that belong to a statement, as written; `blank`: an empty line stands before it."""

    leading: tuple[str, ...] = ()
    trailing: str = ""
    blank: bool = False


# --- Light paths ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TagRef:
    """`@mirror`, `@!mirror`, `@delta`."""

    name: str
    negated: bool
    span: Span = _span()


@dataclass(frozen=True)
class PathEvents:
    """One event: a letter, or several to choose from. `.` is "DGS"."""

    letters: str
    tag: TagRef | None
    span: Span = _span()


@dataclass(frozen=True)
class PathName:
    """A name in a path: a tag; in a declaration also a port or a path parameter."""

    name: str
    tag: TagRef | None
    span: Span = _span()


@dataclass(frozen=True)
class PathTagged:
    """`(D|G)@mirror`: the tag holds for every event inside."""

    item: PathExpression
    tag: TagRef
    span: Span = _span()


@dataclass(frozen=True)
class PathConcat:
    """Two or more paths in a row."""

    items: tuple[PathExpression, ...]
    span: Span = _span()


@dataclass(frozen=True)
class PathUnion:
    """Two or more alternatives."""

    items: tuple[PathExpression, ...]
    span: Span = _span()


@dataclass(frozen=True)
class PathRepeat:
    """`*` is (0, None), `+` (1, None), `?` (0, 1), `{m,n}` (m, n)."""

    item: PathExpression
    low: int
    high: int | None
    span: Span = _span()


@dataclass(frozen=True)
class PathEmpty:
    """`()`: no event at all."""

    span: Span = _span()


PathExpression = PathEvents | PathName | PathTagged | PathConcat | PathUnion | PathRepeat | PathEmpty

# --- Values of parameters ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class NumberValue:
    """A number with its suffix or unit, as written: `-3`, `200k`, `1%`."""

    text: str
    span: Span = _span()


@dataclass(frozen=True)
class TextValue:
    """A string, unescaped."""

    text: str
    span: Span = _span()


@dataclass(frozen=True)
class FlagValue:
    value: bool
    span: Span = _span()


@dataclass(frozen=True)
class NameValue:
    """A single name: a choice, a tag, a wire or a path, as the declared type says."""

    name: str
    span: Span = _span()


@dataclass(frozen=True)
class PathLiteral:
    path: PathExpression
    span: Span = _span()


Value = NumberValue | TextValue | FlagValue | NameValue | PathLiteral

# --- Wires ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class WireName:
    name: str
    span: Span = _span()


@dataclass(frozen=True)
class Argument:
    """`name = value` in a call."""

    name: str
    value: Value
    span: Span = _span()
    name_span: Span = _span()


@dataclass(frozen=True)
class Call:
    """`Op(wire, ..., parameter = value)`."""

    op: str
    inputs: tuple[WireExpression, ...]
    arguments: tuple[Argument, ...]
    span: Span = _span()
    op_span: Span = _span()


@dataclass(frozen=True)
class Cast:
    """`wire as QuadTree(error = 1%)`: converts here, with these parameters."""

    wire: WireExpression
    representation: str
    arguments: tuple[Argument, ...]
    span: Span = _span()
    representation_span: Span = _span()


@dataclass(frozen=True)
class SumTerm:
    negative: bool
    wire: WireExpression


@dataclass(frozen=True)
class WireSum:
    """`a + b - c`, two terms or more; the first is never negative."""

    terms: tuple[SumTerm, ...]
    span: Span = _span()


WireExpression = WireName | Call | Cast | WireSum

# --- Statements -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class NetworkName:
    name: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class TagGlob:
    kind: str
    glob: str
    span: Span = _span()


@dataclass(frozen=True)
class TagStatement:
    name: str
    globs: tuple[TagGlob, ...]
    comments: Comments
    span: Span = _span()
    name_span: Span = _span()


@dataclass(frozen=True)
class Equation:
    name: str
    representation: str | None
    wire: WireExpression
    comments: Comments
    span: Span = _span()
    name_span: Span = _span()


@dataclass(frozen=True)
class Expect:
    path: PathExpression
    at_most: bool
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class ImageStatement:
    wire: WireExpression
    layers: bool
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class TapStatement:
    wire: WireExpression
    file: str
    comments: Comments
    span: Span = _span()
    file_span: Span = _span()


@dataclass(frozen=True)
class LightmapStatement:
    wire: WireExpression
    file: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class ProbeStatement:
    wire: WireExpression
    sensors: str
    file: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class Use:
    file: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class MacroInput:
    """`in: Points`, or `n = 3`: a wire with its representation, or a parameter with its default."""

    name: str
    representation: str | None
    default: Value | None
    span: Span = _span()


@dataclass(frozen=True)
class Macro:
    """A LightOp made of others; the equation `out` is its result."""

    name: str
    inputs: tuple[MacroInput, ...]
    output: str
    body: tuple[Equation, ...]
    comments: Comments
    end_comments: tuple[str, ...]
    span: Span = _span()
    name_span: Span = _span()


# --- Declarations of the operator library -----------------------------------------------------------------------------


@dataclass(frozen=True)
class RepresentationDeclaration:
    name: str
    doc: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class PortDeclaration:
    name: str
    representation: str
    complete: bool
    variadic: bool
    doc: str
    span: Span = _span()


@dataclass(frozen=True)
class ParameterDeclaration:
    name: str
    type: str
    choices: tuple[str, ...]
    default: Value | None
    low: NumberValue | None
    high: NumberValue | None
    doc: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class PathsDeclaration:
    content: str
    path: PathExpression
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class BiasDeclaration:
    bound: NumberValue
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class ConverterDeclaration:
    cost: NumberValue
    loss: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class RecursionDeclaration:
    kind: str
    comments: Comments
    span: Span = _span()


@dataclass(frozen=True)
class PrepareDeclaration:
    comments: Comments
    span: Span = _span()


OperatorItem = (
    ParameterDeclaration
    | PathsDeclaration
    | BiasDeclaration
    | ConverterDeclaration
    | RecursionDeclaration
    | PrepareDeclaration
)


@dataclass(frozen=True)
class OperatorDeclaration:
    name: str
    ports: tuple[PortDeclaration, ...]
    output: str
    body: tuple[OperatorItem, ...]
    doc: str
    comments: Comments
    end_comments: tuple[str, ...]
    span: Span = _span()
    name_span: Span = _span()


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


@dataclass(frozen=True)
class File:
    statements: tuple[Statement, ...]
    end_comments: tuple[str, ...]  # after the last statement
    span: Span = _span()
