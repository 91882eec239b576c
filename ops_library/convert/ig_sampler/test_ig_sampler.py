"""IGSampler: gradients against finite differences (in C++), and irradiance of which nothing is interpolated."""

from pathlib import Path

import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"


def test_known_answers(unit_test):
    unit_test("test_hemisphere")


def test_furnace(compiled_network, run_program):
    """E / (1 - rho) = 2 along every ray; all that is seen is equally bright, so even few directions are exact."""
    program = compiled_network("irradiance_gradients")
    options = ("--samples", "16", "--set", "samples.samples=64")
    run = run_program(program, SCENES / "furnace.gltf", "--size", "20x15", *options)
    assert run.status == 0, run.stderr
    picture = exr.read(run.picture)
    assert picture.mean() == pytest.approx(2, rel=5e-3)
    assert picture.min() > 1.8
    assert picture.max() < 2.2
