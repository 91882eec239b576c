"""LepskiDensity: closed forms (in C++), agreement with path tracing in a closed room, and less error than NNDensity."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
network {operator}
light   = Lights()
photons = ParticleTracer(light, count = {count})
density = {operator}(photons)
expect  <= L (D|G|S)* E
image   density
"""


def test_known_answers(runtime_tool):
    done = subprocess.run([runtime_tool("test_photon_bandwidth")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.fixture(scope="module")
def picture(compiled_network, tmp_path_factory):
    """picture("NNDensity", "200k", ...): of the closed box."""
    folder = tmp_path_factory.mktemp("lepski")

    def render(operator, count, *options):
        program = compiled_network(operator, text=NETWORK.format(operator=operator, count=count))
        out = folder / "out.exr"
        command = [program, SCENES / "closed_box.gltf", "-o", out, "--size", "40x30", "--progress", "none", *options]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return exr.read(out)

    return render


def test_less_error_than_of_the_nearest_neighbours(picture, compiled_network, run_program):
    """With the same photons at default settings: less than half of the relMSE, and the right mean."""
    run = run_program(
        compiled_network("path_tracing"), SCENES / "closed_box.gltf", "--size", "40x30", "--samples", "512"
    )
    assert run.status == 0, run.stderr
    truth = exr.read(run.picture)
    errors = {}
    for operator in ("NNDensity", "LepskiDensity"):
        found = picture(operator, "200k", "--samples", "4")
        assert found.mean() == pytest.approx(truth.mean(), rel=0.015)
        ratio = found.mean(axis=2) / truth.mean(axis=2)
        errors[operator] = np.median((ratio - 1) ** 2)  # without pixels at the lamp's edge
    assert errors["LepskiDensity"] < 0.5 * errors["NNDensity"]


def test_the_seed_decides_not_the_threads(picture):
    pictures = [picture("LepskiDensity", "20k", "--samples", "1", "--threads", str(n)) for n in (1, 2, 5)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != picture("LepskiDensity", "20k", "--samples", "1", "--seed", "1")).any()
