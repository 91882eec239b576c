"""NNDensity: closed forms (in C++), and agreement with path tracing in a closed diffuse room, corners included."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")


def test_known_answers(unit_test):
    unit_test("test_photon_density")


def picture(run_program, program, *options):
    run = run_program(program, SCENES / "closed_box.gltf", "--size", "64x48", *options)
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


def test_mean_agrees_with_path_tracing(compiled_network, run_program):
    density = picture(run_program, compiled_network("photon_density"), "--samples", "4")
    paths = picture(run_program, compiled_network("path_tracing"), "--samples", "256")
    assert density.mean() == pytest.approx(paths.mean(), rel=0.015)


def test_the_seed_decides_not_the_threads(compiled_network, run_program):
    program = compiled_network("photon_density")
    options = ("--samples", "1", "--set", "photons.count=20000")
    pictures = [picture(run_program, program, *options, "--threads", str(n)) for n in (1, 2, 5)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != picture(run_program, program, *options, "--seed", "1")).any()
