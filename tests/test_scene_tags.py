"""Tags that match nothing in a scene: the names in a glTF file, matching as the program does, and what is said."""

from __future__ import annotations

import base64
import json
import os
import struct
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lnc.cli import main
from lnc.diagnostics import Diagnostic, Reporter
from lnc.scene_tags import UnreadableScene, check_tags, matches, read_scene_names
from lnc.source import SourceFile
from lnc.syntax.parse import parse

ROOT = Path(__file__).resolve().parent.parent
SCENES = sorted((ROOT / "examples" / "scenes").glob("*.gl[bt]*"))
SHARED = Path(os.environ.get("LN_GLTF_SET", ROOT.parent / "shared" / "gltf")) / "valid"

TRIANGLES = struct.pack("<18f", *(0, 0, 0, 1, 0, 0, 0, 1, 0), *(0, 0, 1, 1, 0, 1, 0, 1, 1))
ROOM: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "extras": {"tags": "shiny"}}]}},
    "scene": 1,
    "scenes": [{"nodes": [0]}, {"nodes": [1, 4]}],
    "nodes": [
        {"name": "elsewhere", "mesh": 0},
        {"name": "group", "children": [2, 3]},
        {"name": "ball", "mesh": 1, "extras": {"tags": ["round", 5, "x" * 257]}},
        {"name": "drawing", "mesh": 2},
        {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ],
    "meshes": [
        {"name": "hidden", "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
        {
            "name": "Ball",
            "primitives": [{"attributes": {"POSITION": 0}, "material": 1}, {"attributes": {"POSITION": 1}}],
        },
        {"name": "lines", "primitives": [{"attributes": {"POSITION": 0}, "mode": 1, "material": 0}]},
    ],
    "materials": [{"name": "unused"}, {"name": "Mirror", "extras": {"tags": {"any": "bright", "list": ["no"]}}}],
    "accessors": [
        {"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0, "byteOffset": at} for at in (0, 36)
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 72}],
    "buffers": [{"byteLength": 72, "uri": "data:;base64," + base64.b64encode(TRIANGLES).decode()}],
}
ROOM_NAMES = {
    "material": {"Mirror", ""},
    "mesh": {"Ball"},
    "node": {"ball", "lamp"},
    "extras": {"round", "shiny", "bright"},
}


def write(path: Path, scene: object) -> str:
    path.write_text(scene if isinstance(scene, str) else json.dumps(scene))
    return str(path)


def checked(tags: str, scene: str) -> list[Diagnostic]:
    reporter = Reporter()
    check_tags(parse(SourceFile("a.ln", tags), reporter), read_scene_names(scene), "room.gltf", reporter)
    return reporter.sorted()


# --- Matching ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("glob", "same", "other"),
    [
        ("Mirror", ["Mirror"], ["mirror", "Mirror ball", ""]),
        ("Mirror*", ["Mirror", "Mirror ball", "Mirror/a"], ["A Mirror"]),
        ("*", ["", ".hidden", "a/b"], []),
        ("?", ["a"], ["", "ab", "é"]),  # a byte
        ("??", ["é"], ["éé"]),
        ("[a-c]x", ["bx"], ["dx", "Bx"]),
        ("[!a-c]x", ["dx"], ["bx"]),
        ("[[:upper:]]*", ["Wall"], ["wall", "Élan"]),
        ("[a", ["[a"], ["a"]),
        (r"\*", ["*"], ["a", ""]),
        ("{a,b}", ["{a,b}"], ["a"]),
    ],
)
def test_globs(glob: str, same: list[str], other: list[str]) -> None:
    assert [name for name in (*same, *other) if matches(glob, name)] == same


def test_globs_take_no_time() -> None:
    begin = time.process_time()
    assert not matches("*a" * 200 + "b", "a" * 1000)
    assert time.process_time() - begin < 1


# --- Names ------------------------------------------------------------------------------------------------------------


def test_names_of_what_is_in_use(tmp_path: Path) -> None:
    assert read_scene_names(write(tmp_path / "room.gltf", ROOM)) == ROOM_NAMES
    without_scenes = {name: value for name, value in ROOM.items() if name not in ("scene", "scenes")}
    names = read_scene_names(write(tmp_path / "all.gltf", without_scenes))
    assert names["mesh"] == {"Ball", "hidden"} and names["material"] == {"Mirror", "", "unused"}


def test_names_are_those_of_the_runtime(runtime_tool: Callable[[str], Path], tmp_path: Path) -> None:
    """Names of characters that a terminal can show only, as the tool prints others differently."""
    own = Path(write(tmp_path / "room.gltf", ROOM))
    shared = [path for path in sorted(SHARED.rglob("*.gl*")) if path.suffix in (".glb", ".gltf")]
    compared = 0
    for path in [own, *SCENES, *shared]:
        done = subprocess.run([runtime_tool("ln_scene_info"), path], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            continue
        info = json.loads(done.stdout)
        parts, lights = info["parts"], info["lights"]
        materials = [info["materials"][part["material"]] for part in parts]
        assert read_scene_names(str(path)) == {
            "material": {m["name"] for m in materials},
            "mesh": {part["mesh"] for part in parts},
            "node": {o["node"] for o in (*parts, *lights)},
            "extras": {tag for o in (*parts, *materials, *lights) for tag in o["tags"]},
        }, path
        compared += 1
    assert compared > len(SCENES)


# --- Files that are wrong ---------------------------------------------------------------------------------------------


def glb(text: bytes, *, length: int = -1, version: int = 2, chunk: int = -1, kind: bytes = b"JSON") -> bytes:
    chunk = len(text) if chunk < 0 else chunk
    length = 20 + len(text) if length < 0 else length
    return b"glTF" + struct.pack("<III", version, length, chunk) + kind + text


WRONG = {
    "empty": (b"", "is not JSON"),
    "text": (b"hello", "is not JSON"),
    "latin": (b'{"asset": "\xe9"}', "is not UTF-8 text"),
    "surrogate": (
        json.dumps({**ROOM, "nodes": [{"name": "\ud800", "mesh": 1}], "scenes": []}).encode(),
        "is not UTF-8 text",
    ),
    "number": (b'{"asset": NaN}', "NaN is no number"),
    "long number": (b'{"asset": ' + b"9" * 10_000 + b"}", ""),
    "array": (b"[]", "has no asset"),
    "no gltf": (b"{}", "has no asset"),
    "deep": (b"[" * 1_000_000, "nested too deeply"),
    "deep value": (b'{"a":' * 200_000 + b"1" + b"}" * 200_000, "nested too deeply"),
    "header": (b"glTF\2\0\0\0", "cut short"),
    "cut": (glb(b"{}" * 50)[:60], "cut short"),
    "version": (glb(b"{}", version=1), "version 1"),
    "binary": (glb(b"{}", kind=b"BIN\0"), "not JSON"),
    "chunk": (glb(b"{}", chunk=3), "3 bytes, 2 are left"),
    "huge chunk": (glb(b"{}", chunk=0xFFFFFFFF), "are left"),
    "nodes": (b'{"asset": {}, "nodes": 3}', "nodes is not an array"),
    "mesh": (b'{"asset": {}, "nodes": [{"mesh": 7}]}', "nodes[0].mesh is 7, but there are only 0"),
    "float": (b'{"asset": {}, "nodes": [{"mesh": 1e999}]}', "nodes[0].mesh is not a whole number"),
    "child": (b'{"asset": {}, "nodes": [{"children": ["a"]}]}', "nodes[0].children[0] is not a whole number"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, reason = WRONG[name]
    (tmp_path / "scene.glb").write_bytes(content)
    network = tmp_path / "good.ln"
    network.write_text("image Direct(Lights())\n")
    assert main(["check", str(network), "--scene", str(tmp_path / "scene.glb")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"lnc: {tmp_path}/scene.glb: ") and reason in line


def test_files_that_are_none(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, reason in (
        (tmp_path / "missing.glb", "No such file"),
        (tmp_path, "directory"),
        (tmp_path / "pipe", "not a regular file"),
        (Path("a\0b"), "not a valid path"),
    ):
        with pytest.raises(UnreadableScene, match=reason):
            read_scene_names(str(path))


def test_circles_of_nodes_end(tmp_path: Path) -> None:
    nodes = [{"children": [1]}, {"children": [0], "name": "a"}]
    scene = {"asset": {}, "scenes": [{"nodes": [0]}], "nodes": nodes}
    assert read_scene_names(write(tmp_path / "a.gltf", scene))["node"] == set()


def test_a_large_file(tmp_path: Path) -> None:
    """Time by the size of the JSON; the binary chunk is not read."""
    nodes = [{"name": f"n{i}", "mesh": 1} for i in range(100_000)]
    text = json.dumps({**ROOM, "scenes": [{"nodes": list(range(100_000))}], "scene": 0, "nodes": nodes}).encode()
    with (tmp_path / "large.glb").open("wb") as file:
        file.write(glb(text, length=20 + len(text) + (1 << 30)))
        file.truncate(20 + len(text) + (1 << 30))
    begin = time.process_time()
    assert len(read_scene_names(str(tmp_path / "large.glb"))["node"]) == 100_000
    assert time.process_time() - begin < 5
    (tmp_path / "large.glb").write_bytes(b'{"a": "')
    os.truncate(tmp_path / "large.glb", 200 << 20)
    with pytest.raises(UnreadableScene, match="more than 128 MB of JSON"):
        read_scene_names(str(tmp_path / "large.glb"))


# --- What is said -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tag", "help"),
    [
        ('tag t = material "Miror"', "did you mean 'Mirror'?"),
        ('tag t = material "*Miror*"', "did you mean 'Mirror'?"),
        ('tag t = material "mirr*"', "upper and lower case differ: did you mean 'Mirror'?"),
        ('tag t = material "Bal*"', "a mesh is called 'Ball': did you mean that?"),
        ('tag t = mesh "group"', "mesh names of the scene: 'Ball'"),
        ('tag t = node "group"', "node names of the scene: 'ball', 'lamp'"),
        ('tag t = material "q" | mesh "Bell"', "did you mean 'Ball'?"),
        ("tag Mirror", "a material is called 'Mirror': did you mean that?"),
        ("tag rounds", "did you mean 'round'?"),
        ("tag something", "tags in extras.tags of the scene: 'bright', 'round', 'shiny'"),
    ],
)
def test_help(tag: str, help: str, tmp_path: Path) -> None:
    (found,) = checked(tag + "\n", write(tmp_path / "room.gltf", ROOM))
    assert found.code == "LN0501" and found.severity == "error"
    assert found.span.text in tag and found.help == (help,)


def test_tags_that_match(tmp_path: Path) -> None:
    scene = write(tmp_path / "room.gltf", ROOM)
    assert not checked('tag a = mesh "nothing" | node "la*"\ntag b = material "*"\ntag round\ntag shiny\n', scene)
    assert not checked('tag a = colour "red"\n', scene), "another mistake, which resolve reports"


def test_no_tags_in_a_scene(tmp_path: Path) -> None:
    scene = write(tmp_path / "a.gltf", {"asset": {}, "nodes": []})
    (found,) = checked("tag t\n", scene)
    assert found.help == ("the scene has no tags in extras.tags",)


def test_check_with_a_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "room.gltf", ROOM)
    text = 'tag t = node "lam*"\ntag u = node "Lam"\nlight = Lights(from = t)\n'
    text += "expect <= L (D|G)? S* E\nimage Direct(light, to = u)\n"
    (tmp_path / "a.ln").write_text(text)
    assert main(["check", "a.ln"]) == 0
    assert main(["check", "a.ln", "--scene", "room.gltf", "--format", "json"]) == 1
    output = capsys.readouterr().out
    (found,) = json.loads(output[output.index("[") :])
    assert (found["code"], found["line"], found["column"], found["end_column"]) == ("LN0501", 2, 9, 19)
    assert found["message"] == "the tag 'u' matches nothing in 'room.gltf'"
