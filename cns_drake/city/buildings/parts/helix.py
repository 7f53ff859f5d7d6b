"""One turn of a helical ramp with its parapets, to be stacked."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.geometry.mesh import Mesh

_SEGMENTS = 24
_PARAPET_THICKNESS_M = 0.2


def ramp_turn(
    outer: float,
    inner: float,
    rise: float,
    slab: float,
    parapet: float,
    start: float = 0.0,
) -> Mesh:
    """Returns a closed turn of a ramp that climbs counter-clockwise.

    Args:
        outer, inner: radii of its edges [m].
        rise: of one turn [m].
        slab: thickness of the deck [m].
        parapet: height of the solid rails above the deck, on both edges [m].
        start: heading where the turn begins, its deck there at z = 0 [rad].

    Returns:
        The turn, about the z axis; copies `rise` apart make a ramp. Surfaces
        that climb are twisted and therefore made of triangles.
    """
    t = _PARAPET_THICKNESS_M
    # The cross-section (radius, height above the deck), counter-clockwise
    # with the radius to the right: a trough.
    section = np.array(
        [
            (inner, -slab),
            (outer, -slab),
            (outer, parapet),
            (outer - t, parapet),
            (outer - t, 0.0),
            (inner + t, 0.0),
            (inner + t, parapet),
            (inner, parapet),
        ]
    )
    n = len(section)
    angles = start + np.linspace(0.0, 2.0 * math.pi, _SEGMENTS + 1)
    levels = np.linspace(0.0, rise, _SEGMENTS + 1)
    vertices = np.array(
        [
            (r * math.cos(a), r * math.sin(a), h + z)
            for a, z in zip(angles, levels, strict=True)
            for r, h in section
        ]
    )
    faces: list[tuple[int, ...]] = []
    # All diagonals run outwards and up, so that the deck is as thick
    # everywhere.
    for s in range(_SEGMENTS):
        for k in range(n):
            m = (k + 1) % n
            a, b = s * n + k, s * n + m
            c, d = (s + 1) * n + m, (s + 1) * n + k
            if k in _UPRIGHT:
                faces.append((b, a, d, c))
            elif section[k, 0] > section[m, 0]:
                faces += [(b, a, d), (b, d, c)]
            else:
                faces += [(b, a, c), (a, d, c)]
    last = _SEGMENTS * n
    for quad in ((0, 1, 4, 5), (1, 2, 3, 4), (0, 5, 6, 7)):
        faces.append(quad)
        faces.append(tuple(last + i for i in quad[::-1]))
    return Mesh(vertices, tuple(faces))


# Sides of the cross-section that stay plane along the ramp.
_UPRIGHT = (1, 3, 5, 7)
