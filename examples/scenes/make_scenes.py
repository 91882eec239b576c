"""Make the scenes of this folder: `python make_scenes.py [NAME...] [--out FOLDER] [--large]`.

Without arguments it writes all the small scenes next to itself, always the same bytes. `--large` writes the scenes that
are too big to keep, into `generated/`; `--triangles` and `--lights` set their size. README.md says what each shows.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Callable
from pathlib import Path

import closed_forms as truth
from gltf_writer import GltfWriter, axis_rotation, look_rotation
from shapes import (
    Shape,
    Vector,
    add,
    box,
    cross,
    faceted,
    icosphere,
    lump,
    normalized,
    octahedron,
    paraboloid,
    quad,
    rod,
    room_walls,
    scaled,
    sub,
    trough,
)

WHITE: Vector = (0.73, 0.73, 0.73)
RED: Vector = (0.63, 0.065, 0.05)
GREEN: Vector = (0.14, 0.45, 0.091)
UP: Vector = (0.0, 1.0, 0.0)

WALL_NAMES = {
    "floor": "Floor",
    "ceiling": "Ceiling",
    "back": "Wall back",
    "front": "Wall front",
    "left": "Wall left",
    "right": "Wall right",
}


def add_room(scene: GltfWriter, low: Vector, high: Vector, materials: dict[str, int]) -> None:
    """The named sides of a box seen from inside, each a mesh and a node of its own."""
    walls = room_walls(low, high)
    for side, material in materials.items():
        scene.add_object(WALL_NAMES[side], walls[side], material)


def ceiling_light(center: Vector, width: float, depth: float) -> Shape:
    """A rectangle that faces down."""
    return quad(add(center, (-width / 2, 0.0, -depth / 2)), (width, 0.0, 0.0), (0.0, 0.0, depth))


def add_open_box(scene: GltfWriter, left: Vector, right: Vector) -> int:
    """A Cornell-like box, 6 x 5 x 5.5 m, open in front, its light, and a camera that looks in; returns the white."""
    white = scene.add_lambert("White", WHITE)
    walls = {"floor": white, "ceiling": white, "back": white}
    walls["left"] = scene.add_lambert("Wall left", left)
    walls["right"] = scene.add_lambert("Wall right", right)
    add_room(scene, (-3.0, 0.0, -5.5), (3.0, 5.0, 0.0), walls)
    light = scene.add_emitter("Light", (20.0, 16.0, 11.0))
    scene.add_object("Light", ceiling_light((0.0, 4.98, -2.75), 1.6, 1.2), light)
    scene.add_camera("Camera", (0.0, 2.5, 7.0), (0.0, 2.5, 0.0), 35.6)
    return white


def cornell_box() -> GltfWriter:
    scene = GltfWriter("Cornell-like box")
    white = add_open_box(scene, RED, GREEN)
    scene.add_object(
        "Short block", box((1.8, 1.6, 1.7)), white, translation=(1.15, 0.0, -1.9), rotation=axis_rotation(UP, -17)
    )
    scene.add_object(
        "Tall block", box((1.7, 3.2, 1.8)), white, translation=(-1.1, 0.0, -3.7), rotation=axis_rotation(UP, 19)
    )
    return scene


def mirror_glass() -> GltfWriter:
    scene = GltfWriter("A mirror ball and a glass ball")
    add_open_box(scene, (0.6, 0.3, 0.08), (0.1, 0.25, 0.55))
    sphere = icosphere(1.1, 4)
    scene.add_object("Mirror ball", sphere, scene.add_mirror("Mirror", (1.0, 1.0, 1.0)), translation=(-1.4, 1.1, -3.8))
    glass = scene.add_glass("Glass", ior=1.5, thickness=2.2)
    scene.add_object("Glass ball", sphere, glass, translation=(1.35, 1.1, -2.1))
    return scene


def reflectors_figure3() -> GltfWriter:
    """Three white bulbs in the foci of red, green and blue parabolic mirrors."""
    scene = GltfWriter("Three spotlights in coloured parabolic reflectors")
    white = scene.add_lambert("White", WHITE)
    add_room(scene, (-2.8, 0.0, -4.0), (2.8, 3.6, 1.5), dict.fromkeys(("floor", "back", "left", "right"), white))
    focal_length = 0.2
    dish = paraboloid(focal_length, 0.55, rings=16, segments=64)
    bulb = faceted(icosphere(0.06, 1))
    bulb_light = scene.add_emitter("Bulb", (220.0, 220.0, 220.0))
    colors: dict[str, Vector] = {"red": (0.95, 0.08, 0.06), "green": (0.08, 0.9, 0.1), "blue": (0.08, 0.15, 0.95)}
    for (name, color), x in zip(colors.items(), (-1.5, 0.0, 1.5), strict=True):
        position, target = (x, 2.2, -2.6), (0.75 * x, 0.0, -1.1)
        direction = normalized(sub(target, position))
        scene.add_object(
            f"Reflector {name}",
            dish,
            scene.add_mirror(f"Mirror {name}", color),
            translation=position,
            rotation=look_rotation(normalized(cross(direction, (1.0, 0.0, 0.0))), direction),
        )
        scene.add_object(f"Bulb {name}", bulb, bulb_light, translation=add(position, scaled(direction, focal_length)))
    scene.add_camera("Camera", (0.0, 2.0, 5.0), (0.0, 1.15, -2.0), 32.0)
    return scene


def cylinder_figure4() -> GltfWriter:
    """A tube between the focus and the axis of half a cylinder, which focuses its light onto the floor."""
    scene = GltfWriter("A light in a semi-cylindrical reflector")
    walls = dict.fromkeys(WALL_NAMES, scene.add_lambert("White", WHITE))
    walls["left"] = scene.add_lambert("Wall left", (0.6, 0.45, 0.15))
    walls["right"] = scene.add_lambert("Wall right", (0.2, 0.4, 0.55))
    add_room(scene, (-2.5, 0.0, -5.0), (2.5, 3.2, 0.0), walls)
    block = box((0.9, 0.8, 0.8))
    scene.add_object("Table", block, walls["back"], translation=(-1.6, 0.0, -4.0), rotation=axis_rotation(UP, 25))
    # Mirror equation: 1/0.26 + 1/distance = 2/0.45 puts the image about 1.7 m below the vertex.
    radius, height, turn = 0.45, 1.9, axis_rotation(UP, 35)
    mirror = scene.add_mirror("Mirror", (1.0, 1.0, 1.0))
    scene.add_object(
        "Reflector", trough(radius, 1.6, 96), mirror, translation=(0.1, height - radius, -3.1), rotation=turn
    )
    tube = scene.add_emitter("Tube", (40.0, 36.0, 30.0))
    scene.add_object("Tube", rod(0.03, 1.4, 12), tube, translation=(0.1, height - 0.26, -3.1), rotation=turn)
    scene.add_camera("Camera", (0.0, 1.05, -0.1), (0.0, 1.0, -3.0), 58.0)
    return scene


def furnace(albedo: float = 0.5, emission: float = 1.0) -> GltfWriter:
    """A closed box whose walls all emit and reflect alike: the radiance is emission / (1 - albedo) everywhere."""
    scene = GltfWriter("White furnace")
    wall = scene.add_lambert("Furnace", (albedo,) * 3, (emission,) * 3)
    add_room(scene, (-2.0, -1.5, -3.0), (2.0, 1.5, 2.0), dict.fromkeys(WALL_NAMES, wall))
    scene.add_camera("Camera", (0.7, -0.3, 1.1), (-0.5, 0.2, -3.0), 60.0)
    return scene


def closed_box() -> GltfWriter:
    """A closed room, 4 x 3 x 5 m, nothing in it but a light; the camera sees its four far corners."""
    scene = GltfWriter("Closed diffuse box")
    white = scene.add_lambert("White", (0.7, 0.7, 0.7))
    walls = dict.fromkeys(WALL_NAMES, white)
    walls["left"] = scene.add_lambert("Wall left", (0.7, 0.5, 0.3))
    walls["right"] = scene.add_lambert("Wall right", (0.3, 0.5, 0.7))
    add_room(scene, (-2.0, 0.0, -5.0), (2.0, 3.0, 0.0), walls)
    light = scene.add_emitter("Light", (6.0, 6.0, 6.0))
    scene.add_object("Light", ceiling_light((0.3, 2.7, -2.9), 1.2, 0.8), light)
    scene.add_camera("Camera", (-0.2, 1.4, -0.2), (0.0, 1.45, -5.0), 62.0)
    return scene


def add_plane(title: str) -> GltfWriter:
    scene = GltfWriter(title)
    h = truth.PLANE_HALF_SIZE
    floor = quad((-h, 0.0, -h), (0.0, 0.0, 2 * h), (2 * h, 0.0, 0.0))
    scene.add_object("Floor", floor, scene.add_lambert("Floor", truth.ALBEDO))
    return scene


def add_overhead_camera(scene: GltfWriter) -> None:
    eye = (0.0, truth.OVERHEAD_HEIGHT, 0.0)
    scene.add_orthographic_camera("Camera", eye, (0.0, 0.0, 0.0), truth.OVERHEAD_YMAG, up=(0.0, 0.0, -1.0))


def plane_point() -> GltfWriter:
    scene = add_plane("A plane under a point light")
    scene.add_light("Point", "point", truth.POINT_INTENSITY, color=truth.POINT_COLOR, position=truth.POINT_POSITION)
    add_overhead_camera(scene)
    return scene


def plane_spot() -> GltfWriter:
    scene = add_plane("A plane under a spot light")
    scene.add_light(
        "Spot",
        "spot",
        truth.SPOT_INTENSITY,
        color=truth.SPOT_COLOR,
        position=truth.SPOT_POSITION,
        direction=sub(truth.SPOT_TARGET, truth.SPOT_POSITION),
        cone=truth.SPOT_CONE,
    )
    scene.add_camera("Camera", truth.OBLIQUE_EYE, truth.OBLIQUE_TARGET, truth.OBLIQUE_YFOV)
    return scene


def plane_area() -> GltfWriter:
    scene = add_plane("A plane under a rectangular light")
    light = scene.add_emitter("Light", truth.AREA_RADIANCE)
    scene.add_object("Light", quad(truth.AREA_CORNER, *truth.AREA_EDGES), light)
    add_overhead_camera(scene)
    return scene


def glossy_tags() -> GltfWriter:
    """Every kind of surface (D, G, S) and of light (area, point, directional); the small things have a tag."""
    scene = GltfWriter("Glossy things, tags, and three kinds of light")
    white = scene.add_lambert("White", WHITE)
    walls = {"floor": scene.add_lambert("Floor", (0.5, 0.47, 0.42)), "back": white}
    walls["left"] = scene.add_lambert("Wall left", (0.55, 0.15, 0.12))
    add_room(scene, (-3.0, 0.0, -4.0), (6.0, 5.0, 1.0), walls)
    sphere, small_sphere = icosphere(0.7, 4), icosphere(0.4, 4)
    gold = scene.add_material("Gold", (1.0, 0.78, 0.34), metallic=1.0, roughness=0.3)
    scene.add_object("Gold ball", sphere, gold, translation=(-1.1, 0.7, -2.4), tags=["small", "glossy"])
    plastic = scene.add_material("Plastic", (0.1, 0.25, 0.6), roughness=0.3)
    scene.add_object("Plastic ball", sphere, plastic, translation=(0.9, 0.7, -2.0), tags=["small", "glossy"])
    glass = scene.add_glass("Glass", ior=1.5, thickness=0.8)
    scene.add_object("Glass ball", small_sphere, glass, translation=(0.0, 0.4, -0.7), tags=["small"])
    block = scene.add_lambert("Block", (0.25, 0.5, 0.2))
    scene.add_object(
        "Block",
        box((0.6, 0.6, 0.6)),
        block,
        translation=(-1.6, 0.0, -0.6),
        rotation=axis_rotation(UP, 30),
        tags=["small"],
    )
    mirror = scene.add_mirror("Mirror", (1.0, 1.0, 1.0))
    panel = quad((-0.7, 0.0, 0.0), (1.4, 0.0, 0.0), (0.0, 1.9, 0.0))
    scene.add_object("Mirror panel", panel, mirror, translation=(2.05, 0.05, -3.1), rotation=axis_rotation(UP, -32))
    light = scene.add_emitter("Light", (14.0, 13.0, 12.0))
    scene.add_object("Light", ceiling_light((-0.3, 3.3, -1.8), 1.2, 0.9), light)
    scene.add_light("Lamp", "point", 6.0, color=(1.0, 0.6, 0.3), position=(-2.3, 1.9, -2.9))
    scene.add_light("Sun", "directional", 1.2, color=(0.8, 0.9, 1.0), direction=(-0.6, -1.0, -0.45))
    scene.add_camera("Camera", (0.4, 2.0, 4.6), (0.15, 1.1, -1.6), 36.0)
    return scene


def many_lights(triangles: int = 300_000, lights: int = 1000) -> GltfWriter:
    """A hall full of lumps, with small lights of many colours and powers hanging over them."""
    scene = GltfWriter("A hall with many small lights")
    pick = random.Random(7)
    white = scene.add_lambert("White", WHITE)
    add_room(scene, (-8.0, 0.0, -12.0), (8.0, 5.0, 0.0), dict.fromkeys(WALL_NAMES, white))
    paints = [scene.add_lambert(f"Paint {i}", [pick.uniform(0.15, 0.8) for _ in range(3)]) for i in range(8)]
    lumps = [scene.add_mesh(f"Lump {i}", lump(3, 0.8 * i), paint) for i, paint in enumerate(paints)]
    count = max(1, triangles // 1280)
    size = min(0.6, 0.6 * (240 / count) ** 0.5)
    for i in range(count):
        scale = size * pick.uniform(0.5, 1.0)
        scene.add_node(
            f"Lump {i}",
            mesh=lumps[i % len(lumps)],
            translation=(pick.uniform(-7.4, 7.4), scale * pick.uniform(0.7, 3.0), pick.uniform(-11.4, -1.5)),
            rotation=axis_rotation(
                normalized((pick.gauss(0, 1), pick.gauss(0, 1), pick.gauss(0, 1))), pick.uniform(0, 360)
            ),
            scale=(scale,) * 3,
        )
    bulb = faceted(octahedron(0.03))
    power = 20_000.0 / lights
    meshes = []
    for i in range(16):
        color = [pick.uniform(0.3, 1.0) for _ in range(3)]
        strength = power * 4.0 ** pick.uniform(-1, 1)
        meshes.append(scene.add_mesh(f"Bulb {i}", bulb, scene.add_emitter(f"Bulb {i}", [c * strength for c in color])))
    for i in range(lights):
        position = (pick.uniform(-7.8, 7.8), pick.uniform(2.6, 4.9), pick.uniform(-11.8, -0.2))
        scene.add_node(f"Bulb {i}", mesh=meshes[i % len(meshes)], translation=position)
    scene.add_camera("Camera", (-6.5, 2.9, -0.6), (1.5, 1.2, -8.0), 52.0)
    return scene


SCENES: dict[str, Callable[[], GltfWriter]] = {
    "cornell_box.gltf": cornell_box,
    "mirror_glass.glb": mirror_glass,
    "reflectors_figure3.glb": reflectors_figure3,
    "cylinder_figure4.glb": cylinder_figure4,
    "furnace.gltf": furnace,
    "closed_box.gltf": closed_box,
    "plane_point.gltf": plane_point,
    "plane_spot.gltf": plane_spot,
    "plane_area.gltf": plane_area,
    "glossy_tags.glb": glossy_tags,
}


def main() -> None:
    here = Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [Path(file).stem for file in SCENES]
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these scenes: " + ", ".join(names))
    parser.add_argument("--out", type=Path, help="folder to write to")
    parser.add_argument("--large", action="store_true", help="write the large scene instead of the small ones")
    parser.add_argument("--triangles", type=int, default=300_000, help="about so many in the large scene")
    parser.add_argument("--lights", type=int, default=1000, help="so many in the large scene")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(names))
    if unknown:
        parser.error(f"no scene {unknown[0]!r}; there are {', '.join(names)}")
    folder = options.out or (here / "generated" if options.large else here)
    folder.mkdir(parents=True, exist_ok=True)
    if options.large:
        many_lights(options.triangles, options.lights).write(folder / "many_lights.glb")
        return
    for file, make in SCENES.items():
        if not options.names or Path(file).stem in options.names:
            make().write(folder / file)


if __name__ == "__main__":
    main()
