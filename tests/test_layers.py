"""Light-path images: the layers of a picture add up to it, say which light they hold, and cost no rays."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from benchmarks import exr
from conftest import SCENES

SCENE = SCENES / "mirror_glass.glb"
SIZE = ("--size", "20x15", "--samples", "8")

WIRES = """
light    = Lights()
direct   = Direct(light)
photons  = ParticleTracer(light, count = 20k, via = S+)
caustic  = NNDensity(photons)
pt       = PathTracer(direct + pt, via = D|G)
both     = direct + caustic
expect <= L (D|G|S)* E
"""
PLAIN = f"network plain {WIRES} image direct + caustic + pt"
LAYERED = f"""network layered {WIRES}
image both + pt layers
tap   caustic -> "caustic.exr"
tap   pt + both - caustic -> "most.exr"
"""
DIFFERENCE = """
network less
light    = Lights()
emitters = Direct(light)
spare    = Direct(light)
R        = PathTracer(emitters + R)
again    = PathTracer(emitters + again)
smooth   = NNDensity(ParticleTracer(light, count = 20k, via = D))
expect <= L (D|G|S)* E
image    emitters + R + R - again - smooth + spare - spare layers
"""


def label(picture: Path, layer: str) -> str:
    """The attribute lightPaths.LAYER."""
    found = re.search(
        rb"lightPaths\.%b\0string\0....([^\0]*)\0?" % layer.encode(), picture.read_bytes()[:4096], re.DOTALL
    )
    assert found, layer
    size = int.from_bytes(found[0].split(b"string\0")[1][:4], "little")
    return found[1][:size].decode()


def assert_adds_up(picture: Path, positive: list[str], negative: tuple[str, ...] = ()) -> None:
    """Up to the rounding of the samples' 32-bit floats."""
    added = sum(exr.read(picture, layer) for layer in positive)
    taken = sum((exr.read(picture, layer) for layer in negative), np.zeros_like(added))
    expected = np.maximum(added - taken, 0)
    assert (np.abs(exr.read(picture) - expected) <= 2**-22 * (added + taken)).all()


def test_layers_add_up_to_the_picture_and_cost_nothing(compiled_network, run_program):
    plain = run_program(compiled_network("plain", text=PLAIN), SCENE, *SIZE)
    assert plain.status == 0, plain.stderr
    expected = exr.read(plain.picture)
    run = run_program(compiled_network("layered", text=LAYERED), SCENE, *SIZE)
    assert run.status == 0, run.stderr
    assert run.stats["rays"] == plain.stats["rays"]
    np.testing.assert_allclose(exr.read(run.picture), expected, rtol=1e-5, atol=1e-6)
    assert_adds_up(run.picture, ["both", "pt", "emitters"])
    for layer in ("both", "pt", "emitters"):
        assert exr.read(run.picture, layer).max() > 0

    folder = run.picture.parent
    caustic, most = exr.read(folder / "caustic.exr"), exr.read(folder / "most.exr")
    np.testing.assert_allclose(
        caustic + most, exr.read(run.picture, "both") + exr.read(run.picture, "pt"), rtol=1e-5, atol=1e-6
    )
    assert caustic.max() > 0


def test_labels_are_closed_as_in_the_picture(compiled_network, run_program):
    run = run_program(compiled_network("layered", text=LAYERED), SCENE, *SIZE)
    assert label(run.picture, "emitters") == "L S* E"
    assert label(run.picture, "both") == "L (G | S* D) S* E"


def test_wires_that_are_subtracted(compiled_network, run_program):
    """They are shown as they are, keep their names, and cost nothing where they cancel out."""
    run = run_program(compiled_network("less", text=DIFFERENCE), SCENE, *SIZE)
    assert run.status == 0, run.stderr
    assert "negative" not in run.stderr
    assert exr.read(run.picture, "smooth").max() > 0
    assert (exr.read(run.picture).sum(axis=-1) == 0).any()
    assert_adds_up(run.picture, ["emitters", "R", "emitters_"], ("again", "smooth"))
    assert label(run.picture, "emitters") == "L (D|G) S* E"
    assert label(run.picture, "smooth") == "-(L D D S* E)"
    assert re.fullmatch(r"2 \(.*L.* E\)", label(run.picture, "R"))
    assert {node["name"]: node["rays"] for node in run.stats["nodes"]}["spare"] == 0
