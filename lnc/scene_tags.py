"""LN0501: tags of a network that match nothing in a scene, which is known from the JSON of a glTF file alone.

    tag mirror = material "Miror*"      the tag 'mirror' matches nothing in 'room.gltf' (did you mean 'Mirror ball'?)

Names and matching are those of the runtime (gltf_scene.cpp, scene.cpp): what counts has a triangle, or is a light, in
the default scene. That all triangles of a mesh vanish takes its geometry to know and is not noticed here.
"""

from __future__ import annotations

import ctypes
import json
import os
import stat
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from lnc.diagnostics import Reporter, did_you_mean, quote
from lnc.passes.resolve import TAG_KINDS
from lnc.syntax import ast

JSON_LIMIT = 128 << 20  # bytes; more takes too much memory as Python's objects
NAME_BYTES, TAG_COUNT, TAG_BYTES = 1000, 64, 256  # as in gltf_materials.cpp
TRIANGLES = 4  # the first `mode` of a primitive that makes triangles


class UnreadableScene(Exception):
    """A file that is no glTF 2.0; the text names it and says why."""


SceneNames = dict[str, set[str]]
"""All that a tag can match, by kind of glob; names are those of objects in use."""


# --- Tags against names -----------------------------------------------------------------------------------------------


def check_tags(file: ast.File, names: SceneNames, scene: str, reporter: Reporter) -> None:
    """Report every tag of a network that matches nothing in the scene."""
    for statement in file.statements:
        if not isinstance(statement, ast.TagStatement):
            continue
        if any(g.kind not in TAG_KINDS for g in statement.globs):
            continue  # which resolve has reported
        globs = [(g.kind, g.glob) for g in statement.globs] or [("extras", statement.name)]
        if any(matches(glob, name) for kind, glob in globs for name in names[kind]):
            continue
        span = statement.globs[0].span.to(statement.globs[-1].span) if statement.globs else statement.name_span
        message = f"the tag {quote(statement.name)} matches nothing in {quote(scene)}"
        help = next((h for kind, glob in globs if (h := _nearest(kind, glob, names))), _listed(globs[0][0], names))
        reporter.error("LN0501", span, message, help=help)


def matches(glob: str, name: str) -> bool:
    """As the program has it: fnmatch of the C library without flags, on the bytes of UTF-8."""
    libc, c_locale = _libc()
    before = libc.uselocale(c_locale)  # in which programs run, whatever the locale of this process is
    try:
        found: int = libc.fnmatch(glob.encode(), name.encode("utf-8", "surrogateescape"), 0)
    finally:
        libc.uselocale(before)
    return found == 0


@cache
def _libc() -> tuple[ctypes.CDLL, ctypes.c_void_p]:
    libc = ctypes.CDLL(None)
    libc.newlocale.restype = libc.uselocale.restype = ctypes.c_void_p
    libc.newlocale.argtypes = [ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p]
    libc.uselocale.argtypes = [ctypes.c_void_p]
    libc.fnmatch.argtypes = [ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int]
    every_category = 0x1FBF  # LC_ALL_MASK of glibc; musl takes it too
    return libc, libc.newlocale(every_category, b"C", None)


def _nearest(kind: str, glob: str, names: SceneNames) -> str | None:
    """A name that the glob nearly matches: in another case, of another kind, or spelled alike."""
    known = sorted(names[kind])
    for name in known:
        if matches(glob.lower(), name.lower()):
            return f"upper and lower case differ: did you mean {quote(name)}?"
    for other in names:
        found = next((name for name in sorted(names[other]) if matches(glob, name)), None)
        if found is not None:
            what = "extras.tags of the scene hold" if other == "extras" else f"a {other} is called"
            return f"{what} {quote(found)}: did you mean that?"
    return did_you_mean(glob.strip("*"), known)


def _listed(kind: str, names: SceneNames) -> str:
    known = sorted(name for name in names[kind] if name)
    what = "tags in extras.tags" if kind == "extras" else f"{kind} names"
    if not known:
        return f"the scene has no {what}"
    more = f", and {len(known) - 8} more" if len(known) > 8 else ""
    return f"{what} of the scene: {', '.join(quote(name) for name in known[:8])}{more}"


# --- Names of a scene -------------------------------------------------------------------------------------------------


def read_scene_names(path: str) -> SceneNames:
    """What tags can match in a .gltf or .glb file. Raises UnreadableScene."""
    try:
        root = json.loads(_json_text(path), parse_constant=_no_constant)
        return _names(_Value(root, ""))
    except RecursionError:
        reason = "its JSON is nested too deeply"
    except MemoryError:
        reason = "there is not enough memory to read it"
    except json.JSONDecodeError as error:
        reason = f"is not JSON: {error.msg} (line {error.lineno}, column {error.colno})"
    except UnicodeError:
        reason = "is not UTF-8 text"
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
    except ValueError as error:
        reason = str(error)
    raise UnreadableScene(f"{path}: {reason}")


def _no_constant(text: str) -> None:
    raise ValueError(f"is not JSON: {text} is no number")


def _json_text(path: str) -> str:
    """The JSON of a file: all of it, or the first chunk of a binary glTF file."""
    if "\0" in path:
        raise ValueError("is not a valid path")
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # opening a pipe must not wait for a writer
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise ValueError("is not a regular file")
        size = os.fstat(descriptor).st_size
        head = file.read(20)
        if head.startswith(b"glTF"):
            wanted = _chunk_size(head, size)
            content = file.read(min(wanted, JSON_LIMIT + 1)).rstrip(b"\0")
        else:
            content = head + file.read(JSON_LIMIT + 1 - len(head))
    if len(content) > JSON_LIMIT:
        raise ValueError(f"has more than {JSON_LIMIT >> 20} MB of JSON")
    return content.decode("utf-8-sig")


def _chunk_size(head: bytes, size: int) -> int:
    """The length of the JSON in a binary glTF file of `size` bytes that begins with `head`."""
    if len(head) < 20:
        raise ValueError("is cut short: the GLB header is not complete")
    version, length, chunk, kind = struct.unpack("<4xIII4s", head)
    if version != 2:
        raise ValueError(f"is a GLB file of version {version}; only 2 is supported")
    if length > size:
        raise ValueError(f"is cut short: the GLB header says {length} bytes, the file has {size}")
    if kind != b"JSON":
        raise ValueError("the first GLB chunk is not JSON")
    if chunk > length - 20:
        raise ValueError(f"GLB chunk 0 says {chunk} bytes, {max(0, length - 20)} are left")
    return int(chunk)


@dataclass(slots=True)
class _Value:
    """A JSON value and where it stands. Absent members are None; what is of another kind than asked for is an error."""

    value: Any
    path: str

    def __getitem__(self, member: str) -> _Value:
        found = self.value.get(member) if isinstance(self.value, dict) else None
        return _Value(found, f"{self.path}.{member}" if self.path else member)

    def elements(self) -> list[_Value]:
        if self.value is None:
            return []
        if not isinstance(self.value, list):
            raise ValueError(f"{self.path or 'the file'} is not an array")
        return [_Value(value, f"{self.path}[{i}]") for i, value in enumerate(self.value)]

    def number(self, fallback: int) -> int:
        if self.value is None:
            return fallback
        if isinstance(self.value, bool) or not isinstance(self.value, int | float) or self.value != self.value // 1:
            raise ValueError(f"{self.path} is not a whole number")
        return int(self.value)

    def one_of(self, values: list[_Value]) -> _Value:
        """The element that this index names."""
        index = self.number(-1)
        if not 0 <= index < len(values):
            raise ValueError(f"{self.path} is {index}, but there are only {len(values)} of these")
        return values[index]

    def name(self) -> str:
        return _cut(_text(self["name"].value) or "")

    def tags(self) -> Iterator[str]:
        """`extras.tags`: a text, or a container of texts; other applications may mean something else by it."""
        found = self["extras"]["tags"].value
        listed = list(found.values()) if isinstance(found, dict) else found if isinstance(found, list) else [found]
        for tag in map(_text, listed[:TAG_COUNT]):
            if tag is not None and len(tag.encode()) <= TAG_BYTES:
                yield tag.partition("\0")[0]


def _text(value: object) -> str | None:
    return value if isinstance(value, str) else None


def _cut(name: str) -> str:
    """As the runtime keeps and compares it: its first bytes, up to a zero."""
    return name.encode()[:NAME_BYTES].decode("utf-8", "surrogateescape").partition("\0")[0]


def _names(root: _Value) -> SceneNames:
    if not isinstance(root.value, dict) or not isinstance(root["asset"].value, dict):
        raise ValueError("is not glTF: it has no asset")
    nodes, meshes, materials = (root[kind].elements() for kind in ("nodes", "meshes", "materials"))
    accessors = root["accessors"].elements()
    lights = root["extensions"]["KHR_lights_punctual"]["lights"].elements()
    found: SceneNames = {kind: set() for kind in (*TAG_KINDS, "extras")}
    visible: dict[str, bool] = {}  # meshes by path: have they triangles?
    for node in _nodes_in_scene(root, nodes):
        placed = node["extensions"]["KHR_lights_punctual"]
        mesh = None if node["mesh"].value is None else node["mesh"].one_of(meshes)
        if mesh is not None and mesh.path not in visible:
            visible[mesh.path] = _add_mesh(mesh, materials, accessors, found)
        if placed.value is not None:
            found["extras"].update(placed["light"].one_of(lights).tags())
        if placed.value is not None or (mesh is not None and visible[mesh.path]):
            found["node"].add(node.name())
            found["extras"].update(node.tags())
    return found


def _add_mesh(mesh: _Value, materials: list[_Value], accessors: list[_Value], found: SceneNames) -> bool:
    """Add the names of a mesh and of its materials; False if it has no triangles."""
    primitives = [p for p in mesh["primitives"].elements() if _has_triangles(p, accessors)]
    for primitive in primitives:
        given = primitive["material"]
        material = _Value({}, "") if given.value is None else given.one_of(materials)
        found["material"].add(material.name())
        found["extras"].update(material.tags())
    if primitives:
        found["mesh"].add(mesh.name())
        found["extras"].update(mesh.tags())
    return bool(primitives)


def _nodes_in_scene(root: _Value, nodes: list[_Value]) -> list[_Value]:
    """All nodes of the default scene: below its roots, or below all roots if the file has no scenes."""
    scenes = root["scenes"].elements()
    if scenes:
        at = root["scene"]
        scene = scenes[0] if at.value is None else at.one_of(scenes)
        reached = [node.one_of(nodes) for node in scene["nodes"].elements()]
    else:
        children = {child.number(-1) for node in nodes for child in node["children"].elements()}
        reached = [node for i, node in enumerate(nodes) if i not in children]
    seen = {node.path for node in reached}
    for node in reached:
        for child in node["children"].elements():
            below = child.one_of(nodes)
            if below.path not in seen:
                seen.add(below.path)
                reached.append(below)
    return reached


def _has_triangles(primitive: _Value, accessors: list[_Value]) -> bool:
    position, indices = primitive["attributes"]["POSITION"], primitive["indices"]
    if position.value is None or primitive["mode"].number(TRIANGLES) < TRIANGLES:
        return False
    corners = position if indices.value is None else indices
    return corners.one_of(accessors)["count"].number(0) >= 3
