"""Path parameters with tags: light is divided by the surfaces that scatter it, and nothing is lost or counted twice."""

from __future__ import annotations

import numpy as np

from benchmarks import exr
from conftest import SCENES

SCENE = SCENES / "glossy_tags.glb"
SIZE = ("--size", "40x30")

FROM_THE_EYE = """
network tagged_steps
tag floor = material "Floor"
tag small
light    = Lights()
direct   = Direct(light)
diffuse  = PathTracer(direct, via = D)
on       = PathTracer(direct, via = D@floor)
off      = PathTracer(direct, via = D@!floor)
any      = PathTracer(direct, via = small)
any_from = PathTracer(direct, from = small)
specular = PathTracer(direct, via = S)
floor_d  = PathTracer(direct, via = D, from = floor)
mixed    = PathTracer(direct, via = D@floor | S)
expect L S* E | L (D|G) S* E
image  direct
tap    diffuse -> "diffuse.exr"
tap    on -> "on.exr"
tap    off -> "off.exr"
tap    any -> "any.exr"
tap    any_from -> "any_from.exr"
tap    specular -> "specular.exr"
tap    floor_d -> "floor_d.exr"
tap    mixed -> "mixed.exr"
"""

FROM_THE_LIGHT = """
network tagged_photons
tag floor = material "Floor"
light = Lights()
all   = NNDensity(ParticleTracer(light, count = 20k, via = {all}))
on    = NNDensity(ParticleTracer(light, count = 20k, via = {on}))
off   = NNDensity(ParticleTracer(light, count = 20k, via = {off}))
tap   all -> "all.exr"
tap   on -> "on.exr"
tap   off -> "off.exr"
"""


def test_steps_of_a_path_tracer(compiled_network, run_program):
    """The nodes share one sample of the BSDF, so parts add up sample by sample."""
    run = run_program(compiled_network("tagged_steps", text=FROM_THE_EYE), SCENE, *SIZE, "--samples", "16")
    assert run.status == 0, run.stderr
    names = ("diffuse", "on", "off", "any", "any_from", "specular", "floor_d", "mixed")
    layer = {name: exr.read(run.picture.with_name(f"{name}.exr")) for name in names}
    for name in names:
        assert layer[name].max() > 0, name
    np.testing.assert_allclose(layer["on"] + layer["off"], layer["diffuse"], rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(layer["any"], layer["any_from"], rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(layer["floor_d"] + layer["specular"], layer["mixed"], rtol=1e-5, atol=1e-7)


def difference_in_errors(compiled_network, run_program, name: str, **paths: str) -> float:
    """(on + off - all) / its standard error, of the pictures' means over several seeds."""
    program = compiled_network(name, text=FROM_THE_LIGHT.format(**paths))
    found = []
    for seed in range(8):
        run = run_program(program, SCENE, *SIZE, "--samples", "2", "--seed", str(seed))
        assert run.status == 0, run.stderr
        found.append([exr.read(run.picture.with_name(f"{tap}.exr")).mean() for tap in ("all", "on", "off")])
    means = np.mean(found, axis=0)
    assert (means[1:] > 0.02 * means[0]).all()
    differences = np.array(found) @ [-1, 1, 1]
    error = differences.std(ddof=1) / np.sqrt(len(found))
    assert error < 0.03 * means[0]
    return abs(differences.mean()) / error


def test_photons(compiled_network, run_program):
    """One diffuse event; and any number of them, at most one of which is on the floor."""
    assert difference_in_errors(compiled_network, run_program, "one", all="D", on="D@floor", off="D@!floor") < 3.5
    paths = {"on": "D@!floor* floor D@!floor*", "off": "D@!floor*", "all": "D@!floor* floor? D@!floor*"}
    assert difference_in_errors(compiled_network, run_program, "several", **paths) < 3.5
