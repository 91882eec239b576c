"""Lights: the emitters with a tag and those with the other add up to all of them."""

from pathlib import Path

import numpy as np

from benchmarks import exr

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "glossy_tags.glb"
NETWORK = """
network lit
tag lamp = node "Lamp"
tag rest = node "Sun" | material "Light"
tag none = node "no such node"
light  = Lights({arguments})
direct = Direct(light)
expect <= L (D|G|S)* E
image  direct layers
"""


def irradiated(compiled_network, run_program, name, arguments):
    program = compiled_network(f"lights_{name}", text=NETWORK.format(arguments=arguments))
    run = run_program(program, SCENE, "--size", "32x24", "--samples", "64")
    assert run.status == 0, run.stderr
    return exr.read(run.picture, "direct"), run


def test_parts_add_up_to_the_whole(compiled_network, run_program):
    whole, _ = irradiated(compiled_network, run_program, "all", "")
    lamp, _ = irradiated(compiled_network, run_program, "lamp", "from = lamp")
    rest, _ = irradiated(compiled_network, run_program, "rest", "from = rest")
    assert lamp.mean() > 0.01 * whole.mean()
    assert rest.mean() > 0.01 * whole.mean()
    # Pixels are independent: the standard error of the mean is that of their differences.
    difference = (lamp + rest - whole).mean(axis=2)
    assert abs(difference.mean()) < 4 * difference.std() / np.sqrt(difference.size)
    assert abs(difference.mean()) < 0.01 * whole.mean()


def test_no_emitter_no_ray(compiled_network, run_program):
    picture, run = irradiated(compiled_network, run_program, "none", "from = none")
    assert not picture.any()
    assert run.stats["rays"]["shadow"] == 0
    assert "matches nothing" in run.stderr
