"""Solid details of facades: canopies, awnings, balconies, steps, stairs.

A detail is placed on a wall by a `WallFrame`, in whose coordinates x runs
along the wall, y outwards and z up.
"""

from __future__ import annotations

import itertools

import numpy as np

from cns_drake.city import massing
from cns_drake.city.buildings.site import FOUNDATION_M
from cns_drake.city.mesh import Mesh, box_mesh, merge_meshes


class WallFrame:
    """Carries geometry from a wall's own coordinates to the building's.

    Attributes:
        length: of the wall [m].
    """

    def __init__(self, outline, edge: int):
        outline = np.asarray(outline, dtype=float)
        start, end = outline[edge], outline[(edge + 1) % len(outline)]
        self.length = float(np.hypot(*(end - start)))
        self._start = start
        self._along = (end - start) / self.length
        self._outward = np.array([self._along[1], -self._along[0]])

    def place(self, mesh: Mesh, z: float = 0.0) -> Mesh:
        """Returns a mesh given in wall coordinates, in building's ones.

        Wall coordinates (x along, y outwards, z up) are left-handed, so the
        faces are turned round.
        """
        x, y, height = mesh.vertices.T
        xy = self._start + np.outer(x, self._along) + np.outer(y, self._outward)
        vertices = np.column_stack([xy, height + z])
        return Mesh(vertices, tuple(face[::-1] for face in mesh.faces))

    def point(self, x: float, y: float) -> np.ndarray:
        """Returns a point given in wall coordinates."""
        return self._start + x * self._along + y * self._outward


def canopy(x0: float, x1: float, reach: float, z: float) -> Mesh:
    """A flat canopy with a fascia, hung on two slanted rods."""
    rods = [
        _beam((x, 0.05, z + 1.2), (x, reach - 0.3, z + 0.3), 0.08)
        for x in (x0 + 0.4, x1 - 0.4)
    ]
    slab = box_mesh((x1 - x0, reach, 0.3), ((x0 + x1) / 2, reach / 2, z + 0.15))
    return merge_meshes([slab, *rods])


def awning(x0: float, x1: float, reach: float, z0: float, z1: float) -> Mesh:
    """A sloped shop awning with a hanging front edge, z1 at the wall."""
    lip = 0.25
    profile = [(0.0, z1), (reach, z0 + lip), (reach, z0), (0.0, z1 - 0.12)]
    vertices = [(x, y, z) for x in (x0, x1) for y, z in profile]
    faces = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    faces += [(3, 2, 0), (2, 1, 0), (4, 5, 6), (4, 6, 7)]
    return Mesh(np.array(vertices), tuple(f[::-1] for f in faces))


def balcony(
    x0: float, x1: float, reach: float, z: float, rail: float = 1.05
) -> Mesh:
    """A slab with a solid balustrade around it."""
    t = 0.1
    middle, width = (x0 + x1) / 2, x1 - x0
    return merge_meshes(
        [
            box_mesh((width, reach, 0.2), (middle, reach / 2, z - 0.1)),
            box_mesh((width, t, rail), (middle, reach - t / 2, z + rail / 2)),
            box_mesh(
                (t, reach - t, rail),
                (x0 + t / 2, (reach - t) / 2, z + rail / 2),
            ),
            box_mesh(
                (t, reach - t, rail),
                (x1 - t / 2, (reach - t) / 2, z + rail / 2),
            ),
        ]
    )


def steps(x0: float, x1: float, reach: float, rise: float, count: int) -> Mesh:
    """Entrance steps: `count` treads from y = reach up to the wall."""
    pieces = []
    for k in range(count):
        y = reach * (count - k) / count
        top = rise * (k + 1) / count
        pieces.append(massing.box(x0, x1, 0.0, y, -FOUNDATION_M, top))
    return merge_meshes(pieces)


def fire_stairs(
    x0: float, x1: float, reach: float, floors: list[float], drop: float
) -> Mesh:
    """Iron landings at the floors, flights between, a ladder at the foot.

    Args:
        x0, x1: ends of the landings [m].
        reach: of the landings from the wall [m].
        floors: heights of the landings, ascending [m].
        drop: length of the ladder under the lowest landing [m].
    """
    pieces = []
    for z in floors:
        pieces += [
            box_mesh((x1 - x0, reach, 0.08), ((x0 + x1) / 2, reach / 2, z)),
            box_mesh((x1 - x0, 0.05, 0.08), ((x0 + x1) / 2, reach, z + 1.0)),
            box_mesh((x1 - x0, 0.05, 0.08), ((x0 + x1) / 2, reach, z + 0.5)),
            *(
                box_mesh((0.06, 0.06, 1.0), (x, reach, z + 0.5))
                for x in (x0, (x0 + x1) / 2, x1)
            ),
        ]
    for k, (low, high) in enumerate(itertools.pairwise(floors)):
        a, b = (x0 + 0.3, x1 - 0.3) if k % 2 else (x1 - 0.3, x0 + 0.3)
        pieces += [
            _beam((a, y, low), (b, y, high), 0.12)
            for y in (0.35 * reach, 0.75 * reach)
        ]
    pieces += [
        box_mesh((0.06, 0.06, drop), (x, reach - 0.1, floors[0] - drop / 2))
        for x in (x0 + 0.2, x0 + 0.65)
    ]
    return merge_meshes(pieces)


def column(x: float, y: float, z0: float, z1: float, radius: float) -> Mesh:
    """A round column with base and capital, in the building's frame."""
    shaft = massing.regular_polygon(radius, 10, (x, y))
    top = massing.regular_polygon(0.85 * radius, 10, (x, y))
    r = 1.25 * radius
    block = massing.rectangle(x - r, y - r, x + r, y + r)
    return merge_meshes(
        [
            massing.prism(block, z0, z0 + 0.3),
            massing.skirt(shaft, top, z0 + 0.3, z1 - 0.4),
            massing.prism(block, z1 - 0.4, z1, bottom=True),
        ]
    )


def _beam(start, end, width: float) -> Mesh:
    """A square bar between two points that lie on no common upright."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = (end - start) / np.linalg.norm(end - start)
    side = np.cross(along, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    up = np.cross(side, along)
    unit = box_mesh((np.linalg.norm(end - start), width, width))
    R = np.column_stack([along, -side, up])
    return Mesh(unit.vertices @ R.T + (start + end) / 2, unit.faces)
