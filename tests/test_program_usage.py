"""Wrong use of a compiled program: one clear line, the right exit status, and no file that was not there before."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parent.parent / "examples" / "scenes"
BOX = SCENES / "cornell_box.gltf"


@pytest.fixture
def program(compiled_network: Callable[..., Path]) -> Path:
    return compiled_network("direct")


@pytest.fixture
def photon_program(compiled_network: Callable[..., Path]) -> Path:
    return compiled_network("photon_density")


def run(program: Path, folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [str(program), *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


def assert_refused(done: subprocess.CompletedProcess[str], program: Path, status: int, *parts: str) -> None:
    assert done.returncode == status, done.stderr
    assert done.stdout == ""
    lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith(f"{program.name}: error: ")
    for part in parts:
        assert part in lines[0]


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ([], ["no scene given"]),
        ([""], ["SCENE"]),
        (["s.gltf", "t.gltf"], ["'t.gltf'"]),
        (["s.gltf", "--smaples", "4"], ["'--smaples'", "--samples"]),
        (["s.gltf", "-q"], ["'-q'"]),
        (["s.gltf", "--samples"], ["--samples"]),
        (["s.gltf", "--samples", "-1"], ["--samples", "'-1'"]),
        (["s.gltf", "--samples", "0"], ["--samples", "'0'"]),
        (["s.gltf", "--samples", "many"], ["--samples", "'many'"]),
        (["s.gltf", "--size", "0x5"], ["--size", "'0x5'"]),
        (["s.gltf", "--size", "640"], ["--size", "640x480"]),
        (["s.gltf", "--size", "1000000x1000000"], ["--size"]),
        (["s.gltf", "--size", "65536x65536"], ["--size", "pixels"]),
        (["s.gltf", "--threads", "0"], ["--threads"]),
        (["s.gltf", "--time", "-3"], ["--time"]),
        (["s.gltf", "--error", "0"], ["--error"]),
        (["s.gltf", "--seed", "-1"], ["--seed"]),
        (["s.gltf", "--progress", "jsno"], ["auto, plain, json, none", "did you mean 'json'?"]),
        (["s.gltf", "--units", "feet"], ["radiometric, photometric"]),
        (["s.gltf", "--set", "direct"], ["NODE.PARAMETER=VALUE"]),
        (["s.gltf", "--set", "nobody.samples=4"], ["'nobody'"]),
        (["s.gltf", "-o", "out.png"], [".exr", "--preview"]),
        (["s.gltf", "--preview", "out.jpg"], [".png"]),
    ],
)
def test_wrong_use(program: Path, tmp_path: Path, arguments: list[str], parts: list[str]) -> None:
    assert_refused(run(program, tmp_path, *arguments), program, 2, *parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("photon.count=1k", ["'photon'", "did you mean 'photons'?"]),
        ("photons.cuont=1k", ["'cuont'", "did you mean 'count'?"]),
        ("photons.count=0", ["photons.count", "'0'"]),
        ("photons.count=-5", ["photons.count", "'-5'"]),
        ("photons.count=1.5", ["photons.count", "whole number"]),
        ("photons.count=5cm", ["photons.count", "'5cm'"]),
        ("density.neighbours=", ["density.neighbours"]),
    ],
)
def test_wrong_parameters(photon_program: Path, tmp_path: Path, setting: str, parts: list[str]) -> None:
    assert_refused(run(photon_program, tmp_path, "s.gltf", "--set", setting), photon_program, 2, *parts)


def test_help_names_the_parameters(photon_program: Path, tmp_path: Path) -> None:
    done = run(photon_program, tmp_path, "--help")
    assert done.returncode == 0
    assert done.stderr == ""
    assert "photons.count=2M" in done.stdout
    assert "density.neighbours=800" in done.stdout


def test_two_names_for_one_file(program: Path, tmp_path: Path) -> None:
    assert_refused(run(program, tmp_path, BOX, "-o", "a", "--stats", "./a"), program, 2, "same file")
    scene = tmp_path / "scene.gltf"
    scene.write_text("precious")
    assert_refused(run(program, tmp_path, "scene.gltf", "-o", "scene.gltf"), program, 2, "same file")
    assert scene.read_text() == "precious"


def test_scenes_that_cannot_be_read(program: Path, tmp_path: Path) -> None:
    inputs = tmp_path / "inputs"
    inputs.mkdir()
    (inputs / "text.gltf").write_text("this is no JSON")
    (inputs / "empty.gltf").write_text("")
    glb = (SCENES / "mirror_glass.glb").read_bytes()
    (inputs / "truncated.glb").write_bytes(glb[: len(glb) // 2])
    (inputs / "header.glb").write_bytes(glb[:7])
    work = tmp_path / "work"
    work.mkdir()
    for name in ("none.gltf", ".", "text.gltf", "empty.gltf", "truncated.glb", "header.glb"):
        assert_refused(run(program, work, inputs / name), program, 1, str(inputs / name))
        assert list(work.iterdir()) == []


@pytest.mark.parametrize("option", ["-o", "--stats"])
@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("none/a.exr", "there is no folder"),
        (".", "this is a folder"),
        ("file/a.exr", "not a folder"),
        ("/dev/full", "No space left"),
    ],
)
def test_outputs_that_cannot_be_written(program: Path, tmp_path: Path, option: str, name: str, part: str) -> None:
    (tmp_path / "file").write_text("old")
    others = ["-o", "other.exr"] if option == "--stats" else []
    done = run(program, tmp_path, BOX, option, name, *others, "--size", "8x5", "--samples", "1")
    assert_refused(done, program, 1, name, part)
    assert (tmp_path / "file").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} <= {"file", "other.exr"}


def test_no_such_camera(program: Path, tmp_path: Path) -> None:
    assert_refused(run(program, tmp_path, BOX, "--camera", "nobody"), program, 1, "'nobody'")


def test_names_cannot_steer_the_terminal(program: Path, tmp_path: Path) -> None:
    done = run(program, tmp_path, "a\x1b[31m\n\u202e.gltf")
    assert_refused(done, program, 1)
    assert all(c == "\n" or ord(c) >= 0x20 for c in done.stderr)
    assert "\u202e" not in done.stderr


def test_interrupt_writes_the_picture(program: Path, tmp_path: Path) -> None:
    command = [str(program), str(BOX), "--samples", "1G", "--time", "60", "--size", "200x120", "--progress", "json"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if '"phase": "render"' in line:
                break
        time.sleep(0.5)
        before = time.monotonic()
        os.kill(process.pid, signal.SIGINT)
        process.stderr.read()
        assert process.wait() == 130
        assert time.monotonic() - before < 20  # of 60, also on a machine that does much else
    assert (tmp_path / "out.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
    assert [path.name for path in tmp_path.iterdir()] == ["out.exr"]
