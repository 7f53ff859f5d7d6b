"""Piers on walls: fins, pilasters and angled piers at corners."""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from worlds.city.facades import bays, solids
from worlds.city.facades.wall_frames import WallFrame
from worlds.shapes import Mesh, merge_meshes, outlines

# Width of a pilaster [m].
_PILASTER_M = 0.5


def wall_piers(
    outline: ArrayLike,
    pitch: float,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    *,
    depth: float = 0.05,
    margin: float = 0.4,
    entrance: float = 0.0,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns upright fins or pilasters along all walls of an outline.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        pitch: approximate distance from one pier to the next [m].
        width: width of each pier [m].
        reach: how far the piers reach out of the wall [m].
        z0: height of the feet of the piers [m].
        z1: height of the tops of the piers [m].
        depth: how far the piers reach into the wall, past recessed glass [m].
        margin: distance of the middle of the outermost piers from the wall's
            ends [m].
        entrance: width of the stretch without piers in the middle of the front
            [m].
        skip: edges of the outline that get no piers.
    """
    pieces = []
    for edge in range(len(np.asarray(outline))):
        wall = WallFrame(outline, edge)
        if edge in skip or wall.length < 2 * width:
            continue
        room = wall.length - 2 * margin
        count = round(room / pitch)
        if count < 1:  # A chord of a curve: one pier in its middle.
            places = [wall.length / 2]
        else:
            places = [margin + k * room / count for k in range(count + 1)]
        if edge == 0 and entrance > 0:
            half = (entrance + width) / 2
            places = [x for x in places if abs(x - wall.length / 2) >= half]
        for x in places:
            pier = _pier(round(x, 2), width, depth, reach, z0, z1)
            pieces.append(wall.place(pier))
    return merge_meshes(*pieces)


def pilasters(
    outline: ArrayLike,
    pitch: float,
    margin: float,
    every: int,
    reach: float,
    z0: float,
    z1: float,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns pilasters between the bays of a wall with a regular layout.

    The layout comes from `worlds.city.facades.bays.rhythm`.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        pitch: width of a bay, as given to `rhythm` [m].
        margin: distance of the bays from corners, as given to `rhythm` [m].
        every: number of bays from one pilaster to the next.
        reach: how far a pilaster reaches out of the wall [m].
        z0: height of its foot [m].
        z1: height of its top [m].
        skip: edges of the outline that get no pilasters.
    """
    pieces = []
    for edge in range(len(np.asarray(outline))):
        wall = WallFrame(outline, edge)
        cells = bays.stretches(wall.length, pitch, margin)
        if edge not in skip and len(cells) > 2:
            for x, _ in cells[every::every]:
                pier = _pier(round(x, 2), _PILASTER_M, 0.02, reach, z0, z1)
                pieces.append(wall.place(pier))
    return merge_meshes(*pieces)


def corner_piers(
    outline: ArrayLike,
    width: float,
    reach: float,
    depth: float,
    z0: float,
    z1: float,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns angled piers around the convex corners of an outline.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        width: length of the pier along each of the two walls [m].
        reach: how far the piers reach out of the walls [m].
        depth: how far the piers reach into the walls, past recessed glass [m].
        z0: height of the feet of the piers [m].
        z1: height of the tops of the piers [m].
        skip: edges whose corners get no piers.
    """
    outline = np.asarray(outline, dtype=float)
    outer = outlines.inset(outline, -reach)
    inner = outlines.inset(outline, depth)
    pieces = []
    for k, p in enumerate(outline):
        before = WallFrame(outline, k - 1)
        after = WallFrame(outline, k)
        a, b = p - outline[k - 1], outline[(k + 1) % len(outline)] - p
        if a[0] * b[1] - a[1] * b[0] < 0.1:
            continue
        if k in skip or (k - 1) % len(outline) in skip:
            continue
        low, high = before.length - width, width
        plan = [
            before.point(low, -depth),
            before.point(low, reach),
            outer[k],
            after.point(high, reach),
            after.point(high, -depth),
            inner[k],
        ]
        pieces.append(solids.prism(plan, z0, z1, bottom=True))
    return merge_meshes(*pieces)


def _pier(
    x: float, width: float, depth: float, reach: float, z0: float, z1: float
) -> Mesh:
    """Returns a box with a back, in wall coordinates.

    The box needs a back because piers are deeper than walls: near a corner, the
    backs of piers are visible in the recesses of the next wall.
    """
    a, b = x - width / 2, x + width / 2
    plan = [(a, -depth), (b, -depth), (b, reach), (a, reach)]
    vertices = np.array([(x, y, z) for z in (z0, z1) for x, y in plan])
    sides = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    return Mesh(vertices, (*sides, (4, 5, 6, 7), (0, 3, 2, 1)))
