"""What tests share: compiled networks, runs of them, and the runtime's own tests and tools."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from lnc.library import Library
from lnc.library_reader import load_library

ROOT = Path(__file__).resolve().parent
SCENES = ROOT / "examples" / "scenes"
FEW = 4  # tests that build what they need by themselves; more of them have everything built at once


@dataclass(frozen=True)
class Run:
    """A finished run of a program."""

    status: int
    stdout: str
    stderr: str
    picture: Path
    stats: dict


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write what was found into the cases")


def pytest_configure() -> None:
    """A shell's background job ignores interrupts, and so would all programs that the tests start and interrupt."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def update_golden(pytestconfig: pytest.Config) -> bool:
    return bool(pytestconfig.getoption("--update-golden"))


@pytest.fixture(scope="session")
def library() -> Library:
    """The built-in operators."""
    found, faults = load_library()
    assert not faults, faults
    return found


@pytest.fixture(scope="session")
def compiled_network(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """compiled_network("direct"): the program of examples/direct.ln; or of a network given as text=..."""
    folder = tmp_path_factory.mktemp("networks")

    @cache
    def compiled(name: str, text: str | None = None, ops: Path | None = None) -> Path:
        source = ROOT / "examples" / f"{name}.ln"
        if text is not None:
            source = folder / f"{name}.ln"
            source.write_text(text)
        program = folder / name
        command = [sys.executable, "-m", "lnc", "compile", str(source), "-o", str(program)]
        if ops is not None:
            command += ["--ops", str(ops)]
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return program

    return compiled


@pytest.fixture
def run_program(tmp_path: Path) -> Callable[..., Run]:
    """run_program(program, scene, "--samples", "4"): runs it and reads its statistics."""

    def run(program: Path, scene: Path | str, *options: str, timeout: float = 300) -> Run:
        picture = tmp_path / "out.exr"
        stats = tmp_path / "stats.json"
        stats.unlink(missing_ok=True)
        command = [str(program), str(scene), "-o", str(picture), "--stats", str(stats), "--progress", "none", *options]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=timeout, check=False)
        found = json.loads(stats.read_text()) if stats.exists() else {}
        return Run(done.returncode, done.stdout, done.stderr, picture, found)

    return run


@pytest.fixture
def kept_wire(compiled_network: Callable[..., Path], run_program: Callable[..., Run]) -> Callable[..., None]:
    """kept_wire(name, text, change, rays): a network with a cache makes the same picture from it, without a ray of this
    kind; but not after `--set change`."""

    def check(name: str, text: str, change: str, rays: str = "shadow") -> None:
        program, scene = compiled_network(name, text=text), SCENES / "cornell_box.gltf"
        size = ("--size", "6x4", "--samples", "2")
        first = run_program(program, scene, *size)
        picture = first.picture.read_bytes()
        again = run_program(program, scene, *size)
        assert first.status == again.status == 0, first.stderr + again.stderr
        assert again.picture.read_bytes() == picture
        assert first.stats["rays"][rays] > 1000 and again.stats["rays"][rays] == 0
        assert "cache" not in first.stderr + again.stderr
        other = run_program(program, scene, *size, "--set", change)
        assert "made by another network, or with other parameters" in other.stderr

    return check


@pytest.fixture(scope="session")
def runtime_build() -> Path:
    """The runtime's build folder, configured with unit tests and tools."""
    from lnc.build import BuildOptions, build_runtime

    folder = build_runtime(BuildOptions(), quiet=True).folder
    done = subprocess.run(
        ["cmake", "-S", str(ROOT), "-B", str(folder), "-DLN_TESTS=ON"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="session")
def runtime_tool(runtime_build: Path, request: pytest.FixtureRequest) -> Callable[[str], Path]:
    """runtime_tool("ln_scene_info"): a developer tool or unit test of the runtime, built."""
    jobs = str(len(os.sched_getaffinity(0)))

    def build(*options: str) -> subprocess.CompletedProcess[str]:
        command = ["cmake", "--build", str(runtime_build), "-j", jobs, *options]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    if sum("runtime_tool" in getattr(item, "fixturenames", ()) for item in request.session.items) > FEW:
        build("--", *(("-k", "0") if (runtime_build / "build.ninja").exists() else ("-k",)))  # on all processors

    @cache
    def tool(name: str) -> Path:
        done = build("--target", name)
        assert done.returncode == 0, done.stdout + done.stderr
        return runtime_build / name

    return tool


@pytest.fixture(scope="session")
def unit_test(runtime_tool: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[..., None]:
    """unit_test("test_quad_tree"): its C++ tests pass; they run once a session. Options of doctest pick some."""

    @cache
    def run(name: str, *options: str) -> subprocess.CompletedProcess[str]:
        folder = tmp_path_factory.mktemp(name)
        return subprocess.run(
            [runtime_tool(name), *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            cwd=folder,
            env={**os.environ, "TMPDIR": str(folder)},
            timeout=900,
            check=False,
        )

    def check(name: str, *options: str) -> None:
        done = run(name, *options)
        assert done.returncode == 0 and "| 0 passed" not in done.stdout, done.stdout[-20_000:]

    return check


COMPILES = {"compiled_network", "runtime_build"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test is marked `program` if one of its fixtures compiles C++."""
    for item in items:
        if COMPILES.intersection(getattr(item, "fixturenames", ())):
            item.add_marker("program")
