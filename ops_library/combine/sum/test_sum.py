"""Sum is `+`, whatever way it is written."""

from pathlib import Path

import numpy as np

from benchmarks import exr

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "plane_point.gltf"
NETWORK = """
network summed
light  = Lights()
direct = Direct(light)
third  = Scale(direct, factor = 3)
expect <= L S* E | L (D|G) S* E
image  {image}
"""


def picture(compiled_network, run_program, name, image):
    program = compiled_network(f"sum_{name}", text=NETWORK.format(image=image))
    run = run_program(program, SCENE, "--size", "8x5", "--samples", "4")
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


def test_sum_of_terms(compiled_network, run_program):
    once = picture(compiled_network, run_program, "once", "direct")
    assert once.min() > 0
    for name, image in (
        ("op", "Sum(direct, third) - direct"),
        ("plus", "direct + third - direct"),
        ("nested", "Sum(third, Sum(direct, third)) - (direct + third)"),
    ):
        np.testing.assert_allclose(picture(compiled_network, run_program, name, image), once * 3, rtol=1e-6)


def test_difference_of_equal_wires_is_black(compiled_network, run_program):
    assert picture(compiled_network, run_program, "minus", "third - Scale(direct, factor = 3)").max() < 1e-6  # rounding
