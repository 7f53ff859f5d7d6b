"""Drives along streets of a map, in their lanes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy.ndimage import uniform_filter1d

from cns_drake.imports.drive_search import WayGraph
from cns_drake.imports.free_drives import simplified_drive
from cns_drake.imports.free_space import FreeSpace
from cns_drake.imports.import_report import DriveOn
from cns_drake.imports.street_lanes import (
    Street,
    lane_links,
    lane_path,
    make_lanes,
)
from cns_drake.imports.waypoint_drives import LONGEST, Obstacle, WaypointDrive

_SPACING = 1.0
# Share of their lateral offset that cars keep in a turn: in narrow streets and
# sharp corners they have to swing out.
_AT_TURNS = (1.0, 0.6, 0.2)
# Distance of the start and end of a turn from its sharpest place [m].
_TURN = 12.0
_SHARP_DEG_PER_M = 4.0
# Tolerances, tried in turn, of waypoints against the lanes [m].
_TOLERANCES = (0.2, 0.4, 0.8, 1.2)
# Lengths of the means that round corners, and lateral offsets [m].
_ROUND, _SMOOTH_ASIDE = 7, 15


class StreetGraph(WayGraph):
    """Lanes of streets from junction to junction.

    One-way streets are driven in their direction, all others in the outermost
    lane.
    """

    def __init__(
        self, streets: Sequence[Street], space: FreeSpace, drive_on: DriveOn
    ):
        """Makes the graph.

        Args:
            streets: they meet at common nodes.
            space: where a car has room.
            drive_on: the side.
        """
        # A street with a wrong place on another continent would never end.
        self.lanes = [
            one for one in make_lanes(streets) if one.length <= LONGEST
        ]
        self._ways = np.array([lane.way for lane in self.lanes], dtype=int)
        self._space = space
        self._side = 1.0 if drive_on is DriveOn.RIGHT else -1.0
        lengths = np.array([lane.length for lane in self.lanes])
        super().__init__(lengths, *lane_links(self.lanes))

    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        closed = np.isin(self._ways, self._ways[pieces])
        closed[joint] = False
        return closed

    def is_simple(self, way: Sequence[int]) -> bool:
        lanes = [self.lanes[k] for k in way]
        passed = [lane.begin for lane in lanes] + [lanes[-1].end]
        return len(set(passed)) == len(passed)

    def drive(self, way: Sequence[int]) -> WaypointDrive | Obstacle:
        rows = lane_path([self.lanes[k] for k in way], _SPACING)
        middle = uniform_filter1d(rows[:, :2], _ROUND, axis=0, mode="nearest")
        along = np.gradient(middle, axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
        bends = np.abs(np.gradient(heading)) > np.radians(_SHARP_DEG_PER_M)
        reach = int(_TURN / _SPACING)
        near = np.convolve(bends, np.ones(2 * reach + 1), mode="same") > 0
        right = np.column_stack([along[:, 1], -along[:, 0]]) * self._side
        found: WaypointDrive | Obstacle = Obstacle(middle[len(middle) // 2])
        for tolerance, share in product(_TOLERANCES, _AT_TURNS):
            aside = rows[:, 2] * np.where(near, share, 1.0)
            aside = uniform_filter1d(aside, _SMOOTH_ASIDE, mode="nearest")
            places = middle + aside[:, None] * right
            found = simplified_drive(places, self._space, (tolerance,))
            if isinstance(found, WaypointDrive):
                break
        return found

    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        from_line = [
            np.linalg.norm(
                lane_path([self.lanes[k]], 1.0)[:, :2] - place, axis=1
            ).min()
            for k in way
        ]
        return np.array([way[int(np.argmin(from_line))]])
