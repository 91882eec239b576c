"""IGInterpolator: the picture of irradiance gradients against path tracing of the same paths, and at what cost."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
BY_PATHS = """
network diffuse_paths
light  = Lights()
direct = Direct(light)
around = PathTracer(direct + around, via = D)
expect L S* E | L (D|G) S* E | L D+ (D|G) S* E
image  direct + around
"""


def blocks(image, size=10):
    height, width, _ = image.shape
    return image.reshape(height // size, size, width // size, size, 3).mean(axis=(1, 3, 4))


@pytest.fixture
def picture(compiled_network, run_program):
    def picture(program, *options, size="80x60"):
        run = run_program(program, SCENES / "cornell_box.gltf", "--size", size, *options)
        assert run.status == 0, run.stderr
        return exr.read(run.picture), run.stats["rays"]

    return picture


def test_agrees_with_path_tracing(compiled_network, picture):
    """The mean and every part of it, within the declared bias; and with far less noise than as many rays make."""
    by_paths = compiled_network("diffuse_paths", text=BY_PATHS)
    truths = [picture(by_paths, "--samples", "512", "--seed", seed)[0] for seed in ("2", "3")]
    truth = np.mean(truths, axis=0)
    noisy, brute_rays = picture(by_paths, "--samples", "64", "--seed", "1")
    smooth, rays = picture(compiled_network("irradiance_gradients"), "--samples", "16")
    assert smooth.mean() == pytest.approx(truth.mean(), rel=0.015)
    np.testing.assert_allclose(blocks(smooth), blocks(truth), rtol=0.04, atol=5e-3 * truth.mean())

    def error(image):
        """Without the noise of the truth: that of its halves is independent."""
        return ((image - truths[0]) * (image - truths[1]) / (truth**2 + 0.01)).mean()

    assert error(smooth) * rays["gather"] < 0.4 * error(noisy) * brute_rays["gather"]


def test_gradients_pay(compiled_network, picture):
    """With records far apart, interpolation without gradients is worse."""
    program = compiled_network("irradiance_gradients")
    options = ("--samples", "4", "--set", "samples.samples=600")
    truth, _ = picture(program, *options, "--set", "records.error=15%", size="24x18")
    far = (*options, "--set", "records.error=30%", "--set", "records.farthest=50%")
    errors = [
        np.abs(picture(program, *far, "--set", f"smooth.gradients={flag}", size="24x18")[0] / truth - 1).mean()
        for flag in ("true", "false")
    ]
    assert errors[0] < 0.8 * errors[1], errors
