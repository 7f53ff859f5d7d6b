"""The parts of two clouds that coincide.

One pass over the pairs of points that are close serves both clouds. The nearest
point is not looked for.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.geometry.sorting import sort_into_grid

# Length of a cell in distances at which points coincide. Longer cells hold more
# points that are too far, and shorter ones are more to look at.
_LENGTH = 2.0
# Most cells for each point; beyond, cells are longer.
_MOST_CELLS = 16
# What is looked at reaches this much farther, against rounding.
_MARGIN = 1.0 + 1e-9


class CoincidingPoints:
    """A cloud that others are compared with.

    Example:
        from evaluation.geometry.coinciding import CoincidingPoints

        of_points, of_cloud = CoincidingPoints(cloud, 1.0).shares(points)
    """

    def __init__(self, cloud: np.ndarray, distance: float):
        """Sorts a cloud into cells.

        Args:
            cloud: (N, 3) finite, N >= 1.
            distance: points nearer than this coincide [m].
        """
        self._square = distance * distance
        # One column at a time: NumPy reduces slowly along a short axis.
        self._low = np.array([column.min() for column in cloud.T])
        sides = np.array([np.ptp(column) for column in cloud.T])
        size = _LENGTH * distance
        while np.prod(sides // size + 1.0) > _MOST_CELLS * len(cloud):
            size *= 2.0
        self._reach = distance * _MARGIN
        self._size = size
        self._shape = (sides // size).astype(np.int64) + 1
        place = ((cloud - self._low) // size).astype(np.int64)
        order, self._starts = sort_into_grid(place, self._shape)
        self._cloud = np.asarray(cloud, np.float64).take(order, axis=0)

    def shares(self, points: np.ndarray) -> tuple[float, float]:
        """Returns which part of points meets the cloud, and of the cloud them.

        Args:
            points: (M, 3) finite, M >= 1.
        """
        is_met = np.zeros(len(self._cloud), np.bool_)
        number = _meet(
            np.ascontiguousarray(points, dtype=np.float64),
            self._square,
            self._reach,
            self._cloud,
            self._starts,
            self._low,
            self._size,
            self._shape,
            is_met,
        )
        return number / len(points), float(is_met.mean())


@compiled
def _meet(
    points: np.ndarray,
    limit: float,
    reach: float,
    cloud: np.ndarray,
    starts: np.ndarray,
    low: np.ndarray,
    size: float,
    shape: np.ndarray,
    is_met: np.ndarray,
) -> int:
    """Marks what points (M, 3) meet; returns how many meet something.

    Args:
        points: to compare.
        limit: square that distances must be less than.
        reach: greatest distance to look at along an axis.
        cloud: (N, 3), sorted by cell.
        starts: of each cell in the cloud; the last is N.
        low: (3,) lowest corner of the cells.
        size: of a cell's side.
        shape: (3,) numbers of cells.
        is_met: (N,) bool to set where a point of the cloud is met.
    """
    number = 0
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        for axis in range(3):
            place = points[i, axis] - low[axis]
            # Far from the cloud, the numbers would not fit.
            begin = max((place - reach) / size, -1.0)
            end = min((place + reach) / size, float(shape[axis]))
            first[axis] = max(int(np.floor(begin)), 0)
            last[axis] = min(int(np.floor(end)), shape[axis] - 1)
        if first[2] > last[2]:
            continue
        meets = False
        for x in range(first[0], last[0] + 1):
            for y in range(first[1], last[1] + 1):
                column = (x * shape[1] + y) * shape[2]
                for k in range(
                    starts[column + first[2]], starts[column + last[2] + 1]
                ):
                    dx, dy = px - cloud[k, 0], py - cloud[k, 1]
                    dz = pz - cloud[k, 2]
                    is_near = dx * dx + dy * dy + dz * dz < limit
                    is_met[k] |= is_near
                    meets |= is_near
        number += meets
    return number
