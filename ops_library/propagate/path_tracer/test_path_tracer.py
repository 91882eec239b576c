"""PathTracer: the furnace, bounded depth, and the rays that it shares."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
ONCE = """
network once
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt, max_depth = 2)
expect L S* E | L (D|G) S* E | L@area . .? (D|G) S* E | L@delta (D|G) .? (D|G) S* E
image  direct + pt
"""


def test_furnace(compiled_network, run_program):
    """E / (1 - rho) = 2 along every ray."""
    run = run_program(compiled_network("path_tracing"), SCENES / "furnace.gltf", "--size", "64x48", "--samples", "256")
    assert run.status == 0, run.stderr
    picture = exr.read(run.picture)
    assert picture.mean() == pytest.approx(2, rel=1e-3)
    assert abs(picture.mean() - 2) < 4 * picture[..., 0].std() / np.sqrt(64 * 48)
    assert picture.min() > 1.5


def test_bounded_depth_is_a_partial_sum(compiled_network, run_program):
    """Two steps of recursion in the furnace: 1 + rho + rho^2 + rho^3."""
    run = run_program(
        compiled_network("once", text=ONCE), SCENES / "furnace.gltf", "--size", "20x15", "--samples", "64"
    )
    assert run.status == 0, run.stderr
    assert exr.read(run.picture).mean() == pytest.approx(1.875, rel=2e-3)


def test_no_ray_is_traced_twice(compiled_network, run_program):
    """One light sample and one BSDF sample a surface: Direct and PathTracer share the ray of the latter."""
    run = run_program(
        compiled_network("path_tracing"), SCENES / "closed_box.gltf", "--size", "20x15", "--samples", "16"
    )
    assert run.status == 0, run.stderr
    rays = {node["name"]: node["rays"] for node in run.stats["nodes"]}
    assert rays["image"] == run.stats["rays"]["camera"] == 20 * 15 * 16
    assert rays["direct"] + rays["pt"] == run.stats["rays"]["shadow"] + run.stats["rays"]["gather"]
    # The emitters are black: every other surface that is met asks for one more ray and casts at most one shadow ray.
    assert run.stats["rays"]["shadow"] <= run.stats["rays"]["gather"]
    assert run.stats["rays"]["total"] == sum(rays.values())
