"""A graph of the lanes of streets, in which drives are searched."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
import math

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from evaluation.base import arctan2, dot, length_of, step_lengths
from worlds.imports.drives.free_space import FreeSpace
from worlds.imports.drives.search import LONGEST
from worlds.imports.drives.steerable_drives import (
    Obstacle,
    WaypointRoute,
    evenly_spaced,
    simplified_drive,
)
from worlds.imports.drives.way_graph import WayGraph
from worlds.imports.options import DriveOn
from worlds.imports.streets import Street, cut_at_nodes

# Drives take no sharper turn from one street into another.
_SHARPEST_TURN_DEG = 125.0
# Distance between the points of a way along lanes [m].
_LANE_SPACING = 1.0
# Share of their lateral offset that cars keep in a turn. In narrow streets and
# sharp corners they have to swing out.
_AT_TURNS = (1.0, 0.6, 0.2)
# A turn begins and ends this far from its sharpest place [m].
_TURN_REACH = 12.0
# A way turns where it bends by more than this [deg/m].
_SHARP_DEG_PER_M = 4.0
# Tolerances of waypoints relative to the lanes, tried in turn [m].
_TOLERANCES = (0.2, 0.4, 0.8, 1.2)
# Places on a line that are closer than this are one place [m].
_SAME_PLACE = 1e-6
# Directions shorter than this have no direction.
_LEAST_LENGTH = 1e-9
# Number of places in the running mean that smooths corners.
_CORNER_WINDOW = 7
# Number of places in the running mean that smooths lateral offsets.
_OFFSET_WINDOW = 15


@dataclass(frozen=True, eq=False)
class StreetLane:
    """A lane from one junction to the next.

    Attributes:
        line: (N, 2) middle of the street, in driving direction [m].
        begin: node at which the lane begins.
        end: node at which the lane ends.
        aside: lateral offset of the lane from `line` [m], positive towards the
            side on which traffic keeps.
        way: number of the piece of street; the lane in the opposite direction
            has the same number.
    """

    line: np.ndarray
    begin: int
    end: int
    aside: float
    way: int

    @property
    def length(self) -> float:
        """Length of the lane along the middle of the street [m]."""
        return length_of(self.line)


def make_lanes(streets: Sequence[Street]) -> list[StreetLane]:
    """Returns the outermost lane of each street in each allowed direction.

    Streets are cut where they meet.
    """
    lanes: list[StreetLane] = []
    for number, piece in enumerate(cut_at_nodes(streets)):
        begin, end = piece.nodes
        aside = piece.street.aside
        if piece.street.forward:
            lanes.append(StreetLane(piece.line, begin, end, aside, number))
        if piece.street.backward:
            lanes.append(
                StreetLane(piece.line[::-1], end, begin, aside, number)
            )
    return [lane for lane in lanes if lane.length > 0.0]


def lane_links(lanes: Sequence[StreetLane]) -> tuple[np.ndarray, np.ndarray]:
    """Returns pairs of lanes, where the first lane leads into the second.

    The result is two arrays (L,): the numbers of the first lanes, and the
    numbers of the second lanes. Sharp turns are left out.
    """
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


def _leads_on(lane: StreetLane, after: StreetLane) -> bool:
    """Returns whether cars may turn from a lane into one that begins there."""
    if lane.way == after.way:
        return False
    a, b = lane.line[-1] - lane.line[-2], after.line[1] - after.line[0]
    cross = a[0] * b[1] - a[1] * b[0]
    turn = math.atan2(cross, float(dot(a, b)))
    return abs(math.degrees(turn)) <= _SHARPEST_TURN_DEG


def lane_path(lanes: Sequence[StreetLane]) -> np.ndarray:
    """Returns a line (N, 3) along lanes: x, y and lateral offset [m].

    x and y are in the middle of the street; the offset is the `aside` of the
    lane. Each lane leads into the next.
    """
    parts = []
    for lane in lanes:
        line = evenly_spaced(lane.line, _LANE_SPACING)
        parts.append(np.column_stack([line, np.full(len(line), lane.aside)]))
    rows = np.concatenate(parts)
    steps = step_lengths(rows[:, :2])
    return rows[np.append(True, steps > _SAME_PLACE)]


class StreetGraph(WayGraph):
    """A `WayGraph` of the lanes of streets, from junction to junction.

    On one-way streets a car drives only in the allowed direction. On all other
    streets it drives in the outermost lane.

    Attributes:
        lanes: the N lanes, which are the pieces of the graph.
    """

    def __init__(
        self, streets: Sequence[Street], space: FreeSpace, drive_on: DriveOn
    ):
        """Makes the graph of streets, which meet at common nodes."""
        # Streets with a faulty place, for example on another continent, are
        # left out: sampling them would never end.
        self.lanes = [
            lane for lane in make_lanes(streets) if lane.length <= LONGEST
        ]
        self._ways = np.array([lane.way for lane in self.lanes], dtype=int)
        self._space = space
        self._side = 1.0 if drive_on == "right" else -1.0
        lengths = np.array([lane.length for lane in self.lanes])
        ends = np.array([lane.line[[0, -1]] for lane in self.lanes])
        super().__init__(lengths, *lane_links(self.lanes), ends=ends)

    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        closed = np.isin(self._ways, self._ways[pieces])
        closed[joint] = False
        return closed

    def is_simple(self, way: Sequence[int]) -> bool:
        lanes = [self.lanes[k] for k in way]
        passed = [lane.begin for lane in lanes] + [lanes[-1].end]
        return len(set(passed)) == len(passed)

    def drive(self, way: Sequence[int]) -> WaypointRoute | Obstacle:
        rows = lane_path([self.lanes[k] for k in way])
        middle = uniform_filter1d(
            rows[:, :2], _CORNER_WINDOW, axis=0, mode="nearest"
        )
        along = np.gradient(middle, axis=0)
        # Where a line turns back, its direction may be (0, 0).
        lengths = np.linalg.norm(along, axis=1)
        along /= np.maximum(lengths, _LEAST_LENGTH)[:, None]
        heading = np.unwrap(arctan2(along[:, 1], along[:, 0]))
        bends = np.abs(np.gradient(heading)) > np.radians(_SHARP_DEG_PER_M)
        reach = int(_TURN_REACH / _LANE_SPACING)
        near_turn = maximum_filter1d(bends, 2 * reach + 1, mode="constant")
        right = np.column_stack([along[:, 1], -along[:, 0]])
        to_kept_side = right * self._side
        drive: WaypointRoute | Obstacle = middle[len(middle) // 2]
        for tolerance, share in product(_TOLERANCES, _AT_TURNS):
            aside = rows[:, 2] * np.where(near_turn, share, 1.0)
            aside = uniform_filter1d(aside, _OFFSET_WINDOW, mode="nearest")
            places = middle + aside[:, None] * to_kept_side
            drive = simplified_drive(places, self._space, (tolerance,))
            if isinstance(drive, WaypointRoute):
                break
        return drive

    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        lines = [lane_path([self.lanes[k]]) for k in way]
        distances = [
            np.linalg.norm(line[:, :2] - place, axis=1).min().round(6)
            for line in lines
        ]
        return np.array([way[int(np.argmin(distances))]])
