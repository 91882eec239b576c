"""The nouns that the passes hand on: Network, TypedNetwork, Schedule.

A wire has the name of the node that makes it. A port reads a linear combination of wires: `a - b` is the terms
(a, 1), (b, -1). Everything here is plain, immutable data.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from lnc.library import Operator, Parameter, Port, Scalar
from lnc.paths.automaton import EventTable
from lnc.paths.language import Alphabet
from lnc.source import Span
from lnc.syntax.ast import PathExpression, TagRef, Value


@dataclass(frozen=True)
class PathValue:
    """The value of a path parameter: as text, and as a deterministic automaton over tagged events."""

    text: str
    expression: PathExpression = field(compare=False, repr=False)
    events: EventTable


@dataclass(frozen=True)
class ParameterValue:
    """A parameter with its value in SI units; None is a tags parameter that is not given: everywhere."""

    declaration: Parameter
    value: Scalar | PathValue | TagRef | None
    given: Value | None  # as written in the network; None where the default stands

    @property
    def name(self) -> str:
        return self.declaration.name


@dataclass(frozen=True)
class Term:
    """One wire of a sum, with its weight."""

    node: str
    weight: float
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Input:
    """What a port reads."""

    port: Port
    terms: tuple[Term, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Node:
    """A LightOp in the network, and the wire that leaves it.

    `origin`: "equation" (the user's), "nested" (a call inside an expression) or "converter" (inserted; then
    `reason` says why). `statement` is the statement that it was written in.
    """

    name: str
    op: Operator
    inputs: tuple[Input, ...]  # in declared order; a variadic port has one Input
    parameters: tuple[ParameterValue, ...]  # in declared order, defaults filled in
    origin: str
    span: Span = field(compare=False, repr=False)  # of the expression
    statement: Span = field(compare=False, repr=False)
    reason: str = ""

    def input(self, port: str) -> Input | None:
        return next((i for i in self.inputs if i.port.name == port), None)

    def parameter(self, name: str) -> ParameterValue | None:
        return next((p for p in self.parameters if p.name == name), None)


@dataclass(frozen=True)
class Tag:
    """A part of the scene: surfaces whose material, mesh or node matches a glob, or that carry an extras tag."""

    name: str
    globs: tuple[tuple[str, str], ...]  # (kind, glob), kind in material | mesh | node | extras
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Image:
    """The picture through the camera; with `layers`, one layer per term beside it."""

    terms: tuple[Term, ...]
    layers: bool
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Tap:
    """A wire written to a file of its own."""

    terms: tuple[Term, ...]
    file: str
    span: Span = field(compare=False, repr=False)
    file_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Probe:
    """The irradiance of a wire at the sensors of a file, written to another."""

    terms: tuple[Term, ...]
    sensors: str
    file: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Lightmap:
    """The irradiance of a wire, baked onto the surfaces."""

    terms: tuple[Term, ...]
    file: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Expectation:
    """`expect PATH`: the light paths that the picture, or a wire, is to contain, each once."""

    wire: str | None  # None: the picture
    path: PathExpression
    at_most: bool
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Network:
    """Names resolved and parameters checked; representations not yet."""

    name: str
    file: str
    nodes: tuple[Node, ...]
    tags: tuple[Tag, ...]
    image: Image | None
    taps: tuple[Tap, ...]
    probes: tuple[Probe, ...]
    lightmaps: tuple[Lightmap, ...]
    expectations: tuple[Expectation, ...]

    def results(self) -> list[tuple[str, tuple[Term, ...]]]:
        """What is asked for: what to call it, and the wires that it adds up."""
        found = [("image", self.image.terms)] if self.image else []
        found += [(f"tap {tap.file}", tap.terms) for tap in self.taps]
        found += [(f"probe {probe.file}", probe.terms) for probe in self.probes]
        return found + [(f"lightmap {lightmap.file}", lightmap.terms) for lightmap in self.lightmaps]

    def by_name(self) -> dict[str, Node]:
        return {node.name: node for node in self.nodes}


@dataclass(frozen=True)
class TypedNetwork:
    """A network with the representation of every wire; after insert_converters every port gets what it takes."""

    network: Network
    representations: dict[str, str]
    alphabet: Alphabet  # the tags that the network tells apart


@dataclass(frozen=True)
class PathReport:
    """Light paths as readable expressions."""

    wires: dict[str, tuple[tuple[str, str], ...]]  # wire -> (content, expression)
    image: str | None  # the picture's
    lacking: str | None  # what of all light the picture lacks
    missing: str | None  # a shortest path of those


# --- Schedule: all that code generation needs -------------------------------------------------------------------------


@dataclass(frozen=True)
class ScheduledInput:
    """A port with the wires that it reads. Several terms are a weighted sum of Points, to be evaluated in place."""

    port: Port
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class ScheduledNode:
    """A node in its place.

    `identifier` is unique among nodes and no C++ keyword; it is `name` wherever that is possible.
    `recursive`: lies on a pull cycle. `head`: is read, on a cycle, by a node that comes before it or by itself,
    so it must be declared ahead. `receivers`: where `to` wants the wire, None for everywhere.
    `line`, `text`: where the user wrote it, for comments.
    """

    name: str
    identifier: str
    op: Operator
    inputs: tuple[ScheduledInput, ...]
    parameters: tuple[ParameterValue, ...]
    contents: tuple[str, ...]
    prepares: bool
    recursive: bool
    head: bool
    receivers: TagRef | None
    origin: str
    reason: str
    file: str
    line: int
    text: str

    def input(self, port: str) -> ScheduledInput | None:
        return next((i for i in self.inputs if i.port.name == port), None)

    def parameter(self, name: str) -> ParameterValue | None:
        return next((p for p in self.parameters if p.name == name), None)


@dataclass(frozen=True)
class Schedule:
    """A network in the order in which it is built, prepared and pulled.

    `taps`: those of Points, which are pictures through the camera; `stored_taps`: of what is stored otherwise.
    `nodes`: every node that a result needs, sources first (nodes of one pull cycle stand together, in the order of
    the text). `prepare`: names of the nodes to prepare, in order. `cycles`: the pull cycles, as names.
    """

    network: str
    file: str
    nodes: tuple[ScheduledNode, ...]
    prepare: tuple[str, ...]
    cycles: tuple[tuple[str, ...], ...]
    image: Image | None
    taps: tuple[Tap, ...]
    stored_taps: tuple[Tap, ...]
    probes: tuple[Probe, ...]
    lightmaps: tuple[Lightmap, ...]
    tags: tuple[Tag, ...]
    wanted: tuple[str, ...]  # the wires that results are made of

    def node(self, name: str) -> ScheduledNode:
        return next(n for n in self.nodes if n.name == name)
