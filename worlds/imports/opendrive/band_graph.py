"""A graph of OpenDRIVE lanes, in which drives are searched."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
import math

import numpy as np
from scipy.spatial import cKDTree

from evaluation.base import dot, length_of, step_lengths, wrapped
from worlds.imports.drives import search, steerable_drives, way_graph
from worlds.imports.drives.steerable_drives import Obstacle, WaypointRoute
from worlds.imports.opendrive.lanes import DRIVEN, LaneBand

# A lane follows another one if its start is within this distance of the other's
# end [m].
_JOINED_WITHIN = 0.6
# A lane follows another one only if their headings differ by less than this
# [rad].
_ASTRAY = np.radians(20.0)
# A car needs this width at both ends of a lane [m].
_LEAST_WIDTH = 1.8
# Shorter lanes are not driven [m].
_LEAST_LENGTH = 0.05
# Places on a lane that are closer than this are one place [m].
_SAME_PLACE = 1e-3
# Points of a drive that are closer than this to the point before are left out
# [m].
_LEAST_STEP = 0.05
# A step of a drive goes backwards if the cosine of its angle to the step before
# is at most this (60 deg).
_BACKWARD_COSINE = 0.5
# Distance between waypoints [m].
_WAYPOINT_SPACING = 2.0
# Numbers of waypoints to both sides in the running mean of a drive, tried in
# turn.
_SMOOTHING = (0, 1, 2, 3)
# Speed limit where the file gives none [m/s].
_DEFAULT_LIMIT = 13.9


class BandGraph(way_graph.WayGraph):
    """A `worlds.imports.drives.way_graph.WayGraph` of OpenDRIVE lanes.

    Each lane of a road section is a piece. Edges lead in driving direction.

    Attributes:
        bands: the N driven lanes.
        lines: for each lane, its path in driving direction, (M, 3) in W [m].
    """

    def __init__(self, bands: Sequence[LaneBand]):
        self.bands = [band for band in bands if _is_driven(band)]
        self.lines = [_driven_line(band) for band in self.bands]
        lengths = [length_of(line) for line in self.lines]
        # A drive may use each road only once. In a junction, each way is a
        # road.
        self._roads = np.array([band.road.name for band in self.bands])
        ends = np.array([line[[0, -1], :2] for line in self.lines])
        super().__init__(np.array(lengths), *self._followers(), ends=ends)

    def _followers(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns pairs of lanes, where the second lane follows the first.

        The result is two arrays (L,) of lane numbers.
        """
        lines = self.lines
        starts = np.array([line[0] for line in lines]).reshape(-1, 3)
        ends = np.array([line[-1] for line in lines]).reshape(-1, 3)
        pairs = []
        if lines:
            first = [_heading(line[:2]) for line in lines]
            last = [_heading(line[-2:]) for line in lines]
            near = cKDTree(starts).query_ball_point(ends, _JOINED_WITHIN)
            for lane, followers in enumerate(near):
                for after in sorted(followers):
                    turn = wrapped(first[after] - last[lane])
                    if abs(turn) < _ASTRAY and after != lane:
                        pairs.append((lane, after))
        before, after = np.array(pairs, dtype=int).reshape(-1, 2).T
        return before, after

    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        roads = set(self._roads[pieces]) - {self._roads[joint]}
        closed = np.isin(self._roads, list(roads))
        closed[pieces] = True
        closed[joint] = False
        return closed

    def is_simple(self, way: Sequence[int]) -> bool:
        seen: set[str] = set()
        last = ""
        for k in way:
            road = self.bands[k].road
            place = road.name if road.junction is None else f" {road.junction}"
            if place != last and place in seen:
                return False
            seen.add(place)
            last = place
        return True

    def drive(self, way: Sequence[int]) -> WaypointRoute | Obstacle:
        line = np.concatenate([self.lines[k] for k in way])
        points = steerable_drives.evenly_spaced(
            _without_backward_points(line), _WAYPOINT_SPACING
        )[: int(search.LONGEST / _WAYPOINT_SPACING) + 1]
        drive: WaypointRoute | Obstacle = points[0, :2]
        for window in _SMOOTHING:
            drive = steerable_drives.steerable_drive(_smoothed(points, window))
            if isinstance(drive, WaypointRoute):
                limit = _usual_limit(self.bands[k] for k in way)
                return replace(drive, limit=limit)
        return drive

    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        distances = [
            float(np.hypot(*(self.lines[k][:, :2] - place).T).min().round(6))
            for k in way
        ]
        return np.array([way[int(np.argmin(distances))]])


def _is_driven(band: LaneBand) -> bool:
    """Returns whether cars drive on a lane, and fit in at both ends."""
    width = band.width
    return (
        band.kind in DRIVEN
        and min(width[0], width[-1]) > _LEAST_WIDTH
        and float(np.abs(np.diff(band.s)).sum()) > _LEAST_LENGTH
    )


def _driven_line(band: LaneBand) -> np.ndarray:
    """Returns the middle of a lane (N, 3) in the direction of its traffic."""
    along = (band.lane.number < 0) != band.road.keeps_left
    along ^= band.lane.is_reversed
    line = band.middle if along else band.middle[::-1]
    steps = step_lengths(line[:, :2])
    kept = np.concatenate([[True], steps > _SAME_PLACE])
    kept[-1] = True
    return line[kept]


def _usual_limit(bands: Iterable[LaneBand]) -> float:
    """Returns the median of the speed limit along lanes [m/s]."""
    limits, lengths = [], []
    for band in bands:
        middle = (band.s[1:] + band.s[:-1]) / 2.0
        limit = band.road.limits.at(middle, middle)
        limits.append(np.where(limit > 0.0, limit, _DEFAULT_LIMIT))
        lengths.append(np.diff(band.s))
    limit, length = np.concatenate(limits), np.concatenate(lengths)
    order = np.argsort(limit, kind="stable")
    reached = np.cumsum(length[order])
    return float(limit[order][np.searchsorted(reached, reached[-1] / 2.0)])


def _heading(ends: np.ndarray) -> float:
    """Returns the heading from the first of two places (2, 3) to the second."""
    return math.atan2(ends[1, 1] - ends[0, 1], ends[1, 0] - ends[0, 0])


def _smoothed(points: np.ndarray, window: int) -> np.ndarray:
    """Returns a running mean (N, 3) of points, narrower at both ends.

    The mean extends over `window` points to both sides, and over fewer points
    near both ends.
    """
    count = len(points)
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(points, axis=0)])
    at = np.arange(count)
    reach = np.minimum(np.minimum(at, count - 1 - at), window)
    return (total[at + reach + 1] - total[at - reach]) / (2 * reach + 1)[
        :, None
    ]


def _without_backward_points(line: np.ndarray) -> np.ndarray:
    """Returns a line without points that go backwards, as at rough joints."""
    kept = [line[0], line[1]]
    for point in line[2:]:
        step, last = (point - kept[-1])[:2], (kept[-1] - kept[-2])[:2]
        size = float(np.hypot(*step))
        ahead = dot(step, last) > _BACKWARD_COSINE * size * np.hypot(*last)
        if size > _LEAST_STEP and ahead:
            kept.append(point)
    return np.array(kept)
