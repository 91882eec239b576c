"""The nouns of the operator library, and the questions that passes ask it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property

from lnc.source import Span
from lnc.syntax.ast import PathExpression

CONTENTS = ("emission", "irradiance", "samples", "radiance")
SCATTERED = {"emission": "DGS", "irradiance": "D", "samples": "DG", "radiance": "DGS"}
PARAMETER_TYPES = ("count", "ratio", "length", "angle", "time", "number", "flag", "choice", "path", "tags", "text")
POINTS = "Points"
"""The representation that sums and most results are made of."""

Scalar = int | float | bool | str
"""A parameter's value in SI units: metres, radians, seconds; a ratio is a fraction of 1."""


@dataclass(frozen=True)
class Representation:
    """How illumination is stored on a wire.

    `pulled`: it is not, but found out for each request. `taps`: the suffixes of the files that a tap can write it as.
    """

    name: str
    pulled: bool
    taps: tuple[str, ...]
    doc: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Port:
    """An input. `complete`: must be whole before it is read (pushed). `pulled`: answers requests.

    `subtracted`: what is given counts with the opposite sign.
    """

    name: str
    representation: str
    pulled: bool
    complete: bool
    subtracted: bool
    variadic: bool
    doc: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Parameter:
    """A declared parameter. `low` and `high` are in SI units; for a path they bound its number of events.

    `default` is None where the parameter must be given, and for `tags`, where it means "everywhere".
    """

    name: str
    type: str
    choices: tuple[str, ...]
    default: Scalar | PathExpression | None
    low: float | None
    high: float | None
    doc: str
    default_text: str = ""
    span: Span = field(compare=False, repr=False, default=None)  # type: ignore[assignment]


@dataclass(frozen=True)
class PathRule:
    """One alternative of `paths CONTENT = ...`: the light at a port (or a new `L`), then events.

    `port` is None where the light starts here. `emitter` is "area", "delta", the name of a tags parameter, or None. At
    a port whose light has left its emitters the tags say on which surfaces it is read, to be used on any.
    `tail` holds letters and the names of path parameters; None is the empty path.
    """

    content: str  # one of CONTENTS, or "unchanged"
    port: str | None
    emitter: str | None
    tail: PathExpression | None


@dataclass(frozen=True)
class Converter:
    """States that an operator may be inserted automatically."""

    cost: float
    loss: str


@dataclass(frozen=True)
class Operator:
    """A LightOp's declaration."""

    name: str
    family: str
    folder: str  # absolute path of its folder
    doc: str
    ports: tuple[Port, ...]
    output: str
    pulled: bool  # the output answers requests
    parameters: tuple[Parameter, ...]
    paths: tuple[PathRule, ...]
    bias: float
    converter: Converter | None
    recursion: str | None  # "roulette" or "depth": bounds a pull recursion through it
    depth_parameter: str | None  # the count parameter that cuts a recursion after so many steps (0: never)
    equal: tuple[str, ...]  # ports that must carry equal light paths, which count once
    prepares: bool  # works before the picture: its C++ has a `prepare` function
    cached: bool  # may know its wire from an earlier run: then nothing that it alone reads whole is prepared
    for_view: bool  # what it prepares depends on what results look at: camera, size of the picture, places of probes
    overloads: str | None  # another operator, whose name stands for this one where the inputs are of this one's kind
    scale_parameter: str | None  # multiplies the light, which its paths do not show; may be negative where its range is
    span: Span = field(compare=False, repr=False)

    @property
    def file_stem(self) -> str:
        """The name of its folder, header and test."""
        return snake_case(self.name)

    def port(self, name: str) -> Port | None:
        return next((p for p in self.ports if p.name == name), None)

    def parameter(self, name: str) -> Parameter | None:
        return next((p for p in self.parameters if p.name == name), None)

    @property
    def may_negate(self) -> bool:
        """Can --set or the text turn the sign of the light?"""
        factor = self.parameter(self.scale_parameter) if self.scale_parameter else None
        return factor is not None and (factor.low is None or factor.low < 0)


@dataclass(frozen=True)
class Library:
    """Everything that is declared, by name."""

    operators: dict[str, Operator]
    representations: dict[str, Representation]

    @cached_property
    def converters(self) -> dict[str, tuple[Operator, ...]]:
        """Operators that may be inserted, by the representation that they read, sorted by name."""
        found: dict[str, list[Operator]] = {}
        for op in sorted(self.operators.values(), key=lambda o: o.name):
            if op.converter is not None:
                found.setdefault(op.ports[0].representation, []).append(op)
        return {name: tuple(ops) for name, ops in found.items()}

    @cached_property
    def overloads(self) -> dict[str, tuple[Operator, ...]]:
        """Operators that a name stands for beside the one that it belongs to, sorted by name."""
        found: dict[str, list[Operator]] = {}
        for op in sorted(self.operators.values(), key=lambda o: o.name):
            if op.overloads is not None:
                found.setdefault(op.overloads, []).append(op)
        return {name: tuple(ops) for name, ops in found.items()}


def unknown_source(representation: str | None) -> str:
    """The operator that stands for whatever gives a wire of this representation; no name in a text."""
    return f"any {representation}"


def with_unknown_sources(library: Library) -> Library:
    """The library with an operator for each representation that gives it from nothing: for wires of unknown origin."""
    sources = {
        unknown_source(name): Operator(
            name=unknown_source(name),
            family="",
            folder="",
            doc="",
            ports=(),
            output=name,
            pulled=representation.pulled,
            parameters=(),
            paths=(),
            bias=0,
            converter=None,
            recursion=None,
            depth_parameter=None,
            equal=(),
            prepares=False,
            cached=False,
            for_view=False,
            overloads=None,
            scale_parameter=None,
            span=representation.span,
        )
        for name, representation in library.representations.items()
    }
    return Library({**library.operators, **sources}, library.representations)


def first_sentence(doc: str) -> str:
    """What a list shows of a documentation, on one line."""
    paragraph = " ".join(doc.strip().split("\n\n")[0].split())
    return re.split(r"(?<=\.) (?=[A-Z0-9])", paragraph, maxsplit=1)[0]


def snake_case(name: str) -> str:
    """`KDPhotonTree` -> `kd_photon_tree`."""
    out: list[str] = []
    for i, c in enumerate(name):
        if c.isupper() and i > 0:
            after_small = not name[i - 1].isupper()
            before_small = i + 1 < len(name) and name[i + 1].islower()
            if (after_small or before_small) and name[i - 1] != "_":
                out.append("_")
        out.append(c.lower())
    return "".join(out)
