"""A graph of the cells of free space, in which drives are searched."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from evaluation.base import distances_along
from worlds.imports.drives.free_space import CELL, FreeSpace
from worlds.imports.drives.steerable_drives import (
    Obstacle,
    WaypointRoute,
    simplified_drive,
)
from worlds.imports.drives.way_graph import WayGraph

# Paths prefer to be this far from walls [m].
_COMFORT = 6.0
# A metre right beside a wall costs this much more than a metre in comfort.
_WALL_PRICE = 3.0
# Except near the joint, an arm keeps this distance from the drive that it
# leaves [m].
_ARM_APART = 10.0
# Cells within this distance are near the joint [m].
_JOINT_REACH = 1.5 * _ARM_APART
# Cells within this distance of an obstacle are closed [m].
_OBSTRUCTED = 3.0


class CellGraph(WayGraph):
    """A `WayGraph` of the cells of free space, each with eight neighbours."""

    def __init__(self, space: FreeSpace):
        self._space = space
        wide = space.clearance >= space.least
        row, column = np.nonzero(wide)
        self._xy = space.middle(row, column)
        number = np.full(wide.shape, -1)
        number[wide] = np.arange(len(row))
        clearance = space.clearance[wide]
        discomfort = 1.0 - np.minimum(clearance / _COMFORT, 1.0)
        price = 1.0 + discomfort * _WALL_PRICE
        starts, ends = [], []
        rows, columns = wide.shape
        for down, aside in ((0, 1), (1, 0), (1, 1), (1, -1)):
            left, right = max(-aside, 0), max(aside, 0)
            a = number[: rows - down, left : columns - right]
            b = number[down:, right : columns - left]
            linked = (a >= 0) & (b >= 0)
            starts += [a[linked], b[linked]]
            ends += [b[linked], a[linked]]
        start, end = np.concatenate(starts), np.concatenate(ends)
        length = np.linalg.norm(self._xy[start] - self._xy[end], axis=1)
        cost = length * (price[start] + price[end]) / 2.0
        super().__init__(np.full(len(row), CELL), start, end, cost)

    def along(self, way: Sequence[int]) -> np.ndarray:
        return distances_along(self._xy[list(way)])

    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        driven = cKDTree(self._xy[pieces])
        distance, _ = driven.query(self._xy, distance_upper_bound=_ARM_APART)
        from_joint = np.linalg.norm(self._xy - self._xy[joint], axis=1)
        return np.isfinite(distance) & (from_joint > _JOINT_REACH)

    def is_simple(self, way: Sequence[int]) -> bool:
        return len(set(way)) == len(way)

    def drive(self, way: Sequence[int]) -> WaypointRoute | Obstacle:
        return simplified_drive(self._xy[list(way)], self._space)

    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(self._xy[list(way)] - place, axis=1)
        limit = max(_OBSTRUCTED, float(distance.min()))
        return np.array(way)[distance <= limit]
