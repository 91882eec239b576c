"""A small writer of glTF 2.0 files: materials, meshes, nodes, cameras and punctual lights, with deterministic bytes.

Positions and normals are rounded to a micrometre before they become 32-bit floats, so that the last bit of some
machine's sine does not change a file.
"""

from __future__ import annotations

import json
import math
import struct
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from shapes import Shape, Vector, cross, dot, normalized, sub

Json = dict[str, Any]

ARRAY_BUFFER = 34962
ELEMENT_ARRAY_BUFFER = 34963
FLOAT = 5126
UNSIGNED_SHORT = 5123
UNSIGNED_INT = 5125


@dataclass
class GltfWriter:
    """Collects one scene; every `add_...` returns the index of what it added."""

    title: str
    materials: list[Json] = field(default_factory=list)
    meshes: list[Json] = field(default_factory=list)
    nodes: list[Json] = field(default_factory=list)
    cameras: list[Json] = field(default_factory=list)
    lights: list[Json] = field(default_factory=list)
    accessors: list[Json] = field(default_factory=list)
    views: list[Json] = field(default_factory=list)
    data: bytearray = field(default_factory=bytearray)
    extensions: set[str] = field(default_factory=set)
    _shared: dict[int, tuple[Shape, Json, int]] = field(default_factory=dict)

    # ---- materials ----

    def add_material(
        self,
        name: str,
        color: Sequence[float],
        *,
        metallic: float = 0.0,
        roughness: float = 1.0,
        emission: Sequence[float] = (0.0, 0.0, 0.0),
        specular: float | None = None,
        transmission: float = 0.0,
        ior: float | None = None,
        thickness: float | None = None,
        double_sided: bool = False,
    ) -> int:
        """A metallic-roughness material; `emission` is radiance in W/(m^2 sr), of any size."""
        extensions: Json = {}
        if specular is not None:
            extensions["KHR_materials_specular"] = {"specularFactor": specular}
        if transmission > 0:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
        if ior is not None:
            extensions["KHR_materials_ior"] = {"ior": ior}
        if thickness is not None:
            extensions["KHR_materials_volume"] = {"thicknessFactor": thickness}
        material: Json = {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color, 1.0],
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
            },
        }
        strength = max(emission)
        if strength > 0:
            material["emissiveFactor"] = [round(e / strength, 9) for e in emission]
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if double_sided:
            material["doubleSided"] = True
        if extensions:
            material["extensions"] = extensions
            self.extensions.update(extensions)
        self.materials.append(material)
        return len(self.materials) - 1

    def add_lambert(self, name: str, color: Sequence[float], emission: Sequence[float] = (0.0, 0.0, 0.0)) -> int:
        """Exactly Lambertian with albedo `color`."""
        return self.add_material(name, color, specular=0.0, emission=emission)

    def add_emitter(self, name: str, emission: Sequence[float]) -> int:
        """A black surface that emits the radiance `emission` on its front."""
        return self.add_lambert(name, (0.0, 0.0, 0.0), emission)

    def add_mirror(self, name: str, color: Sequence[float]) -> int:
        """An ideal mirror with Schlick's Fresnel, F0 = `color`."""
        return self.add_material(name, color, metallic=1.0, roughness=0.0, double_sided=True)

    def add_glass(self, name: str, ior: float, thickness: float) -> int:
        """A solid of clear glass with polished faces."""
        return self.add_material(name, (1.0, 1.0, 1.0), roughness=0.0, transmission=1.0, ior=ior, thickness=thickness)

    # ---- meshes and nodes ----

    def add_mesh(self, name: str, shape: Shape, material: int) -> int:
        """One primitive; a shape that is used again shares its buffer views."""
        attributes, indices = self._add_shape(shape)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        self.meshes.append({"name": name, "primitives": [primitive]})
        return len(self.meshes) - 1

    def add_node(
        self,
        name: str,
        *,
        mesh: int | None = None,
        camera: int | None = None,
        light: int | None = None,
        translation: Sequence[float] | None = None,
        rotation: Sequence[float] | None = None,
        scale: Sequence[float] | None = None,
        tags: Sequence[str] = (),
    ) -> int:
        node: Json = {"name": name}
        if mesh is not None:
            node["mesh"] = mesh
        if camera is not None:
            node["camera"] = camera
        if light is not None:
            node["extensions"] = {"KHR_lights_punctual": {"light": light}}
        for key, value in (("translation", translation), ("rotation", rotation), ("scale", scale)):
            if value is not None:
                node[key] = [round(v, 9) for v in value]
        if tags:
            node["extras"] = {"tags": list(tags)}
        self.nodes.append(node)
        return len(self.nodes) - 1

    def add_object(self, name: str, shape: Shape, material: int, **placement: Any) -> int:
        """A mesh and the node that places it, both called `name`."""
        return self.add_node(name, mesh=self.add_mesh(name, shape, material), **placement)

    # ---- cameras and lights ----

    def add_camera(self, name: str, eye: Vector, target: Vector, yfov: float, up: Vector = (0.0, 1.0, 0.0)) -> int:
        """A perspective camera at `eye` that looks at `target`, 4:3; `yfov` in degrees."""
        lens = {"aspectRatio": 4 / 3, "yfov": math.radians(yfov), "znear": 0.01}
        self.cameras.append({"name": name, "type": "perspective", "perspective": lens})
        return self._add_camera_node(name, eye, target, up)

    def add_orthographic_camera(
        self, name: str, eye: Vector, target: Vector, ymag: float, up: Vector = (0.0, 1.0, 0.0)
    ) -> int:
        """An orthographic camera, 4:3, that sees `2 ymag` metres from bottom to top."""
        lens = {"xmag": ymag * 4 / 3, "ymag": ymag, "znear": 0.01, "zfar": 100.0}
        self.cameras.append({"name": name, "type": "orthographic", "orthographic": lens})
        return self._add_camera_node(name, eye, target, up)

    def _add_camera_node(self, name: str, eye: Vector, target: Vector, up: Vector) -> int:
        return self.add_node(
            name, camera=len(self.cameras) - 1, translation=eye, rotation=look_rotation(sub(target, eye), up)
        )

    def add_light(
        self,
        name: str,
        kind: str,
        intensity: float,
        *,
        color: Sequence[float] = (1.0, 1.0, 1.0),
        position: Vector = (0.0, 0.0, 0.0),
        direction: Vector | None = None,
        cone: tuple[float, float] | None = None,
    ) -> int:
        """A punctual light, `kind` point, spot or directional; `cone` holds the inner and outer angle in radians."""
        light: Json = {"name": name, "type": kind, "color": list(color), "intensity": intensity}
        if cone is not None:
            light["spot"] = {"innerConeAngle": cone[0], "outerConeAngle": cone[1]}
        self.lights.append(light)
        self.extensions.add("KHR_lights_punctual")
        rotation = None
        if direction is not None:
            up = (0.0, 1.0, 0.0) if abs(normalized(direction)[1]) < 0.99 else (0.0, 0.0, -1.0)
            rotation = look_rotation(direction, up)
        return self.add_node(name, light=len(self.lights) - 1, translation=position, rotation=rotation)

    # ---- buffers ----

    def _add_shape(self, shape: Shape) -> tuple[Json, int]:
        if id(shape) in self._shared:
            _, attributes, indices = self._shared[id(shape)]
            return attributes, indices
        attributes = {"POSITION": self._add_vectors(shape.positions, bounds=True)}
        attributes["NORMAL"] = self._add_vectors(shape.normals, bounds=False)
        indices = self._add_indices(shape)
        self._shared[id(shape)] = (shape, attributes, indices)
        return attributes, indices

    def _add_vectors(self, vectors: Sequence[Vector], bounds: bool) -> int:
        values = array("f", (round(c, 6) + 0.0 for v in vectors for c in v))
        accessor: Json = {"componentType": FLOAT, "count": len(vectors), "type": "VEC3"}
        if bounds:
            accessor["min"] = [min(values[axis::3]) for axis in range(3)]
            accessor["max"] = [max(values[axis::3]) for axis in range(3)]
        return self._add_accessor(accessor, little_endian(values), ARRAY_BUFFER)

    def _add_indices(self, shape: Shape) -> int:
        short = len(shape.positions) < 65536
        values = array("H" if short else "I", (i for triangle in shape.triangles for i in triangle))
        accessor = {
            "componentType": UNSIGNED_SHORT if short else UNSIGNED_INT,
            "count": len(values),
            "type": "SCALAR",
        }
        return self._add_accessor(accessor, little_endian(values), ELEMENT_ARRAY_BUFFER)

    def _add_accessor(self, accessor: Json, content: bytes, target: int) -> int:
        self.data.extend(b"\0" * (-len(self.data) % 4))
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content), "target": target}
        self.data.extend(content)
        self.views.append(view)
        self.accessors.append({"bufferView": len(self.views) - 1, **accessor})
        return len(self.accessors) - 1

    # ---- files ----

    def write(self, path: Path) -> None:
        """Write `path`: a .glb, or a .gltf with a .bin of the same name next to it."""
        self.data.extend(b"\0" * (-len(self.data) % 4))
        if path.suffix == ".glb":
            path.write_bytes(self._glb())
            return
        buffer = path.with_suffix(".bin")
        path.write_text(to_text(self._document(buffer.name)) + "\n", encoding="utf-8", newline="\n")
        buffer.write_bytes(self.data)

    def _glb(self) -> bytes:
        text = json.dumps(self._document(None), separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(self.data)
        return b"".join(
            (
                struct.pack("<4sII", b"glTF", 2, length),
                struct.pack("<I4s", len(text), b"JSON") + text,
                struct.pack("<I4s", len(self.data), b"BIN\0") + bytes(self.data),
            )
        )

    def _document(self, uri: str | None) -> Json:
        document: Json = {"asset": {"version": "2.0", "generator": "make_scenes.py"}}
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        if self.lights:
            document["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        document["scene"] = 0
        document["scenes"] = [{"name": self.title, "nodes": list(range(len(self.nodes)))}]
        document["nodes"] = self.nodes
        document["cameras"] = self.cameras
        document["materials"] = self.materials
        document["meshes"] = self.meshes
        document["accessors"] = self.accessors
        document["bufferViews"] = self.views
        document["buffers"] = [{"byteLength": len(self.data)} | ({"uri": uri} if uri else {})]
        return document


def little_endian(values: array[Any]) -> bytes:
    if struct.pack("=H", 1) != struct.pack("<H", 1):
        values = array(values.typecode, values)
        values.byteswap()
    return values.tobytes()


def to_text(document: Json) -> str:
    """JSON with one line per element of each top-level list: short, and a diff of it can be read."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            body = ",\n".join("    " + json.dumps(v) for v in value)
            lines.append(f"  {json.dumps(key)}: [\n{body}\n  ]")
        else:
            lines.append(f"  {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(lines) + "\n}"


def look_rotation(forward: Vector, up: Vector = (0.0, 1.0, 0.0)) -> tuple[float, float, float, float]:
    """The quaternion (x, y, z, w) that turns -z to `forward` and +y as near to `up` as can be."""
    z = normalized((-forward[0], -forward[1], -forward[2]))
    x = normalized(cross(up, z))
    y = cross(z, x)
    return _quaternion(x, y, z)


def axis_rotation(axis: Vector, degrees: float) -> tuple[float, float, float, float]:
    """The quaternion of a right-handed turn by `degrees` about `axis`."""
    half = math.radians(degrees) / 2
    s = math.sin(half)
    x, y, z = normalized(axis)
    return (x * s, y * s, z * s, math.cos(half))


def _quaternion(x: Vector, y: Vector, z: Vector) -> tuple[float, float, float, float]:
    """Of the rotation whose matrix has the columns x, y, z; picks the largest component first, for accuracy."""
    assert abs(dot(x, y)) < 1e-9 and abs(dot(y, z)) < 1e-9
    trace = x[0] + y[1] + z[2]
    squares = (1 + 2 * x[0] - trace, 1 + 2 * y[1] - trace, 1 + 2 * z[2] - trace, 1 + trace)
    largest = squares.index(max(squares))
    s = 2 * math.sqrt(squares[largest])
    q = [(y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s, s / 4]
    if largest == 0:
        q = [s / 4, (x[1] + y[0]) / s, (z[0] + x[2]) / s, (y[2] - z[1]) / s]
    elif largest == 1:
        q = [(x[1] + y[0]) / s, s / 4, (y[2] + z[1]) / s, (z[0] - x[2]) / s]
    elif largest == 2:
        q = [(z[0] + x[2]) / s, (y[2] + z[1]) / s, s / 4, (x[1] - y[0]) / s]
    length = math.sqrt(sum(c * c for c in q))
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
