"""`probe`: irradiance at sensors against closed forms, with standard errors that are true; and what it refuses."""

from __future__ import annotations

import csv
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[1] / "examples" / "scenes"
sys.path.insert(0, str(SCENES))
import closed_forms as known  # noqa: E402

PROBE = """
network lux
light  = Lights()
direct = Direct(light)
pt     = PathTracer(direct + pt)
probe  direct at "sensors.csv" -> "direct.csv"
probe  direct + pt at "sensors.csv" -> "all.csv"
"""
PHOTONS = """
network photon_lux
tag ground = node "Floor"
light   = Lights()
photons = ParticleTracer(light, count = 200k, via = ())
near    = NNDensity(photons, neighbours = 200, to = ground)
tagged  = Direct(light, to = ground)
expect  <= L
probe   near at "sensors.csv" -> "photons.csv"
probe   tagged at "sensors.csv" -> "tagged.csv"
"""
LUMENS = 683 * np.array([0.2126, 0.7152, 0.0722])

Vector = tuple[float, float, float]
Sensor = tuple[Vector, Vector]
Measure = Callable[..., dict[str, np.ndarray]]


def tilted(angle: float, turn: float) -> Vector:
    return (math.sin(angle) * math.cos(turn), math.cos(angle), math.sin(angle) * math.sin(turn))


def grid(height: float, normal: Vector = known.UP, columns: int = 16, rows: int = 10) -> list[Sensor]:
    """Sensors around the y axis."""
    xs, zs = np.linspace(-1.5, 1.5, columns), np.linspace(-1.1, 1.3, rows)
    return [((float(x), height, float(z)), normal) for z in zs for x in xs]


@pytest.fixture
def measure(tmp_path: Path) -> Measure:
    """measure(program, scene, sensors, "all.csv", *options): the columns of a probe's table."""

    def run(program: Path, scene: Path, sensors: list[Sensor], table: str, *options: str) -> dict[str, np.ndarray]:
        rows = "".join(",".join(map(repr, (*p, *n))) + "\n" for p, n in sensors)
        (tmp_path / "sensors.csv").write_text(rows)
        command = [str(program), str(scene), "--progress", "none", *options]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stderr
        with (tmp_path / table).open() as file:
            found = list(csv.DictReader(file))
        assert len(found) == len(sensors)
        return {name: np.array([float(row[name]) for row in found]) for name in found[0]}

    return run


def rgb(columns: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([columns[c] for c in ("E_r", "E_g", "E_b")], axis=-1)


def check_errors(columns: dict[str, np.ndarray], exact: np.ndarray) -> None:
    """Deviations in standard errors have the spread that 15 degrees of freedom give them: 15/13, and no bias."""
    z = (columns["lux"] - exact @ LUMENS) / columns["stderr"]
    n = len(z)
    assert abs(z.mean()) < 4 * math.sqrt(15 / 13 / n)
    spread = math.sqrt((3 * 15**2 / (13 * 11) - (15 / 13) ** 2) / n)  # of z^2: Student's fourth moment
    assert abs((z**2).mean() - 15 / 13) < 4 * spread


def test_point_light(compiled_network, measure):
    program = compiled_network("lux", text=PROBE)
    sensors = grid(0.0) + grid(0.7, tilted(0.5, 1.0))
    found = measure(program, SCENES / "plane_point.gltf", sensors, "direct.csv", "--samples", "4")
    light = np.array(known.POINT_COLOR)
    exact = [known.point_irradiance(known.POINT_POSITION, known.POINT_INTENSITY, p, n) * light for p, n in sensors]
    np.testing.assert_allclose(rgb(found), exact, rtol=2e-5, atol=1e-6)
    np.testing.assert_allclose(found["lux"], rgb(found) @ LUMENS, rtol=1e-6)
    photometric = measure(
        program, SCENES / "plane_point.gltf", sensors, "direct.csv", "--samples", "4", "--units", "photometric"
    )
    np.testing.assert_allclose(photometric["lux"] * 683, found["lux"], rtol=1e-6)


def test_polygonal_light(compiled_network, measure):
    a, b = known.AREA_EDGES
    corner = np.array(known.AREA_CORNER)
    corners = [
        tuple(map(float, corner + s * np.array(a) + t * np.array(b))) for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    sensors = grid(0.0) + grid(1.1, tilted(0.2, 2.0))
    exact = np.array([known.polygon_irradiance(corners, 1.0, p, n) * np.array(known.AREA_RADIANCE) for p, n in sensors])
    found = measure(
        compiled_network("lux", text=PROBE), SCENES / "plane_area.gltf", sensors, "direct.csv", "--samples", "256"
    )
    assert np.abs(rgb(found) / exact - 1).max() < 0.02
    check_errors(found, exact)


def test_environment_above_a_plane(compiled_network, measure, tmp_path):
    """Above an endless plane of albedo rho below an even sky, E = pi L ((1 + cos) / 2 + rho (1 - cos) / 2)."""
    sky = np.array([1.0, 2.0, 3.0])
    exr.write(tmp_path / "sky.exr", np.broadcast_to(sky, (4, 8, 3)))
    scene = tmp_path / "plane.gltf"
    make_plane(scene)
    # Not level: so few samples would find the plane that their errors could not be told.
    sensors = [((0.1 * i, 0.02, -0.05 * i), tilted(0.3 + 0.06 * i, 0.7 * i)) for i in range(40)]
    cos = np.array([n[1] for _, n in sensors])[:, None]
    program = compiled_network("lux", text=PROBE)
    options = ("--env", str(tmp_path / "sky.exr"), "--samples", "1000")
    direct = measure(program, scene, sensors, "direct.csv", *options)
    exact = math.pi * sky * (1 + cos) / 2
    np.testing.assert_allclose(rgb(direct).mean(0), exact.mean(0), rtol=0.005)
    check_errors(direct, exact)
    whole = measure(program, scene, sensors, "all.csv", *options)
    exact = exact + math.pi * sky * np.array(known.ALBEDO) * (1 - cos) / 2
    np.testing.assert_allclose(rgb(whole).mean(0), exact.mean(0), rtol=0.005)
    check_errors(whole, exact)


def make_plane(path: Path) -> None:
    """The plane of `plane_point`, without its light."""
    import json

    model = json.loads((SCENES / "plane_point.gltf").read_text())
    model.pop("extensions", None)
    model.pop("extensionsUsed", None)
    for node in model["nodes"]:
        node.pop("extensions", None)
    for buffer in model["buffers"]:
        (path.parent / buffer["uri"]).write_bytes((SCENES / buffer["uri"]).read_bytes())
    path.write_text(json.dumps(model))


def test_same_bytes_on_any_number_of_threads(compiled_network, measure, tmp_path):
    program = compiled_network("lux", text=PROBE)
    tables = []
    for threads in ("1", "2", "5"):
        options = ("--samples", "37", "--threads", threads, "--seed", "7")
        measure(program, SCENES / "plane_area.gltf", grid(0.3), "all.csv", *options)
        tables.append((tmp_path / "all.csv").read_bytes())
    assert tables[0] == tables[1] == tables[2]


def test_stored_irradiance_is_known_on_surfaces(compiled_network, measure, tmp_path):
    program = compiled_network("photon_lux", text=PHOTONS)
    scene = SCENES / "plane_area.gltf"
    on = grid(0.0)
    found = measure(program, scene, on, "photons.csv")
    exact = measure(program, scene, on, "tagged.csv", "--samples", "64")
    assert abs((rgb(found) / rgb(exact)).mean() - 1) < 0.03
    assert (found["stderr"] == 0).all()  # the photons are given
    for off in (((0.5, 0.01, 0.5), known.UP), ((0.5, 0.0, 0.5), (1.0, 0.0, 0.0))):
        (tmp_path / "sensors.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,1,0\n" + ",".join(map(str, (*off[0], *off[1]))))
        done = subprocess.run([str(program), str(scene)], capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 1
        assert "sensors.csv:3: this sensor is on no surface, but 'near' is known on surfaces only" in done.stderr


@pytest.mark.parametrize("place", ["1e30,0,0", "0,-1e300,0"])
def test_a_sensor_out_of_reach(compiled_network, tmp_path, place):
    program = compiled_network("lux", text=PROBE)
    (tmp_path / "sensors.csv").write_text(f"0,1,0,0,1,0\n{place},0,1e300,0\n")
    command = [str(program), str(SCENES / "plane_area.gltf")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 1
    assert "sensors.csv:2: this sensor is too far away from the scene" in done.stderr


def test_no_image_no_picture(compiled_network, run_program, tmp_path):
    program = compiled_network("lux", text=PROBE)
    (tmp_path / "sensors.csv").write_text("0,0.5,0,0,1,0\n")
    run = run_program(program, SCENES / "plane_point.gltf", "--size", "8x5")
    assert run.status == 0
    assert "-o is not used" in run.stderr and "--size is not used" in run.stderr
    assert not run.picture.exists()
    assert run.stats["samples"] == 1024 and run.stats["rays"]["camera"] == 0
    (tmp_path / "sensors.csv").write_text("0,0.5,0,0,0,0\n")
    run = run_program(program, SCENES / "plane_point.gltf")
    assert run.status == 1 and "sensors.csv:1: the normal nx,ny,nz is zero" in run.stderr


def test_picture_and_probe(compiled_network, run_program, tmp_path):
    (tmp_path / "sensors.csv").write_text("0,0.5,0,0,1,0\n")
    text = PROBE.replace("network lux", "network both") + "image direct\n"
    run = run_program(
        compiled_network("both", text=text), SCENES / "plane_point.gltf", "--size", "8x5", "--samples", "2"
    )
    assert run.status == 0, run.stderr
    assert exr.read(run.picture).shape == (5, 8, 3)
    assert (tmp_path / "all.csv").exists()
