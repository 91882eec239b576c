"""Direct against closed forms: point, spot and polygonal light on a Lambertian plane."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"


def closed_forms():
    sys.path.insert(0, str(SCENES))
    try:
        spec = importlib.util.spec_from_file_location("closed_forms", SCENES / "closed_forms.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    finally:
        sys.path.remove(str(SCENES))


@pytest.mark.parametrize("scene", ["plane_point", "plane_spot", "plane_area"])
def test_closed_form(compiled_network, run_program, scene):
    run = run_program(compiled_network("direct"), SCENES / f"{scene}.gltf", "--size", "40x30", "--samples", "256")
    assert run.status == 0, run.stderr
    found = exr.read(run.picture)
    expected = np.array(closed_forms().expected_image(scene, 40, 30, 8))
    assert abs(found.mean() / expected.mean() - 1) < 1e-3
    # In every part of the picture, too.
    np.testing.assert_allclose(blocks(found), blocks(expected), rtol=4e-3, atol=1e-3 * expected.mean())


def blocks(image):
    """Means over blocks of 10 x 10 pixels."""
    return image.reshape(3, 10, 4, 10, 3).mean(axis=(1, 3))


def test_more_samples_less_noise(compiled_network, run_program):
    def noise(samples):
        options = ("--size", "40x30", "--samples", "1", "--set", f"direct.samples={samples}")
        run = run_program(compiled_network("direct"), SCENES / "plane_area.gltf", *options)
        assert run.status == 0, run.stderr
        expected = np.array(closed_forms().expected_image("plane_area", 40, 30, 4))
        return ((exr.read(run.picture) - expected) ** 2).mean()

    assert noise(16) < noise(1) / 4
