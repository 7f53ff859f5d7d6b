"""Balconies, and railings along their edges."""

import math

import numpy as np

from worlds.city.facades.wall_frames import WallFrame
from worlds.shapes import Assembly, Finish, Mesh

# Length of the shared mesh of a railing [m].
_RAILING_M = 2.0


def balcony(
    x0: float, x1: float, reach: float, z: float, rail: float = 1.05
) -> Mesh:
    """Returns a slab with a solid balustrade on its three free sides.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: how far it reaches out of the wall [m].
        z: height of its floor [m].
        rail: height of the balustrade above the floor [m].
    """
    t = 0.12
    low = z - 0.2
    high = z + rail
    outer = [(x0, 0.0), (x0, reach), (x1, reach), (x1, 0.0)]
    inner = [(x0 + t, 0.0), (x0 + t, reach - t)]
    inner += [(x1 - t, reach - t), (x1 - t, 0.0)]
    rings = ((outer, low), (outer, high), (inner, high), (inner, z))
    vertices = np.array([(x, y, h) for ring, h in rings for x, y in ring])
    faces = [
        (4 * ring + k, 4 * ring + 4 + k, 4 * ring + 5 + k, 4 * ring + 1 + k)
        for ring in range(3)
        for k in range(3)
    ]
    faces += [(0, 1, 2, 3), (12, 15, 14, 13)]
    return Mesh(vertices, tuple(faces))


def add_railing(
    out: Assembly,
    part: str,
    wall: WallFrame,
    start: tuple[float, float],
    end: tuple[float, float],
    z: float,
    finish: Finish,
) -> None:
    """Places the shared mesh of a railing between two points at a wall.

    Args:
        out: the building under assembly, which gets the parts.
        part: name of the part.
        wall: the wall.
        start: distances of the first point along the wall and out of the wall
            [m].
        end: distances of the last point along the wall and out of the wall [m].
        z: height of the floor [m].
        finish: colour and material.
    """
    p, q = wall.point(*start), wall.point(*end)
    length = float(np.hypot(*(q - p)))
    out.place(
        part,
        out.shared("railing_panel", (round(length / _RAILING_M, 3), 1.0, 1.0)),
        (*((p + q) / 2), z),
        math.atan2(*(q - p)[::-1]),
        finish=finish,
    )
