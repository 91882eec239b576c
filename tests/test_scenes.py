"""The scenes of examples/scenes are what their script makes, and they are sound glTF files."""

from __future__ import annotations

import json
import math
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SCENES = Path(__file__).resolve().parent.parent / "examples" / "scenes"
sys.path.insert(0, str(SCENES))

import closed_forms  # noqa: E402
import make_scenes  # noqa: E402
import shapes  # noqa: E402

FILES = sorted(make_scenes.SCENES)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    subprocess.run([sys.executable, str(SCENES / "make_scenes.py"), "--out", str(folder)], check=True)
    return folder


def read(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON document and the one buffer of a .gltf or .glb file."""
    if path.suffix == ".gltf":
        document = json.loads(path.read_text())
        return document, (path.parent / document["buffers"][0]["uri"]).read_bytes()
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    binary_size, binary_kind = struct.unpack_from("<I4s", data, 20 + size)
    assert binary_kind == b"BIN\0" and 28 + size + binary_size == length
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def values(document: dict[str, Any], data: bytes, index: int) -> list[tuple[float, ...]]:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    letter = {5126: "f", 5123: "H", 5125: "I"}[accessor["componentType"]]
    layout = struct.Struct(f"<{ {'VEC3': 3, 'SCALAR': 1}[accessor['type']] }{letter}".replace(" ", ""))
    assert view["byteOffset"] % 4 == 0
    assert accessor["count"] * layout.size == view["byteLength"]
    assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"] == len(data)
    return [layout.unpack_from(data, view["byteOffset"] + i * layout.size) for i in range(accessor["count"])]


def test_the_kept_files_are_what_the_script_makes(made: Path) -> None:
    names = sorted(path.name for path in made.iterdir())
    assert names == sorted(p.name for p in SCENES.iterdir() if p.suffix in (".gltf", ".glb", ".bin"))
    for name in names:
        assert (made / name).read_bytes() == (SCENES / name).read_bytes(), f"{name}: run make_scenes.py again"
        assert (made / name).stat().st_size < 200_000


@pytest.mark.parametrize("file", FILES)
def test_structure(file: str) -> None:
    document, data = read(SCENES / file)
    assert document["asset"]["version"] == "2.0"
    used = set(document.get("extensions", {}))
    for thing in document["materials"] + document["nodes"]:
        used |= set(thing.get("extensions", {}))
    assert used == set(document.get("extensionsUsed", []))
    assert document["scenes"][0]["nodes"] == list(range(len(document["nodes"])))
    for node in document["nodes"]:
        assert node["name"]
        for key, things in (("mesh", "meshes"), ("camera", "cameras")):
            assert node.get(key, 0) < len(document[things])
        if "rotation" in node:
            assert math.hypot(*node["rotation"]) == pytest.approx(1, abs=1e-6)
    assert sum("camera" in node for node in document["nodes"]) == 1
    for material in document["materials"]:
        assert all(0 <= c <= 1 for c in material["pbrMetallicRoughness"]["baseColorFactor"])
        assert all(0 <= c <= 1 for c in material.get("emissiveFactor", [0]))
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            check_primitive(document, data, primitive)


def check_primitive(document: dict[str, Any], data: bytes, primitive: dict[str, Any]) -> None:
    """Bounds hold, normals are unit, indices are in range, and the winding agrees with the normals."""
    assert primitive["material"] < len(document["materials"])
    positions = values(document, data, primitive["attributes"]["POSITION"])
    normals = values(document, data, primitive["attributes"]["NORMAL"])
    indices = [int(i) for (i,) in values(document, data, primitive["indices"])]
    accessor = document["accessors"][primitive["attributes"]["POSITION"]]
    assert accessor["min"] == [min(axis) for axis in zip(*positions, strict=True)]
    assert accessor["max"] == [max(axis) for axis in zip(*positions, strict=True)]
    assert len(normals) == len(positions)
    assert len(indices) % 3 == 0 and max(indices) < len(positions)
    assert all(math.hypot(*n) == pytest.approx(1, abs=1e-5) for n in normals)
    for i in range(0, len(indices), 3):
        p, q, r = (positions[k] for k in indices[i : i + 3])
        face = shapes.cross(shapes.sub(q, p), shapes.sub(r, p))
        assert math.hypot(*face) > 0
        assert all(shapes.dot(face, normals[k]) > 0.5 * math.hypot(*face) for k in indices[i : i + 3])


CLOSED_SHAPES = {
    "box": shapes.box((1.0, 2.0, 3.0)),
    "icosphere": shapes.icosphere(0.8, 2),
    "octahedron": shapes.octahedron(0.5),
    "rod": shapes.rod(0.1, 1.5, 12),
    "lump": shapes.lump(2, 0.3),
}


@pytest.mark.parametrize("name", CLOSED_SHAPES)
def test_solids_are_closed_and_face_outwards(name: str) -> None:
    shape = CLOSED_SHAPES[name]
    edges = set()
    for triangle in shape.triangles:
        corners = [tuple(round(c, 9) for c in shape.positions[i]) for i in triangle]
        edges |= {(corners[i], corners[(i + 1) % 3]) for i in range(3)}
    assert len(edges) == 3 * len(shape.triangles)
    assert all((b, a) in edges for a, b in edges)
    p = shape.positions
    volume = sum(shapes.dot(p[a], shapes.cross(p[b], p[c])) for a, b, c in shape.triangles) / 6
    assert volume > 0


def test_room_walls_face_inwards() -> None:
    low, high = (-1.0, 0.0, -2.0), (3.0, 2.0, 5.0)
    walls = shapes.room_walls(low, high)
    outwards = {"left": (0, -1), "right": (0, 1), "floor": (1, -1), "ceiling": (1, 1), "back": (2, -1), "front": (2, 1)}
    for side, (axis, sign) in outwards.items():
        assert all(n[axis] == -sign for n in walls[side].normals)
        assert all(p[axis] == (low, high)[sign > 0][axis] for p in walls[side].positions)


def test_parabolic_mirror_makes_a_parallel_beam() -> None:
    dish = shapes.paraboloid(0.2, 0.5, 8, 32)
    for p, n in zip(dish.positions, dish.normals, strict=True):
        towards = shapes.normalized(shapes.sub(p, (0.0, 0.2, 0.0)))
        reflected = shapes.sub(towards, shapes.scaled(n, 2 * shapes.dot(towards, n)))
        assert reflected == pytest.approx((0, 1, 0), abs=1e-9)


def test_polygon_irradiance_against_numerical_integration() -> None:
    corners = closed_forms.area_corners()
    point = (0.4, 0.0, -0.9)
    count = 200
    (x0, y, z0), (width, _, _), (_, _, depth) = closed_forms.AREA_CORNER, *closed_forms.AREA_EDGES
    total = 0.0
    for i in range(count):
        for j in range(count):
            light = (x0 + (i + 0.5) / count * width, y, z0 + (j + 0.5) / count * depth)
            d = shapes.sub(light, point)
            total += y * y / shapes.dot(d, d) ** 2  # cos at both ends is y / distance
    expected = 3.0 * total * width * depth / count**2
    assert closed_forms.polygon_irradiance(corners, 3.0, point) == pytest.approx(expected, rel=1e-5)


def test_spot_falloff() -> None:
    down = (0.0, -1.0, 0.0)
    inner, outer = closed_forms.SPOT_CONE

    def at(angle: float) -> float:
        return closed_forms.spot_falloff(down, (math.sin(angle), -math.cos(angle), 0.0), inner, outer)

    assert at(0.5 * inner) == 1 and at(1.01 * outer) == 0
    assert at(inner) == pytest.approx(1) and at(outer) == pytest.approx(0, abs=1e-12)
    middle = math.acos((math.cos(inner) + math.cos(outer)) / 2)
    assert at(middle) == pytest.approx(0.25)


def test_every_pixel_of_a_plane_scene_sees_the_plane() -> None:
    for name in closed_forms.NAMES:
        for x, y in ((0, 0), (8, 0), (0, 6), (8, 6)):
            p = closed_forms.visible_point(name, x, y, 8, 6)
            assert p[1] == pytest.approx(0, abs=1e-12)
            assert max(abs(c) for c in p) < closed_forms.PLANE_HALF_SIZE
    image = closed_forms.expected_image("plane_area", 4, 3)
    assert len(image) == 3 and len(image[0]) == 4 and all(c > 0 for row in image for pixel in row for c in pixel)


def test_large_scene_has_the_size_asked_for(tmp_path: Path) -> None:
    scene = make_scenes.many_lights(triangles=20_000, lights=30)
    scene.write(tmp_path / "small.glb")
    document, data = read(tmp_path / "small.glb")
    for mesh in document["meshes"]:
        check_primitive(document, data, mesh["primitives"][0])
    counts = [document["accessors"][m["primitives"][0]["indices"]]["count"] // 3 for m in document["meshes"]]
    assert sum(counts[node["mesh"]] for node in document["nodes"] if "mesh" in node) == pytest.approx(20_000, rel=0.1)
    assert sum(node["name"].startswith("Bulb") for node in document["nodes"]) == 30
