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

MANY = """
network many
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt, samples = 16)
expect <= L (D|G|S)* E
image  pt
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


def test_directions_at_the_first_surface(compiled_network, run_program):
    """16 directions: the same mean with less noise than one, further surfaces follow one each; --set finds the same."""
    program = compiled_network("many", text=MANY)

    def means(*options: str) -> tuple[np.ndarray, int]:
        found = []
        for seed in range(8):
            run = run_program(
                program, SCENES / "glossy_tags.glb", "--size", "16x12", "--samples", "64", "--seed", str(seed), *options
            )
            assert run.status == 0, run.stderr
            found.append(exr.read(run.picture).mean(axis=-1))
        return np.array(found), run.stats["rays"]["gather"]

    one, one_rays = means("--set", "pt.samples=1")
    many, many_rays = means()
    assert 10 * one_rays < many_rays < 16.5 * one_rays
    energy = [pictures.mean(axis=(1, 2)) for pictures in (one, many)]
    error = np.sqrt(sum(e.var(ddof=1) / len(e) for e in energy))
    assert abs(energy[0].mean() - energy[1].mean()) < 4 * error < 0.05 * energy[1].mean()
    assert many.var(axis=0, ddof=1).mean() < 0.3 * one.var(axis=0, ddof=1).mean()


def test_directions_keep_the_energy(compiled_network, run_program):
    """In the furnace: what is emitted, 1, and what is scattered twice or more, rho^2 / (1 - rho) = 1/2."""
    run = run_program(
        compiled_network("many", text=MANY), SCENES / "furnace.gltf", "--size", "20x15", "--samples", "16"
    )
    assert run.status == 0, run.stderr
    assert exr.read(run.picture).mean() == pytest.approx(1.5, rel=2e-3)
