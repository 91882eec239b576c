"""Declarations in `.ln` files -> Library. What is wrong in one is reported as LN0112."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from lnc.diagnostics import Diagnostic, Reporter
from lnc.library import (
    CONTENTS,
    PARAMETER_TYPES,
    Converter,
    Library,
    Operator,
    Parameter,
    PathRule,
    Port,
    Representation,
    Scalar,
    snake_case,
)
from lnc.locations import cached, compiler_fingerprint, library_folders
from lnc.paths.language import EMITTERS
from lnc.source import SourceFile, Span
from lnc.syntax import ast
from lnc.syntax.parse import parse
from lnc.values import UNITS, ValueFault, number


def load_library(extra_folders: tuple[str, ...] = ()) -> tuple[Library, list[Diagnostic]]:
    """The library of all folders, read from the cache if no declaration has changed."""
    texts: dict[str, str] = {}
    digest = hashlib.sha256(compiler_fingerprint().encode())
    for folder in library_folders(extra_folders):
        for path in sorted(_declarations(folder)):
            texts[str(path)] = path.read_text("utf-8", errors="replace")
            digest.update(f"{folder}\0{path}\0{len(texts[str(path)])}\0{texts[str(path)]}".encode())
    return cached("library", digest.hexdigest(), lambda: read_library(texts))


def _declarations(folder: Path) -> list[Path]:
    found: list[Path] = []
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(f for f in folders if not f.startswith((".", "__")))
        found += [Path(place) / name for name in files if name.endswith(".ln")]
    return found


def read_library(texts: dict[str, str]) -> tuple[Library, list[Diagnostic]]:
    """All declarations in the given texts, by path. A later operator of the same name replaces an earlier one."""
    reporter = Reporter()
    representations: dict[str, Representation] = {}
    declared: list[tuple[Path, ast.OperatorDeclaration]] = []
    for path, text in texts.items():
        file = parse(SourceFile(path, text.replace("\r\n", "\n")), reporter)
        for statement in file.statements:
            match statement:
                case ast.RepresentationDeclaration(name, pulled, taps, doc):
                    representations[name] = Representation(name, pulled, taps, doc, statement.span)
                case ast.OperatorDeclaration():
                    declared.append((Path(path), statement))
                case _:
                    message = "an operator library holds operators and representations only"
                    reporter.error("LN0112", statement.span, message)
    operators: dict[str, Operator] = {}
    for place, declaration in declared:
        operators[declaration.name] = _OperatorReader(declaration, place, representations, reporter).read()
    for _, declaration in declared:
        _check_overload(declaration, operators, reporter)
    return Library(operators, representations), reporter.sorted()


def _check_overload(declaration: ast.OperatorDeclaration, operators: dict[str, Operator], reporter: Reporter) -> None:
    """One name gives one representation, whatever the inputs: so a call's output is known before its inputs are."""
    item = next((i for i in declaration.body if isinstance(i, ast.OverloadsDeclaration)), None)
    if item is None:
        return
    named, op = operators.get(item.name), operators[declaration.name]
    if named is None:
        reporter.error("LN0112", item.span, f"'{op.name}' overloads '{item.name}', which no file declares")
    elif named.overloads is not None:
        reporter.error("LN0112", item.span, f"'{named.name}' overloads '{named.overloads}': overload that instead")
    elif named.output != op.output or [p.name for p in named.ports] != [p.name for p in op.ports]:
        wanted = f"({', '.join(p.name for p in named.ports)}) -> {named.output}"
        message = f"'{op.name}' overloads '{named.name}', but its inputs and output are not named alike: {wanted}"
        reporter.error("LN0112", item.span, message)


class _OperatorReader:
    """Reads one declaration."""

    def __init__(
        self,
        declaration: ast.OperatorDeclaration,
        path: Path,
        representations: dict[str, Representation],
        reporter: Reporter,
    ) -> None:
        self.declaration = declaration
        self.path = path
        self.representations = representations
        self.reporter = reporter

    def read(self) -> Operator:
        declaration = self.declaration
        folder = self.path.parent
        if snake_case(declaration.name) != self.path.stem:
            self._error(declaration.name_span, f"'{declaration.name}' belongs into {snake_case(declaration.name)}.ln")
        for name in (declaration.output, *(p.representation for p in declaration.ports)):
            if name not in self.representations:
                self._error(declaration.name_span, f"'{declaration.name}' uses '{name}', which no file declares")
        pulled = {name for name, representation in self.representations.items() if representation.pulled}
        ports = tuple(
            Port(
                p.name,
                p.representation,
                p.representation in pulled,
                p.mode == "complete",
                p.mode == "minus",
                p.variadic,
                p.doc,
                p.span,
            )
            for p in declaration.ports
        )
        body = declaration.body
        parameters = tuple(self._parameter(i) for i in body if isinstance(i, ast.ParameterDeclaration))
        converter = next((i for i in body if isinstance(i, ast.ConverterDeclaration)), None)
        recursion = next((i for i in body if isinstance(i, ast.RecursionDeclaration)), None)
        overloads = next((i for i in body if isinstance(i, ast.OverloadsDeclaration)), None)
        if recursion is not None and recursion.kind not in ("roulette", "depth"):
            self._error(recursion.span, "a recursion is bounded by 'roulette' or by 'depth'")
        if converter is not None and len(ports) != 1:
            self._error(converter.span, "a converter has exactly one port")
        rules = [
            rule for i in body if isinstance(i, ast.PathsDeclaration) for rule in self._rules(i, ports, parameters)
        ]
        if not any(isinstance(i, ast.PathsDeclaration) for i in body):
            self._error(declaration.name_span, f"'{declaration.name}' does not declare its light paths")
        return Operator(
            name=declaration.name,
            family=folder.parent.name,
            folder=str(folder),
            doc=declaration.doc,
            ports=ports,
            output=declaration.output,
            pulled=declaration.output in pulled,
            parameters=parameters,
            paths=tuple(rules),
            bias=sum(self._number(i.bound, "ratio") for i in body if isinstance(i, ast.BiasDeclaration)),
            converter=Converter(self._number(converter.cost, "number"), converter.loss) if converter else None,
            recursion=recursion.kind if recursion else None,
            depth_parameter=self._depth_parameter(recursion, parameters),
            equal=self._equal(body, ports),
            prepares=any(p.complete for p in ports) or any(isinstance(i, ast.PrepareDeclaration) for i in body),
            cached=any(isinstance(i, ast.PrepareDeclaration) and i.cached for i in body),
            for_view=any(isinstance(i, ast.PrepareDeclaration) and i.for_view for i in body),
            overloads=overloads.name if overloads else None,
            scale_parameter=self._scale_parameter(body, parameters),
            span=declaration.name_span,
        )

    def _depth_parameter(
        self, recursion: ast.RecursionDeclaration | None, parameters: tuple[Parameter, ...]
    ) -> str | None:
        if recursion is None or recursion.bound is None:
            return None
        if not any(p.name == recursion.bound and p.type == "count" for p in parameters):
            self._error(recursion.span, f"'{recursion.bound}' is no count parameter of this operator")
        return recursion.bound

    def _scale_parameter(self, body: tuple[ast.OperatorItem, ...], parameters: tuple[Parameter, ...]) -> str | None:
        item = next((i for i in body if isinstance(i, ast.ScalesDeclaration)), None)
        if item is None:
            return None
        if not any(p.name == item.parameter and p.type in ("number", "ratio") for p in parameters):
            self._error(item.span, f"'{item.parameter}' is no number or ratio of this operator")
        return item.parameter

    def _equal(self, body: tuple[ast.OperatorItem, ...], ports: tuple[Port, ...]) -> tuple[str, ...]:
        names: list[str] = []
        for item in body:
            if isinstance(item, ast.EqualDeclaration):
                names += item.ports
                unknown = [name for name in item.ports if name not in {p.name for p in ports}]
                if unknown:
                    self._error(item.span, f"'{unknown[0]}' is no port of this operator")
        return tuple(names)

    def _parameter(self, item: ast.ParameterDeclaration) -> Parameter:
        if item.type not in PARAMETER_TYPES:
            self._error(item.span, f"'{item.type}' is no parameter type ({', '.join(PARAMETER_TYPES)})")
        bounds_type = "count" if item.type == "path" else item.type
        low = high = None
        if item.low and item.high:
            if bounds_type in UNITS:
                low, high = self._number(item.low, bounds_type), self._number(item.high, bounds_type)
            else:
                self._error(item.span, f"a {item.type} has no range")
        default, text = self._default(item)
        return Parameter(item.name, item.type, item.choices, default, low, high, item.doc, text, item.span)

    def _default(self, item: ast.ParameterDeclaration) -> tuple[Scalar | ast.PathExpression | None, str]:
        match item.type, item.default:
            case _, None:
                return None, ""
            case kind, ast.NumberValue(text) if kind in UNITS:
                return self._number(ast.NumberValue(text, item.span), kind), text
            case "flag", ast.FlagValue(value):
                return value, str(value).lower()
            case "choice", ast.NameValue(name) if name in item.choices:
                return name, name
            case "text", ast.TextValue(text):
                return text, text
            case "path", ast.PathLiteral(path):
                return path, path.span.text
            case "path", ast.NameValue(name) if set(name) <= set("DGS"):
                events: list[ast.PathExpression] = [ast.PathEvents(c, None, item.span) for c in name]
                return (ast.PathConcat(tuple(events), item.span) if len(events) > 1 else events[0]), name
        self._error(item.span, f"the default of '{item.name}' is not a {item.type}")
        return None, ""

    def _number(self, value: ast.NumberValue, type: str) -> float:
        try:
            return number(value.text, type)
        except ValueFault as fault:
            self._error(value.span, str(fault))
            return 0

    # --- paths CONTENT = ... ------------------------------------------------------------------------------------------

    def _rules(
        self, item: ast.PathsDeclaration, ports: tuple[Port, ...], parameters: tuple[Parameter, ...]
    ) -> list[PathRule]:
        """One rule per alternative: a port (or a letter L) at the front, then letters and path parameters."""
        if item.content not in (*CONTENTS, "unchanged"):
            self._error(item.span, f"'{item.content}' is no angular content ({', '.join(CONTENTS)} or unchanged)")
            return []
        names = {p.name for p in ports}
        rules: list[PathRule] = []
        for path in item.path.items if isinstance(item.path, ast.PathUnion) else (item.path,):
            items = path.items if isinstance(path, ast.PathConcat) else (path,)
            head, rest = items[0], items[1:]
            tail: ast.PathExpression | None = None
            if rest:
                tail = ast.PathConcat(rest, item.span) if len(rest) > 1 else rest[0]
            if isinstance(head, ast.PathName) and head.name in names and not head.negated:
                rules.append(PathRule(item.content, head.name, head.tag.name if head.tag else None, tail))
            elif isinstance(head, ast.PathEvents) and head.letters == "L":
                rules.append(PathRule(item.content, None, head.tag.name if head.tag else None, tail))
            else:
                self._error(path.span, "light paths begin with a port or with L")
                continue
            self._check_tail(tail, parameters)
            tags = {p.name for p in parameters if p.type == "tags"}
            emitter = rules[-1].emitter
            if emitter is not None and emitter not in (*EMITTERS, *tags):
                self._error(path.span, f"'@{emitter}' is neither area nor delta nor a tags parameter")
        return rules

    def _check_tail(self, tail: ast.PathExpression | None, parameters: tuple[Parameter, ...]) -> None:
        kinds = {p.name: p.type for p in parameters}

        def walk(path: ast.PathExpression) -> None:
            match path:
                case ast.PathName(name, tag, negated=negated):
                    if negated or kinds.get(name) != "path" or (tag and kinds.get(tag.name) != "tags"):
                        self._error(path.span, f"'{path.span.text}' is no path parameter of this operator")
                case ast.PathConcat(items) | ast.PathUnion(items):
                    for part in items:
                        walk(part)
                case ast.PathRepeat(part):
                    walk(part)
                case ast.PathEvents(_, tag) if tag is not None and (tag.negated or kinds.get(tag.name) != "tags"):
                    self._error(path.span, f"'@{tag.name}' is no tags parameter of this operator")
                case ast.PathTagged():
                    self._error(path.span, "a declaration tags letters and path parameters: (D@from)+, via@from")

        if tail is not None:
            walk(tail)

    def _error(self, span: Span, message: str) -> None:
        self.reporter.error("LN0112", span, message)
