"""Drives through the free space of a city, where no streets are known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
from scipy.spatial import cKDTree
from shapely.geometry import LineString

from cns_drake.imports.drive_search import WayGraph
from cns_drake.imports.free_space import CELL, FreeSpace
from cns_drake.imports.waypoint_drives import (
    Obstacle,
    WaypointDrive,
    steerable_drive,
)

# Paths prefer this distance from walls [m].
_COMFORT = 6.0
# An arm keeps this distance from the drive it leaves, except at the joint [m].
_APART = 10.0
# Cells within this distance of an obstacle are closed [m].
_OBSTRUCTED = 3.0
# Greatest distance of waypoints, for their heights, and least distance from
# corners [m].
_WAYPOINT_SPACING = 15.0
# Tolerances, tried in turn, of waypoints against the found path [m].
_SIMPLIFICATIONS = (1.5, 1.0, 0.7, 2.0, 3.0)
# Cells in a running mean, chosen by trial.
_STRAIGHTENED = (5, 11, 17)


class CellGraph(WayGraph):
    """Cells with room, each linked to the eight beside it."""

    def __init__(self, space: FreeSpace):
        self._space = space
        wide = space.clearance >= space.least
        row, column = np.nonzero(wide)
        self._xy = space.middle(row, column)
        number = np.full(wide.shape, -1)
        number[wide] = np.arange(len(row))
        clearance = space.clearance[wide]
        # A cell near a wall costs up to four times as much.
        price = 1.0 + (1.0 - np.minimum(clearance / _COMFORT, 1.0)) * 3.0
        starts, ends = [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            a = number[: wide.shape[0] - down]
            b = number[down:]
            if right > 0:
                a, b = a[:, :-1], b[:, 1:]
            elif right < 0:
                a, b = a[:, 1:], b[:, :-1]
            linked = (a >= 0) & (b >= 0)
            starts += [a[linked], b[linked]]
            ends += [b[linked], a[linked]]
        start, end = np.concatenate(starts), np.concatenate(ends)
        length = np.linalg.norm(self._xy[start] - self._xy[end], axis=1)
        cost = length * (price[start] + price[end]) / 2.0
        super().__init__(np.full(len(row), CELL), start, end, cost)

    def along(self, way: Sequence[int]) -> np.ndarray:
        steps = np.linalg.norm(np.diff(self._xy[list(way)], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        driven = cKDTree(self._xy[pieces])
        distance, _ = driven.query(self._xy, distance_upper_bound=_APART)
        here = np.linalg.norm(self._xy - self._xy[joint], axis=1)
        return np.isfinite(distance) & (here > 1.5 * _APART)

    def is_simple(self, way: Sequence[int]) -> bool:
        return len(set(way)) == len(way)

    def drive(self, way: Sequence[int]) -> WaypointDrive | Obstacle:
        return simplified_drive(self._xy[list(way)], self._space)

    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(self._xy[list(way)] - place, axis=1)
        limit = max(_OBSTRUCTED, float(distance.min()))
        return np.array(way)[distance <= limit]


def simplified_drive(
    xy: np.ndarray,
    space: FreeSpace,
    tolerances: Sequence[float] = _SIMPLIFICATIONS,
) -> WaypointDrive | Obstacle:
    """Returns a drive with as few waypoints as the room allows.

    Args:
        xy: (N, 2) places to pass, about 1 m apart [m].
        space: where a car has room.
        tolerances: of its waypoints against these places, tried in turn [m].
    """
    found: WaypointDrive | Obstacle = Obstacle(xy[len(xy) // 2])
    for straightened, tolerance in product(_STRAIGHTENED, tolerances):
        if len(xy) < 4 * straightened:
            break
        kernel = np.ones(straightened) / straightened
        smooth = np.column_stack(
            [np.convolve(column, kernel, mode="valid") for column in xy.T]
        )
        line = LineString(smooth).simplify(tolerance)
        found = steerable_drive(
            _densified(np.array(line.coords)), space.obstacle
        )
        if isinstance(found, WaypointDrive):
            break
    return found


def _densified(corners: np.ndarray) -> np.ndarray:
    """Returns waypoints with others between those that lie far apart."""
    points = [corners[:1]]
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        number = int((length - _WAYPOINT_SPACING) // _WAYPOINT_SPACING)
        if number > 0:
            # No waypoints are near the corners, whose arcs need room.
            parts = np.linspace(0.0, 1.0, number + 2)[1:-1]
            points.append(a + parts[:, None] * (b - a))
        points.append(b[None])
    return np.concatenate(points)
