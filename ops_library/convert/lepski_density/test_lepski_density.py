"""LepskiDensity: closed forms (in C++), agreement with path tracing in a closed room, and less error than NNDensity."""

from pathlib import Path

import numpy as np
import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
network lepski
light   = Lights()
photons = ParticleTracer(light, count = 200k)
density = LepskiDensity(photons)
expect  <= L (D|G|S)* E
image   density
"""


def test_known_answers(unit_test):
    unit_test("test_photon_bandwidth")


@pytest.fixture(scope="module")
def lepski(compiled_network):
    return compiled_network("lepski", text=NETWORK)


def picture(run_program, program, *options):
    """Of the closed box."""
    run = run_program(program, SCENES / "closed_box.gltf", "--size", "40x30", *options)
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


def test_less_error_than_of_the_nearest_neighbours(lepski, compiled_network, run_program):
    """With the same photons, and both operators at default settings: less than half the error, and the right mean."""
    truth = picture(run_program, compiled_network("path_tracing"), "--samples", "512")
    nearest = ("--set", "photons.count=200k", "--set", "density.neighbours=60")
    errors = {}
    for program, options in ((compiled_network("photon_density"), nearest), (lepski, ())):
        found = picture(run_program, program, "--samples", "4", *options)
        assert found.mean() == pytest.approx(truth.mean(), rel=0.015)
        ratio = found.mean(axis=2) / truth.mean(axis=2)
        errors[program] = np.median((ratio - 1) ** 2)  # without pixels at the lamp's edge
    assert errors[lepski] < 0.5 * errors[compiled_network("photon_density")]


def test_the_seed_decides_not_the_threads(lepski, run_program):
    options = ("--set", "photons.count=20k", "--samples", "1")
    pictures = [picture(run_program, lepski, *options, "--threads", str(n)) for n in (1, 2, 5)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != picture(run_program, lepski, *options, "--seed", "1")).any()
