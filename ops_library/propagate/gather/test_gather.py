"""Gather: secondary sources against closed forms and against the same paths traced by PathTracer."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
NETWORK = """
network gather_{name}
light    = Lights()
direct   = Direct(light)
gathered = {gathered}
expect <= L (D|G|S)* E
image  {image}
"""


@pytest.fixture
def picture(compiled_network, run_program):
    def picture(scene, gathered, *options, image="direct + gathered", seed=0):
        name = f"gather_{''.join(c if c.isalnum() else '_' for c in gathered + image)}"
        program = compiled_network(name, text=NETWORK.format(name=name, gathered=gathered, image=image))
        run = run_program(program, SCENES / scene, "--size", "20x15", "--seed", str(seed), *options)
        assert run.status == 0, run.stderr
        return exr.read(run.picture), run.stats["rays"]

    return picture


@pytest.mark.parametrize("samples", [1, 8])
def test_furnace(picture, samples):
    """One reflection more: 1 + rho + rho^2, whatever the number of directions."""
    gathered = f"Direct(direct, samples = {samples})"
    found, _ = picture("furnace.gltf", gathered, "--samples", str(64 // samples))
    assert found.mean() == pytest.approx(1.75, rel=2e-3)


def test_recursion(picture):
    """Fed back on itself it is a path tracer: E / (1 - rho)."""
    found, _ = picture("furnace.gltf", "Gather(direct + gathered)", "--samples", "64")
    assert found.mean() == pytest.approx(2, rel=4e-3)


def test_agrees_with_path_tracing(picture):
    """The same paths by PathTracer, judged by the noise of several seeds: on diffuse and glossy receivers."""
    differences = []
    for seed in range(6):
        by_paths, rays = picture(
            "glossy_tags.glb", "PathTracer(direct, via = D)", "--samples", "32", image="gathered", seed=seed
        )
        gathered, more_rays = picture(
            "glossy_tags.glb", "Direct(direct, samples = 4)", "--samples", "32", image="gathered", seed=seed
        )
        differences.append(gathered.mean() / by_paths.mean() - 1)
        assert more_rays["gather"] > 3.5 * rays["gather"]
    error = np.std(differences, ddof=1) / np.sqrt(len(differences))
    assert abs(np.mean(differences)) < 4 * error < 0.04


def test_a_single_direction_is_shared(picture):
    """With one direction it traces the ray that Direct looks along: the same rays as a path tracer."""
    by_paths = picture("closed_box.gltf", "PathTracer(direct, via = D)", "--samples", "4")
    gathered = picture("closed_box.gltf", "Direct(direct)", "--samples", "4")
    np.testing.assert_array_equal(gathered[0], by_paths[0])
    assert gathered[1] == by_paths[1]
