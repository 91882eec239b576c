"""What a scene does not need costs nothing: no rays, no preparation, and the same picture."""

from __future__ import annotations

import json

import pytest

from benchmarks import exr
from conftest import SCENES

SIZE = ("--size", "20x15", "--samples", "4")
DIFFUSE, SPECULAR, GLOSSY = SCENES / "cornell_box.gltf", SCENES / "mirror_glass.glb", SCENES / "glossy_tags.glb"

TAGGED = """
network by_tag
tag mirror  = material "Mirror"
tag lamp    = node "Lamp"
tag nowhere = node "Nothing is called this"
light   = Lights()
direct  = Direct(light)
lit     = Direct(Lights(from = lamp))
unlit   = Direct(Lights(from = nowhere))
photons = ParticleTracer(light, count = 5k, via = S@mirror)
caustic = NNDensity(photons)
bounce  = PathTracer(direct, via = D@nowhere)
expect L S* E | L (D|G) S* E
image  direct
tap    lit -> "lit.exr"
tap    unlit -> "unlit.exr"
tap    caustic -> "caustic.exr"
tap    bounce -> "bounce.exr"
"""


def nodes(run) -> dict[str, dict]:
    assert run.status == 0, run.stderr
    return {node["name"]: node for node in run.stats["nodes"]}


def test_without_specular_surfaces_caustics_are_direct_light(compiled_network, run_program):
    caustics = compiled_network("caustics")
    run = run_program(caustics, DIFFUSE, *SIZE)
    found = nodes(run)
    for name in ("photons", "photons_tree", "caustic"):
        assert found[name]["skipped"] == "the scene has no specular surface"
        assert f"note: {name}: skipped, the scene has no specular surface\n" in run.stderr
        assert found[name]["rays"] == 0
        assert found[name]["seconds"] == 0
    assert found["light"]["skipped"] is found["direct"]["skipped"] is None
    assert run.stats["rays"]["photon"] == 0
    picture, rays = exr.read(run.picture), run.stats["rays"]

    direct = run_program(compiled_network("direct"), DIFFUSE, *SIZE)
    assert direct.stats["rays"] == rays
    assert (exr.read(direct.picture) == picture).all()

    run = run_program(caustics, SPECULAR, *SIZE, "--set", "photons.count=1k")
    assert all(node["skipped"] is None for node in nodes(run).values())
    assert run.stats["rays"]["photon"] >= 1000


def test_tags(compiled_network, run_program):
    program = compiled_network("by_tag", text=TAGGED)
    run = run_program(program, GLOSSY, *SIZE)
    skipped = {name: node["skipped"] for name, node in nodes(run).items() if node["skipped"]}
    no_light = "the scene has no emitter tagged nowhere"
    no_place = "the scene has no diffuse surface tagged nowhere"
    assert skipped == {"unlit_lights": no_light, "unlit": no_light, "bounce": no_place}
    for name in ("lit", "caustic"):
        assert exr.read(run.picture.with_name(f"{name}.exr")).max() > 0
    for name in ("unlit", "bounce"):
        assert exr.read(run.picture.with_name(f"{name}.exr")).max() == 0
        assert nodes(run)[name]["rays"] == 0

    run = run_program(program, DIFFUSE, *SIZE)
    found = nodes(run)
    assert found["caustic"]["skipped"] == "the scene has no specular surface tagged mirror"
    assert found["lit"]["skipped"] == "the scene has no emitter tagged lamp"
    assert found["lit"]["rays"] == 0
    assert run.stats["rays"]["photon"] == 0


def test_progress_in_json(compiled_network, run_program):
    run = run_program(compiled_network("caustics"), DIFFUSE, *SIZE, "--progress", "json")
    events = [json.loads(line) for line in run.stderr.splitlines()]
    found = {event["node"]: event["reason"] for event in events if event["event"] == "skipped"}
    assert found == dict.fromkeys(("photons", "photons_tree", "caustic"), "the scene has no specular surface")


@pytest.mark.parametrize("network", ["direct", "path_tracing"])
def test_what_every_scene_has_is_not_tested(compiled_network, network):
    """There always is an emitter, so nothing stands in the way of the hottest code."""
    program = compiled_network(network)
    assert b"skipped" in compiled_network("caustics").read_bytes()
    assert b"specular surface" not in program.read_bytes()
