"""Which points lie in the convex hull of a cloud."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

# Tolerance of the boundary and of flatness, relative to the extent of the
# cloud. Without it, rounding would put the hull's own corners outside.
_TOLERANCE = 1e-9
# Number of points processed at a time: their distances to all facets fit into
# the cache.
_CHUNK = 1 << 8


def in_convex_hull(
    points: np.ndarray, vertices: np.ndarray, margin: float = 0.0
) -> np.ndarray:
    """Returns which points lie in a convex hull or on its boundary.

    A cloud without volume has a hull as well: a polygon in a plane, a line
    segment or a point. Coordinates are centred first, so that large offsets
    (UTM) do not cost precision.

    Args:
        points: (N, 3) float64.
        vertices: (M, 3) float64 points that span the hull.
        margin: distance by which each face of the hull is moved outwards [m].

    Returns:
        (N,) bool; all false if there are no vertices.
    """
    if len(vertices) == 0:
        return np.zeros(len(points), dtype=bool)
    centre = vertices.mean(axis=0)
    hull = vertices - centre
    inside = points - centre
    extent = float(np.ptp(hull, axis=0).max())
    tolerance = _TOLERANCE * max(1.0, extent)
    # Rows of `axes` are the directions of largest to smallest spread.
    axes = np.linalg.svd(hull.T @ hull)[2]
    spread = np.ptp(hull @ axes.T, axis=0)
    rank = int(np.count_nonzero(spread > 2.0 * tolerance))
    tolerance += margin
    while rank > 1:
        try:
            facets = ConvexHull(hull @ axes[:rank].T).equations
        except QhullError:
            # For Qhull the cloud is flat, up to rounding.
            rank -= 1
            continue
        return _in_half_spaces(inside @ axes[:rank].T, facets, tolerance) & (
            _is_within(inside, hull, axes[rank:], tolerance)
        )
    return _is_within(inside, hull, axes[:rank], tolerance) & (
        _is_within(inside, hull, axes[rank:], tolerance)
    )


def _in_half_spaces(
    points: np.ndarray, facets: np.ndarray, tolerance: float
) -> np.ndarray:
    """Returns which points fulfil n . p + d <= tolerance for all facets."""
    result = np.empty(len(points), dtype=bool)
    for start in range(0, len(points), _CHUNK):
        span = slice(start, start + _CHUNK)
        distances = points[span] @ facets[:, :-1].T + facets[:, -1]
        result[span] = (distances <= tolerance).all(axis=1)
    return result


def _is_within(
    points: np.ndarray,
    hull: np.ndarray,
    axes: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Returns which points lie within the hull's extent along some axes."""
    heights = hull @ axes.T
    out = points @ axes.T
    return (
        (out >= heights.min(axis=0) - tolerance)
        & (out <= heights.max(axis=0) + tolerance)
    ).all(axis=1)
