"""glTF files as the runtime loads them: a shared set of valid and hostile ones, and ones that are written here.

The shared set is looked for in $LN_GLTF_SET, or in ../shared/gltf beside the checkout; without it those tests are
skipped.
"""

from __future__ import annotations

import json
import os
import random
import struct
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("LN_GLTF_SET", ROOT.parent / "shared" / "gltf"))

SECONDS = 10
ADDRESS_SPACE = 3 << 30
MIB = 1 << 20


@dataclass(frozen=True)
class Loaded:
    """How loading a file ended."""

    status: int
    info: dict[str, Any]
    message: str
    seconds: float
    peak_bytes: int


Load = Callable[[Path], Loaded]


@pytest.fixture(scope="session")
def load(runtime_tool: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Load:
    """Loads a file with ln_scene_info within time and memory; fails if that crashes, hangs or says more than a line."""
    tool = runtime_tool("ln_scene_info")
    folder = tmp_path_factory.mktemp("scene_info")

    def run(path: Path) -> Loaded:
        out, err = folder / "out", folder / "err"
        with out.open("wb") as stdout, err.open("wb") as stderr:
            limits = ["prlimit", f"--as={ADDRESS_SPACE}", "timeout", "-s", "KILL", str(6 * SECONDS)]
            process = subprocess.Popen([*limits, str(tool), str(path)], stdout=stdout, stderr=stderr)
            _, wait_status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(wait_status)
        message = err.read_text()
        assert process.returncode in (0, 1), (process.returncode, message)
        info = json.loads(out.read_bytes())
        loaded = Loaded(process.returncode, info, message, usage.ru_utime + usage.ru_stime, info["peak_bytes"])
        assert loaded.seconds < SECONDS, loaded
        lines = message.splitlines()
        assert len(lines) == (0 if loaded.status == 0 else 1), message
        assert not any(ord(c) < 0x20 or ord(c) == 0x7F for line in lines for c in line), message
        return loaded

    return run


# ---------------------------------------------------------------- the shared set


def shared_files(which: str) -> list[Any]:
    manifest = SHARED / which / "manifest.json"
    if not manifest.exists():
        return []
    found = []
    for entry in json.loads(manifest.read_text()):
        for file in entry.get("files", [entry]):
            if file["file"].endswith((".gltf", ".glb")):
                found.append(pytest.param(file["file"], entry["expected"], id=file["file"]))
    return found


@pytest.mark.skipif(not SHARED.exists(), reason="the shared set of glTF files is not there")
@pytest.mark.parametrize(("name", "expected"), shared_files("valid"))
def test_valid(name: str, expected: str, load: Load) -> None:
    loaded = load(SHARED / "valid" / name)
    if expected == "error-unsupported-extension":
        assert loaded.status == 1
        assert "KHR_draco_mesh_compression" in loaded.message or "EXT_meshopt_compression" in loaded.message
    elif expected == "load":
        assert loaded.status == 0, loaded.message
        assert loaded.info["triangles"] > 0


@pytest.mark.skipif(not SHARED.exists(), reason="the shared set of glTF files is not there")
@pytest.mark.parametrize(("name", "expected"), shared_files("invalid"))
def test_invalid(name: str, expected: str, load: Load) -> None:
    path = SHARED / "invalid" / name
    loaded = load(path)
    if expected == "error":
        assert loaded.status == 1
    if loaded.status == 1:
        assert path.name in loaded.message
        assert loaded.peak_bytes < 200 * MIB


@pytest.mark.skipif(not SHARED.exists(), reason="the shared set of glTF files is not there")
def test_equal_groups_agree(load: Load) -> None:
    folder = SHARED / "valid" / "primitive-strips-fans"
    cubes = [load(path).info for path in sorted(folder.glob("cube*.glb"))]
    assert len(cubes) == 6
    for cube in cubes:
        assert cube["triangles"] == 12
        assert cube["area"] == pytest.approx(cubes[0]["area"], rel=1e-6)
        assert cube["volume"] == pytest.approx(cubes[0]["volume"], rel=1e-6)
    plain = load(SHARED / "valid" / "neon-sign-love" / "love.glb").info
    quantized = load(SHARED / "valid" / "neon-sign-quantized" / "love_quantized.glb").info
    assert quantized["area"] == pytest.approx(plain["area"], rel=2e-3)
    fallback = load(SHARED / "valid" / "meshopt-fallback" / "meshopt-fallback.gltf").info
    assert fallback["triangles"] == 60


# ---------------------------------------------------------------- files of one megabyte that are made to be expensive


def document(**members: Any) -> str:
    return json.dumps({"asset": {"version": "2.0"}, **members}, separators=(",", ":"))


def repeated(member: str, item: str, size: int = MIB, **others: Any) -> str:
    """A document of about `size` bytes whose array `member` holds `item` again and again."""
    count = (size - len(document(**others)) - 20) // (len(item) + 1)
    return document(**others, **{member: []}).replace(
        f'"{member}":[]', f'"{member}":[' + ",".join([item] * count) + "]"
    )


def triangle_buffer() -> dict[str, Any]:
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    return {
        "buffers": [{"byteLength": len(data), "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    }


def chain(size: int = MIB) -> str:
    count = size // 22
    nodes = "".join(f'{{"children":[{i + 1}]}},' for i in range(count))
    return document(nodes=[]).replace("[]", f"[{nodes}{{}}]")


def star(size: int = MIB) -> str:
    count = size // 11
    children = ",".join(str(i + 1) for i in range(count))
    return document(nodes=[]).replace("[]", f'[{{"children":[{children}]}}{",{}" * count}]')


EXPENSIVE: dict[str, Callable[[], str]] = {
    "nothing but nodes": lambda: repeated("nodes", "{}"),
    "nothing but materials": lambda: repeated("materials", "{}"),
    "nothing but accessors": lambda: repeated("accessors", '{"componentType":5126,"count":1,"type":"VEC3"}'),
    "nothing but textures": lambda: repeated("textures", "{}"),
    "nothing but skins": lambda: repeated("skins", '{"joints":[0]}', nodes=[{}]),
    "nothing but numbers": lambda: repeated("extras", "0"),
    "nothing but arrays": lambda: repeated("extras", "[[]]"),
    "nothing but extensions": lambda: repeated("extensionsUsed", '"a"'),
    "many members": lambda: document(extras={f"k{i}": 0 for i in range(90_000)}),
    "a chain of nodes": chain,
    "a node with many children": star,
    "a long name": lambda: document(nodes=[{"name": "x" * MIB}]),
    "a long bad name": lambda: document(materials=[{"alphaMode": "\u001b" * (MIB // 6)}]),
    "many cameras": lambda: repeated(
        "nodes", '{"camera":0}', cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
    ),
    "many lights": lambda: repeated(
        "nodes",
        '{"extensions":{"KHR_lights_punctual":{"light":0}}}',
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
    ),
    "many singular cameras": lambda: repeated(
        "nodes",
        '{"camera":0,"scale":[0,0,0]}',
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
    ),
    "elements that take no bytes": lambda: document(
        accessors=[{"componentType": 5126, "count": 1 << 50, "type": "VEC3"}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}],
        nodes=[{"mesh": 0}],
    ),
}


@pytest.mark.parametrize("name", EXPENSIVE)
def test_expensive_files_take_little_memory(name: str, load: Load, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    path.write_text(EXPENSIVE[name]())
    size = path.stat().st_size
    assert size < 1.2 * MIB
    loaded = load(path)
    assert loaded.peak_bytes <= 64 * MIB + 4 * size
    assert loaded.seconds < 1


def test_many_instances_load_or_are_refused(load: Load, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    mesh = {"name": "m" * 1000, "extras": {"tags": ["t" * 200] * 20}, "primitives": [{"attributes": {"POSITION": 0}}]}
    path.write_text(repeated("nodes", '{"mesh":0}', meshes=[mesh], **triangle_buffer()))
    loaded = load(path)
    assert loaded.status == 0 or "needs" in loaded.message


def test_time_is_linear_in_the_number_of_nodes(load: Load, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    path.write_text(chain(8 * MIB))
    assert load(path).seconds < 8


# ---------------------------------------------------------------- damaged files


def glb(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def small_model() -> dict[str, Any]:
    """A model with a bit of everything that is read from buffers."""
    views = [(0, 48), (48, 12), (60, 48), (108, 4), (112, 12), (124, 16), (140, 64), (204, 128)]
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 332}],
        "bufferViews": [{"buffer": 0, "byteOffset": offset, "byteLength": length} for offset, length in views],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"},
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "sparse": {
                    "count": 1,
                    "indices": {"bufferView": 3, "componentType": 5123},
                    "values": {"bufferView": 4},
                },
            },
            {"bufferView": 5, "componentType": 5121, "count": 4, "type": "VEC4"},
            {"bufferView": 6, "componentType": 5126, "count": 4, "type": "VEC4"},
            {"bufferView": 7, "componentType": 5126, "count": 2, "type": "MAT4"},
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 2, "JOINTS_0": 4, "WEIGHTS_0": 5},
                        "indices": 1,
                        "material": 0,
                        "targets": [{"POSITION": 3}],
                    },
                    {"attributes": {"POSITION": 3}, "mode": 5},
                ],
                "weights": [0.5],
            }
        ],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0}}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 6}],
        "nodes": [
            {"mesh": 0, "skin": 0},
            {"children": [2]},
            {"translation": [0, 1, 0]},
            {"mesh": 0, "translation": [3, 0, 0]},
        ],
        "scenes": [{"nodes": [0, 1, 3]}],
    }


def small_binary() -> bytes:
    identity = [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    return (
        struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0)
        + struct.pack("<6H", 0, 1, 2, 2, 1, 3)
        + struct.pack("<12f", *[0, 0, 1] * 4)
        + struct.pack("<Hxx", 2)
        + struct.pack("<3f", 0, 2, 0)
        + bytes([0, 1, 0, 0] * 4)
        + struct.pack("<16f", *[0.5, 0.5, 0, 0] * 4)
        + struct.pack("<32f", *identity, *identity)
    )


def test_the_small_model_is_whole(load: Load, tmp_path: Path) -> None:
    path = tmp_path / "scene.glb"
    path.write_bytes(glb(small_model(), small_binary()))
    loaded = load(path)
    assert loaded.status == 0, loaded.message
    assert loaded.info["notes"] == []


@pytest.mark.parametrize("seed", range(4))
def test_flipped_bytes(seed: int, load: Load, tmp_path: Path) -> None:
    whole = glb(small_model(), small_binary())
    rng = random.Random(seed)
    path = tmp_path / "scene.glb"
    for _ in range(25):
        damaged = bytearray(whole)
        for _ in range(rng.choice([1, 1, 2, 8])):
            damaged[rng.randrange(12, len(damaged))] = rng.choice([0, 0x2D, 0x30, 0x39, 0x7F, 0xFF, rng.randrange(256)])
        path.write_bytes(damaged)
        load(path)


VALUES = [None, True, -1, 0, 1, 3, 255, 65535, 4294967295, 2**53, 1e300, -1e-300, 0.5, "", "x", [], [0], {}, {"a": 0}]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values inside a JSON value."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else []
    return [path, *(place for key, child in inside for place in places(child, (*path, key)))]


@pytest.mark.parametrize("seed", range(4))
def test_changed_members(seed: int, load: Load, tmp_path: Path) -> None:
    rng = random.Random(100 + seed)
    path = tmp_path / "scene.glb"
    for _ in range(25):
        model = small_model()
        for _ in range(rng.choice([1, 1, 2])):
            *parents, last = rng.choice(places(model)[1:])
            inside = model
            for key in parents:
                inside = inside[key]
            inside[last] = rng.choice(VALUES)
        path.write_bytes(glb(model, small_binary()))
        load(path)
