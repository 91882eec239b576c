"""Scale multiplies, and only where `to` says so."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from lnc.cli import main

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


@pytest.mark.parametrize(("low", "negative"), [("-1", "true"), ("0", "false")])
def test_any_operator_may_declare_that_it_scales(tmp_path, low, negative):
    """What its factor's range allows decides whether samples may be negative, not the operator's name."""
    folder = tmp_path / "mine" / "dimmer"
    folder.mkdir(parents=True)
    declaration = (Path(__file__).parent / "scale.ln").read_text().replace("Scale", "Dimmer")
    (folder / "dimmer.ln").write_text(declaration.replace("-1G..1G", f"{low}..1"))
    (tmp_path / "n.ln").write_text(
        'direct = Direct(Lights())\ndim = Dimmer(direct)\nimage direct\ntap dim -> "dim.exr"\n'
    )
    command = [
        "compile",
        str(tmp_path / "n.ln"),
        "--ops",
        str(tmp_path / "mine"),
        "--emit-cpp",
        str(tmp_path / "n.cpp"),
    ]
    assert main(command) == 0
    assert f".subtracts = {negative}" in (tmp_path / "n.cpp").read_text()


def test_receivers_without_the_tag_get_nothing(compiled_network, run_program):
    assert not picture(compiled_network, run_program, "half", "nothing").any()
