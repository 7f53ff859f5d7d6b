"""Rectangles: the largest within polygons, and which of many meet."""

import numpy as np
import shapely
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

# A rectangle is chosen between at most this many lines in each direction.
_MOST_LINES = 12
# The footprint is simplified by at most this much to find its corners [m].
_SIMPLIFY = 0.05
# A rectangle may extend beyond the footprint by this much, because its corners
# are rounded [m].
_TOLERANCE = 0.01
# Half the side of the square that stands for a rectangle if none fits [m].
_HALF_SMALLEST = 0.1


def largest_rectangle(footprint: BaseGeometry) -> Polygon:
    """Returns a large axis-aligned rectangle that lies within a footprint.

    The sides of the rectangle pass through corners of the footprint. The result
    is the largest such rectangle, unless the footprint has so many corners that
    only some corners are tried. If no such rectangle lies within the footprint,
    the result is a tiny square around a point of the footprint; the square can
    extend beyond a narrow footprint.
    """
    corners = shapely.get_coordinates(footprint.simplify(_SIMPLIFY))
    xs, ys = (_evenly_chosen(np.unique(np.round(c, 3))) for c in corners.T)
    x0, x1 = (xs[k] for k in np.triu_indices(len(xs), 1))
    y0, y1 = (ys[k] for k in np.triu_indices(len(ys), 1))
    sides = x0[:, None], y0[None], x1[:, None], y1[None]
    boxes = shapely.box(*sides).reshape(-1)
    room = footprint.buffer(_TOLERANCE)
    shapely.prepare(room)
    inside = boxes[shapely.covers(room, boxes)]
    if len(inside) == 0:
        x, y = footprint.representative_point().coords[0]
        half = _HALF_SMALLEST
        return box(x - half, y - half, x + half, y + half)
    return max(inside, key=lambda one: round(one.area, 6))


def _evenly_chosen(values: np.ndarray) -> np.ndarray:
    """Returns at most `_MOST_LINES` of increasing values, evenly chosen."""
    if len(values) <= _MOST_LINES:
        return values
    kept = np.linspace(0, len(values) - 1, _MOST_LINES).round().astype(int)
    return values[kept]


def overlap(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Returns (N,) bool: which pairs of rectangles overlap.

    `first` and `second` (N, 4, 2) contain their corners [m].
    """
    pairs = (np.asarray(shapely.polygons(one)) for one in (first, second))
    return np.asarray(shapely.intersects(*pairs))


def close_pairs(
    first: np.ndarray, second: np.ndarray, distance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns which rectangles are within a distance of which others.

    Args:
        first, second: (N, 4, 2) and (M, 4, 2) corners of rectangles [m].
        distance: the distance [m].

    Returns:
        (K,) indices in `first`, and (K,) in `second`, of all such pairs.
    """
    tree = shapely.STRtree(np.asarray(shapely.polygons(second)))
    one, other = tree.query(shapely.polygons(first), "dwithin", distance)
    return one, other
