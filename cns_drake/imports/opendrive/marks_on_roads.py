"""Keeps painted lines on the carriageway, clear of kerbs.

A line on the border of two lanes lies half on each of them. Where one of them
is no carriageway, half of the line would lie below the stones of its kerb.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.triangulation import triangulate
from cns_drake.imports.osm_places import parts_of

# Edges of carriageways and of lanes differ by less than this, which is also
# the distance of lines from a kerb [m].
_SLACK = 0.02
# Beside its very end a border is looked at this far from it [m].
_INWARDS = 0.05
# Lines are cut with the carriageway of one such square at a time [m].
_SQUARE = 64.0
_MM = 0.001


def moved_off_kerbs(
    border: np.ndarray,
    left: np.ndarray,
    reach: tuple[float, float],
    carriageway: BaseGeometry,
) -> np.ndarray:
    """Returns how far (N,) lines are moved to the left [m].

    Where only one side of a border is carriageway, they lie on that side.

    Args:
        border: (N, 3) places of a border of lanes [m].
        left: (N, 2) unit vectors to its left.
        reach: of the lines to the left and to the right of it [m].
        carriageway: prepared.
    """
    xy = border[:, :2].copy()
    # A kerb may cross the very end.
    for end, beside in ((0, 1), (-1, -2)):
        step = xy[beside] - xy[end]
        xy[end] += step * min(0.5, _INWARDS / max(np.hypot(*step), _INWARDS))
    on_left, on_right = (
        shapely.contains_xy(carriageway, *(xy + out * left).T)
        for out in (reach[0] - _SLACK, _SLACK - reach[1])
    )
    moved = np.zeros(len(border))
    moved[on_left & ~on_right] = reach[1] + _SLACK
    moved[on_right & ~on_left] = -reach[0] - _SLACK
    # Lines come back to their border only behind the end of a kerb.
    near = np.append(0.0, moved[:-1]) + np.append(moved[1:], 0.0)
    return np.where(moved == 0.0, near, moved)


def as_triangles(quads: np.ndarray) -> np.ndarray:
    """Returns quads (K, 4, 3) as triangles (2 K, 3, 3)."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)


def on_carriageway(quads: np.ndarray, carriageway: BaseGeometry) -> np.ndarray:
    """Returns the parts of quads on a carriageway, as triangles (M, 3, 3) [m].

    Args:
        quads: (K, 4, 3), seen from above [m].
        carriageway: prepared.
    """
    outlines = np.asarray(shapely.polygons(quads[..., :2]))
    inside = shapely.contains_properly(carriageway, outlines)
    found = [as_triangles(quads[inside])]
    rest, outlines = quads[~inside], outlines[~inside]
    squares = np.floor(rest[:, 0, :2] / _SQUARE).astype(int)
    for square in np.unique(squares, axis=0):
        chosen = np.flatnonzero((squares == square).all(axis=1))
        near = shapely.box(*shapely.total_bounds(outlines[chosen]))
        ground = shapely.intersection(carriageway, near)
        pieces = shapely.intersection(outlines[chosen], ground, grid_size=_MM)
        for quad, piece in zip(rest[chosen], pieces, strict=True):
            found += [
                _raised(np.array(triangulate(part)), quad)
                for part in parts_of(piece)
            ]
    return np.concatenate(found)


def _raised(flat: np.ndarray, quad: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 2) at the heights of a quad (4, 3) [m]."""
    middle = quad.mean(axis=0)
    slope = np.linalg.lstsq(
        (quad - middle)[:, :2], quad[:, 2] - middle[2], rcond=None
    )[0]
    z = middle[2] + (flat - middle[:2]) @ slope
    return np.concatenate([flat, z[..., None]], axis=2)
