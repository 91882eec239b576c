"""The command line: arguments, files and exit status. Everything else is elsewhere, and imported when it is needed."""

from __future__ import annotations

import argparse
import gc
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import lnc

if TYPE_CHECKING:
    from lnc.diagnostics import Diagnostic
    from lnc.driver import Result
    from lnc.scene_tags import SceneNames

FINE, WRONG, USAGE = 0, 1, 2


def main(argv: list[str] | None = None) -> int:
    """Run one command. 0: fine (warnings too), 1: the network is wrong, 2: wrong usage or an unreadable file."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    arguments, rest = _parser().parse_known_args(argv)
    if rest and arguments.command != "run":
        return fail(f"unknown argument {rest[0]!r}; lnc {arguments.command} --help lists what there is")
    arguments.rest = rest
    for folder in getattr(arguments, "ops", ()):
        if not Path(folder).is_dir():
            return fail(f"--ops {folder}: is not a folder")
    gc.disable()  # passes leave hardly any cycles, and the search for them takes a tenth of the time
    try:
        status: int = arguments.run(arguments)
        sys.stdout.flush()
        return status
    except BrokenPipeError:  # the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FINE
    except KeyboardInterrupt:
        return 130
    finally:
        gc.enable()


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"lnc: {message}", file=sys.stderr)
        raise SystemExit(USAGE)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="lnc", description="The compiler of lighting networks.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"lnc {lnc.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    check = commands.add_parser("check", help="report what is wrong in networks", allow_abbrev=False)
    check.add_argument("files", nargs="+", metavar="FILE")
    check.add_argument("--format", choices=("human", "json", "sarif", "github"), default="human")
    check.add_argument("--scene", metavar="SCENE", help="a glTF file: are there tags that match nothing in it?")
    check.add_argument("--exact", action="store_true", help="decide about light paths in rational numbers")
    check.set_defaults(run=_check)

    explain = commands.add_parser(
        "explain", help="wires, light paths and schedule; or a code's page", allow_abbrev=False
    )
    explain.add_argument("what", metavar="FILE|CODE")
    explain.add_argument("--format", choices=("human", "json"), default="human")
    explain.set_defaults(run=_explain)

    fmt = commands.add_parser("fmt", help="rewrite networks in the canonical layout", allow_abbrev=False)
    fmt.add_argument("files", nargs="+", metavar="FILE")
    fmt.add_argument("--check", action="store_true", help="change nothing; exit status 1 if a file would change")
    fmt.add_argument("--explicit", action="store_true", help="print with inserted converters written out")
    fmt.set_defaults(run=_fmt)

    build = commands.add_parser("compile", help="make a program", allow_abbrev=False)
    build.add_argument("file", nargs="?", metavar="FILE")
    build.add_argument("-o", dest="output", metavar="PROGRAM")
    build.add_argument("--emit-cpp", metavar="FILE", help="also write the C++ text")
    build.add_argument("--scene", metavar="SCENE", help="for this scene alone, and those that have no more")
    build.add_argument(
        "--reference", metavar="EXPR", help="make the plain reference tracer of these light paths; FILE defines tags"
    )
    build.add_argument("--portable", action="store_true", help="code for any x86-64 processor instead of this one")
    build.add_argument("--dump-after", action="append", default=[], metavar="STAGE")
    build.set_defaults(run=_compile)

    run = commands.add_parser("run", help="compile into the cache and render SCENE", allow_abbrev=False)
    run.add_argument("file", metavar="FILE")
    run.add_argument("scene", metavar="SCENE")
    run.set_defaults(run=_run)

    graph = commands.add_parser("graph", help="draw a network", allow_abbrev=False)
    graph.add_argument("file", metavar="FILE")
    graph.add_argument("-o", dest="output", metavar="FILE.svg", required=True)
    graph.set_defaults(run=_graph)

    ops = commands.add_parser("ops", help="list the operators, or describe one", allow_abbrev=False)
    ops.add_argument("name", nargs="?", metavar="NAME")
    ops.set_defaults(run=_ops)

    doctor = commands.add_parser("doctor", help="check that everything that lnc needs is there", allow_abbrev=False)
    doctor.set_defaults(run=_doctor)

    for command in (check, explain, fmt, build, run, graph, ops, doctor):
        command.add_argument("--ops", action="append", default=[], metavar="DIR", help="a folder of further operators")
    return parser


def fail(message: str) -> int:
    from lnc.diagnostics.format import printable

    print(f"lnc: {printable(message)}", file=sys.stderr)
    return USAGE


def report(diagnostics: list[Diagnostic]) -> None:
    """Diagnostics for people, on stderr."""
    from lnc.diagnostics.format import human

    for diagnostic in diagnostics:
        print(human(diagnostic), file=sys.stderr)


def compile_or_report(path: str, ops: list[str]) -> tuple[Result | None, int]:
    """A compiled network whose diagnostics have been printed, and the exit status so far."""
    from lnc.driver import Unreadable, compile_file

    try:
        result = compile_file(path, tuple(ops))
    except Unreadable as error:
        return None, fail(str(error))
    report(result.diagnostics)
    return result, WRONG if result.failed else FINE


def _check(arguments: argparse.Namespace) -> int:
    from lnc.diagnostics import Reporter, unreadable
    from lnc.driver import Unreadable, compile_network, read_source
    from lnc.library_reader import load_library

    status = FINE
    found: list[Diagnostic] = []
    names: SceneNames | None = None
    if arguments.scene is not None:
        from lnc.scene_tags import UnreadableScene, check_tags, read_scene_names

        try:
            names = read_scene_names(arguments.scene)
        except UnreadableScene as error:
            return fail(str(error))
    library, faults = load_library(tuple(arguments.ops))
    if faults:
        _print_found(faults, arguments.format, 0)
        return WRONG
    for path in arguments.files:
        try:
            result = compile_network(read_source(path), library, exact=arguments.exact, macros=True)
        except Unreadable as error:
            status = USAGE
            found.append(unreadable(path, str(error)))
            continue
        reporter = Reporter(list(result.diagnostics))
        if names is not None:
            check_tags(result.file, names, arguments.scene, reporter)
        status = max(status, WRONG if reporter.failed else FINE)
        found += [d for d in reporter.sorted() if d not in found]
    _print_found(found, arguments.format, len(arguments.files))
    return status


def _print_found(found: list[Diagnostic], format: str, files: int) -> None:
    """Diagnostics for people go to stderr, for programs to stdout."""
    from lnc.diagnostics.format import as_github, as_json

    match format:
        case "json":
            import json

            print(json.dumps([as_json(d) for d in found], indent=2))
        case "sarif":
            import json

            from lnc.diagnostics.sarif import as_sarif

            print(json.dumps(as_sarif(found), indent=2))
        case "github":
            for diagnostic in found:
                print(as_github(diagnostic))
            _print_summary(found, files)
        case _:
            report(found)
            _print_summary(found, files)


def _print_summary(found: list[Diagnostic], files: int) -> None:
    errors = sum(d.severity == "error" for d in found)
    warnings = len(found) - errors
    counts = [f"{n} {word}{'s' if n != 1 else ''}" for n, word in ((errors, "error"), (warnings, "warning")) if n]
    print(f"{files} network{'s' if files != 1 else ''} checked: {', '.join(counts) or 'all fine'}")


def _explain(arguments: argparse.Namespace) -> int:
    from lnc.diagnostics.codes import page

    found = page(arguments.what)
    if found is not None:
        from lnc.explain import print_page

        print(print_page(found), end="")
        return FINE
    if arguments.what[:2].upper() == "LN" and arguments.what[2:].isdigit():
        return fail(f"no code is called {arguments.what}")
    result, status = compile_or_report(arguments.what, arguments.ops)
    if result is None or result.typed is None or result.schedule is None:
        return status
    from lnc.explain import explain_json, explain_text

    if arguments.format == "json":
        import json

        print(json.dumps(explain_json(result), indent=2))
    else:
        print(explain_text(result), end="")
    return status


def _fmt(arguments: argparse.Namespace) -> int:
    from lnc.diagnostics import Reporter
    from lnc.driver import Unreadable, read_source, write_text
    from lnc.syntax.parse import parse
    from lnc.syntax.printer import print_file

    status = FINE
    for path in arguments.files:
        if arguments.explicit:
            status = max(status, _fmt_explicit(path, arguments))
            continue
        try:
            source = read_source(path)
            reporter = Reporter()
            file = parse(source, reporter)
            report(reporter.sorted())
            if reporter.failed:
                status = max(status, WRONG)
                continue
            text = print_file(file)
            if text == source.text:
                continue
            if arguments.check:
                print(f"{path}: would change")
                status = max(status, WRONG)
            else:
                write_text(path, text)
        except Unreadable as error:
            status = fail(str(error))
    return status


def _fmt_explicit(path: str, arguments: argparse.Namespace) -> int:
    """Explicit text goes to stdout: it is another network, not another layout."""
    from lnc.syntax.explicit import explicit

    result, status = compile_or_report(path, arguments.ops)
    if result is None or result.typed is None:
        return status
    text = explicit(result.file, result.typed.network)
    if not arguments.check:
        print(text, end="")
        return status
    if text != result.file.span.source.text:
        print(f"{path}: would change")
        return WRONG
    return status


def _compile(arguments: argparse.Namespace) -> int:
    from lnc.programs import compile_command

    return int(compile_command(arguments))


def _run(arguments: argparse.Namespace) -> int:
    from lnc.programs import run_command

    return int(run_command(arguments))


def _graph(arguments: argparse.Namespace) -> int:
    from lnc.driver import Unreadable, write_text

    if not arguments.output.lower().endswith(".svg"):
        return fail("a graph is written as .svg")
    result, status = compile_or_report(arguments.file, arguments.ops)
    if result is None or result.typed is None or result.schedule is None:
        return status
    from lnc.drawing import draw

    try:
        write_text(arguments.output, draw(result))
    except Unreadable as error:
        return fail(str(error))
    return status


def _ops(arguments: argparse.Namespace) -> int:
    from lnc.diagnostics import did_you_mean
    from lnc.explain import describe_operator, list_operators
    from lnc.library_reader import load_library

    library, faults = load_library(tuple(arguments.ops))
    report(faults)
    if arguments.name is None:
        print(list_operators(library), end="")
    elif arguments.name in library.operators:
        print(describe_operator(library.operators[arguments.name]), end="")
    elif arguments.name in library.representations:
        print(f"representation {arguments.name}\n\n{library.representations[arguments.name].doc}")
    else:
        help = did_you_mean(arguments.name, [*library.operators, *library.representations])
        return fail(f"no operator is called {arguments.name}" + (f": {help}" if help else ""))
    return WRONG if faults else FINE


def _doctor(arguments: argparse.Namespace) -> int:
    from lnc.doctor import doctor

    text, fine = doctor(tuple(arguments.ops))
    print(text, end="")
    return FINE if fine else WRONG


if __name__ == "__main__":
    sys.exit(main())
