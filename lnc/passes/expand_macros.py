"""Macro LightOps -> plain equations.

    op Indirect(in: Points) -> Points {         bounce = PathTracer(direct + bounce)
        out = PathTracer(in + out)         =>   (out takes the name of the call; other wires are bounce_NAME)
    }
    bounce = Indirect(direct)

On entry: any syntax tree. On exit: no macro, no `use`, no call of a macro. Spans stay those of the macro's text;
`calls` says which call led into each macro, so that a mistake inside is shown at both places. Faults are LN0111.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from lnc.diagnostics import Related, Reporter, did_you_mean, quote
from lnc.naming import Names
from lnc.source import SourceFile, Span
from lnc.syntax import ast
from lnc.syntax.parse import parse

EQUATION_LIMIT = 10_000
FILE_LIMIT = 100
RESULT = "out"

Read = Callable[[str, SourceFile], SourceFile]
"""Reads the file that a `use` names, relative to the file it stands in. Raises OSError with a readable text."""


@dataclass(frozen=True)
class Expanded:
    """A file without macros, and for each macro that was used its span and its first call."""

    file: ast.File
    calls: dict[Span, Span] = field(default_factory=dict)
    broken: frozenset[str] = frozenset()  # wires whose macro call was wrong, which has been reported


def expand_macros(file: ast.File, operators: set[str], read: Read, reporter: Reporter) -> Expanded:
    """The file with every macro call replaced by the macro's equations."""
    if not any(isinstance(s, ast.Macro | ast.Use) for s in file.statements):
        return Expanded(file)
    macros = _Macros(operators, read, reporter)
    macros.collect(file)
    known = operators if macros.unread else None
    return _Expander(macros.found, file.broken | macros.broken, known, reporter).run(file)


class _Macros:
    """All macros of a file and of the files it uses."""

    def __init__(self, operators: set[str], read: Read, reporter: Reporter) -> None:
        self.operators = operators
        self.read = read
        self.reporter = reporter
        self.found: dict[str, ast.Macro] = {}
        self.files: set[str] = set()
        self.broken: set[str] = set()
        self.unread = False  # whether a file could not be read that may hold any macro

    def collect(self, file: ast.File) -> None:
        queue = [file]
        self.files.add(file.span.source.name)
        for at in queue:
            for statement in at.statements:
                if isinstance(statement, ast.Macro):
                    self._add(statement)
                elif isinstance(statement, ast.Use):
                    used = self._use(statement)
                    queue += [used] if used else []
                elif at is not file:
                    message = "a file that is used holds macros only"
                    self.reporter.error("LN0111", statement.span, message)

    def _use(self, use: ast.Use) -> ast.File | None:
        try:
            source = self.read(use.file, use.span.source)
        except OSError as error:
            self.reporter.error("LN0111", use.span, f"{quote(use.file)} cannot be used: {error}")
            self.unread = True
            return None
        if source.name in self.files:
            return None
        self.files.add(source.name)
        if len(self.files) > FILE_LIMIT:
            self.reporter.error("LN0111", use.span, f"more than {FILE_LIMIT} files are used")
            return None
        file = parse(source, self.reporter)
        self.broken |= file.broken
        return file

    def _add(self, macro: ast.Macro) -> None:
        if macro.name in self.found or macro.name in self.operators:
            first = self.found.get(macro.name)
            related = [Related(first.name_span, "first here")] if first else []
            message = f"the operator {quote(macro.name)} is defined twice"
            self.reporter.error("LN0106", macro.name_span, message, related=related)
            return
        self.found[macro.name] = macro
        names: set[str] = set()
        for name, span in [(i.name, i.span) for i in macro.inputs] + [(e.name, e.name_span) for e in macro.body]:
            if name in names:
                self.reporter.error("LN0106", span, f"{quote(name)} is defined twice in this macro")
            names.add(name)
        if all(e.name != RESULT for e in macro.body):
            message = f"the macro {quote(macro.name)} has no result"
            self.reporter.error("LN0111", macro.name_span, message, help=f"add an equation: {RESULT} = ...")


@dataclass(frozen=True)
class _Instance:
    """One call: what its names stand for outside, and the macros that led here."""

    wires: dict[str, ast.WireExpression]
    values: dict[str, ast.Value]
    trail: tuple[str, ...]
    macro: ast.Macro | None


class _Expander:
    """`operators`: all names of operators, if a macro of any other name may be missing; else None."""

    def __init__(
        self, macros: dict[str, ast.Macro], broken: frozenset[str], operators: set[str] | None, reporter: Reporter
    ) -> None:
        self.macros = macros
        self.operators = operators
        self.reporter = reporter
        self.names = Names(())
        self.calls: dict[Span, Span] = {}
        self.broken = set(broken)
        self.pending: list[tuple[ast.Equation, _Instance]] = []
        self.count = 0

    def run(self, file: ast.File) -> Expanded:
        outside = _Instance({}, {}, (), None)
        self.names = Names(s.name for s in file.statements if isinstance(s, ast.Equation))
        statements: list[ast.Statement] = []
        for statement in file.statements:
            match statement:
                case ast.Macro() | ast.Use():
                    continue
                case ast.Equation():
                    self.pending.append((statement, outside))
                case ast.ImageStatement() | ast.TapStatement() | ast.LightmapStatement() | ast.ProbeStatement():
                    home = statement.span.text.split(maxsplit=1)[0]
                    statements.append(statement.changed(wire=self._wire(statement.wire, home, outside)))
                case _:
                    statements.append(statement)
            while self.pending:
                equation, instance = self.pending.pop()
                statements += self._equation(equation, instance)
        return Expanded(file.changed(statements=tuple(statements)), self.calls, frozenset(self.broken))

    def _equation(self, equation: ast.Equation, instance: _Instance) -> list[ast.Statement]:
        """The equation without macro calls in it; equations of the macros it calls become pending."""
        self.count += 1
        if self.count > EQUATION_LIMIT:
            if self.count == EQUATION_LIMIT + 1:
                message = f"macros expand to more than {EQUATION_LIMIT} equations"
                self.reporter.error("LN0111", equation.span, message)
            self.broken.add(equation.name)
            return []
        wire = equation.wire
        if isinstance(wire, ast.Call) and wire.op in self.macros:
            self._call(wire, equation.name, instance, equation)
            return []
        return [equation.changed(wire=self._wire(wire, equation.name, instance))]

    def _wire(self, wire: ast.WireExpression, home: str, instance: _Instance) -> ast.WireExpression:
        match wire:
            case ast.WireName(name):
                return self._name(wire, name, instance)
            case ast.WireSum(terms):
                return wire.changed(terms=tuple(t.changed(wire=self._wire(t.wire, home, instance)) for t in terms))
            case ast.Cast(inner, _, arguments):
                given = self._arguments(arguments, instance)
                return wire.changed(wire=self._wire(inner, home, instance), arguments=given)
        if wire.op not in self.macros:
            if self.operators is not None and wire.op not in self.operators:
                self.broken.add(wire.op)
            inputs = tuple(self._wire(w, home, instance) for w in wire.inputs)
            return wire.changed(inputs=inputs, arguments=self._arguments(wire.arguments, instance))
        name = self.names.derived(home, wire.op)
        self._call(wire, name, instance, None)
        return ast.WireName(name, wire.span)

    def _name(self, wire: ast.WireName, name: str, instance: _Instance) -> ast.WireExpression:
        if instance.macro is None:
            return wire
        if name in instance.wires:
            return instance.wires[name]
        known = list(instance.wires)
        message = f"no wire is called {quote(name)} in the macro {quote(instance.macro.name)}"
        help = did_you_mean(name, known) or "a macro sees its own inputs and equations only"
        if name not in self.broken:
            self.reporter.error("LN0102", wire.span, message, help=help)
        self.broken.add(name)
        return wire

    def _arguments(self, arguments: tuple[ast.Argument, ...], instance: _Instance) -> tuple[ast.Argument, ...]:
        """Parameters of the macro replaced by their values, and inputs by their wires."""
        replaced: list[ast.Argument] = []
        for argument in arguments:
            value = argument.value
            if isinstance(value, ast.NameValue) and value.name in instance.values:
                argument = argument.changed(value=instance.values[value.name])
            elif isinstance(value, ast.NameValue) and value.name in instance.wires:
                wire = instance.wires[value.name]
                if isinstance(wire, ast.WireName):
                    argument = argument.changed(value=value.changed(name=wire.name))
            elif isinstance(value, ast.PathLiteral):
                argument = argument.changed(value=value.changed(path=_with_tags(value.path, instance.values)))
            replaced.append(argument)
        return tuple(replaced)

    def _call(self, call: ast.Call, name: str, instance: _Instance, equation: ast.Equation | None) -> None:
        """Queue the equations of one call, whose result is to be called `name`."""
        macro = self.macros[call.op]
        if call.op in instance.trail or len(instance.trail) > 32:
            loop = " -> ".join([*instance.trail, call.op][-8:])
            self.reporter.error("LN0111", call.op_span, f"the macro {quote(call.op)} uses itself: {loop}")
            self.broken.add(name)
            return
        self.calls.setdefault(macro.span, call.op_span)
        wires: dict[str, ast.WireExpression] = {}
        values: dict[str, ast.Value] = {}
        ports = [i for i in macro.inputs if i.representation is not None]
        self._bind_wires(call, macro, ports, name, instance, wires)
        self._bind_values(call, macro, instance, values)
        for port in ports:
            if port.name not in wires:
                message = f"{quote(macro.name)} needs its input '{port.name}: {port.representation}'"
                declared = Related(port.span, f"{quote(macro.name)} is defined here")
                self.reporter.error("LN0105", call.span, message, related=[declared])
                wires[port.name] = ast.WireName(port.name, call.span)
                self.broken.add(port.name)
        for inner in macro.body:
            inner_name = name if inner.name == RESULT else self.names.free(f"{name}_{inner.name}")
            wires[inner.name] = ast.WireName(inner_name, inner.name_span)
        inside = _Instance(wires, values, (*instance.trail, call.op), macro)
        if RESULT not in wires:
            self.broken.add(name)
        for inner in reversed(macro.body):
            target = wires[inner.name]
            assert isinstance(target, ast.WireName)
            fresh = inner.changed(name=target.name, comments=ast.Comments())
            if inner.name == RESULT and equation is not None:
                fresh = fresh.changed(comments=equation.comments, representation=equation.representation)
            self.pending.append((fresh, inside))

    def _bind_wires(
        self,
        call: ast.Call,
        macro: ast.Macro,
        ports: list[ast.MacroInput],
        name: str,
        instance: _Instance,
        wires: dict[str, ast.WireExpression],
    ) -> None:
        if len(call.inputs) > len(ports):
            message = f"{quote(macro.name)} takes {len(ports)} wire{'s' if len(ports) != 1 else ''}"
            self.reporter.error("LN0107", call.inputs[len(ports)].span, message)
        given = [(p.name, self._wire(w, name, instance)) for p, w in zip(ports, call.inputs, strict=False)]
        port_names = {p.name for p in ports}
        for argument in self._arguments(call.arguments, instance):
            if argument.name in port_names and isinstance(argument.value, ast.NameValue):
                given.append((argument.name, ast.WireName(argument.value.name, argument.value.span)))
        for port, wire in given:
            if port in wires:
                self.reporter.error("LN0107", wire.span, f"the input {quote(port)} is given twice")
                continue
            if not isinstance(wire, ast.WireName):  # computed once, however often the macro reads it
                held = self.names.free(f"{name}_{port}")
                self.pending.append(
                    (ast.Equation(held, None, wire, ast.Comments(), wire.span, wire.span), _Instance({}, {}, (), None))
                )
                wire = ast.WireName(held, wire.span)
            wires[port] = wire

    def _bind_values(self, call: ast.Call, macro: ast.Macro, instance: _Instance, values: dict[str, ast.Value]) -> None:
        known = {i.name for i in macro.inputs}
        for port in macro.inputs:
            if port.default is not None:
                values[port.name] = port.default
        for argument in self._arguments(call.arguments, instance):
            if argument.name not in known:
                message = f"{quote(macro.name)} has no parameter {quote(argument.name)}"
                help = did_you_mean(argument.name, known)
                self.reporter.error("LN0103", argument.name_span, message, help=help)
            elif argument.name in values:
                values[argument.name] = argument.value


def _with_tags(path: ast.PathExpression, values: Mapping[str, ast.Value]) -> ast.PathExpression:
    """The path with the tags that are parameters of a macro replaced by their values."""

    def chosen(tag: ast.TagRef) -> ast.TagRef:
        match values.get(tag.name):
            case ast.NameValue(name):
                return tag.changed(name=name)
            case ast.PathLiteral(ast.PathName(name, None, negated=negated)):
                return tag.changed(name=name, negated=negated != tag.negated)
        return tag

    match path:
        case ast.PathConcat(items) | ast.PathUnion(items):
            return path.changed(items=tuple(_with_tags(item, values) for item in items))
        case ast.PathRepeat(item):
            return path.changed(item=_with_tags(item, values))
        case ast.PathTagged(item, tag):
            return path.changed(item=_with_tags(item, values), tag=chosen(tag))
        case ast.PathEvents(tag=ast.TagRef() as tag):
            return path.changed(tag=chosen(tag))
        case ast.PathName(name, tag, span, negated):
            named = chosen(ast.TagRef(name, negated, span))
            return path.changed(name=named.name, negated=named.negated, tag=chosen(tag) if tag else None)
    return path
