"""Roofs: shells along a roof line, gable walls, hips and roof equipment.

A roof line is the upper surface of a roof, as seen along the ridge: (across, z)
points with increasing `across` [m]. By default the ridge runs along x, and
`across` is y; with `along_y` the ridge runs along y, and `across` is x.
"""

from collections.abc import Sequence
import itertools
import math

import numpy as np
from numpy.typing import ArrayLike

from worlds.city.facades import bays, solids
from worlds.city.facades.reliefs import Patch
from worlds.shapes import Mesh, merge_meshes, outlines

Line = Sequence[tuple[float, float]]
# Gables reach this far into the roof above them, so that no ray slips between
# the two [m].
_INTO_ROOF = 0.03


def gable_line(
    a: float, b: float, z: float, top: float
) -> list[tuple[float, float]]:
    """Returns the roof line of a gable roof as (across, height) points [m].

    Args:
        a: where the line begins across the roof [m].
        b: where the line ends across the roof [m].
        z: height of both ends [m].
        top: height of the ridge [m].
    """
    return [(a, z), (a + 0.5 * (b - a), top), (b, z)]


def gambrel_line(
    a: float, b: float, z: float, top: float
) -> list[tuple[float, float]]:
    """Returns the roof line of a gambrel roof: (across, height) points [m].

    The slopes are steep up to a knee, and flatter above.

    Args:
        a: where the line begins across the roof [m].
        b: where the line ends across the roof [m].
        z: height of both ends [m].
        top: height of the ridge [m].
    """
    half = (b - a) / 2
    run = 0.24 * half
    up = z + 0.66 * (top - z)
    return [(a, z), (a + run, up), (a + half, top), (b - run, up), (b, z)]


def barrel_line(
    a: float, b: float, z: float, top: float
) -> list[tuple[float, float]]:
    """Returns the roof line of a barrel roof as (across, height) points [m].

    Args:
        a: where the line begins across the roof [m].
        b: where the line ends across the roof [m].
        z: height of both ends [m].
        top: height of the crown [m].
    """
    half = (b - a) / 2
    middle = (a + b) / 2
    rise = top - z
    radius = (half**2 + rise**2) / (2 * rise)
    span = math.atan2(half, radius - rise)
    return [
        (middle + radius * math.sin(t), top - radius * (1.0 - math.cos(t)))
        for t in np.linspace(-span, span, 9).tolist()
    ]


def with_eaves(line: Line, low: float, high: float) -> list[bays.Span]:
    """Returns a roof line whose two end slopes are extended, as eaves.

    `low` and `high` are the horizontal lengths by which the first and the last
    slope are extended [m].
    """
    (a, za), (b, zb) = line[0], line[1]
    (c, zc), (d, zd) = line[-2], line[-1]
    first = (a - low, za - low * (zb - za) / (b - a))
    last = (d + high, zd - high * (zc - zd) / (d - c))
    return [first, *line[1:-1], last]


def line_height(line: Line, across: float) -> float:
    """Returns the height of a roof line at a place across the roof [m].

    `line` contains the points (across, height), and `across` is the place.
    """
    us, zs = np.transpose(line)
    return float(np.interp(across, us, zs))


def shell(
    line: Line,
    start: float,
    end: float,
    thickness: float,
    *,
    along_y: bool = False,
) -> Mesh:
    """Returns a roof of even vertical thickness along a roof line.

    Args:
        line: (across, height) points of the roof's upper surface [m].
        start: where the roof begins along its ridge [m].
        end: where the roof ends along its ridge [m].
        thickness: vertical thickness [m].
        along_y: whether the ridge is along y instead of x.
    """
    n = len(line)
    vertices = np.array(
        [
            (x, u, z - lower)
            for x in (start, end)
            for lower in (0.0, thickness)
            for u, z in line
        ]
    )
    faces = []
    for k in range(n - 1):
        top = k
        far = 2 * n + k
        under = n + k
        far_under = 3 * n + k
        faces += [
            (top, far, far + 1, top + 1),
            (under, under + 1, far_under + 1, far_under),
            (top, top + 1, under + 1, under),
            (far, far_under, far_under + 1, far + 1),
        ]
    faces.append((0, n, 3 * n, 2 * n))
    faces.append((n - 1, 3 * n - 1, 4 * n - 1, 2 * n - 1))
    mesh = Mesh(vertices, tuple(faces))
    return solids.swapped(mesh) if along_y else mesh


def gable_wall(
    line: Line, a: float, b: float, z: float, holes: Sequence[Patch] = ()
) -> Mesh:
    """Returns the wall below a gable roof, in wall coordinates.

    Args:
        line: underside of the roof as (along the wall, height) points [m]. The
            line runs from a to b, and is nowhere below z.
        a: left end of the wall [m].
        b: right end of the wall [m].
        z: height of the wall's foot [m].
        holes: windows side by side; `gable_glass` returns their panes.
    """
    bounds = {a, b, *(u for u, _ in line if a < u < b)}
    bounds.update(x for hole in holes for x in (hole.x0, hole.x1))
    faces = solids.Faces()

    def top(x: float) -> float:
        height = line_height(line, x)
        return z if height < z + 1e-6 else height + _INTO_ROOF

    for x0, x1 in itertools.pairwise(sorted(bounds)):
        rows = [z]
        for hole in holes:
            if hole.x0 <= x0 and x1 <= hole.x1:
                rows += [hole.z0, hole.z1]
        for k in range(0, len(rows), 2):
            low = rows[k]
            is_last = k + 1 == len(rows)
            z0, z1 = (top(x0), top(x1)) if is_last else (rows[k + 1],) * 2
            faces.add((x0, 0, low), (x0, 0, z0), (x1, 0, z1), (x1, 0, low))
    for h in holes:
        rim = [(h.x0, h.z0), (h.x1, h.z0), (h.x1, h.z1), (h.x0, h.z1)]
        for (xa, za), (xb, zb) in zip(rim, rim[1:] + rim[:1], strict=True):
            inner = (xa, -h.depth, za), (xb, -h.depth, zb)
            faces.add((xb, 0, zb), (xa, 0, za), *inner)
    return faces.mesh()


def gable_glass(holes: Sequence[Patch]) -> Mesh:
    """Returns the mesh of the panes that close window openings in a gable.

    Args:
        holes: openings in the gable, in wall coordinates [m].
    """
    faces = solids.Faces()
    for h in holes:
        low, high = (h.x0, -h.depth, h.z0), (h.x1, -h.depth, h.z1)
        faces.add(low, (h.x0, -h.depth, h.z1), high, (h.x1, -h.depth, h.z0))
    return faces.mesh()


def hip(
    outline: ArrayLike, z: float, top: float, eaves: ArrayLike, fascia: float
) -> Mesh:
    """Returns a hipped roof over a rectangle; the eaves have undersides.

    Args:
        outline: (4, 2) corners of the walls in the building's frame [m].
        z: height of the underside of the eaves [m].
        top: height of the ridge [m].
        eaves: overhang [m]: one number for all edges, or one number per edge.
        fascia: height of the vertical edge of the eaves [m].
    """
    outer = outlines.inset(outline, -np.asarray(eaves))
    underside = solids.flat(outer, z, up=False)
    edge = solids.skirt(outer, outer, z, z + fascia)
    slopes = solids.skirt(outer, _ridge(outer), z + fascia, top)
    return merge_meshes(underside, edge, slopes)


def _ridge(rectangle: np.ndarray) -> np.ndarray:
    """Returns the points (4, 2) on the ridge above a rectangle's corners.

    Two corners share each end of the ridge; on a square, all four share one
    point.
    """
    ends = np.roll(rectangle, -1, axis=0)
    sides = np.linalg.norm(ends - rectangle, axis=1)
    return outlines.inset(rectangle, float(sides.min()) / 2)
