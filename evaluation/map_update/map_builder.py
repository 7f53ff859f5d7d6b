"""Merges scans into a map with one point in each cell."""

import numpy as np

from cns_drake.base import poses
from cns_drake.base.points import xyz
from evaluation.maps.grid_cells import CELLS_PER_AXIS, cell_keys

# Side of the cells of which each keeps one point [m].
CELL = 0.1
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
        self._parts: list[np.ndarray] = []
        self._points: list[np.ndarray] = []

    def add(self, scan: np.ndarray, X_WS: np.ndarray) -> None:
        """Adds a scan to the map.

        Args:
            scan: structured array (N,) with x, y, z in the LiDAR's frame S [m].
                The map keeps the fields `label` and `instance`, if any.
            X_WS: (4, 4) pose of the LiDAR.
        """
        points = np.zeros(len(scan), _MAP_DTYPE)
        p_W = poses.transform(X_WS, xyz(scan))
        for column, name in enumerate("xyz"):
            points[name] = p_W[:, column]
        for name in ("label", "instance"):
            if name in (scan.dtype.names or ()):
                points[name] = scan[name]
        cells = np.floor(p_W / CELL) - self._origin
        keys, inside = cell_keys(cells)
        keys, first = np.unique(keys, return_index=True)
        is_new = np.ones(len(keys), bool)
        for part in self._parts:
            positions = np.minimum(np.searchsorted(part, keys), len(part) - 1)
            is_new &= part[positions] != keys
        if not is_new.any():
            return
        # The order of the points follows the order of the scans.
        self._points.append(points[inside][np.sort(first[is_new])])
        self._parts.append(keys[is_new])
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
