"""What the picture of a `plane_*` scene must be, and the numbers that those scenes are made of.

Each scene is the Lambertian plane y = 0 with one light above it, so the radiance at a point is `albedo / pi * E`:

- `plane_point`: E = I cos / d^2;
- `plane_spot`: the same, times the falloff of the reference code in KHR_lights_punctual;
- `plane_area`: E of a polygon by Lambert's formula (Lambert, Photometria, 1760):
  E = L/2 * sum over edges of (angle of the edge seen from the point) * (n . unit normal of the edge's plane).

The furnace needs no function: `furnace_radiance` is the same for every ray.
"""

from __future__ import annotations

import math

from shapes import Vector, add, cross, dot, normalized, scaled, sub

ALBEDO: Vector = (0.6, 0.5, 0.4)
PLANE_HALF_SIZE = 20.0
UP: Vector = (0.0, 1.0, 0.0)

POINT_POSITION: Vector = (0.3, 1.5, -0.2)
POINT_INTENSITY = 12.0
POINT_COLOR: Vector = (1.0, 0.8, 0.6)

SPOT_POSITION: Vector = (-0.4, 2.0, 0.3)
SPOT_TARGET: Vector = (0.2, 0.0, -0.1)
SPOT_INTENSITY = 20.0
SPOT_COLOR: Vector = (0.7, 0.9, 1.0)
SPOT_CONE = (math.radians(15.0), math.radians(30.0))

AREA_CORNER: Vector = (-0.6, 2.0, -0.7)
AREA_EDGES: tuple[Vector, Vector] = ((1.5, 0.0, 0.0), (0.0, 0.0, 1.0))
AREA_RADIANCE: Vector = (8.0, 7.0, 6.0)

# Looking straight down from below the lights: the picture is 4 m x 3 m of the plane, -z is up.
OVERHEAD_HEIGHT = 0.5
OVERHEAD_YMAG = 1.5

# The spot is seen by a perspective camera; every pixel of a 4:3 picture sees the plane.
OBLIQUE_EYE: Vector = (0.0, 2.5, 3.5)
OBLIQUE_TARGET: Vector = (0.0, 0.0, 0.0)
OBLIQUE_YFOV = 40.0

NAMES = ("plane_point", "plane_spot", "plane_area")


def furnace_radiance(albedo: float = 0.5, emission: float = 1.0) -> float:
    """Radiance along every ray in a closed room whose walls all emit `emission` and have the same albedo."""
    return emission / (1 - albedo)


def point_irradiance(position: Vector, intensity: float, point: Vector, normal: Vector = UP) -> float:
    """E [W/m^2] at `point` from a point light of `intensity` [W/sr]."""
    to_light = sub(position, point)
    squared = dot(to_light, to_light)
    return intensity * max(0.0, dot(normal, to_light)) / (squared * math.sqrt(squared))


def spot_falloff(spot_direction: Vector, to_receiver: Vector, inner: float, outer: float) -> float:
    """The angular attenuation of KHR_lights_punctual's reference code; both directions lead away from the light."""
    scale = 1 / max(0.001, math.cos(inner) - math.cos(outer))
    offset = -math.cos(outer) * scale
    attenuation = min(1.0, max(0.0, dot(spot_direction, to_receiver) * scale + offset))
    return attenuation * attenuation


def polygon_irradiance(corners: list[Vector], radiance: float, point: Vector, normal: Vector = UP) -> float:
    """E [W/m^2] at `point` from a polygon of uniform `radiance` that lies wholly above the horizon.

    The sign is positive where the polygon's corners run clockwise as seen from the point (it emits on the other side
    of its counter-clockwise front otherwise); we return the magnitude.
    """
    rays = [normalized(sub(c, point)) for c in corners]
    total = 0.0
    for a, b in zip(rays, rays[1:] + rays[:1], strict=True):
        angle = math.acos(max(-1.0, min(1.0, dot(a, b))))
        total += angle * dot(normal, normalized(cross(a, b)))
    return abs(total) * radiance / 2


def area_corners() -> list[Vector]:
    u, v = AREA_EDGES
    return [AREA_CORNER, add(AREA_CORNER, u), add(add(AREA_CORNER, u), v), add(AREA_CORNER, v)]


def radiance(name: str, point: Vector) -> Vector:
    """The radiance that leaves `point` of the plane in the scene `name`."""
    if name == "plane_point":
        irradiance = point_irradiance(POINT_POSITION, POINT_INTENSITY, point)
        color = POINT_COLOR
    elif name == "plane_spot":
        direction = normalized(sub(SPOT_TARGET, SPOT_POSITION))
        falloff = spot_falloff(direction, normalized(sub(point, SPOT_POSITION)), *SPOT_CONE)
        irradiance = falloff * point_irradiance(SPOT_POSITION, SPOT_INTENSITY, point)
        color = SPOT_COLOR
    elif name == "plane_area":
        irradiance = polygon_irradiance(area_corners(), 1.0, point)
        color = AREA_RADIANCE
    else:
        raise ValueError(f"no closed form for the scene {name!r}; there is one for {', '.join(NAMES)}")
    s = irradiance / math.pi
    return (ALBEDO[0] * color[0] * s, ALBEDO[1] * color[1] * s, ALBEDO[2] * color[2] * s)


def visible_point(name: str, x: float, y: float, width: int, height: int) -> Vector:
    """The point of the plane seen at (x, y), in pixels from the upper left corner of a `width` x `height` picture."""
    right = (2 * x / width - 1) * width / height
    up = 1 - 2 * y / height
    if name != "plane_spot":
        return (right * OVERHEAD_YMAG, 0.0, -up * OVERHEAD_YMAG)
    forward = normalized(sub(OBLIQUE_TARGET, OBLIQUE_EYE))
    camera_x = normalized(cross(forward, UP))
    camera_y = cross(camera_x, forward)
    t = math.tan(math.radians(OBLIQUE_YFOV) / 2)
    ray = add(forward, add(scaled(camera_x, right * t), scaled(camera_y, up * t)))
    return add(OBLIQUE_EYE, scaled(ray, -OBLIQUE_EYE[1] / ray[1]))


def expected_image(name: str, width: int, height: int, subsamples: int = 4) -> list[list[Vector]]:
    """Rows of pixels, top row first; each pixel is the mean over `subsamples`^2 points, as the box filter has it."""
    offsets = [(i + 0.5) / subsamples for i in range(subsamples)]
    rows = []
    for y in range(height):
        row = []
        for x in range(width):
            values = [
                radiance(name, visible_point(name, x + dx, y + dy, width, height)) for dy in offsets for dx in offsets
            ]
            r, g, b = (sum(channel) / len(values) for channel in zip(*values, strict=True))
            row.append((r, g, b))
        rows.append(row)
    return rows
