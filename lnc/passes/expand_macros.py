"""Macro LightOps -> plain equations.

    op Indirect(in: Points) -> Points {         bounce = PathTracer(direct + bounce)
        out = PathTracer(in + out)         =>   (out takes the name of the call; other wires are bounce_NAME)
    }
    bounce = Indirect(direct)

On entry: any syntax tree. On exit: no macro, no `use`, no call of a macro. Spans stay those of the macro's text, with a
source of its own for each call but the first; `calls` says which call that was, so that a mistake inside is shown
at both places. The file's own macros that nothing calls become files of their own, `bodies`, whose inputs come from
operators of which only the representation is known:

    op Indirect(in: Points) -> Points {         in          = any Points()
        out = PathTracer(in + out)         =>   out: Points = PathTracer(in + out)
    }

Faults are LN0111.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from lnc.diagnostics import Diagnostic, Related, Reporter, did_you_mean, quote
from lnc.library import POINTS, Library, snake_case, unknown_source
from lnc.naming import Names
from lnc.passes.parameters import letters_or_tag
from lnc.passes.resolve import GIVE_BY_POSITION, report_unknown_representation
from lnc.record import Record
from lnc.source import SourceFile, Span
from lnc.syntax import ast
from lnc.syntax.parse import parse

EQUATION_LIMIT = 10_000
FILE_LIMIT = 100
RESULT = "out"
_T = TypeVar("_T", bound=Record)

Read = Callable[[str, SourceFile], SourceFile]
"""Reads the file that a `use` names, relative to the file it stands in. Raises OSError with a readable text."""


@dataclass(frozen=True)
class Expanded:
    """A file without macros, and for each use of a macro its span and the call."""

    file: ast.File
    calls: dict[Span, Span] = field(default_factory=dict)
    origins: dict[Span, Span] = field(default_factory=dict)  # of statements that come from macros: who called
    broken: frozenset[str] = frozenset()  # wires whose macro call was wrong, which has been reported
    called: frozenset[str] = frozenset()  # macros
    bodies: tuple[Expanded, ...] = ()  # of the file's own macros that are not called
    diagnostics: tuple[Diagnostic, ...] = ()  # of such a body


def expand_macros(file: ast.File, library: Library, read: Read, reporter: Reporter) -> Expanded:
    """The file with every macro call replaced by the macro's equations."""
    if not any(isinstance(s, ast.Macro | ast.Use) for s in file.statements):
        return Expanded(file)
    macros = _Macros(library, read, reporter)
    macros.collect(file)
    expanded = _Expander(macros, file, library, reporter, _OUTSIDE).run()
    return replace(expanded, bodies=tuple(_bodies(file, macros, library, expanded.called)))


class _Macros:
    """All macros of a file and of the files it uses."""

    def __init__(self, library: Library, read: Read, reporter: Reporter) -> None:
        self.library = library
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
        if macro.name in self.found or macro.name in self.library.operators:
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
        declared = [(i.representation, i.span) for i in macro.inputs] + [(macro.output, macro.name_span)]
        for representation, span in declared:
            if representation is not None and representation not in self.library.representations:
                report_unknown_representation(representation, self.library, span, self.reporter)
        garbled = any(d.code == "LN0101" and macro.span.holds(d.span) for d in self.reporter.diagnostics)
        if all(e.name != RESULT for e in macro.body) and not garbled:
            message = f"the macro {quote(macro.name)} has no result"
            self.reporter.error("LN0111", macro.name_span, message, help=f"add an equation: {RESULT} = ...")


@dataclass(frozen=True)
class _Instance:
    """One call: what its names stand for outside, and the macros that led here."""

    wires: dict[str, ast.WireExpression]
    values: dict[str, ast.Value]
    trail: tuple[str, ...]
    macro: ast.Macro | None


_OUTSIDE = _Instance({}, {}, (), None)
"""Where the statements of the file stand, in no macro."""


def _bodies(file: ast.File, macros: _Macros, library: Library, called: frozenset[str]) -> Iterator[Expanded]:
    """The bodies of macros in a file that are not `called`, those first that no other macro calls: what they call is
    looked at inside of them."""
    own = [s for s in file.statements if isinstance(s, ast.Macro) and macros.found.get(s.name) is s]
    inner = {call.op for macro in own for call in _parts(macro.body, ast.Call) if call.op != macro.name}
    for macro in sorted(own, key=lambda m: m.name in inner):
        if macro.name in called:
            continue
        body = _body(macro, file, macros, library)
        called |= body.called
        yield body


def _body(macro: ast.Macro, file: ast.File, macros: _Macros, library: Library) -> Expanded:
    """What a macro does with inputs of which only the representation is known, and with its parameters' defaults."""
    equations = {i.name: _from_unknown(i) for i in macro.inputs if i.representation in library.representations}
    for equation in macro.body:
        equations.setdefault(equation.name, equation)
    wires: dict[str, ast.WireExpression] = {name: ast.WireName(name, e.name_span) for name, e in equations.items()}
    values = {i.name: i.default for i in macro.inputs if i.default is not None}
    place = _Instance(wires, values, (macro.name,), macro)
    tags = [s for s in file.statements if isinstance(s, ast.TagStatement)]
    statements = (*tags, *equations.values())
    reporter = Reporter()
    expander = _Expander(macros, file.changed(statements=statements), library, reporter, place)
    expander.broken |= {i.name for i in macro.inputs}  # where it is none of `wires`
    expanded = replace(expander.run(), diagnostics=tuple(reporter.diagnostics))
    if not all(isinstance(s, ast.Macro | ast.Use) for s in file.statements):
        return expanded
    # Tags are those of the networks that will use this file: any name may be one.
    tree = expanded.file
    named: list[ast.NameValue | ast.PathName | ast.TagRef] = [
        *_parts(tree, ast.NameValue),
        *_parts(tree, ast.PathName),
        *_parts(tree, ast.TagRef),
    ]
    unique = {n.name: ast.TagStatement(n.name, (), ast.Comments(), n.span, n.span) for n in named}
    return replace(expanded, file=tree.changed(statements=(*unique.values(), *tree.statements)))


def _from_unknown(port: ast.MacroInput) -> ast.Equation:
    call = ast.Call(unknown_source(port.representation), (), (), port.span, port.span)
    return ast.Equation(port.name, None, call, ast.Comments(), port.span, port.span)


class _Expander:
    """`place`: where the equations of the file stand."""

    def __init__(self, macros: _Macros, file: ast.File, library: Library, reporter: Reporter, place: _Instance) -> None:
        self.place = place
        self.macros = macros.found
        self.unread = macros.unread
        self.file = file
        self.library = library
        self.reporter = reporter
        self.equations = {s.name: s for s in file.statements if isinstance(s, ast.Equation)}
        self.names = Names(self.equations)
        self.calls: dict[Span, Span] = {}
        self.called: set[str] = set(place.trail)
        self.converted: dict[tuple[str, str], str] = {}  # a wire and what inputs of macros want -> its conversion
        self.broken = set(file.broken | macros.broken)
        self.pending: list[tuple[ast.Equation, _Instance]] = []
        self.count = 0

    def run(self) -> Expanded:
        statements: list[ast.Statement] = []
        origins: dict[Span, Span] = {}
        for statement in self.file.statements:
            first = len(statements)
            match statement:
                case ast.Macro() | ast.Use():
                    continue
                case ast.Equation():
                    macro = self.place.macro
                    if macro is not None and statement.name == RESULT:
                        statement = statement.changed(representation=self._checked_as(macro, statement, None))
                    self.pending.append((statement, self.place))
                case ast.ImageStatement() | ast.TapStatement() | ast.LightmapStatement() | ast.ProbeStatement():
                    home = statement.span.text.split(maxsplit=1)[0]
                    statements.append(statement.changed(wire=self._wire(statement.wire, home, _OUTSIDE)))
                case _:
                    statements.append(statement)
            while self.pending:
                equation, instance = self.pending.pop()
                statements += self._equation(equation, instance)
            origins |= {made.span: statement.span for made in statements[first:] if made.span != statement.span}
        file = self.file.changed(statements=tuple(statements))
        return Expanded(file, self.calls, origins, frozenset(self.broken), frozenset(self.called))

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
            if self.unread and wire.op not in self.library.operators:  # it may stand in that file
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
            return instance.wires[name].changed(span=wire.span)
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
                argument = argument.changed(value=value.changed(path=_with_values(value.path, instance.values)))
            replaced.append(argument)
        return tuple(replaced)

    def _call(self, call: ast.Call, name: str, instance: _Instance, equation: ast.Equation | None) -> None:
        """Queue the equations of one call, whose result is to be called `name`."""
        macro = self.macros[call.op]
        self.called.add(call.op)
        if call.op in instance.trail or len(instance.trail) > 32:
            loop = " -> ".join([*instance.trail, call.op][-8:])
            self.reporter.error("LN0111", call.op_span, f"the macro {quote(call.op)} uses itself: {loop}")
            self.broken.add(name)
            return
        if macro.span in self.calls:
            source = macro.span.source
            macro = _copied(macro, SourceFile(source.name, source.text))
        self.calls[macro.span] = call.op_span
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
            if inner.name == RESULT:
                fresh = fresh.changed(representation=self._checked_as(macro, inner, equation))
                if equation is not None:
                    fresh = fresh.changed(comments=equation.comments)
            self.pending.append((fresh, inside))

    def _checked_as(self, macro: ast.Macro, out: ast.Equation, equation: ast.Equation | None) -> str | None:
        """What the result of a call is checked for: the macro's output. `out: R`, `x: R = Macro(...)` are to agree."""
        for annotated in (out, equation):
            if annotated is not None and annotated.representation not in (None, macro.output):
                what = f"{quote(annotated.name_span.text)} is to be {annotated.representation}"
                declared = Related(macro.name_span, f"{quote(macro.name)} is declared here")
                message = f"{what}, but {quote(macro.name)} gives {macro.output}"
                self.reporter.error("LN0201", annotated.wire.span, message, related=[declared])
        return macro.output if macro.output in self.library.representations else None

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
            defined = Related(macro.name_span, f"{quote(macro.name)} is defined here")
            self.reporter.error("LN0107", call.inputs[len(ports)].span, message, related=[defined])
        given = [
            (port, self._wire(wire, name, instance), self._representation(wire, instance))
            for port, wire in zip(ports, call.inputs, strict=False)
        ]
        named = {port.name: port for port in ports}
        for argument, replaced in zip(call.arguments, self._arguments(call.arguments, instance), strict=True):
            if argument.name not in named:
                continue
            port, value = named[argument.name], argument.value
            if not isinstance(value, ast.NameValue) or not isinstance(replaced.value, ast.NameValue):
                message = f"{quote(port.name)} is an input: by name it takes a single wire"
                self.reporter.error("LN0104", value.span, message, help=GIVE_BY_POSITION)
                wires[port.name] = ast.WireName(port.name, call.span)
                self.broken.add(port.name)
                continue
            found = self._representation(ast.WireName(value.name, value.span), instance)
            given.append((port, ast.WireName(replaced.value.name, replaced.value.span), found))
        for port, wire, found in given:
            if port.name in wires:
                self.reporter.error("LN0107", wire.span, f"the input {quote(port.name)} is given twice")
                continue
            if not isinstance(wire, ast.WireName):  # computed once, however often the macro reads it
                held = self.names.free(f"{name}_{port.name}")
                self.pending.append((ast.Equation(held, None, wire, ast.Comments(), wire.span, wire.span), _OUTSIDE))
                wire = ast.WireName(held, wire.span)
            wires[port.name] = self._converted(wire, port, macro, found)

    def _converted(self, wire: ast.WireName, port: ast.MacroInput, macro: ast.Macro, found: str | None) -> ast.WireName:
        """The wire as the input of a macro takes it: converted where it is something else, once for all macros."""
        wanted = port.representation
        if wanted not in self.library.representations or found is None or found == wanted:
            return wire
        key = (wire.name, wanted)
        if key not in self.converted:
            name = self.converted[key] = self.names.free(f"{wire.name}_{snake_case(wanted)}")
            cast = ast.Cast(wire, wanted, (), wire.span, port.span, macro.name)
            equation = ast.Equation(name, None, cast, ast.Comments(), wire.span, wire.span)
            self.pending.append((equation, _OUTSIDE))
        return ast.WireName(self.converted[key], wire.span)

    def _representation(self, wire: ast.WireExpression, instance: _Instance) -> str | None:
        """What an expression is, as far as its text says; None if that is wrong, which is reported elsewhere."""
        seen: set[str] = set()
        while isinstance(wire, ast.WireName):
            for port in instance.macro.inputs if instance.macro else ():
                if port.name == wire.name:
                    return port.representation
            equations = {e.name: e for e in instance.macro.body} if instance.macro else self.equations
            if wire.name in seen or wire.name not in equations:
                return None
            seen.add(wire.name)
            wire = equations[wire.name].wire
        match wire:
            case ast.Call(op) if op in self.macros:
                return self.macros[op].output
            case ast.Call(op):
                return self.library.operators[op].output if op in self.library.operators else None
            case ast.Cast(_, representation):
                return representation
        return POINTS

    def _bind_values(self, call: ast.Call, macro: ast.Macro, instance: _Instance, values: dict[str, ast.Value]) -> None:
        known = {i.name for i in macro.inputs}
        given: dict[str, Span] = {}
        for port in macro.inputs:
            if port.default is not None:
                values[port.name] = port.default
        for argument in self._arguments(call.arguments, instance):
            if argument.name in given and argument.name in values:
                message = f"the parameter {quote(argument.name)} is given twice"
                first = Related(given[argument.name], "first here")
                self.reporter.error("LN0107", argument.span, message, related=[first])
            given.setdefault(argument.name, argument.span)
            if argument.name not in known:
                message = f"{quote(macro.name)} has no parameter {quote(argument.name)}"
                listed = f"it has: {', '.join(i.name for i in macro.inputs)}" if known else "it has none"
                help = did_you_mean(argument.name, known) or listed
                self.reporter.error("LN0103", argument.name_span, message, help=help)
            elif argument.name in values:
                values[argument.name] = argument.value


def _parts(tree: Any, kind: type[_T]) -> Iterator[_T]:
    """The parts of a syntax tree that are of this kind."""
    if isinstance(tree, kind):
        yield tree
    if isinstance(tree, tuple):
        for part in tree:
            yield from _parts(part, kind)
    elif isinstance(tree, Record):
        for name in tree.__match_args__:
            yield from _parts(getattr(tree, name), kind)


def _copied(tree: Any, source: SourceFile) -> Any:
    """A part of a syntax tree with its spans in another source of the same text."""
    if isinstance(tree, Span):
        return Span(source, tree.start, tree.end)
    if isinstance(tree, tuple):
        return tuple([_copied(part, source) for part in tree])
    if isinstance(tree, Record):
        return type(tree)(*[_copied(getattr(tree, name), source) for name in tree.__match_args__])
    return tree


def _with_values(path: ast.PathExpression, values: Mapping[str, ast.Value]) -> ast.PathExpression:
    """The path with the tags and paths that are parameters of a macro replaced by their values."""

    def chosen(tag: ast.TagRef) -> ast.TagRef:
        match values.get(tag.name):
            case ast.NameValue(name):
                return tag.changed(name=name)
            case ast.PathLiteral(ast.PathName(name, None, negated=negated)):
                return tag.changed(name=name, negated=negated != tag.negated)
        return tag

    match path:
        case ast.PathConcat(items) | ast.PathUnion(items):
            return path.changed(items=tuple(_with_values(item, values) for item in items))
        case ast.PathRepeat(item):
            return path.changed(item=_with_values(item, values))
        case ast.PathTagged(item, tag):
            return path.changed(item=_with_values(item, values), tag=chosen(tag))
        case ast.PathEvents(tag=ast.TagRef() as tag):
            return path.changed(tag=chosen(tag))
        case ast.PathName(name, tag, span, False) if (given := _given_path(values.get(name), span)) is not None:
            return given if tag is None else ast.PathTagged(given, chosen(tag), span)
        case ast.PathName(name, tag, span, negated):
            named = chosen(ast.TagRef(name, negated, span))
            return path.changed(name=named.name, negated=named.negated, tag=chosen(tag) if tag else None)
    return path


def _given_path(value: ast.Value | None, span: Span) -> ast.PathExpression | None:
    """The path that a parameter of a macro stands for; None where it stands for a tag or no path at all."""
    match value:
        case ast.NameValue(name):
            path = letters_or_tag(name, span)
        case ast.PathLiteral(path):
            pass
        case _:
            return None
    return None if isinstance(path, ast.PathName) else path
