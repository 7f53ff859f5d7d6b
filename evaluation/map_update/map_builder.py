"""Merges scans into a map with one point in each cell."""

import numpy as np

from evaluation.base import poses, xyz
from evaluation.maps import CELLS_PER_AXIS, cell_keys

# Side of the cells of which each keeps one point [m].
CELL = 0.1
# A point of a map; `label` and `instance` are 0 where unknown.
_MAP_DTYPE = np.dtype(
    [
        ("x", "<f8"),
        ("y", "<f8"),
        ("z", "<f8"),
        ("label", "<u2"),
        ("instance", "<u2"),
    ]
)
# Greatest number of arrays of cells to search; more are merged.
_MOST_PARTS = 8


class MapBuilder:
    """Merges scans into a map with one point in each cell of 0.1 m.

    The first point of a cell represents the cell, because the mean of the
    cell's points may lie off the surface.
    """

    def __init__(self, origin: np.ndarray):
        """Starts an empty map; its origin (3,) must be near all points [m]."""
        self._origin = np.floor(origin / CELL) - CELLS_PER_AXIS // 2
        # The occupied cells as a few sorted arrays of numbers: each is at least
        # twice as long as the next, so that adding cells merges little.
        self._parts: list[np.ndarray] = []
        # The points of the map, in the order in which they were added.
        self._points: list[np.ndarray] = []

    def add(self, scan: np.ndarray, X_WS: np.ndarray) -> None:
        """Adds a scan to the map.

        Args:
            scan: structured array (N,) with x, y, z in the LiDAR's frame S [m].
                The map keeps the fields `label` and `instance`, if any.
            X_WS: (4, 4) pose of the LiDAR.
        """
        p_W = poses.transform(X_WS, xyz(scan))
        keys, inside = cell_keys(np.floor(p_W / CELL) - self._origin)
        keys, first = np.unique(keys, return_index=True)
        is_new = self._are_free(keys)
        if not is_new.any():
            return
        # The order of the points follows the order of the scans.
        points = _map_points(scan, p_W)[inside]
        self._points.append(points[np.sort(first[is_new])])
        self._occupy(keys[is_new])

    def _are_free(self, keys: np.ndarray) -> np.ndarray:
        """Returns which cells have no point yet, (N,) bool.

        Args:
            keys: (N,) numbers of the cells, see `cell_keys`.
        """
        is_free = np.ones(len(keys), bool)
        for part in self._parts:
            positions = np.minimum(np.searchsorted(part, keys), len(part) - 1)
            is_free &= part[positions] != keys
        return is_free

    def _occupy(self, keys: np.ndarray) -> None:
        """Adds cells to the occupied cells.

        Args:
            keys: (N,) numbers of the cells, ascending.
        """
        self._parts.append(keys)
        while len(self._parts) > _MOST_PARTS or (
            len(self._parts) > 1
            and len(self._parts[-2]) < 2 * len(self._parts[-1])
        ):
            last = self._parts.pop()
            self._parts[-1] = np.union1d(self._parts[-1], last)

    def points(self) -> np.ndarray:
        """Returns the map as a structured array (N,).

        Its fields are x, y, z [m], label and instance.
        """
        return np.concatenate([np.zeros(0, _MAP_DTYPE), *self._points])


def _map_points(scan: np.ndarray, p_W: np.ndarray) -> np.ndarray:
    """Returns the points of a scan as points of a map, (N,) `_MAP_DTYPE`.

    Args:
        scan: structured array (N,) with the fields `label` and `instance`, if
            any.
        p_W: (N, 3) the same points in W [m].
    """
    points = np.zeros(len(scan), _MAP_DTYPE)
    for column, name in enumerate("xyz"):
        points[name] = p_W[:, column]
    for name in ("label", "instance"):
        if name in (scan.dtype.names or ()):
            points[name] = scan[name]
    return points
