"""mis weights two estimates of the same light."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "cornell_box.gltf"
NETWORK = """
network weighted
light = Lights()
one   = Direct(light)
four  = Direct(light, samples = 4)
both  = mis(one, four, weight = {weight})
expect L S* E | L (D|G) S* E
image both layers
"""
ALONE = "light = Lights()\nexpect <= L S* E | L (D|G) S* E\nimage Direct(light, samples = {samples})\n"


def picture(compiled_network, run_program, name, text):
    run = run_program(compiled_network(name, text=text), SCENE, "--size", "16x9", "--samples", "4")
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


@pytest.mark.parametrize("weight", [0, 25, 100])
def test_weights(compiled_network, run_program, weight):
    """Both inputs answer the same requests with the same random numbers, so the picture is their weighted sum."""
    one = picture(compiled_network, run_program, "mis_one", ALONE.format(samples=1))
    four = picture(compiled_network, run_program, "mis_four", ALONE.format(samples=4))
    assert not np.allclose(one, four)
    text = NETWORK.format(weight=f"{weight}%")
    both = picture(compiled_network, run_program, f"mis_{weight}", text)
    np.testing.assert_allclose(both, one * (weight / 100) + four * (1 - weight / 100), rtol=1e-5, atol=1e-6)
