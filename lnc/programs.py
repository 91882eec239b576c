"""`lnc compile` and `lnc run`: from a network's file to a program."""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from lnc.build import BuildError, BuildOptions, build_program, program_path
from lnc.cli import FINE, USAGE, WRONG, fail, report
from lnc.diagnostics import Reporter
from lnc.driver import (
    STAGES,
    Result,
    Unreadable,
    compile_file,
    describe_baked,
    describe_conditions,
    describe_paths,
    describe_seen,
    describe_wires,
    read_source,
    write_text,
)
from lnc.locations import library_folders

if TYPE_CHECKING:
    from lnc.codegen.view import SceneLetters


def compile_command(arguments: argparse.Namespace) -> int:
    """`lnc compile FILE -o PROGRAM`."""
    if arguments.reference is not None:
        if arguments.scene is not None:
            return fail("--scene is for networks; the reference tracer works on every scene")
        return _compile_reference(arguments)
    if arguments.file is None:
        return fail("compile needs a network: lnc compile FILE -o PROGRAM")
    unknown = [stage for stage in arguments.dump_after if stage not in STAGES]
    if unknown:
        return fail(f"no stage is called {unknown[0]}; there are: {', '.join(STAGES)}")
    if arguments.output is None and arguments.emit_cpp is None and not arguments.dump_after:
        return fail("compile needs the program's name: -o PROGRAM")

    result, status = _read(arguments)
    if result is None or status != FINE:
        return status
    scene = None
    if arguments.scene is not None:
        try:
            scene = _letters_of(arguments.scene, result, arguments)
        except (BuildError, Unreadable) as error:
            return fail(str(error))
    return _finish(write_cpp(result, scene), arguments)


def _letters_of(scene: str, result: Result, arguments: argparse.Namespace) -> SceneLetters:
    """What light paths find in a scene: the network's program knows, for any scene. Raises BuildError, Unreadable."""
    from lnc.codegen.view import SceneLetters

    assert result.typed is not None
    cpp = write_cpp(result)
    program = program_path(Path(f"{hashlib.sha256(cpp.encode()).hexdigest()[:16]}/letters"))
    build_program(cpp, library_folders(tuple(arguments.ops)), program, _options(arguments))
    done = subprocess.run(
        [str(program), scene, "--print-letters"], capture_output=True, text=True, errors="replace", check=False
    )
    if done.returncode != FINE:
        reason = (done.stderr.strip().splitlines() or ["it cannot be loaded"])[-1]
        raise Unreadable(f"--scene: {reason.removeprefix('letters: error: ')}")
    kinds = [int(kind) for kind in done.stdout.split()]
    count = result.typed.alphabet.combinations
    return SceneLetters(Path(scene).name, sum(kind << (i * count) for i, kind in enumerate(kinds)))


def _compile_reference(arguments: argparse.Namespace) -> int:
    """`lnc compile [FILE] --reference EXPR -o PROGRAM`: FILE's tags, no network."""
    from lnc.codegen.languages import reference_view
    from lnc.codegen.write import write_reference
    from lnc.reference import read_reference
    from lnc.syntax.parse import parse

    if arguments.dump_after:
        return fail("--dump-after shows stages of a network; --reference has none")
    if arguments.output is None and arguments.emit_cpp is None:
        return fail("compile needs the program's name: -o PROGRAM")
    reporter = Reporter()
    network = None
    if arguments.file is not None:
        try:
            network = parse(read_source(arguments.file), reporter)
        except Unreadable as error:
            return fail(str(error))
        if reporter.failed:
            report(reporter.sorted())
            return WRONG
    reference = read_reference(arguments.reference, network, reporter)
    report(reporter.sorted())
    if reference is None:
        return USAGE
    if reference.lost is not None:
        message = "no particle and no eye path finds such light from a delta emitter; it is missing in the picture"
        print(f"lnc: warning: {reference.lost}: {message}", file=sys.stderr)
    return _finish(write_reference(reference_view(reference)), arguments)


def _finish(cpp: str, arguments: argparse.Namespace) -> int:
    """Write the C++ text and the program, where they are wanted."""
    try:
        if arguments.emit_cpp is not None:
            write_text(arguments.emit_cpp, cpp)
    except Unreadable as error:
        return fail(str(error))
    if arguments.output is None:
        return FINE
    return _build(cpp, arguments, Path(arguments.output).absolute())


def run_command(arguments: argparse.Namespace) -> int:
    """`lnc run FILE SCENE [program options]`: becomes the program, unless that cannot be made."""
    result, status = _read(arguments)
    if result is None or status != FINE or result.schedule is None:
        return status
    cpp = write_cpp(result)
    name = f"{hashlib.sha256(cpp.encode()).hexdigest()[:16]}/{result.schedule.network}"
    try:
        program = program_path(Path(name))
    except BuildError as error:
        return fail(str(error))
    status = _build(cpp, arguments, program)
    if status == FINE:
        sys.stdout.flush()
        os.execv(program, [str(program), arguments.scene, *arguments.rest])
    return status


def write_cpp(result: Result, scene: SceneLetters | None = None) -> str:
    """The C++ text of a network that has passed; for one scene only, if it is given."""
    from lnc.codegen.view import LightView, program_view
    from lnc.codegen.write import write_program

    assert result.schedule is not None and result.typed is not None
    paths = describe_paths(result.typed)
    source = result.file.span.source.text
    light = LightView(
        image_paths=paths.image or "",
        seen_paths=describe_seen(result.typed),
        baked_paths=describe_baked(result.typed),
        counts=describe_wires(result.typed),
        conditions=describe_conditions(result),
        alphabet=result.typed.alphabet,
        scene=scene,
    )
    return write_program(program_view(result.schedule, source, light))


def _read(arguments: argparse.Namespace) -> tuple[Result | None, int]:
    """The network, with its diagnostics printed, and the exit status so far."""
    wanted = getattr(arguments, "dump_after", [])

    def dump(stage: str, text: str) -> None:
        if stage in wanted:
            print(text, end="" if text.endswith("\n") else "\n")

    try:
        result = compile_file(arguments.file, tuple(arguments.ops), dump if wanted else None)
    except Unreadable as error:
        return None, fail(str(error))
    report(result.diagnostics)
    if result.failed or result.schedule is None:
        return result, WRONG
    return result, FINE


def _build(cpp: str, arguments: argparse.Namespace, output: Path) -> int:
    try:
        build_program(cpp, library_folders(tuple(arguments.ops)), output, _options(arguments))
    except BuildError as error:
        print(f"lnc: {error}", file=sys.stderr)
        return USAGE
    return FINE


def _options(arguments: argparse.Namespace) -> BuildOptions:
    return BuildOptions(portable=getattr(arguments, "portable", False))
