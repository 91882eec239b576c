"""The spine: the rooms that a network walks through, in order.

parse -> expand_macros -> resolve -> typecheck -> insert_converters -> narrow_converters -> check_cycles -> contents
      -> schedule -> check_paths     (-> light_paths, for explain and graph)                (-> codegen, build)
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lnc.diagnostics import Diagnostic, InternalError, Related, Reporter
from lnc.library import Library, with_unknown_sources
from lnc.library_reader import load_library
from lnc.network import PathReport, Schedule, TypedNetwork
from lnc.passes.check_cycles import check_cycles
from lnc.passes.check_paths import check_paths
from lnc.passes.contents import contents
from lnc.passes.expand_macros import Expanded, expand_macros
from lnc.passes.insert_converters import insert_converters
from lnc.passes.narrow_converters import narrow_converters
from lnc.passes.resolve import resolve
from lnc.passes.schedule import print_schedule, schedule
from lnc.passes.sound_part import sound_part
from lnc.passes.typecheck import typecheck
from lnc.paths.weighted import CountTable
from lnc.source import SourceFile, Span
from lnc.syntax import ast
from lnc.syntax.parse import parse

if TYPE_CHECKING:
    from lnc.passes.conditions import Formula

SIZE_LIMIT = 256 * 1024
LIGHT_PATH_CODES = "LN03"  # from here on a macro's mistakes depend on what it is given
STAGES = ("parse", "expand_macros", "insert_converters", "schedule")

Dump = Callable[[str, str], None]
"""Called with the name of a stage and its result as text."""


class Unreadable(Exception):
    """A file that cannot be read as a network; the text says why."""


@dataclass(frozen=True)
class Result:
    """How far a network came: each stage is None if an earlier one found an error."""

    file: ast.File
    typed: TypedNetwork | None
    contents: dict[str, tuple[str, ...]]
    schedule: Schedule | None
    diagnostics: list[Diagnostic]

    @property
    def failed(self) -> bool:
        return any(d.severity == "error" for d in self.diagnostics)


def read_source(path: str) -> SourceFile:
    """A network's text. Raises Unreadable."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(SIZE_LIMIT + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a valid path"
        raise Unreadable(f"{path}: cannot be read: {reason}") from error
    if len(content) > SIZE_LIMIT:
        raise Unreadable(f"{path}: is larger than {SIZE_LIMIT // 1024} KB, which no network is")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise Unreadable(f"{path}: is not UTF-8 text (line {line})") from error
    return SourceFile(path, text.replace("\r\n", "\n"))


def write_text(path: str, text: str) -> None:
    """Write a whole file or nothing: to a temporary name, then renamed. Raises Unreadable.

    What exists and is no regular file (a pipe, a terminal, `/dev/stdout`) cannot be replaced and is written into.
    """
    target = Path(path)
    temporary: Path | None = None
    try:
        if target.exists() and not target.is_file():
            target.write_text(text, "utf-8", newline="\n")
            return
        target = Path(os.path.realpath(target))  # a link stays one
        temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
        temporary.write_text(text, "utf-8", newline="\n")
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        os.replace(temporary, target)
    except (OSError, ValueError) as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise Unreadable(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from error


def compile_network(
    source: SourceFile, library: Library, dump: Dump | None = None, exact: bool = False, macros: bool = False
) -> Result:
    """All passes over one text. After an error they go on with the part of the network that it does not reach.

    `macros`: the text may be one for `use`, of macros alone, which are not called here.
    """
    reporter = Reporter()
    file = parse(source, reporter)
    _dump_text(dump, "parse", file)
    expanded = expand_macros(file, library, _read_used, reporter)
    if macros and file.statements and all(isinstance(s, ast.Macro | ast.Use) for s in file.statements):
        return Result(file, None, {}, None, _all_diagnostics(reporter, expanded, library))
    file = expanded.file
    _dump_text(dump, "expand_macros", file)
    typed = _typed(expanded, _default_name(source.name), library, reporter)
    well_typed = not reporter.failed
    found = contents(typed.network, reporter)
    plan = None if reporter.failed else schedule(typed.network, found)
    check_paths(_sound(typed, expanded, reporter), reporter, exact, complete=plan is not None)
    if dump is not None and plan is not None:
        from lnc.syntax.explicit import explicit

        dump("insert_converters", explicit(file, typed.network))
        dump("schedule", print_schedule(plan))
    diagnostics = _all_diagnostics(reporter, expanded, library)
    if not well_typed:
        return Result(file, None, {}, None, diagnostics)
    return Result(file, typed, found, plan, diagnostics)


def _typed(expanded: Expanded, name: str, library: Library, reporter: Reporter, body: bool = False) -> TypedNetwork:
    """Names, types, converters and cycles of a file, or of a macro's body: the part that is right."""
    file = expanded.file
    network = resolve(file, name, library, reporter, expanded.broken | file.broken, body)
    typed = typecheck(sound_part(network, expanded, reporter), reporter)
    typed = insert_converters(_sound(typed, expanded, reporter), library, reporter)
    _check_inserted(typed, reporter)
    typed = narrow_converters(_sound(typed, expanded, reporter))
    check_cycles(typed.network, reporter)
    return _sound(typed, expanded, reporter)


def _sound(typed: TypedNetwork, expanded: Expanded, reporter: Reporter) -> TypedNetwork:
    return replace(typed, network=sound_part(typed.network, expanded, reporter))


def _all_diagnostics(reporter: Reporter, expanded: Expanded, library: Library) -> list[Diagnostic]:
    """Also those of macros that nothing calls, but for light paths, which depend on what a macro is given."""
    found = Reporter(_with_calls(reporter.sorted(), expanded.calls))
    library = with_unknown_sources(library) if expanded.bodies else library
    for body in expanded.bodies:
        own = Reporter(list(body.diagnostics))
        _typed(body, "", library, own, body=True)
        for diagnostic in _with_calls(own.sorted(), body.calls):
            found.add(diagnostic)
    return found.sorted()


def describe_paths(typed: TypedNetwork) -> PathReport:
    """The light paths of a network that has passed."""
    from lnc.passes.light_paths import light_paths

    return light_paths(typed.network, typed.alphabet)


def describe_seen(typed: TypedNetwork) -> dict[str, str]:
    """The light paths that the eye sees of each wire with a picture of its own."""
    from lnc.passes.light_paths import seen_paths

    return seen_paths(typed.network, typed.alphabet)


def describe_baked(typed: TypedNetwork) -> dict[str, str]:
    """The light paths that lightmaps show of each of their wires."""
    from lnc.passes.light_paths import baked_paths

    return baked_paths(typed.network, typed.alphabet)


def describe_conditions(result: Result) -> dict[str, Formula]:
    """What a scene must have for operators to carry light, where that is worth a test."""
    from lnc.passes.conditions import light_conditions, skip_conditions

    assert result.typed is not None and result.schedule is not None
    alphabet = result.typed.alphabet
    return skip_conditions(result.schedule, light_conditions(result.typed.network, alphabet), alphabet)


def describe_wires(typed: TypedNetwork) -> dict[str, CountTable | None]:
    """How often the eye sees each path by a wire that brings light to surfaces."""
    from lnc.passes.light_paths import wire_counts

    return wire_counts(typed.network, typed.alphabet)


def compile_file(path: str, ops: tuple[str, ...] = (), dump: Dump | None = None) -> Result:
    """Read and compile a network. Raises Unreadable; faults in the library come first among the diagnostics."""
    source = read_source(path)
    library, faults = load_library(ops)
    if faults:
        return Result(ast.File((), (), frozenset(), faults[0].span), None, {}, None, faults)
    return compile_network(source, library, dump)


def _check_inserted(typed: TypedNetwork, reporter: Reporter) -> None:
    """After insertion every port gets its own representation."""
    if reporter.failed:
        return
    for node in typed.network.nodes:
        for given in node.inputs:
            for term in given.terms:
                if typed.representations[term.node] != given.port.representation:
                    raise InternalError(f"{node.name}.{given.port.name} reads {term.node} of another representation")


def _read_used(name: str, source: SourceFile) -> SourceFile:
    """The file of a `use`, relative to the file it stands in. Opening a pipe or a device might wait for ever."""
    path = Path(source.name).parent / name
    try:
        if path.exists() and not path.is_file():
            raise OSError("is not a regular file")
        return read_source(str(path))
    except Unreadable as error:
        raise OSError(str(error)) from error


def _with_calls(diagnostics: list[Diagnostic], calls: dict[Span, Span]) -> list[Diagnostic]:
    """A mistake inside a macro is also shown where the macro is called, and the macro that calls it, and so on.

    Of a macro that is called several times, what is wrong whatever it is given is shown for its first call.
    """
    shown: list[Diagnostic] = []
    known: set[tuple[str, str]] = set()
    for diagnostic in diagnostics:
        trail: list[Related] = []
        place: Span | None = diagnostic.span if diagnostic.code != "LN0101" else None
        while place is not None:
            place = next((call for macro, call in calls.items() if macro.holds(place)), None)
            if place is not None:
                trail.append(Related(place, "in this call of the macro"))
        mistake = (diagnostic.code, str(diagnostic.span))
        if trail and mistake in known:
            continue
        if diagnostic.code < LIGHT_PATH_CODES:
            known.add(mistake)
        shown.append(replace(diagnostic, related=(*diagnostic.related, *trail)))
    return shown


def _dump_text(dump: Dump | None, stage: str, file: ast.File) -> None:
    if dump is not None:
        from lnc.syntax.printer import print_file

        dump(stage, print_file(file))


def _default_name(path: str) -> str:
    """The file's name as an identifier."""
    stem = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in Path(path).stem)
    return stem if stem and not stem[0].isdigit() else f"network_{stem}"
