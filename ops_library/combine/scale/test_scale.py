"""Scale multiplies, and only where `to` says so."""

from pathlib import Path

import numpy as np

from benchmarks import exr

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "plane_point.gltf"
NETWORK = """
network scaled
tag plane = material "*"
tag nothing = material "no such material"
light  = Lights()
direct = Direct(light)
half   = Scale(direct, factor = 0.5, to = {tag})
expect <= L S* E | L (D|G) S* E
image  {image}
"""


def picture(compiled_network, run_program, image, tag="plane"):
    program = compiled_network(f"scale_{image}_{tag}", text=NETWORK.format(image=image, tag=tag))
    run = run_program(program, SCENE, "--size", "8x5", "--samples", "4")
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


def test_half_is_half(compiled_network, run_program):
    whole = picture(compiled_network, run_program, "direct")
    assert whole.min() > 0
    np.testing.assert_array_equal(picture(compiled_network, run_program, "half"), whole * 0.5)


def test_what_is_negative_is_so_in_its_tap(compiled_network, run_program):
    text = NETWORK.format(image="direct", tag="plane")
    text += 'apart = half - direct\nagain = Sum(apart)\ntap again -> "sum.exr"\n'
    text += 'less = Scale(direct, factor = -2)\ntap less -> "less.exr"\n'
    run = run_program(compiled_network("scale_signed", text=text), SCENE, "--size", "8x5", "--samples", "4")
    assert run.status == 0, run.stderr
    whole = exr.read(run.picture)
    np.testing.assert_allclose(exr.read(run.picture.parent / "sum.exr"), -0.5 * whole, rtol=1e-6)
    np.testing.assert_allclose(exr.read(run.picture.parent / "less.exr"), -2 * whole, rtol=1e-6)


def test_receivers_without_the_tag_get_nothing(compiled_network, run_program):
    assert not picture(compiled_network, run_program, "half", "nothing").any()
