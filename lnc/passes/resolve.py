"""Names -> library declarations and parameter values.

    light  = Lights()                       Node light  = Lights
    direct = Direct(light, samples = 4)     Node direct = Direct, port light <- light, samples = 4, to = None
    image  direct + PathTracer(direct)      Node image_tracer = PathTracer; image <- direct + image_tracer

On entry: any syntax tree whose macros are expanded. On exit: every port names wires that exist, every parameter has a
checked value, calls inside expressions are nodes of their own. What cannot be resolved is reported once and left out.
Representations are left to typecheck and insert_converters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from os.path import normpath

from lnc.conversions import cheapest_chains
from lnc.diagnostics import Related, Reporter, did_you_mean, quote
from lnc.library import Library, Operator, Parameter, Port
from lnc.naming import Names
from lnc.network import Expectation, Image, Input, Lightmap, Network, Node, ParameterValue, Probe, Tag, Tap, Term
from lnc.passes.parameters import parameter_value, report_unknown_tags
from lnc.source import Span
from lnc.syntax import ast

TAG_KINDS = ("material", "mesh", "node")
GIVE_BY_POSITION = "give the expression by position, or give it a name in an equation of its own"


def resolve(
    file: ast.File,
    name: str,
    library: Library,
    reporter: Reporter,
    broken: frozenset[str] = frozenset(),
    body: bool = False,
) -> Network:
    """The network of a file; `name` is its name if the text gives none. Wires in `broken` have been reported.

    `body`: the file is the body of a macro, and has no results.
    """
    return _Resolver(file, library, reporter, broken).run(name, body)


def define_tags(statements: Iterable[ast.Statement], reporter: Reporter) -> dict[str, Tag]:
    """The tags that statements define, by name."""
    tags: dict[str, Tag] = {}
    for statement in statements:
        if not isinstance(statement, ast.TagStatement):
            continue
        if statement.name in tags:
            message = f"the tag {quote(statement.name)} is defined twice"
            first = Related(tags[statement.name].span, "first here")
            reporter.error("LN0106", statement.name_span, message, related=[first])
            continue
        for glob in statement.globs:
            if glob.kind not in TAG_KINDS:
                message = f"a tag is a glob on material, mesh or node names, not on {quote(glob.kind)}"
                reporter.error("LN0102", glob.span, message, help=did_you_mean(glob.kind, TAG_KINDS))
        globs = tuple((g.kind, g.glob) for g in statement.globs) or (("extras", statement.name),)
        tags[statement.name] = Tag(statement.name, globs, statement.name_span)
    return tags


def report_unknown_representation(name: str, library: Library, span: Span, reporter: Reporter) -> None:
    help = did_you_mean(name, library.representations)
    reporter.error("LN0102", span, f"no representation is called {quote(name)}", help=help)


@dataclass(frozen=True)
class _Home:
    """Where an expression stands: the name that calls inside it derive theirs from, and the statement."""

    name: str
    statement: Span


class _Resolver:
    def __init__(self, file: ast.File, library: Library, reporter: Reporter, broken: frozenset[str]) -> None:
        self.file = file
        self.broken = broken
        self.library = library
        self.reporter = reporter
        self.equations: dict[str, ast.Equation] = {}
        self.tags = define_tags(file.statements, reporter)
        self.nodes: list[Node] = []
        self.names = Names(())
        self.made: set[str] = set()  # names in `nodes`
        self.used: set[str] = set()
        self.ends: dict[str, str | None] = {}  # second names -> the wire they stand for
        self.circular: set[str] = set()

    def run(self, name: str, body: bool) -> Network:
        names = [s for s in self.file.statements if isinstance(s, ast.NetworkName)]
        for again in names[1:]:
            self._twice(again.span, "the network has a name already", names[0].span)
        self._collect()
        for equation in self.equations.values():
            if not self.reporter.full:
                self._equation(equation)
        image: Image | None = None
        taps: list[Tap] = []
        probes: list[Probe] = []
        lightmaps: list[Lightmap] = []
        expectations: list[Expectation] = []
        for statement in self.file.statements:
            match statement:
                case ast.ImageStatement(wire, layers):
                    terms = self._wire(wire, _Home("image", statement.span))
                    if image is not None:
                        self._twice(statement.span, "the network has an image already", image.span)
                    else:
                        image = Image(terms or (), layers, statement.span)
                case ast.TapStatement(wire, path):
                    terms = self._wire(wire, _Home("tap", statement.span))
                    taps.append(Tap(terms or (), path, statement.span, statement.file_span))
                case ast.Expect():
                    expectations += self._expectation(statement)
                case ast.ProbeStatement(wire, sensors, path):
                    terms = self._wire(wire, _Home("probe", statement.span))
                    self._check_file("a probe reads sensors from a table (.csv)", ".csv", sensors, statement.span)
                    self._check_file("a probe writes a table (.csv)", ".csv", path, statement.span)
                    if path == sensors:
                        message = f"the probe would overwrite its sensors {quote(path)}"
                        self.reporter.error("LN0104", statement.span, message, help="give its results another name")
                    probes.append(Probe(terms or (), sensors, path, statement.span))
                case ast.LightmapStatement(wire, path):
                    terms = self._wire(wire, _Home("lightmap", statement.span))
                    self._check_file("a lightmap is a glTF file (.glb)", ".glb", path, statement.span)
                    lightmaps.append(Lightmap(terms or (), path, statement.span))
                case ast.OperatorDeclaration() | ast.RepresentationDeclaration():
                    message = "declarations belong into a folder of an operator library"
                    self.reporter.error("LN0110", statement.span, message, help="give its folder by --ops")
        written: list[Tap | Probe | Lightmap] = [*taps, *probes, *lightmaps]
        self._check_distinct([(result.file, result.span) for result in written] + self._caches())
        if not body:
            self._check_result(image, written)
            self._report_unused()
        self._check_layers(image)
        return Network(
            name=names[0].name if names else name,
            file=self.file.span.source.name,
            nodes=tuple(self.nodes),
            tags=tuple(self.tags.values()),
            image=image,
            taps=tuple(taps),
            probes=tuple(probes),
            lightmaps=tuple(lightmaps),
            expectations=tuple(expectations),
        )

    def _check_file(self, what: str, suffix: str, path: str, span: Span) -> None:
        if not path.lower().endswith(suffix) or "\0" in path:
            self.reporter.error("LN0104", span, f"{what}, not {quote(path)}")

    def _check_distinct(self, files: list[tuple[str, Span]]) -> None:
        """No two results, and no two caches, may be written to the same file."""
        first: dict[str, Span] = {}
        for path, span in files:
            place = normpath(path)
            if place in first:
                self._twice(span, f"the file {quote(path)} is written twice", first[place])
            first.setdefault(place, span)

    def _caches(self) -> list[tuple[str, Span]]:
        """The files that wires are kept in, with the places that say so."""
        given = [node.parameter("file") for node in self.nodes if node.op.cached]
        return [(str(file.value), file.given.span) for file in given if file and file.given]

    def _expectation(self, statement: ast.Expect) -> list[Expectation]:
        if report_unknown_tags(statement.path, self.tags, self.reporter, self.broken):
            return []
        wire = statement.wire
        if wire is not None and statement.wire_span is not None:
            terms = self._wire_name(ast.WireName(wire, statement.wire_span))
            if not terms:
                return []
            wire = terms[0].node
        return [Expectation(wire, statement.path, statement.at_most, statement.span)]

    # --- Definitions --------------------------------------------------------------------------------------------------

    def _collect(self) -> None:
        for statement in self.file.statements:
            if isinstance(statement, ast.Equation):
                if statement.name in self.equations:
                    first = self.equations[statement.name].name_span
                    self._twice(statement.name_span, f"the wire {quote(statement.name)} is defined twice", first)
                else:
                    self.equations[statement.name] = statement
                    self.names.free(statement.name)

    def _equation(self, equation: ast.Equation) -> None:
        self._check_annotation(equation)
        home = _Home(equation.name, equation.span)
        match equation.wire:
            case ast.Call() as call:
                self._call(call, equation.name, "equation", home)
            case ast.Cast() as cast:
                self._cast(cast, equation.name, home)
            case ast.WireSum() as wire:
                terms = self._wire(wire, home)
                sum_op = self.library.operators["Sum"]
                if terms is not None:
                    inputs = (Input(sum_op.ports[0], terms, wire.span),)
                    self._add(equation.name, sum_op, inputs, (), "equation", home, wire.span)
            case ast.WireName():
                self._alias(equation)

    def _check_annotation(self, equation: ast.Equation) -> None:
        wanted = equation.representation
        if wanted is None:
            return
        if wanted not in self.library.representations:
            report_unknown_representation(wanted, self.library, equation.name_span, self.reporter)
            return
        found = self._representation(equation.wire)
        if found is None or found == wanted:
            return
        what, related = f"this is {found}", []
        if isinstance(equation.wire, ast.Call):
            op = self.library.operators[equation.wire.op]
            what, related = f"'{op.name}' gives {found}", [_declared_here(op, op.span)]
        message = f"{quote(equation.name_span.text)} is to be {wanted}, but {what}"
        help = f"to convert it, write: ... as {wanted}" if cheapest_chains(self.library, found, wanted) else None
        self.reporter.error("LN0201", equation.wire.span, message, related=related, help=help)

    def _alias(self, equation: ast.Equation) -> None:
        """A second name for a wire: no node, but its end must exist and must not be itself."""
        if isinstance(equation.wire, ast.WireName):
            self.used.add(equation.wire.name)
            if equation.wire.name not in self.equations:
                self._unknown_wire(equation.wire)
            elif self._alias_end(equation.name) is None and equation.name in self.circular:
                message = f"the wire {quote(equation.name)} is defined by nothing but itself"
                self.reporter.error("LN0402", equation.span, message)

    def _alias_end(self, name: str) -> str | None:
        """The wire that a name stands for, through all second names; None if there is none."""
        chain: list[str] = []
        end: str | None = name
        while end is not None and end not in self.ends:
            wire = self.equations[end].wire if end in self.equations else None
            self.ends[end] = None  # until it is known; meeting it again is a circle
            chain.append(end)
            if not isinstance(wire, ast.WireName):
                self.ends[end] = end if wire is not None else None
                break
            end = wire.name
            if end in chain:
                self.circular.add(end)
        result = self.ends[end] if end is not None else None
        for link in chain:
            self.ends[link] = result
        return result

    # --- Wires --------------------------------------------------------------------------------------------------------

    def _wire(self, wire: ast.WireExpression, home: _Home) -> tuple[Term, ...] | None:
        """The wires that an expression adds up; None if it is wrong, which has been reported."""
        match wire:
            case ast.WireName():
                return self._wire_name(wire)
            case ast.Call(op):
                name = self.names.derived(home.name, op)
                self._call(wire, name, "nested", home)
                return (Term(name, 1.0, wire.span),) if name in self.made else None
            case ast.Cast():
                return self._cast(wire, None, home)
        terms: list[Term] = []
        wrong = False
        for part in wire.terms:
            inner = self._wire(part.wire, home)
            if inner is None:
                wrong = True
                continue
            sign = -1.0 if part.negative else 1.0
            terms += [Term(t.node, sign * t.weight, t.span) for t in inner]
        return None if wrong else tuple(terms)

    def _wire_name(self, wire: ast.WireName) -> tuple[Term, ...] | None:
        if wire.name not in self.equations:
            self._unknown_wire(wire)
            return None
        self.used.add(wire.name)
        end = self._alias_end(wire.name)
        if end is None:
            return None
        self.used.add(end)
        return (Term(end, 1.0, wire.span),)

    def _unknown_wire(self, wire: ast.WireName) -> None:
        if wire.name in self.broken or self.reporter.full:
            return
        message = f"no wire is called {quote(wire.name)}"
        if wire.name in self.library.operators:
            help: str | None = f"'{wire.name}' is an operator: write {wire.name}(...)"
        elif wire.name in self.tags:
            help = f"'{wire.name}' is a tag; tags are given as parameters: from = {wire.name}"
        else:
            help = did_you_mean(wire.name, self.equations)
        self.reporter.error("LN0102", wire.span, message, help=help)

    # --- Calls --------------------------------------------------------------------------------------------------------

    def _call(self, call: ast.Call, name: str, origin: str, home: _Home) -> None:
        op = self._operator(call)
        if op is None:
            self._unknown_operator(call)
            for wire in call.inputs:  # look for further mistakes
                self._wire(wire, home)
            return
        inputs = self._inputs(call, op, home if origin == "equation" else _Home(name, home.statement))
        parameters = self._parameters(call, op)
        if inputs is not None and parameters is not None:
            self._add(name, op, inputs, parameters, origin, home, call.span)

    def _operator(self, call: ast.Call) -> Operator | None:
        """The operator that a name stands for: of its overloads the one whose inputs take the least conversion."""
        op = self.library.operators.get(call.op)
        if op is None or call.op not in self.library.overloads:
            return op
        candidates = (op, *self.library.overloads[call.op])
        return min(candidates, key=lambda candidate: self._conversion_cost(call, candidate))

    def _conversion_cost(self, call: ast.Call, op: Operator) -> float:
        """Cost of the converters that the inputs of a call need; infinite where one cannot be converted."""
        given: dict[str, ast.WireExpression] = {p.name: w for p, w in zip(op.ports, call.inputs, strict=False)}
        for argument in call.arguments:
            if isinstance(argument.value, ast.NameValue):
                given.setdefault(argument.name, ast.WireName(argument.value.name, argument.value.span))
        total = 0.0
        for port in op.ports:
            found = self._representation(given[port.name]) if port.name in given else None
            if found is not None:
                chains = cheapest_chains(self.library, found, port.representation)
                total += sum(o.converter.cost for o in chains[0] if o.converter) if chains else math.inf
        return total

    def _unknown_operator(self, call: ast.Call) -> None:
        if call.op in self.broken or self.reporter.full:
            return
        message = f"no operator is called {quote(call.op)}"
        akin = [name for name in sorted(self.library.operators) if len(call.op) > 3 and call.op in name]
        help = f"there are: {', '.join(akin)}" if len(akin) > 1 else did_you_mean(call.op, self.library.operators)
        if call.op in self.equations:
            help = f"'{call.op}' is a wire; wires take no arguments"
        self.reporter.error("LN0102", call.op_span, message, help=help or "lnc ops lists all operators")

    def _inputs(self, call: ast.Call, op: Operator, home: _Home) -> tuple[Input, ...] | None:
        wrong = False
        given: dict[str, Input] = {}
        ports = list(op.ports)
        variadic: list[tuple[Port, tuple[Term, ...], Span]] = []
        for i, wire in enumerate(call.inputs):
            terms = self._wire(wire, home)
            if i < len(ports):
                port = ports[i]
            elif ports and ports[-1].variadic:
                port = ports[-1]
            else:
                self._too_many_wires(call, op, wire.span)
                wrong = True
                break
            if terms is None:
                wrong = True
                terms = ()
            if port.variadic:
                variadic.append((port, terms, wire.span))
            else:
                given[port.name] = Input(port, terms, wire.span)
        if variadic:
            all_terms = tuple(t for _, terms, _ in variadic for t in terms)
            given[variadic[0][0].name] = Input(variadic[0][0], all_terms, variadic[0][2].to(variadic[-1][2]))
        for argument in call.arguments:
            port_named = op.port(argument.name)
            if port_named is not None:
                wrong |= not self._named_port(argument, port_named, given)
        missing = [p for p in op.ports if p.name not in given]
        misspelt = any(isinstance(a.value, ast.NameValue) for a in _unknown_arguments(call, op))
        if missing and not wrong and not misspelt:
            wanted = " and ".join(f"'{p.name}: {p.representation}'" for p in missing)
            message = f"{_meant(call, op)} needs its input {wanted}"
            self.reporter.error("LN0105", call.span, message, related=[_declared_here(op, missing[0].span)])
        if missing or wrong:
            return None
        return tuple(_signed(given[p.name]) for p in op.ports)

    def _too_many_wires(self, call: ast.Call, op: Operator, span: Span) -> None:
        if not op.ports:
            message = f"{_meant(call, op)} takes no wires"
        else:
            message = f"{_meant(call, op)} takes {len(op.ports)} wire{'s' if len(op.ports) > 1 else ''}"
        help = "parameters are given by name: parameter = value" if op.parameters else None
        self.reporter.error("LN0107", span, message, help=help, related=[_declared_here(op, op.span)])

    def _named_port(self, argument: ast.Argument, port: Port, given: dict[str, Input]) -> bool:
        if port.name in given:
            first = given[port.name].span
            self._twice(argument.span, f"the input '{port.name}' is given twice", first, "LN0107")
            return False
        if not isinstance(argument.value, ast.NameValue):
            message = f"'{port.name}' is an input: by name it takes a single wire"
            self.reporter.error("LN0104", argument.value.span, message, help=GIVE_BY_POSITION)
            return False
        terms = self._wire_name(ast.WireName(argument.value.name, argument.value.span))
        given[port.name] = Input(port, terms or (), argument.value.span)
        return terms is not None

    def _parameters(self, call: ast.Call, op: Operator) -> tuple[ParameterValue, ...] | None:
        given: dict[str, ast.Argument] = {}
        wrong = False
        for argument in call.arguments:
            if op.port(argument.name) is not None:
                continue
            if op.parameter(argument.name) is None:
                known = [p.name for p in op.parameters] + [p.name for p in op.ports]
                message = f"{_meant(call, op)} has no parameter {quote(argument.name)}"
                close = did_you_mean(argument.name, known)
                listed = f"it has: {', '.join(known)}" if known else "it has none"
                self.reporter.error("LN0103", argument.name_span, message, help=close or listed)
                wrong = True
            elif argument.name in given:
                first = given[argument.name].span
                self._twice(argument.span, f"the parameter '{argument.name}' is given twice", first, "LN0107")
                wrong = True
            else:
                given[argument.name] = argument
        values = [self._parameter(p, given.get(p.name), call, op) for p in op.parameters]
        if wrong or any(v is None for v in values):
            return None
        return tuple(v for v in values if v is not None)

    def _parameter(
        self, parameter: Parameter, argument: ast.Argument | None, call: ast.Call, op: Operator
    ) -> ParameterValue | None:
        if argument is None and parameter.default is None and parameter.type != "tags":
            if _unknown_arguments(call, op):
                return None  # one of which may be meant
            message = f"{_meant(call, op)} needs its parameter '{parameter.name}: {parameter.type}'"
            help = f"add: {parameter.name} = " + ('"..."' if parameter.type == "text" else "...")
            related = [_declared_here(op, parameter.span)]
            self.reporter.error("LN0105", call.span, message, related=related, help=help)
            return None
        value = argument.value if argument else None
        place = argument.span if argument and not argument.span.holds(argument.value.span) else None
        return parameter_value(parameter, value, self.tags, self.reporter, self.broken, place)

    # --- Conversions that are asked for -------------------------------------------------------------------------------

    def _cast(self, cast: ast.Cast, name: str | None, home: _Home) -> tuple[Term, ...] | None:
        """`wire as Representation(...)`: the cheapest chain, its last node called `name` if there is one."""
        terms = self._wire(cast.wire, home)
        if cast.representation not in self.library.representations:
            report_unknown_representation(cast.representation, self.library, cast.representation_span, self.reporter)
            return None
        found = self._representation(cast.wire)
        if terms is None or found is None:
            return None
        if len(terms) > 1:
            sum_op = self.library.operators["Sum"]
            summed = self.names.derived(home.name, "Sum")
            self._add(summed, sum_op, (Input(sum_op.ports[0], terms, cast.wire.span),), (), "nested", home, cast.span)
            terms = (Term(summed, 1.0, cast.wire.span),)
        chains = cheapest_chains(self.library, found, cast.representation)
        if len(chains) != 1 or not chains[0]:
            return self._no_single_chain(cast, found, chains)
        accepted = {p.name for op in chains[0] for p in op.parameters}
        for argument in cast.arguments:
            if argument.name not in accepted:
                message = f"no converter from {found} to {cast.representation} has a parameter {quote(argument.name)}"
                help = did_you_mean(argument.name, accepted)
                self.reporter.error("LN0103", argument.name_span, message, help=help)
                return None
        reason = ""
        if cast.macro is not None:
            reason = f"'{cast.macro}' takes {cast.representation}, '{terms[0].node}' is {found}"
        for op in chains[0]:
            arguments = tuple(a for a in cast.arguments if op.parameter(a.name))
            parameters = self._parameters(ast.Call(op.name, (), arguments, cast.span, cast.span), op)
            if parameters is None:
                return None
            last = op is chains[0][-1]
            node = name if last and name else self.names.derived(home.name, op.name)
            origin = "converter" if reason else "equation" if last and name else "nested"
            inputs = (Input(op.ports[0], terms, cast.wire.span),)
            self._add(node, op, inputs, parameters, origin, home, cast.span, reason)
            terms = (Term(node, 1.0, cast.span),)
        return terms

    def _no_single_chain(
        self, cast: ast.Cast, found: str, chains: list[tuple[Operator, ...]]
    ) -> tuple[Term, ...] | None:
        wanted = f"'{cast.macro}' takes {cast.representation}, this is {found}: " if cast.macro else ""
        related = [Related(cast.representation_span, "declared here")] if cast.macro else []
        if not chains:
            message = f"{wanted}no converter leads from {found} to {cast.representation}"
            self.reporter.error("LN0201", cast.span, message, related=related)
        elif len(chains) > 1:
            listed = ", ".join(" then ".join(op.name for op in chain) for chain in chains)
            message = f"{wanted}several conversions from {found} to {cast.representation} cost the same: {listed}"
            help = "write the one you want as a call"
            self.reporter.error("LN0202", cast.span, message, related=related, help=help)
        else:
            message = f"this is {found} already"
            self.reporter.error("LN0201", cast.span, message, help="remove the conversion")
        return None

    def _representation(self, wire: ast.WireExpression) -> str | None:
        """What an expression is, as far as its text says; None if that is wrong, which is reported elsewhere."""
        if isinstance(wire, ast.WireName):
            end = self._alias_end(wire.name)
            if end is None:
                return None
            wire = self.equations[end].wire
        match wire:
            case ast.Call(op):
                return self.library.operators[op].output if op in self.library.operators else None
            case ast.Cast(_, representation):
                return representation
        return self.library.operators["Sum"].output

    # --- Small helpers ------------------------------------------------------------------------------------------------

    def _add(
        self,
        name: str,
        op: Operator,
        inputs: tuple[Input, ...],
        parameters: tuple[ParameterValue, ...],
        origin: str,
        home: _Home,
        span: Span,
        reason: str = "",
    ) -> None:
        if not parameters:
            defaults = [parameter_value(p, None, self.tags, self.reporter) for p in op.parameters]
            parameters = tuple(v for v in defaults if v is not None)
        self.made.add(name)
        self.nodes.append(Node(name, op, inputs, parameters, origin, span, home.statement, reason))

    def _check_result(self, image: Image | None, written: list[Tap | Probe | Lightmap]) -> None:
        if image is None and not written and not self.reporter.failed:
            start = self.file.statements[0].span if self.file.statements else self.file.span
            self.reporter.error("LN0109", start, "the network has no result", help="add: image WIRE")

    def _check_layers(self, image: Image | None) -> None:
        """No two layers of the picture may have one name."""
        layers: dict[str, Span] = {}
        if image is not None and image.layers:
            layers = {term.node: term.span for term in image.terms}
        for node in self.nodes:
            value = node.parameter("layer")
            if value is None or not isinstance(value.value, str) or value.given is None:
                continue
            if value.value in layers:
                message = f"the picture has a layer {quote(value.value)} already"
                self._twice(value.given.span, message, layers[value.value])
            layers.setdefault(value.value, value.given.span)

    def _twice(self, span: Span, message: str, first: Span, code: str = "LN0106") -> None:
        self.reporter.error(code, span, message, related=[Related(first, "first here")])

    def _report_unused(self) -> None:
        if self.reporter.failed:
            return
        for name, equation in self.equations.items():
            if name not in self.used:
                message = f"nothing uses the wire {quote(name)}"
                self.reporter.warning("LN0108", equation.name_span, message, help="it is left out of the program")


def _unknown_arguments(call: ast.Call, op: Operator) -> list[ast.Argument]:
    """Arguments whose names the operator does not know: LN0103, and what seems to be missing may be one of them."""
    return [a for a in call.arguments if op.port(a.name) is None and op.parameter(a.name) is None]


def _meant(call: ast.Call, op: Operator) -> str:
    """The operator as the call has it, and what it is if that is overloaded."""
    return f"'{call.op}'" + (f" (here the operator '{op.name}')" if op.name != call.op else "")


def _declared_here(op: Operator, span: Span) -> Related:
    return Related(span, f"'{op.name}' is declared here")


def _signed(given: Input) -> Input:
    """With the sign of its port."""
    if not given.port.subtracted:
        return given
    return replace(given, terms=tuple(replace(term, weight=-term.weight) for term in given.terms))
