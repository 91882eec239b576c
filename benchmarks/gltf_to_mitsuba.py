"""Turn one of our glTF scenes into a Mitsuba 3 scene with the same semantics.

    mi.set_variant("llvm_ad_rgb")
    scene = load_scene("examples/scenes/cornell_box.gltf", 320, 240)

The camera has the same projection (vertical field of view kept, box pixel filter, no crop, 32-bit film), emission is
radiance, and materials are Mitsuba's own where it has the same ones:

- Lambertian (metallic 0, specularFactor 0): `diffuse` on both sides;
- white ideal mirror: `conductor` without material, since Schlick's formula with F0 = 1 is 1 at every angle;
- polished glass: `dielectric` where it is solid, `thindielectric` where it is not;
- directional light: `directional`; point light: `point`.

Coloured mirrors, rough materials and spot lights are Python plug-ins with the runtime's formulas
(mitsuba_plugins.py). Anything else raises UnsupportedScene.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from benchmarks import mitsuba_plugins
from benchmarks.gltf import Camera, Light, Material, Triangles, UnsupportedScene, load

Plugin = dict[str, Any]

SPECULAR_LIMIT = 1e-4
"""A lobe is ideal specular where roughness^2 is below this."""


def load_scene(path: str | os.PathLike[str], width: int, height: int, camera: str | None = None) -> Any:
    """The mi.Scene of a glTF file, for the current variant, with the integrator that `render` of it uses."""
    with tempfile.TemporaryDirectory() as folder:
        return mi.load_dict(scene_dict(path, width, height, Path(folder), camera))


def scene_dict(
    path: str | os.PathLike[str], width: int, height: int, folder: Path, camera: str | None = None
) -> Plugin:
    """The dictionary of the scene; its meshes are PLY files written into `folder`."""
    mitsuba_plugins.register()
    model = load(path)
    cameras = [c for c in model.cameras if camera is None or c.name == camera]
    if not cameras:
        raise UnsupportedScene(f"{path}: no camera" + (f" {camera!r}" if camera else ""))
    scene: Plugin = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5, "hide_emitters": False},
        "sensor": _sensor(cameras[0], width, height),
    }
    for i, triangles in enumerate(model.triangles):
        scene[f"shape{i}"] = _shape(triangles, folder / f"{i}.ply")
    for i, light in enumerate(model.lights):
        scene[f"light{i}"] = _light(light)
    return scene


def _sensor(camera: Camera, width: int, height: int) -> Plugin:
    turned = camera.to_world @ np.diag([-1.0, 1.0, -1.0, 1.0])  # Mitsuba's cameras look along +z, +x is left
    film = {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    sensor: Plugin = {"film": film, "sampler": {"type": "independent"}, "near_clip": 1e-3, "far_clip": 1e4}
    if camera.yfov is not None:
        sensor |= {"type": "perspective", "fov_axis": "y", "fov": math.degrees(camera.yfov)}
    else:
        assert camera.ymag is not None
        half_width = camera.ymag * width / height
        turned = turned @ np.diag([half_width, half_width, 1.0, 1.0])
        sensor["type"] = "orthographic"
    sensor["to_world"] = mi.ScalarTransform4f(turned)
    return sensor


def _shape(triangles: Triangles, file: Path) -> Plugin:
    _write_ply(triangles, file)
    shape: Plugin = {"type": "ply", "filename": str(file), "face_normals": triangles.normals is None}
    shape["bsdf"] = bsdf(triangles.material)
    if max(triangles.material.emission) > 0:
        shape["emitter"] = {"type": "area", "radiance": _rgb(triangles.material.emission)}
    return shape


def _write_ply(triangles: Triangles, file: Path) -> None:
    columns = [triangles.positions] + ([triangles.normals] if triangles.normals is not None else [])
    vertices = np.hstack(columns).astype("<f4")
    faces = np.empty(len(triangles.indices), dtype=[("count", "u1"), ("indices", "<i4", 3)])
    faces["count"] = 3
    faces["indices"] = triangles.indices
    names = ["x", "y", "z", "nx", "ny", "nz"][: vertices.shape[1]]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    file.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


def bsdf(material: Material) -> Plugin:
    """The Mitsuba BSDF of a glTF material."""
    m = material
    polished = m.roughness**2 < SPECULAR_LIMIT
    if m.transmission > 0:
        if m.transmission < 1 or not polished or m.metallic > 0 or set(m.color) != {1.0} or m.specular != 1:
            raise UnsupportedScene(f"material {m.name!r}: transmission other than clear polished glass")
        return {"type": "dielectric" if m.thickness > 0 else "thindielectric", "int_ior": m.ior, "ext_ior": 1.0}
    if m.metallic == 0 and m.specular == 0:
        return _two_sided({"type": "diffuse", "reflectance": _rgb(m.color)})
    if polished:
        if m.metallic < 1:
            raise UnsupportedScene(f"material {m.name!r}: a polished coat on a diffuse base")
        if set(m.color) == {1.0}:
            return _two_sided({"type": "conductor", "material": "none"})
        return {"type": "ln_mirror", "f0_r": m.color[0], "f0_g": m.color[1], "f0_b": m.color[2]}
    if set(m.specular_color) != {1.0}:
        raise UnsupportedScene(f"material {m.name!r}: specularColorFactor")
    return {
        "type": "ln_rough",
        "color_r": m.color[0],
        "color_g": m.color[1],
        "color_b": m.color[2],
        "metallic": m.metallic,
        "roughness": m.roughness,
        "f0": m.specular * ((m.ior - 1) / (m.ior + 1)) ** 2,
        "f90": m.specular,
    }


def _light(light: Light) -> Plugin:
    if light.kind == "directional":
        return {"type": "directional", "direction": list(light.direction), "irradiance": _rgb(light.intensity)}
    if light.kind == "point":
        return {"type": "point", "position": list(light.position), "intensity": _rgb(light.intensity)}
    r, g, b = (float(c) for c in light.intensity)
    x, y, z = (float(c) for c in light.position)
    dx, dy, dz = (float(c) for c in light.direction)
    spot: Plugin = {"type": "ln_spot", "intensity_r": r, "intensity_g": g, "intensity_b": b, "x": x, "y": y, "z": z}
    return spot | {"dx": dx, "dy": dy, "dz": dz, "inner": light.inner, "outer": light.outer}


def _two_sided(plugin: Plugin) -> Plugin:
    return {"type": "twosided", "bsdf": plugin}


def _rgb(values: Sequence[float] | np.ndarray[Any, Any]) -> Plugin:
    return {"type": "rgb", "value": [float(v) for v in values]}
