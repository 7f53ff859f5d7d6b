"""Drives in the lanes of a city's streets, or else through its free space."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial import cKDTree
from shapely.geometry import LineString

from cns_drake.imports.drives import search
from cns_drake.imports.drives.free_space import CELL, FreeSpace
from cns_drake.imports.drives.search import Obstacle, WaypointDrive
from cns_drake.imports.foreign_city import (
    SHARPEST_TURN_DEG,
    Street,
    cut_at_nodes,
)
from cns_drake.imports.options import DriveOn

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


@dataclass(frozen=True, eq=False)
class Lane:
    """A lane from one junction to the next.

    Attributes:
        line: (N, 2) the middle of its street, in driving direction [m].
        begin, end: numbers of the junctions.
        aside: offset of the lane to the right of that line [m].
        way: number of the piece of street; its other lane has the same one.
    """

    line: np.ndarray
    begin: int
    end: int
    aside: float
    way: int

    @property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.line, axis=0), axis=1).sum())


def make_lanes(streets: Sequence[Street]) -> list[Lane]:
    """Returns the lanes of streets that meet."""
    lanes: list[Lane] = []
    for way, (street, line, (begin, end)) in enumerate(cut_at_nodes(streets)):
        if street.forward:
            lanes.append(Lane(line, begin, end, street.aside, way))
        if street.backward:
            lanes.append(Lane(line[::-1], end, begin, street.aside, way))
    return [lane for lane in lanes if lane.length > 0.0]


def lane_links(lanes: Sequence[Lane]) -> tuple[np.ndarray, np.ndarray]:
    """Returns pairs of lane numbers; the first lane leads into the second."""
    starts: defaultdict[int, list[int]] = defaultdict(list)
    for number, lane in enumerate(lanes):
        starts[lane.begin].append(number)
    pairs = [
        (number, after)
        for number, lane in enumerate(lanes)
        for after in starts[lane.end]
        if _leads_on(lane, lanes[after])
    ]
    before, after = np.array(pairs, dtype=int).reshape(-1, 2).T
    return before, after


def _leads_on(lane: Lane, after: Lane) -> bool:
    if lane.way == after.way:
        return False
    a, b = lane.line[-1] - lane.line[-2], after.line[1] - after.line[0]
    cross, dot = a[0] * b[1] - a[1] * b[0], a @ b
    return bool(abs(np.degrees(np.arctan2(cross, dot))) <= SHARPEST_TURN_DEG)


def lane_path(lanes: Sequence[Lane], spacing: float) -> np.ndarray:
    """Returns a line along lanes: x, y and lateral offset (N, 3) [m].

    Each lane leads into the next; points are about a spacing apart [m].
    """
    parts = []
    for lane in lanes:
        line = search.evenly_spaced(lane.line, spacing)
        parts.append(np.column_stack([line, np.full(len(line), lane.aside)]))
    rows = np.concatenate(parts)
    steps = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    return rows[np.append(True, steps > 1e-6)]


class CellGraph(search.WayGraph):
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

    It passes places (N, 2), about 1 m apart, within tolerances that are tried
    in turn [m].
    """
    found: WaypointDrive | Obstacle = xy[len(xy) // 2]
    for straightened, tolerance in product(_STRAIGHTENED, tolerances):
        if len(xy) < 4 * straightened:
            break
        kernel = np.ones(straightened) / straightened
        smooth = np.column_stack(
            [np.convolve(column, kernel, mode="valid") for column in xy.T]
        )
        line = LineString(smooth).simplify(tolerance)
        found = search.steerable_drive(
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


class StreetGraph(search.WayGraph):
    """Lanes of streets from junction to junction.

    One-way streets are driven in their direction, all others in the outermost
    lane.
    """

    def __init__(
        self, streets: Sequence[Street], space: FreeSpace, drive_on: DriveOn
    ):
        """Makes the graph of streets that meet at common nodes."""
        # A street with a wrong place on another continent would never end.
        self.lanes = [
            one for one in make_lanes(streets) if one.length <= search.LONGEST
        ]
        self._ways = np.array([lane.way for lane in self.lanes], dtype=int)
        self._space = space
        self._side = 1.0 if drive_on == "right" else -1.0
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
        found: WaypointDrive | Obstacle = middle[len(middle) // 2]
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
