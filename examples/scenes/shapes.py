"""Triangle meshes of simple shapes. Front faces are counter-clockwise; units are metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector = tuple[float, float, float]
Triangle = tuple[int, int, int]


@dataclass(frozen=True)
class Shape:
    positions: list[Vector]
    normals: list[Vector]
    triangles: list[Triangle]


def sub(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def add(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def scaled(a: Vector, s: float) -> Vector:
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalized(a: Vector) -> Vector:
    return scaled(a, 1 / math.sqrt(dot(a, a)))


def quad(corner: Vector, u: Vector, v: Vector) -> Shape:
    """The parallelogram `corner + s u + t v`; its front is where `u x v` points."""
    n = normalized(cross(u, v))
    return Shape([corner, add(corner, u), add(add(corner, u), v), add(corner, v)], [n] * 4, [(0, 1, 2), (0, 2, 3)])


def merged(*shapes: Shape) -> Shape:
    positions: list[Vector] = []
    normals: list[Vector] = []
    triangles: list[Triangle] = []
    for shape in shapes:
        first = len(positions)
        positions += shape.positions
        normals += shape.normals
        triangles += [(a + first, b + first, c + first) for a, b, c in shape.triangles]
    return Shape(positions, normals, triangles)


def room_walls(low: Vector, high: Vector) -> dict[str, Shape]:
    """The six sides of a box, seen from inside: left -x, right +x, floor -y, ceiling +y, back -z, front +z."""
    x, y, z = (high[0] - low[0], 0.0, 0.0), (0.0, high[1] - low[1], 0.0), (0.0, 0.0, high[2] - low[2])
    return {
        "floor": quad(low, z, x),
        "ceiling": quad(add(low, y), x, z),
        "back": quad(low, x, y),
        "front": quad(add(low, z), y, x),
        "left": quad(low, y, z),
        "right": quad(add(low, x), z, y),
    }


def box(size: Vector) -> Shape:
    """A box on the ground: x and z from -size/2 to size/2, y from 0 to size; normals outwards."""
    low, high = (-size[0] / 2, 0.0, -size[2] / 2), (size[0] / 2, size[1], size[2] / 2)
    inside = merged(*room_walls(low, high).values())
    return Shape(
        inside.positions, [scaled(n, -1.0) for n in inside.normals], [(a, c, b) for a, b, c in inside.triangles]
    )


def faceted(shape: Shape) -> Shape:
    """The same triangles, each with its own vertices and its flat normal."""
    positions: list[Vector] = []
    normals: list[Vector] = []
    for a, b, c in shape.triangles:
        p, q, r = shape.positions[a], shape.positions[b], shape.positions[c]
        positions += [p, q, r]
        normals += [normalized(cross(sub(q, p), sub(r, p)))] * 3
    return Shape(positions, normals, [(i, i + 1, i + 2) for i in range(0, len(positions), 3)])


def octahedron(radius: float) -> Shape:
    axes: list[Vector] = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    triangles = []
    for x in (0, 1):
        for y in (2, 3):
            for z in (4, 5):
                outward = (x + y + z) % 2 == 0
                triangles.append((x, y, z) if outward else (x, z, y))
    return Shape([scaled(a, radius) for a in axes], axes, triangles)


def icosphere(radius: float, subdivisions: int) -> Shape:
    """A sphere of `20 * 4^subdivisions` triangles with smooth normals, closed (neighbours share vertices)."""
    g = (1 + math.sqrt(5)) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    unit = [normalized(p) for p in points]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    triangles += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    triangles += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(subdivisions):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(unit)
                unit.append(normalized(add(unit[a], unit[b])))
            return middles[key]

        finer = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return Shape([scaled(u, radius) for u in unit], unit, triangles)


def lump(subdivisions: int, phase: float) -> Shape:
    """A sphere of radius about 1 with waves on it, smooth normals by averaging; `phase` makes different ones."""
    sphere = icosphere(1.0, subdivisions)
    positions = []
    for x, y, z in sphere.positions:
        wave = math.sin(3 * x + phase) * math.cos(4 * y - phase) + 0.5 * math.sin(7 * z + 2 * phase)
        positions.append(scaled((x, y, z), 1 + 0.15 * wave))
    sums: list[Vector] = [(0.0, 0.0, 0.0)] * len(positions)
    for a, b, c in sphere.triangles:
        n = cross(sub(positions[b], positions[a]), sub(positions[c], positions[a]))
        for i in (a, b, c):
            sums[i] = add(sums[i], n)
    return Shape(positions, [normalized(n) for n in sums], sphere.triangles)


def paraboloid(focal_length: float, rim_radius: float, rings: int, segments: int) -> Shape:
    """The dish `y = r^2 / (4 f)`, vertex at the origin, open towards +y, its front inside; the focus is (0, f, 0)."""
    positions: list[Vector] = [(0.0, 0.0, 0.0)]
    normals: list[Vector] = [(0.0, 1.0, 0.0)]
    for i in range(1, rings + 1):
        r = rim_radius * i / rings
        for j in range(segments):
            c, s = math.cos(2 * math.pi * j / segments), math.sin(2 * math.pi * j / segments)
            positions.append((r * c, r * r / (4 * focal_length), r * s))
            normals.append(normalized((-c * r / (2 * focal_length), 1.0, -s * r / (2 * focal_length))))
    triangles = [(0, 1 + (j + 1) % segments, 1 + j) for j in range(segments)]
    for i in range(1, rings):
        inner, outer = 1 + (i - 1) * segments, 1 + i * segments
        for j in range(segments):
            k = (j + 1) % segments
            triangles += [(inner + j, inner + k, outer + k), (inner + j, outer + k, outer + j)]
    return Shape(positions, normals, triangles)


def trough(radius: float, length: float, segments: int) -> Shape:
    """Half a cylinder about the x axis, its vertex at (0, radius, 0), open towards -y, its front inside."""
    positions: list[Vector] = []
    normals: list[Vector] = []
    for i in range(segments + 1):
        angle = math.pi * (i / segments - 0.5)
        y, z = math.cos(angle), math.sin(angle)
        positions += [(-length / 2, radius * y, radius * z), (length / 2, radius * y, radius * z)]
        normals += [(0.0, -y, -z)] * 2
    triangles = []
    for i in range(0, 2 * segments, 2):
        triangles += [(i, i + 1, i + 3), (i, i + 3, i + 2)]
    return Shape(positions, normals, triangles)


def rod(radius: float, length: float, sides: int) -> Shape:
    """A closed prism along the x axis, centred, flat faces, normals outwards."""
    ring = [(math.cos(2 * math.pi * i / sides), math.sin(2 * math.pi * i / sides)) for i in range(sides)]
    positions = [(x, radius * y, radius * z) for x in (-length / 2, length / 2) for y, z in ring]
    triangles = []
    for i in range(sides):
        k = (i + 1) % sides
        triangles += [(i, k, sides + k), (i, sides + k, sides + i)]
    for i in range(1, sides - 1):
        triangles += [(0, i + 1, i), (sides, sides + i, sides + i + 1)]
    positions_and_normals = Shape(positions, [(0.0, 1.0, 0.0)] * len(positions), triangles)
    return faceted(positions_and_normals)
