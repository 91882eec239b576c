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
tap   one -> "one.exr"
tap   four -> "four.exr"
"""


@pytest.mark.parametrize("weight", [0, 25, 100])
def test_weights(compiled_network, run_program, weight):
    """All wires answer the same requests with the same random numbers, so the layer is the weighted sum of the taps."""
    program = compiled_network(f"mis_{weight}", text=NETWORK.format(weight=f"{weight}%"))
    run = run_program(program, SCENE, "--size", "16x9", "--samples", "4")
    assert run.status == 0, run.stderr
    one, four = (exr.read(run.picture.parent / f"{name}.exr") for name in ("one", "four"))
    assert not np.allclose(one, four)
    both = exr.read(run.picture, "both")
    np.testing.assert_allclose(both, one * (weight / 100) + four * (1 - weight / 100), rtol=1e-5, atol=1e-6)
