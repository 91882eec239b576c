"""ByDistance: what short rays see, against a closed form; final gathering where things touch, against path tracing."""

import csv
import math
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

WALL = """
network wall
light   = Lights()
direct  = Direct(light)
photons = ParticleTracer(light, count = 1k, via = ())
density = NNDensity(photons, neighbours = 4k, radius = 50cm)
none    = Scale(density, factor = 0)
near    = Gather(ByDistance(none, direct, distance = 40cm, radii = 0))
far     = Gather(ByDistance(direct, none, distance = 40cm))
kernel  = Gather(ByDistance(none, direct))
radii   = Gather(ByDistance(none, direct, radii = 0.8))
probe near at "sensor.csv" -> "near.csv"
probe far at "sensor.csv" -> "far.csv"
probe kernel at "sensor.csv" -> "kernel.csv"
probe radii at "sensor.csv" -> "radii.csv"
"""

CONTACT = f"""
network contact
use "{EXAMPLES}/macros/photon_maps.ln"
light    = Lights()
direct   = Direct(light)
caustic  = CausticMap(light)
global   = GlobalMap(light, count = 20k)
all      = direct + caustic + indirect
indirect = FinalGather(global, all)
blurred  = Gather(global)
traced   = PathTracer(direct + traced, via = D)
expect indirect: <= L (D|G|S)+
probe indirect at "sensor.csv" -> "indirect.csv"
probe blurred at "sensor.csv" -> "blurred.csv"
probe traced at "sensor.csv" -> "traced.csv"
"""


@pytest.fixture
def probe(compiled_network, run_program, tmp_path):
    """Illuminance at a sensor, and its standard error, by wire."""

    def measure(name, text, scene, sensor, samples):
        program = compiled_network(name, text=text)
        (tmp_path / "sensor.csv").write_text(f"x,y,z,nx,ny,nz\n{sensor}\n")
        run = run_program(program, EXAMPLES / "scenes" / scene, "--samples", str(samples))
        assert run.status == 0, run.stderr
        found = {}
        for file in tmp_path.glob("*.csv"):
            (row,) = csv.DictReader(file.read_text().splitlines())
            if "lux" in row:
                found[file.stem] = float(row["lux"]), float(row["stderr"])
        return found

    return measure


def test_short_rays(probe):
    """30 cm before a wall of radiosity pi / 2, rays shorter than d see a disc of it, of radius sqrt(d^2 - 30^2)."""
    shares = {
        "near": 1 - (30 / 40) ** 2,
        "far": (30 / 40) ** 2,
        "kernel": 1 - (30 / 50) ** 2,
        "radii": 1 - (30 / 40) ** 2,
    }
    found = probe("wall", WALL, "furnace.gltf", "1.7,0,-0.5,1,0,0", 40000)
    for name, share in shares.items():
        lux, error = found[name]
        assert abs(lux - 683 * math.pi / 2 * share) < 4 * error < 20, name


def test_contact(probe):
    """At the foot of a block, final gathering over sparse photons finds what path tracing finds; plain Gather, twice as
    much."""
    found = probe("contact", CONTACT, "cornell_box.gltf", "0.9,0.01,-1.08,-0.292,0,0.956", 80000)
    lux, error = found["indirect"]
    truth, of_truth = found["traced"]
    assert abs(lux - truth) < 4 * math.hypot(error, of_truth) < truth / 8
    assert found["blurred"][0] > 2 * truth


@pytest.mark.parametrize(
    ("far", "warns"),
    [("direct", True), ("direct, distance = 1cm", False), ("direct, radii = 0", False), ("density", False)],
)
def test_a_warning_where_no_ray_is_ever_short(compiled_network, run_program, far, warns):
    source, *parameters = far.split(", ")
    text = "\n".join(
        [
            "network silent",
            "light = Lights()",
            "direct = Direct(light)",
            "density = NNDensity(ParticleTracer(light, count = 1k, via = ()))",
            f"image Gather(ByDistance({', '.join([source, 'direct', *parameters])}))",
        ]
    )
    program = compiled_network("silent", text=text)
    run = run_program(program, EXAMPLES / "scenes" / "cornell_box.gltf", "--samples", "1", "--size", "32x24")
    assert run.status == 0, run.stderr
    assert run.stderr.count("ByDistance: 'far' is no mean over a radius") == (1 if warns else 0)
    assert not warns or "give it a 'distance'" in run.stderr
