"""Load the subset of glTF that our own scenes use, for comparisons with other renderers.

Written apart from the runtime's loader on purpose: a mistake there should not be repeated here. Textures, sparse
accessors, skins and morph targets are refused, not ignored.
"""

from __future__ import annotations

import json
import math
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Json = dict[str, Any]

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class UnsupportedScene(ValueError):
    """The file uses something that this loader, or the other renderer, cannot show exactly."""


@dataclass(frozen=True)
class Material:
    name: str = "default"
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    specular: float = 1.0
    specular_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    transmission: float = 0.0
    ior: float = 1.5
    thickness: float = 0.0


@dataclass(frozen=True)
class Triangles:
    """One primitive in world space; `normals` is None where it is flat."""

    name: str
    positions: Array
    normals: Array | None
    indices: NDArray[np.uint32]
    material: Material


@dataclass(frozen=True)
class Camera:
    """`to_world` looks along -z, y up; `yfov` in radians, or `ymag` for an orthographic one."""

    name: str
    to_world: Array
    yfov: float | None
    ymag: float | None


@dataclass(frozen=True)
class Light:
    """`kind` is point, spot or directional; `intensity` is W/sr or W/m^2 per channel; it shines along `direction`."""

    kind: str
    position: Array
    direction: Array
    intensity: Array
    inner: float = 0.0
    outer: float = math.pi / 4


@dataclass
class Model:
    triangles: list[Triangles] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)


def load(path: str | os.PathLike[str]) -> Model:
    """The default scene of a .gltf or .glb file, in world space."""
    document, buffers = _read(Path(path))
    if "extensionsRequired" in document:
        raise UnsupportedScene(f"{path}: requires {', '.join(document['extensionsRequired'])}")
    loader = _Loader(document, buffers)
    for node in document["scenes"][document.get("scene", 0)]["nodes"]:
        loader.visit(node, np.eye(4))
    return loader.model


def _read(path: Path) -> tuple[Json, list[bytes]]:
    data = path.read_bytes()
    binary = b""
    if data[:4] == b"glTF":
        (size,) = struct.unpack_from("<I", data, 12)
        document = json.loads(data[20 : 20 + size])
        binary = data[28 + size :]
    else:
        document = json.loads(data)
    buffers = []
    for buffer in document.get("buffers", []):
        if buffer.get("uri", "").startswith("data:"):
            raise UnsupportedScene(f"{path}: embedded buffers")
        buffers.append((path.parent / buffer["uri"]).read_bytes() if "uri" in buffer else binary)
    return document, buffers


class _Loader:
    def __init__(self, document: Json, buffers: list[bytes]) -> None:
        self.document = document
        self.buffers = buffers
        self.materials = [_material(m) for m in document.get("materials", [])]
        self.model = Model()

    def visit(self, index: int, parent: Array) -> None:
        node = self.document["nodes"][index]
        to_world = parent @ _transform(node)
        if "mesh" in node:
            mesh = self.document["meshes"][node["mesh"]]
            for primitive in mesh["primitives"]:
                self.model.triangles.append(self._triangles(node.get("name", ""), primitive, to_world))
        if "camera" in node:
            self.model.cameras.append(self._camera(node, to_world))
        light = node.get("extensions", {}).get("KHR_lights_punctual")
        if light is not None:
            self.model.lights.append(self._light(light["light"], to_world))
        for child in node.get("children", []):
            self.visit(child, to_world)

    def _triangles(self, name: str, primitive: Json, to_world: Array) -> Triangles:
        if primitive.get("mode", 4) != 4 or "targets" in primitive:
            raise UnsupportedScene(f"{name}: only plain triangles")
        positions = self._accessor(primitive["attributes"]["POSITION"])
        indices = np.arange(len(positions), dtype=np.uint32)
        if "indices" in primitive:
            indices = self._accessor(primitive["indices"])[:, 0].astype(np.uint32)
        indices = indices.reshape(-1, 3)
        linear = to_world[:3, :3]
        normals = None
        if "NORMAL" in primitive["attributes"]:
            normals = self._accessor(primitive["attributes"]["NORMAL"]) @ np.linalg.inv(linear)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        positions = positions @ linear.T + to_world[:3, 3]
        if np.linalg.det(linear) < 0:
            indices = indices[:, ::-1]
        if normals is not None and _is_flat(positions, normals, indices):
            normals = None
        material = self.materials[primitive["material"]] if "material" in primitive else Material()
        return Triangles(name, positions, normals, indices, material)

    def _accessor(self, index: int) -> Array:
        accessor = self.document["accessors"][index]
        if "sparse" in accessor or accessor.get("normalized"):
            raise UnsupportedScene(f"accessors[{index}]: sparse or normalized")
        view = self.document["bufferViews"][accessor["bufferView"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        width = WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        shape, strides = (accessor["count"], width), (stride, kind.itemsize)
        values: NDArray[Any] = np.ndarray(shape, kind, self.buffers[view["buffer"]], start, strides)
        return values.astype(np.float64)

    def _camera(self, node: Json, to_world: Array) -> Camera:
        camera = self.document["cameras"][node["camera"]]
        name = node.get("name", camera.get("name", ""))
        if camera["type"] == "perspective":
            return Camera(name, to_world, camera["perspective"]["yfov"], None)
        return Camera(name, to_world, None, camera["orthographic"]["ymag"])

    def _light(self, index: int, to_world: Array) -> Light:
        light = self.document["extensions"]["KHR_lights_punctual"]["lights"][index]
        intensity = np.array(light.get("color", (1, 1, 1))) * light.get("intensity", 1.0)
        spot = light.get("spot", {})
        direction = -to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
        inner, outer = spot.get("innerConeAngle", 0.0), spot.get("outerConeAngle", math.pi / 4)
        return Light(light["type"], to_world[:3, 3], direction, intensity, inner, outer)


def _transform(node: Json) -> Array:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _material(material: Json) -> Material:
    text = json.dumps(material)
    if "Texture" in text or material.get("alphaMode", "OPAQUE") != "OPAQUE":
        raise UnsupportedScene(f"material {material.get('name')!r}: textures or alpha")
    extensions = material.get("extensions", {})
    known = {"emissive_strength", "ior", "transmission", "volume", "specular"}
    unknown = set(extensions) - {f"KHR_materials_{k}" for k in known}
    if unknown:
        raise UnsupportedScene(f"material {material.get('name')!r}: {', '.join(sorted(unknown))}")
    pbr = material.get("pbrMetallicRoughness", {})
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    specular = extensions.get("KHR_materials_specular", {})
    return Material(
        name=material.get("name", ""),
        color=tuple(pbr.get("baseColorFactor", (1, 1, 1, 1))[:3]),
        metallic=pbr.get("metallicFactor", 1.0),
        roughness=pbr.get("roughnessFactor", 1.0),
        emission=tuple(strength * e for e in material.get("emissiveFactor", (0, 0, 0))),
        specular=specular.get("specularFactor", 1.0),
        specular_color=tuple(specular.get("specularColorFactor", (1, 1, 1))),
        transmission=extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0.0),
        ior=extensions.get("KHR_materials_ior", {}).get("ior", 1.5),
        thickness=extensions.get("KHR_materials_volume", {}).get("thicknessFactor", 0.0),
    )


def _is_flat(positions: Array, normals: Array, indices: NDArray[np.uint32]) -> bool:
    p = positions[indices]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-300)
    cosines = np.einsum("tvc,tc->tv", normals[indices], face)
    return bool(cosines.min() > 1 - 1e-5)
