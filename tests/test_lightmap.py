"""`lightmap`: every texel against Lambert's formula, and the written file as our own programs see it."""

from __future__ import annotations

import json
import math
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from lnc.driver import compile_network
from lnc.source import SourceFile

SCENES = Path(__file__).resolve().parents[1] / "examples" / "scenes"
sys.path.insert(0, str(SCENES))
import closed_forms as known  # noqa: E402

BAKED = """
network baked
direct   = Direct(Lights())
expect   <= L
lightmap direct -> "floor.glb"
"""
MIRRORED = """
network mirrored
expect   <= L@area S
lightmap PathTracer(Direct(Lights()), via = S) -> "mirrored.glb"
"""
TWICE = """
network twice
direct = Direct(Lights())
again  = Direct(Lights())
expect   <= L
lightmap direct
       + again -> "floor.glb"
"""


def parts(path: Path) -> tuple[dict, bytes, dict[str, np.ndarray]]:
    """JSON, binary chunk, and of the mesh of fronts its attributes, positions in world coordinates."""
    data = path.read_bytes()
    size = int.from_bytes(data[12:16], "little")
    model, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    (node,) = (n for n in model["nodes"] if n["name"] == "front")
    primitive = model["meshes"][node["mesh"]]["primitives"][0]

    def accessor(i: int) -> np.ndarray:
        a = model["accessors"][i]
        kind, width = {"VEC3": ("<f4", 3), "VEC2": ("<f4", 2), "SCALAR": ("<u4", 1)}[a["type"]]
        offset = model["bufferViews"][a["bufferView"]]["byteOffset"]
        return np.frombuffer(binary, kind, a["count"] * width, offset).reshape(-1, width)

    found = {name: accessor(i).astype(float) for name, i in primitive["attributes"].items()}
    found["POSITION"] = found["POSITION"] * node["scale"] + node["translation"]
    found["triangles"] = accessor(primitive["indices"]).reshape(-1, 3)
    return model, binary, found


def floor_triangles(mesh: dict[str, np.ndarray]) -> list[np.ndarray]:
    return [t for t in mesh["triangles"] if np.abs(mesh["POSITION"][t, 1]).max() < 1e-3]


def area_irradiance(point: tuple[float, float, float]) -> np.ndarray:
    a, b = (np.array(edge) for edge in known.AREA_EDGES)
    corner = np.array(known.AREA_CORNER)
    corners = [tuple(map(float, corner + s * a + t * b)) for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return known.polygon_irradiance(corners, 1.0, point) * np.array(known.AREA_RADIANCE)


def test_texels(compiled_network, run_program, tmp_path):
    program = compiled_network("baked", text=BAKED)
    scene = SCENES / "plane_area.gltf"
    options = ("--samples", "64", "--lightmap-size", "128")
    run = run_program(program, scene, *options, "--threads", "2")
    assert run.status == 0, run.stderr
    assert "-o is not used" in run.stderr

    atlas = exr.read(tmp_path / "floor.exr")
    assert atlas.shape == (128, 128, 3)
    model, _, mesh = parts(tmp_path / "floor.glb")
    extras = model["asset"]["extras"]
    assert extras["lightPaths"] == "L D E"  # as irradiance: not by G, nor in mirrors
    assert extras["unit"] == "W/m^2" and extras["exposure"] > 0
    triangles = floor_triangles(mesh)
    assert len(triangles) == 2  # the floor is one chart
    ratios = []
    for triangle in triangles:
        uv, place = mesh["TEXCOORD_0"][triangle] * 128 - 0.5, mesh["POSITION"][triangle]
        to_world = np.linalg.solve(np.column_stack([uv, np.ones(3)]), place)
        low, high = np.ceil(uv.min(0) - 1e-3).astype(int), np.floor(uv.max(0) + 1e-3).astype(int)
        for y in range(low[1], high[1] + 1):
            for x in range(low[0], high[0] + 1):
                point = np.array([x, y, 1]) @ to_world
                if np.hypot(point[0], point[2]) > 2.5:
                    continue
                ratios.append(atlas[y, x] / area_irradiance((float(point[0]), 0.0, float(point[2]))))
    assert len(ratios) > 100
    assert np.abs(np.array(ratios) - 1).max() < 0.15
    assert abs(np.mean(ratios) - 1) < 0.01

    first = [(tmp_path / name).read_bytes() for name in ("floor.glb", "floor.exr")]
    run_program(program, scene, *options, "--threads", "1")
    assert first == [(tmp_path / name).read_bytes() for name in ("floor.glb", "floor.exr")]


def test_light_that_no_eye_sees(compiled_network, run_program, tmp_path):
    """A mirror lights its lamp: a picture of nothing but these two has no path L S D E, the lightmap has L S."""
    program = compiled_network("mirrored", text=MIRRORED)
    diffuse = SCENES / "plane_area.gltf"
    run = run_program(program, diffuse, "--samples", "4", "--lightmap-size", "64")
    (tracer,) = (node for node in run.stats["nodes"] if node["op"] == "PathTracer")
    assert (tracer["skipped"], tracer["rays"]) == ("the scene has no specular surface", 0)
    assert exr.read(tmp_path / "mirrored.exr").max() == 0

    model = json.loads(diffuse.read_text())
    for material in model["materials"]:
        if "emissiveFactor" not in material:
            material["pbrMetallicRoughness"] = {"metallicFactor": 1, "roughnessFactor": 0}
            del material["extensions"]
    shutil.copy(SCENES / "plane_area.bin", tmp_path)
    mirror = tmp_path / "mirror.gltf"
    mirror.write_text(json.dumps(model))
    run = run_program(program, mirror, "--samples", "64", "--lightmap-size", "64")
    assert run.status == 0, run.stderr
    (tracer,) = (node for node in run.stats["nodes"] if node["op"] == "PathTracer")
    assert tracer["skipped"] is None and tracer["rays"] > 0
    assert exr.read(tmp_path / "mirrored.exr").max() > 0


def test_light_counted_twice_is_found_where_it_is_written(library):
    (found,) = compile_network(SourceFile("twice.ln", TWICE), library).diagnostics
    assert (found.code, found.message) == ("LN0301", "L is counted 2 times on 'lightmap'")
    assert str(found.span) == "twice.ln:6:1"
    routes = [[f"{hop.wire} {hop.span}" for hop in route] for route in found.witness.routes]
    assert routes == [
        ["direct twice.ln:3:17", "lightmap twice.ln:6:10"],
        ["again twice.ln:4:17", "lightmap twice.ln:7:10"],
    ]


def test_our_programs_show_it(compiled_network, run_program, tmp_path):
    run_program(
        compiled_network("baked", text=BAKED), SCENES / "plane_area.gltf", "--lightmap-size", "128", "--samples", "64"
    )
    model, binary, _ = parts(tmp_path / "floor.glb")
    model["cameras"] = [{"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1.5, "zfar": 10, "znear": 0.01}}]
    down = math.sqrt(0.5)
    model["nodes"].append({"camera": 0, "translation": [0, 0.5, 0], "rotation": [-down, 0, 0, down]})
    model["scenes"][0]["nodes"].append(len(model["nodes"]) - 1)
    text = json.dumps(model).encode()
    text += b" " * (-len(text) % 4)
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text + len(binary).to_bytes(4, "little") + b"BIN\0" + binary
    shown = tmp_path / "shown.glb"
    shown.write_bytes(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)
    run = run_program(compiled_network("direct"), shown, "--size", "8x6", "--samples", "64")
    assert run.status == 0, run.stderr
    picture = exr.read(run.picture)
    for y in range(6):
        for x in range(8):
            wanted = area_irradiance(((x - 3.5) / 2, 0.0, (y - 2.5) / 2)) * model["asset"]["extras"]["exposure"]
            np.testing.assert_allclose(picture[y, x], np.minimum(wanted, 1), rtol=0.05, atol=0.01)


def test_others_read_it(compiled_network, run_program, tmp_path):
    """An independent reader finds the floor in world coordinates, and on it the texture that the atlas demands."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("PIL")
    run_program(
        compiled_network("baked", text=BAKED), SCENES / "plane_area.gltf", "--lightmap-size", "64", "--samples", "4"
    )
    scene = trimesh.load_scene(tmp_path / "floor.glb")
    extras = (
        scene.metadata["asset"]["extras"]
        if "asset" in scene.metadata
        else parts(tmp_path / "floor.glb")[0]["asset"]["extras"]
    )
    (front,) = (scene.to_geometry() if len(scene.geometry) == 1 else scene.dump()[:1],)
    low, high = front.bounds
    np.testing.assert_allclose(high[[0, 2]] - low[[0, 2]], 2 * known.PLANE_HALF_SIZE, rtol=1e-4)
    assert ((front.visual.uv >= 0) & (front.visual.uv <= 1)).all()
    texture = np.asarray(front.visual.material.baseColorTexture.convert("RGB")) / 255
    wanted = np.minimum(exr.read(tmp_path / "floor.exr") * extras["exposure"], 1)
    assert texture.shape == wanted.shape
    encoded = np.where(wanted <= 0.0031308, 12.92 * wanted, 1.055 * wanted ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(texture, encoded, atol=0.6 / 255)
