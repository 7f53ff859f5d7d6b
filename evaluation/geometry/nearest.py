"""The nearest point of a cloud for each point of another one.

The cloud is sorted into the cells of a grid, which are searched from the cell
of a point outwards. For clouds of surfaces this takes half of the time of a
tree.
"""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.geometry.sorting import sort_into_grid

# Cells of the cloud's box for each of its points. Most are empty, because
# surfaces fill little of the space around them.
_CELLS = 0.5
# A side of the cloud counts as at least this part of the longest one.
_FLATTEST = 0.02
# Cells around are taken to be nearer by this part of a cell, against rounding.
_MARGIN = 1e-9


class NearestPoints:
    """A cloud in which the nearest point of any place is found quickly.

    Example:
        from evaluation.geometry.nearest import NearestPoints

        indices, distances = NearestPoints(cloud).find(points)
    """

    def __init__(self, cloud: np.ndarray):
        """Sorts a cloud (N, 3) of finite points into cells."""
        cloud = np.asarray(cloud, dtype=np.float64)
        filled = cloud if len(cloud) else np.zeros((1, 3))
        self._low = filled.min(axis=0)
        sides = np.ptp(filled, axis=0)
        longest = float(sides.max()) or 1.0
        volume = np.maximum(sides, _FLATTEST * longest).prod()
        self._size = float(np.cbrt(volume / (_CELLS * len(filled))))
        self._shape = (sides / self._size).astype(np.int64) + 1
        place = ((cloud - self._low) / self._size).astype(np.int64)
        order, self._starts = sort_into_grid(place, self._shape)
        # The last entry serves points without a nearest one.
        self._order = np.append(order, len(order))
        self._cloud = cloud.take(order, axis=0)

    def find(
        self, points: np.ndarray, limit: float = math.inf
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the nearest point of the cloud for points (M, 3).

        Args:
            points: finite.
            limit: only points nearer than this are found [m].

        Returns:
            (M,) index in the cloud, N where none is found; (M,) distance [m],
            infinite there.
        """
        found, squares = _search(
            np.ascontiguousarray(points, dtype=np.float64),
            limit * limit,
            self._cloud,
            self._starts,
            self._low,
            self._size,
            self._shape,
        )
        return self._order[found], np.sqrt(squares)


@compiled
def _nearer(
    p: np.ndarray,
    cloud: np.ndarray,
    start: int,
    stop: int,
    nearest: int,
    least: float,
) -> tuple[int, float]:
    """Compares points [start, stop) of the cloud with the nearest up to now.

    Returns:
        The nearest of them all, and its squared distance.
    """
    for k in range(start, stop):
        dx, dy, dz = p[0] - cloud[k, 0], p[1] - cloud[k, 1], p[2] - cloud[k, 2]
        square = dx * dx + dy * dy + dz * dz
        if square < least:
            nearest, least = k, square
    return nearest, least


@compiled
def _search(
    points: np.ndarray,
    limit: float,
    cloud: np.ndarray,
    starts: np.ndarray,
    low: np.ndarray,
    size: float,
    shape: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns places of the nearest in a sorted cloud, and squared distances.

    Args:
        points: (M, 3).
        limit: square that distances must be less than.
        cloud: (N, 3), sorted by cell.
        starts: of each cell in the cloud; the last is N.
        low: (3,) lowest corner of the cells.
        size: of a cell's side.
        shape: (3,) numbers of cells.
    """
    found = np.full(len(points), len(cloud))
    squares = np.full(len(points), math.inf)
    own = np.empty(3, np.int64)
    for i in range(len(points)):
        p = points[i]
        for axis in range(3):
            place = math.floor((p[axis] - low[axis]) / size)
            own[axis] = min(max(place, 0), shape[axis] - 1)
        nearest, least = len(cloud), limit
        ring = 0
        # Distance to what is not searched yet.
        gap = 0.0
        while gap < math.inf and max(gap, 0.0) ** 2 < least:
            gap = math.inf
            for axis in range(3):
                if own[axis] > ring:
                    wall = low[axis] + (own[axis] - ring + _MARGIN) * size
                    gap = min(gap, p[axis] - wall)
                if own[axis] + ring + 1 < shape[axis]:
                    wall = low[axis] + (own[axis] + ring + 1 - _MARGIN) * size
                    gap = min(gap, wall - p[axis])
            bottom, top = own[2] - ring, own[2] + ring
            for x in range(
                max(own[0] - ring, 0), min(own[0] + ring + 1, shape[0])
            ):
                for y in range(
                    max(own[1] - ring, 0), min(own[1] + ring + 1, shape[1])
                ):
                    column = (x * shape[1] + y) * shape[2]
                    if max(abs(x - own[0]), abs(y - own[1])) == ring:
                        start = starts[column + max(bottom, 0)]
                        stop = starts[column + min(top + 1, shape[2])]
                        nearest, least = _nearer(
                            p, cloud, start, stop, nearest, least
                        )
                        continue
                    # Within the ring only its bottom and its top are new.
                    for z in (bottom, top):
                        if 0 <= z < shape[2]:
                            start = starts[column + z]
                            stop = starts[column + z + 1]
                            nearest, least = _nearer(
                                p, cloud, start, stop, nearest, least
                            )
            ring += 1
        if nearest < len(cloud):
            found[i], squares[i] = nearest, least
    return found, squares
