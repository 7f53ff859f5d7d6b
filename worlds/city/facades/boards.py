"""Boards on walls, such as the frames of windows."""

from collections.abc import Sequence

import numpy as np

from worlds.city.facades.reliefs import Relief
from worlds.shapes import Mesh


def casings(
    reliefs: Sequence[Relief],
    glass: Sequence[float],
    style: str,
    reach: float = 0.05,
) -> list[Mesh]:
    """Returns frames, sills or shutters for a wall's windows.

    The meshes are in wall coordinates [m].

    Args:
        reliefs: the reliefs of the wall.
        glass: depths of glazed reliefs; a relief with one of these depths is a
            window.
        style: `frame` (a ring of boards), `sill` or `shutters`.
        reach: how far the boards reach out of the wall [m]; sills reach twice
            as far.
    """
    pieces = []
    for r in reliefs:
        if r.depth not in glass or r.z1 - r.z0 < 0.5:
            continue
        if style == "frame":
            pieces.append(_ring(r, reach))
        elif style == "sill":
            low = r.z0 - 0.1
            pieces.append(board(r.x0 - 0.1, r.x1 + 0.1, low, r.z0, 2 * reach))
        else:
            side = min((r.x1 - r.x0) / 2, 0.45)
            for a, b in ((r.x0 - side, r.x0), (r.x1, r.x1 + side)):
                pieces.append(board(a, b, r.z0, r.z1, reach))
    return pieces


def _ring(r: Relief, reach: float) -> Mesh:
    """Returns boards around an opening, mitred at its corners."""
    w = 0.12
    outer = [(r.x0 - w, r.z0 - w), (r.x0 - w, r.z1 + w),
             (r.x1 + w, r.z1 + w), (r.x1 + w, r.z0 - w)]  # fmt: skip
    inner = [(r.x0, r.z0), (r.x0, r.z1), (r.x1, r.z1), (r.x1, r.z0)]
    rings = ((outer, 0.0), (outer, reach), (inner, reach), (inner, 0.0))
    vertices = np.array([(x, y, z) for ring, y in rings for x, z in ring])
    faces = [
        (4 * n + k, 4 * n + (k + 1) % 4, 4 * n + 4 + (k + 1) % 4, 4 * n + 4 + k)
        for n in range(3)
        for k in range(4)
    ]
    return Mesh(vertices, tuple(faces))


def board(x0: float, x1: float, z0: float, z1: float, reach: float) -> Mesh:
    """Returns a board on a wall, in wall coordinates, without its back.

    Args:
        x0: left end [m].
        x1: right end [m].
        z0: height of the lower edge [m].
        z1: height of the upper edge [m].
        reach: thickness of the board [m].
    """
    v = [(x, y, z) for y in (0.0, reach) for z in (z0, z1) for x in (x0, x1)]
    faces = ((4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6),
             (0, 2, 6, 4), (1, 5, 7, 3))  # fmt: skip
    return Mesh(np.array(v), faces)
