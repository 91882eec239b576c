"""Path parameters with tags: light is divided by the surfaces that scatter it, and nothing is lost or counted twice."""

from __future__ import annotations

import json
import shutil

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

COMPLEMENTS = """
network complements
tag floor = material "Floor"
tag lamp  = node "Lamp"
light    = Lights()
direct   = Direct(light)
bounce   = PathTracer(direct)
from_on  = PathTracer(direct, from = floor)
from_off = PathTracer(direct, from = !floor)
to_on    = Scale(bounce, to = floor)
to_off   = Scale(bounce, to = !floor)
via_off  = PathTracer(direct, via = !floor)
lamps    = Direct(Lights(from = lamp))
others   = Direct(Lights(from = !lamp))
expect L S* E | L (D|G) S* E
image  direct
tap    direct -> "direct.exr"
tap    bounce -> "bounce.exr"
tap    from_on -> "from_on.exr"
tap    from_off -> "from_off.exr"
tap    to_on -> "to_on.exr"
tap    to_off -> "to_off.exr"
tap    via_off -> "via_off.exr"
tap    lamps -> "lamps.exr"
tap    others -> "others.exr"
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


def errors_from_zero(difference: np.ndarray) -> float:
    """The mean of a picture of independent pixels, in standard errors."""
    pixels = difference.mean(axis=-1)
    return abs(pixels.mean()) / (pixels.std() / np.sqrt(pixels.size))


def test_negated_tags_are_complements(compiled_network, run_program):
    run = run_program(compiled_network("complements", text=COMPLEMENTS), SCENE, *SIZE, "--samples", "16")
    assert run.status == 0, run.stderr
    names = ("direct", "bounce", "from_on", "from_off", "to_on", "to_off", "via_off", "lamps", "others")
    layer = {name: exr.read(run.picture.with_name(f"{name}.exr")) for name in names}
    for side in ("from", "to"):
        parts = layer[f"{side}_on"], layer[f"{side}_off"]
        assert min(part.max() for part in parts) > 0
        np.testing.assert_allclose(sum(parts), layer["bounce"], rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(layer["via_off"], layer["from_off"])
    assert min(layer["lamps"].max(), layer["others"].max()) > 0
    assert errors_from_zero(layer["lamps"] + layer["others"] - layer["direct"]) < 4


def test_the_environment_has_no_tags(compiled_network, run_program, tmp_path):
    """A scene without lights is lit by a sky, which `from = !lamp` takes and `from = lamp` does not."""
    model = json.loads((SCENES / "plane_area.gltf").read_text())
    for material in model["materials"]:
        material.pop("emissiveFactor", None)
    shutil.copy(SCENES / "plane_area.bin", tmp_path)
    (tmp_path / "dark.gltf").write_text(json.dumps(model))
    options = (*SIZE, "--samples", "16")
    run = run_program(compiled_network("complements", text=COMPLEMENTS), tmp_path / "dark.gltf", *options)
    assert run.status == 0 and "using a clear sky" in run.stderr
    assert exr.read(tmp_path / "lamps.exr").max() == 0
    others = exr.read(tmp_path / "others.exr")
    assert others.max() > 0 and errors_from_zero(others - exr.read(tmp_path / "direct.exr")) < 4


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
