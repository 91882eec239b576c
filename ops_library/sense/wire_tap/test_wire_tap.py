"""WireTap changes nothing and shows its wire as a layer; `tap` and `layers` do the same from outside."""

from pathlib import Path

import numpy as np

from benchmarks import exr

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "mirror_glass.glb"
NETWORK = """
network tapped
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt)
seen   = WireTap(pt, layer = "indirect")
tap    pt -> "outside.exr"
expect <= L (D|G|S)* E
image  direct + seen layers
"""
PLAIN = """
network plain
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt)
expect <= L (D|G|S)* E
image  direct + pt
"""


def test_layers(compiled_network, run_program):
    size = ("--size", "20x15", "--samples", "8")
    run = run_program(compiled_network("tapped", text=NETWORK), SCENE, *size)
    assert run.status == 0, run.stderr
    picture = exr.read(run.picture)
    layers = {name: exr.read(run.picture, name) for name in ("indirect", "direct", "seen")}
    layers["outside"] = exr.read(run.picture.with_name("outside.exr"))

    np.testing.assert_array_equal(layers["indirect"], layers["seen"])
    np.testing.assert_allclose(layers["outside"], layers["seen"], rtol=1e-5)
    assert layers["indirect"].max() > 0
    # What no layer holds are the emitters that are seen.
    emitters = picture - layers["direct"] - layers["seen"]
    assert emitters.min() > -1e-5
    assert (np.abs(emitters) < 1e-5).mean() > 0.5

    plain = run_program(compiled_network("plain", text=PLAIN), SCENE, *size)
    np.testing.assert_allclose(exr.read(plain.picture), picture, rtol=1e-5, atol=1e-6)
