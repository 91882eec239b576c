"""`lnc compile FILE --scene SCENE`: a program for one scene computes the same there, and refuses scenes with more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from conftest import ROOT, SCENES

BOX = SCENES / "cornell_box.gltf"
SIZE = ("--size", "20x15", "--samples", "8", "--threads", "1")


def compile_for(scene: Path, output: Path, *options: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "lnc", "compile", ROOT / "examples" / "caustics.ln", "--scene", scene]
    command += ["-o", output, *options]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """examples/caustics.ln for the Cornell box, which has an area emitter and diffuse surfaces only."""
    program = tmp_path_factory.mktemp("baked") / "caustics"
    done = compile_for(BOX, program, "--emit-cpp", program.with_suffix(".cpp"))
    assert done.returncode == 0, done.stderr
    text = program.with_suffix(".cpp").read_text()
    assert "static constexpr bool skip_photons = true, skip_photons_tree = true, skip_caustic = true;" in text
    assert "static constexpr ln::Events scene_events = ln::Events::D;" in text
    return program


def test_the_same_picture(baked, compiled_network, run_program):
    run = run_program(compiled_network("caustics"), BOX, *SIZE)
    expected, stats = exr.read(run.picture), run.stats
    run = run_program(baked, BOX, *SIZE)
    assert run.status == 0, run.stderr
    assert run.stats["rays"] == stats["rays"]
    reasons = [{node["name"]: node["skipped"] for node in each["nodes"]} for each in (run.stats, stats)]
    assert reasons[0] == reasons[1]
    np.testing.assert_allclose(exr.read(run.picture), expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("scene", "what"),
    [("mirror_glass.glb", "specular surface"), ("plane_point.gltf", "point, spot or directional light")],
)
def test_scenes_that_have_more_are_refused(baked, run_program, scene, what):
    run = run_program(baked, SCENES / scene, *SIZE)
    assert run.status == 1
    assert not run.picture.exists()
    (line,) = [line for line in run.stderr.splitlines() if not line.startswith("note: ")]
    assert f"{scene}: has a {what}; this program was compiled for cornell_box.gltf, which has none" in line


def test_scenes_that_have_no_more_are_fine(baked, run_program):
    run = run_program(baked, SCENES / "furnace.gltf", *SIZE)
    assert run.status == 0, run.stderr
    assert exr.read(run.picture).max() > 0


def test_scenes_that_cannot_be_read(tmp_path):
    done = compile_for(tmp_path / "none.gltf", tmp_path / "program")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("lnc: --scene: ")
    assert "none.gltf" in done.stderr
    assert not (tmp_path / "program").exists()
