"""Taps of what is stored: files that hold the light that closed forms demand, in formats that others read."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[1] / "examples" / "scenes"
sys.path.insert(0, str(SCENES))
import closed_forms as known  # noqa: E402

NETWORK = """
network tapped_light
tag none = node "nowhere"
light   = Lights()
photons = ParticleTracer(light, count = 50k, via = ())
kd_tree = KDPhotonTree(photons)
sorted  = PhotonSurfSort(photons)
direct  = Direct(light)
cells   = PointsToQuadTree(direct, error = 0.2%)
smooth  = QuadTreeToTriMesh(cells)
records = IGCache(IGSampler(PathTracer(direct, via = D), samples = 256))
tap photons -> "photons.ply"
tap photons -> "photons.csv"
tap light   -> "light.ply"
tap light   -> "light.csv"
tap kd_tree -> "kd_tree.ply"
tap kd_tree -> "kd_tree.csv"
tap Lights(from = none) -> "no_light.ply"
tap sorted  -> "sorted.ply"
tap sorted  -> "sorted.csv"
tap cells   -> "cells.glb"
tap smooth  -> "smooth.glb"
tap records -> "records.ply"
tap records -> "records.csv"
tap ParticleTracer(light, via = S) -> "no_photons.ply"
tap ParticleTracer(light, via = S) -> "no_photons.csv"
tap PointsToQuadTree(Direct(light, to = none)) -> "no_cells.glb"
expect <= L (D|G|S)* E
image IGInterpolator(records)
"""
SMALL = ("--size", "16x12", "--samples", "1")
COLUMNS = ["x", "y", "z", "nx", "ny", "nz", "wi_x", "wi_y", "wi_z", "flux_r", "flux_g", "flux_b"]
GRADIENTS = [f"{kind}_{channel}_{axis}" for kind in ("rotation", "translation") for channel in "rgb" for axis in "xyz"]
RECORD_COLUMNS = [*COLUMNS[:6], "E_r", "E_g", "E_b", "radius", *GRADIENTS, "beyond"]


def read_ply(path: Path) -> np.ndarray:
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    types = {"float": "<f4", "uint": "<u4", "uchar": "u1"}
    fields = [(line.split()[2], types[line.split()[1]]) for line in lines if line.startswith("property")]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    found = np.frombuffer(body, np.dtype(fields))
    assert len(found) == count
    return found


def read_glb(path: Path) -> tuple[dict[str, Any], dict[str, dict[str, np.ndarray]]]:
    """The JSON, and by mesh its attributes and its triangles in world coordinates."""
    data = path.read_bytes()
    assert data[:4] == b"glTF" and int.from_bytes(data[8:12], "little") == len(data)
    size = int.from_bytes(data[12:16], "little")
    model = json.loads(data[20 : 20 + size])
    binary = data[28 + size :]

    def accessor(i: int) -> np.ndarray:
        a = model["accessors"][i]
        view = model["bufferViews"][a["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[a["componentType"]]
        return np.frombuffer(binary, kind, a["count"] * width, view["byteOffset"]).reshape(a["count"], width)

    meshes = {}
    for node in model.get("nodes", []):
        primitive = model["meshes"][node["mesh"]]["primitives"][0]
        mesh = {name: accessor(i) for name, i in primitive["attributes"].items()}
        world = mesh["POSITION"].astype(float) * node["scale"] + node["translation"]
        mesh["triangles"] = accessor(primitive["indices"])[:, 0].reshape(-1, 3)
        mesh["corners"] = world[mesh["triangles"]]
        meshes[node["name"]] = mesh
    return model, meshes


def flux(mesh: dict[str, np.ndarray]) -> np.ndarray:
    """Integral of the irradiance, which is linear on each triangle."""
    a, b, c = (mesh["corners"][:, i] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.asarray((area[:, None] * mesh["_IRRADIANCE"][mesh["triangles"]].mean(axis=1)).sum(axis=0))


def assert_csv(path: Path, like: np.ndarray, columns: list[str]) -> None:
    """A table holds the numbers of a point cloud."""
    table = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True))
    assert list(table.dtype.names) == columns
    for name in columns:
        np.testing.assert_allclose(table[name], like[name], rtol=1e-6, atol=1e-7)


def vectors(table: np.ndarray, *names: str) -> np.ndarray:
    return np.stack([table[name].astype(float) for name in names], axis=-1)


def floor_flux() -> np.ndarray:
    """Of the point light, through the solid angle of the floor (a rectangle cut into four at the foot of the light)."""
    x, h, z = known.POINT_POSITION
    solid_angle = sum(
        math.atan(a * b / (h * math.sqrt(a * a + b * b + h * h)))
        for a in (known.PLANE_HALF_SIZE - x, known.PLANE_HALF_SIZE + x)
        for b in (known.PLANE_HALF_SIZE - z, known.PLANE_HALF_SIZE + z)
    )
    return known.POINT_INTENSITY * np.array(known.POINT_COLOR) * solid_angle


def test_files_hold_the_light(compiled_network, run_program, tmp_path):
    program = compiled_network("tapped_light", text=NETWORK)
    run = run_program(program, SCENES / "plane_point.gltf", *SMALL, "--threads", "2")
    assert run.status == 0, run.stderr

    photons = read_ply(tmp_path / "photons.ply")
    count = 50_000
    share = len(photons) / count
    power = np.array([photons[f"flux_{c}"].sum(dtype=float) for c in "rgb"])
    noise = math.sqrt((1 - share) / share / count)
    np.testing.assert_allclose(power, floor_flux(), rtol=4 * noise)
    np.testing.assert_allclose(photons["ny"], 1, atol=1e-3)
    # Photons come straight from the lamp.
    wi = vectors(photons, "wi_x", "wi_y", "wi_z")
    towards = np.array(known.POINT_POSITION) - vectors(photons, "x", "y", "z")
    np.testing.assert_allclose(wi, towards / np.linalg.norm(towards, axis=1)[:, None], atol=2e-4)
    assert 120 < photons["red"].mean() < 255

    assert_csv(tmp_path / "photons.csv", photons, COLUMNS)

    light = read_ply(tmp_path / "light.ply")
    assert_csv(tmp_path / "light.csv", light, [*COLUMNS[:3], "w_x", "w_y", "w_z", *COLUMNS[9:], "delta"])
    power = [light[f"flux_{c}"].sum(dtype=float) for c in "rgb"]
    np.testing.assert_allclose(power, 4 * math.pi * known.POINT_INTENSITY * np.array(known.POINT_COLOR), rtol=1e-3)
    np.testing.assert_allclose(vectors(light, "x", "y", "z"), [known.POINT_POSITION] * len(light), atol=1e-5)
    np.testing.assert_allclose(vectors(light, "w_x", "w_y", "w_z").mean(axis=0), 0, atol=1e-2)
    assert (light["delta"] == 1).all()

    kd_tree = read_ply(tmp_path / "kd_tree.ply")
    assert_csv(tmp_path / "kd_tree.csv", kd_tree, [*COLUMNS[:6], *COLUMNS[9:]])
    for name in [*COLUMNS[:6], *COLUMNS[9:]]:
        np.testing.assert_array_equal(np.sort(kd_tree[name]), np.sort(photons[name]))

    for name in ("cells", "smooth"):
        model, meshes = read_glb(tmp_path / f"{name}.glb")
        assert list(meshes) == ["front"]
        mesh = meshes["front"]
        np.testing.assert_allclose(flux(mesh), floor_flux(), rtol=0.02)
        exposure = model["asset"]["extras"]["exposure"]
        np.testing.assert_allclose(mesh["COLOR_0"], np.minimum(mesh["_IRRADIANCE"] * exposure, 1), rtol=1e-5)
        a, b, c = (mesh["corners"][:, i] for i in range(3))
        assert (np.cross(b - a, c - a)[:, 1] > 0).all()  # fronts look up
        np.testing.assert_allclose(mesh["corners"][..., 1], 0, atol=1e-5)

    before = {path.name: path.read_bytes() for path in tmp_path.glob("*.[pcg]*") if path.suffix != ".exr"}
    assert len(before) == 16
    run_program(program, SCENES / "plane_point.gltf", *SMALL, "--threads", "1")
    for name, content in before.items():
        assert (tmp_path / name).read_bytes() == content, name

    # What carries no light gives empty files.
    assert len(read_ply(tmp_path / "no_photons.ply")) == len(read_ply(tmp_path / "no_light.ply")) == 0
    assert (tmp_path / "no_photons.csv").read_text() == ",".join(COLUMNS) + "\n"
    assert "no_cells.glb: nothing on this wire is lit" in run.stderr
    assert not read_glb(tmp_path / "no_cells.glb")[1]


def test_sorted_photons(compiled_network, run_program, tmp_path):
    """The same photons, surface by surface; in a room of flat walls, each has one normal and one plane."""
    program = compiled_network("tapped_light", text=NETWORK)
    run = run_program(program, SCENES / "closed_box.gltf", *SMALL)
    assert run.status == 0, run.stderr
    photons, found = read_ply(tmp_path / "photons.ply"), read_ply(tmp_path / "sorted.ply")
    assert_csv(tmp_path / "sorted.csv", found, [*COLUMNS, "surface"])
    for name in COLUMNS:
        np.testing.assert_array_equal(np.sort(found[name]), np.sort(photons[name]))
    assert (np.diff(found["surface"].astype(int)) >= 0).all()
    planes = []
    for surface in np.unique(found["surface"]):
        own = found[found["surface"] == surface]
        normal = vectors(own, "nx", "ny", "nz")
        height = (vectors(own, "x", "y", "z") * normal).sum(axis=1)
        np.testing.assert_allclose(normal - normal[0], 0, atol=1e-6)
        np.testing.assert_allclose(height, height[0], atol=1e-3)
        planes.append((*np.round(normal[0], 2), round(float(height[0]), 2)))
    assert len(set(planes)) == len(planes) == 5  # all that the lamp shines on: walls and floor


def test_irradiance_records(compiled_network, run_program, tmp_path):
    """Of one reflection: pi albedo in a closed room that shines; elsewhere gradients foretell what neighbours found."""
    program = compiled_network("tapped_light", text=NETWORK)
    run = run_program(program, SCENES / "furnace.gltf", *SMALL)
    assert run.status == 0, run.stderr
    records = read_ply(tmp_path / "records.ply")
    assert_csv(tmp_path / "records.csv", records, RECORD_COLUMNS)
    assert len(records) > 5 and not records["beyond"].any()
    found = vectors(records, "E_r", "E_g", "E_b")[:, 0]
    assert abs(found.mean() - 0.5 * math.pi) < 4 * found.std() / math.sqrt(len(found)) < 0.01

    run_program(program, SCENES / "closed_box.gltf", "--size", "64x48", "--samples", "1")
    records = read_ply(tmp_path / "records.ply")
    place, normal = vectors(records, "x", "y", "z"), vectors(records, "nx", "ny", "nz")
    irradiance = vectors(records, "E_r", "E_g", "E_b")
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-5)
    slope = vectors(records, *GRADIENTS[9:]).reshape(-1, 3, 3)
    offset = place[None, :] - place[:, None]  # from i to j
    near = (normal @ normal.T > 0.99) & (np.linalg.norm(offset, axis=2) < 3 * records["radius"][:, None])
    i, j = np.nonzero(near & ~np.eye(len(records), dtype=bool))
    assert len(i) > 100
    change = irradiance[j] - irradiance[i]
    for gradient, left in (slope[i], 0.3), (0.5 * (slope[i] + slope[j]), 0.1):  # the latter is how it is interpolated
        foretold = np.einsum("kcx,kx->kc", gradient, offset[i, j])
        assert ((change - foretold) ** 2).mean() < left * (change**2).mean()


def test_our_programs_render_what_is_written(compiled_network, run_program, tmp_path):
    """Seen straight from the front, a cell has its colour."""
    run_program(compiled_network("tapped_light", text=NETWORK), SCENES / "plane_point.gltf", *SMALL)
    data = (tmp_path / "smooth.glb").read_bytes()
    size = int.from_bytes(data[12:16], "little")
    model = json.loads(data[20 : 20 + size])
    model["cameras"] = [{"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1.5, "zfar": 10, "znear": 0.01}}]
    down = math.sqrt(0.5)
    model["nodes"].append({"camera": 0, "translation": [0, 3, 0], "rotation": [-down, 0, 0, down]})
    model["scenes"][0]["nodes"].append(len(model["nodes"]) - 1)
    text = json.dumps(model).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    shown = tmp_path / "shown.glb"
    header = b"glTF" + (2).to_bytes(4, "little") + (20 + len(text) + len(rest)).to_bytes(4, "little")
    shown.write_bytes(header + len(text).to_bytes(4, "little") + b"JSON" + text + rest)
    run = run_program(compiled_network("direct"), shown, "--size", "8x6", "--samples", "64")
    assert run.status == 0, run.stderr
    picture = exr.read(run.picture)
    exposure = model["asset"]["extras"]["exposure"]
    for y in range(6):
        for x in range(8):
            place = ((x - 3.5) / 2, 0.0, (y - 2.5) / 2)
            wanted = known.point_irradiance(known.POINT_POSITION, known.POINT_INTENSITY, place)
            colour = np.minimum(wanted * np.array(known.POINT_COLOR) * exposure, 1)
            np.testing.assert_allclose(picture[y, x], colour, rtol=0.06)
