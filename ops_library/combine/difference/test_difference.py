"""Difference: absolute values as the picture, signed ones in a tap, and numbers that numpy finds, too."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from benchmarks.image_error import rel_mse

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
NETWORK = """
network compared
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt)
less   = Scale(direct, factor = 0.75)
apart  = Difference(less, direct + pt)
image  apart
tap    apart -> "signed.exr"
"""
SAME = """
network same
light  = Lights()
direct = Direct(light)
apart  = Difference(Scale(direct, factor = 2), direct + direct)
tap    apart -> "signed.exr"
"""


def test_picture_tap_and_numbers(compiled_network, run_program):
    run = run_program(compiled_network("compared", text=NETWORK), SCENES / "cornell_box.gltf", "--size", "12x9")
    assert run.status == 0, run.stderr
    picture, signed = exr.read(run.picture), exr.read(run.picture.with_name("signed.exr"))
    a, b = exr.read(run.picture, "less"), exr.read(run.picture, "apart_b")
    np.testing.assert_allclose(signed, a - b, atol=1e-5 * b.max())
    np.testing.assert_allclose(picture, np.abs(signed), atol=1e-5 * b.max())
    assert signed.min() < 0 and picture.max() > 0.1 * b.max()

    (found,) = run.stats["differences"]
    assert found["name"] == "apart"
    assert found["relMSE"] == pytest.approx(rel_mse(a, b), rel=1e-4)
    assert found["RMSE"] == pytest.approx(np.sqrt(((a - b) ** 2).mean()), rel=1e-4)
    assert found["mean"] == pytest.approx((a - b).mean(), rel=1e-4)
    assert found["bias"] == pytest.approx((a - b).sum() / b.sum(), rel=1e-4)
    assert found["max"] == pytest.approx(np.abs(a - b).max(), rel=1e-4)
    assert "note: apart: relMSE" in run.stderr


def test_what_is_the_same_cancels(compiled_network, run_program):
    """Sample by sample, whatever the noise."""
    run = run_program(
        compiled_network("same", text=SAME), SCENES / "plane_area.gltf", "--size", "6x4", "--samples", "2"
    )
    assert run.status == 0, run.stderr
    assert not run.picture.exists()
    assert np.abs(exr.read(run.picture.with_name("signed.exr"))).max() < 1e-5
    assert run.stats["differences"][0]["relMSE"] < 1e-10
