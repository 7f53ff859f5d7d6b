"""Lanes for traffic on OpenStreetMap streets, and ways through junctions.

Tags: https://wiki.openstreetmap.org/wiki/Key:lanes
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base import length_of, wrapped
from cns_drake.imports.openstreetmap import speed_tags
from cns_drake.imports.openstreetmap.tags import count, tag_value
from cns_drake.imports.openstreetmap.way_tags import driven_directions
from cns_drake.imports.streets import SHARPEST_TURN_DEG, Street, cut_at_nodes
from cns_drake.roads import STRAIGHT_LIMIT_DEG, blend
from cns_drake.traffic import SPACING, DirectedLane

# Length of the running mean that rounds the corners of a street [m].
_ROUNDED_OVER = 7.0
# Length of the running mean that rounds a lane on the inner side of a sharp
# bend [m].
_LANE_ROUNDED_OVER = 4.0
# A bend is sharp if a lane's points would be less than this share of their
# usual distance apart, or fold over.
_SHARP_SHARE = 0.2
# Lanes end at this distance from the corner of two streets [m].
_BEFORE_CORNER = 1.0
# Lanes end at least this far from a place where just one street continues [m].
_BEFORE_JOINT = 3.0
# Lanes end at most this far from the end of their stretch [m].
_FARTHEST_STOP = 25.0
# Least length of a lane between two junctions [m].
_SHORTEST_LANE = 1.0
# The direction of a street's end is that of its last piece of this length [m].
_ARM_LENGTH = 6.0
# The edges of nearly parallel streets meet at no corner or far away; the sine
# or tangent of the angle between them counts as at least this.
_LEAST_SINE = 0.1
# An end of a stretch: the number of the stretch, and 0 for its start or -1 for
# its end.
_Arm = tuple[int, int]


# Least width of a lane that carries vehicles [m].
_LEAST_LANE_WIDTH = 2.75
# Greatest width that drivers use per lane if the file gives no number of lanes
# [m].
_USED_LANE_WIDTH = 3.25
# Width of street per lane if the file gives no number of lanes [m].
_USUAL_LANE_WIDTH = 3.5
_MOST_LANES = 8


class _LaneLayout(NamedTuple):
    """The lanes of a street.

    Attributes:
        forward: number of lanes in the direction of the street's line.
        backward: number of lanes in the opposite direction.
        width: width of each lane [m].
        total: number of all lanes, including the empty lanes in the middle
            that belong to neither direction.
    """

    forward: int
    backward: int
    width: float
    total: int

    def offset(self, is_forward: bool, number: int) -> float:
        """Returns the distance of a lane from the middle of the street [m].

        Seen in the lane's direction, the distance is positive to the right if
        traffic drives on the right, and to the left if it drives on the left.

        Args:
            is_forward: whether the lane is in the direction of the street's
                line.
            number: number of the lane in this direction; 0 is the innermost
                lane.
        """
        same = self.forward if is_forward else self.backward
        return self.width * (number + (1 + self.total) / 2.0 - same)


def lane_layout(tags: Mapping[str, str], width: float) -> _LaneLayout:
    """Returns the lanes of a street, from its tags.

    There are no lanes if cars may not use the street, or if it is too narrow.
    `width` is the width of the carriageway [m].
    """
    is_along, is_against = driven_directions(tags)
    directions = is_along + is_against
    most = int(width / _LEAST_LANE_WIDTH)
    if directions == 0 or most < directions:
        return _LaneLayout(0, 0, 0.0, 0)

    def number(key: str) -> int | None:
        value = tag_value(tags, key, count, _MOST_LANES, None, 1.0)
        return None if value is None else int(value)

    tagged = number("lanes")
    total = tagged or directions * int(
        max(1.0, width / directions / _USUAL_LANE_WIDTH)
    )
    if directions == 1:
        forward = min(total, most) * is_along
        backward = min(total, most) * is_against
    else:
        # A middle lane for both directions stays empty.
        there, back = number("lanes:forward"), number("lanes:backward")
        forward = there or max(1, total - back if back else total // 2)
        backward = back or max(1, total - there if there else total // 2)
        while forward + backward > most:
            if forward >= backward:
                forward -= 1
            else:
                backward -= 1
    total = max(forward + backward, min(tagged or 0, most))
    most_used = width if tagged == total else _USED_LANE_WIDTH
    return _LaneLayout(forward, backward, min(most_used, width / total), total)


@dataclass(frozen=True)
class Stretch:
    """A street between two junctions, with its lanes.

    Attributes:
        street: the street, which may extend beyond the junctions.
        line: (N, 2) middle of the street, with rounded corners and evenly
            spaced points [m].
        nodes: nodes at the first and at the last point of `line`.
        layout: numbers and width of the lanes.
    """

    street: Street
    line: np.ndarray
    nodes: tuple[int, int]
    layout: _LaneLayout

    @cached_property
    def length(self) -> float:
        return length_of(self.line)

    def heading(self, end: int) -> float:
        """Returns the direction of the stretch at an end of the stretch [rad].

        The direction points away from this end, along the stretch. `end` is 0
        for the first point and -1 for the last.
        """
        line = self.line if end == 0 else self.line[::-1]
        reach = min(len(line) - 1, max(1, round(_ARM_LENGTH / SPACING)))
        return float(np.arctan2(*(line[reach] - line[0])[::-1]))


@dataclass(frozen=True)
class _Lane:
    """A lane of a stretch, with points (N, 2) in driving direction [m].

    Number 0 is the innermost lane of its direction.
    """

    stretch: int
    is_forward: bool
    number: int
    points: np.ndarray

    @property
    def exit_arm(self) -> _Arm:
        """End of the stretch at which traffic leaves the lane."""
        return self.stretch, -1 if self.is_forward else 0

    @property
    def entry_arm(self) -> _Arm:
        """End of the stretch at which traffic enters the lane."""
        return self.stretch, 0 if self.is_forward else -1


class _Way(NamedTuple):
    """A way from a lane into the next lane.

    Attributes:
        first: number of the lane that leads into the way.
        last: number of the lane into which the way leads.
        is_junction: whether vehicles enter the way as they enter a junction.
        points: (N, 2) points of the way [m].
    """

    first: int
    last: int
    is_junction: bool
    points: np.ndarray


class StreetTraffic(NamedTuple):
    """The lanes of streets, and which lane leads into which.

    Attributes:
        lanes: lanes of streets, followed by lanes through junctions.
        links: pairs of lanes; the second lane of a pair follows the first lane.
        beside: lane -> the neighbouring lane on the outer side, with the same
            direction.
        junctions: nodes at which three or more ends of streets meet.
    """

    lanes: Sequence[DirectedLane]
    links: Sequence[tuple[int, int]]
    beside: Mapping[int, int]
    junctions: Sequence[int]


def make_traffic_lanes(
    streets: Sequence[Street],
    crossed: AbstractSet[int],
    surface: BaseGeometry,
    side: float,
) -> StreetTraffic:
    """Returns the lanes of streets that meet at common nodes.

    Args:
        streets: the streets.
        crossed: nodes at which people cross.
        surface: surface of all streets in W [m]. A way through a junction is
            left out if it leaves this surface.
        side: 1 if traffic keeps right, and -1 if it keeps left.
    """
    stretches = list(_stretches(streets, crossed))
    arms: defaultdict[int, list[_Arm]] = defaultdict(list)
    for number, stretch in enumerate(stretches):
        for end, node in zip((0, -1), stretch.nodes, strict=True):
            arms[node].append((number, end))
    meeting = _MeetingStreets(stretches, arms, crossed, side)
    drawn = list(meeting.lanes())
    lanes = [
        DirectedLane(
            _at_ground_level(lane.points),
            speed_tags.speed_limit(
                stretches[lane.stretch].street.tags, lane.is_forward
            ),
            False,
        )
        for lane in drawn
    ]
    links: list[tuple[int, int]] = []
    shapely.prepare(surface)
    for way in meeting.ways(drawn):
        if not surface.covers(shapely.LineString(way.points)):
            continue
        links += [(way.first, len(lanes)), (len(lanes), way.last)]
        limit = min(lanes[way.first].limit, lanes[way.last].limit)
        points = _at_ground_level(way.points)
        lanes.append(DirectedLane(points, limit, way.is_junction))
    junctions = [node for node, ends in arms.items() if len(ends) > 2]
    return StreetTraffic(lanes, links, _outer_neighbours(drawn), junctions)


@dataclass(frozen=True)
class _MeetingStreets:
    """Streets, cut where they meet.

    Attributes:
        stretches: the pieces of the streets.
        arms: node -> the ends of stretches there.
        crossed: nodes at which people cross.
        side: 1 if traffic keeps right, and -1 if it keeps left.
    """

    stretches: Sequence[Stretch]
    arms: Mapping[int, Sequence[_Arm]]
    crossed: AbstractSet[int]
    side: float

    def setback(self, arm: _Arm) -> float:
        """Returns how far before an end of a stretch its lanes stop [m].

        On a short stretch, both ends share the length that is left.
        """
        stretch = self.stretches[arm[0]]
        wanted = [self._wanted_setback((arm[0], end)) for end in (0, -1)]
        room = max(stretch.length - _SHORTEST_LANE, 0.0)
        return wanted[arm[1]] * min(1.0, room / sum(wanted))

    def _wanted_setback(self, arm: _Arm) -> float:
        """Returns the setback at an end of a stretch that is long enough [m].

        The lanes stop before the corners where the edges of their street meet
        the edges of other streets.
        """
        stretch = self.stretches[arm[0]]
        arms = self.arms[stretch.nodes[arm[1]]]
        is_joint = len(arms) < 3
        reach = _BEFORE_JOINT if is_joint else _BEFORE_CORNER
        half = stretch.street.width / 2.0
        for other in arms:
            if other == arm:
                continue
            crossed = self.stretches[other[0]]
            other_half = crossed.street.width / 2.0
            angle = abs(
                wrapped(crossed.heading(other[1]) - stretch.heading(arm[1]))
            )
            if is_joint:
                tangent = max(np.tan(angle / 2.0), _LEAST_SINE)
                corner = max(other_half, half) / tangent
            else:
                sine = max(np.sin(angle), _LEAST_SINE)
                corner = (other_half + half * np.cos(angle)) / sine
                corner += _BEFORE_CORNER
            reach = max(reach, corner)
        return float(min(reach, _FARTHEST_STOP))

    def lanes(self) -> Iterator[_Lane]:
        """Yields the lanes of all stretches."""
        for number, stretch in enumerate(self.stretches):
            middle, tangent = self._between_setbacks(number)
            for is_forward, num_lanes in (
                (True, stretch.layout.forward),
                (False, stretch.layout.backward),
            ):
                for nth in range(num_lanes):
                    offset = stretch.layout.offset(is_forward, nth)
                    offset *= self.side * (1.0 if is_forward else -1.0)
                    points = _line_beside(middle, tangent, offset)
                    if points is not None:
                        if not is_forward:
                            points = points[::-1]
                        yield _Lane(number, is_forward, nth, points)

    def _between_setbacks(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns the middle of a stretch where its lanes are.

        The result is points (N, 2) [m], and unit vectors (N, 2) along the
        stretch at these points.
        """
        stretch = self.stretches[number]
        along = np.linspace(0.0, stretch.length, len(stretch.line))
        low = self.setback((number, 0))
        high = stretch.length - self.setback((number, -1))
        places = np.linspace(low, high, max(2, int((high - low) / SPACING) + 1))
        middle, tangent = (
            np.column_stack([np.interp(places, along, x) for x in line.T])
            for line in (stretch.line, np.gradient(stretch.line, axis=0))
        )
        return middle, tangent / np.linalg.norm(tangent, axis=1)[:, None]

    def ways(self, lanes: Sequence[_Lane]) -> Iterator[_Way]:
        """Yields the ways from lanes into next lanes."""
        leaving: defaultdict[_Arm, list[int]] = defaultdict(list)
        entering: defaultdict[_Arm, list[int]] = defaultdict(list)
        for number, lane in enumerate(lanes):
            leaving[lane.entry_arm].append(number)
            entering[lane.exit_arm].append(number)
        for node, arms in self.arms.items():
            # Vehicles enter a crossing as they would enter a junction.
            is_entered = len(arms) > 2 or node in self.crossed
            for a, b in product(arms, arms):
                if a == b:
                    continue
                # Vehicles also enter a place where a street loses a lane as
                # they would enter a junction.
                is_junction = is_entered or len(entering[a]) > len(leaving[b])
                for first, last in product(entering[a], leaving[b]):
                    points = self._points_of_way(
                        lanes[first], lanes[last], len(arms) > 2
                    )
                    if points is not None:
                        yield _Way(first, last, is_junction, points)

    def _points_of_way(
        self, first: _Lane, last: _Lane, is_junction: bool
    ) -> np.ndarray | None:
        """Returns points (N, 2) on the way from one lane to another [m].

        The result is None if traffic may not take this way, or if the turn is
        too sharp. `is_junction` is as for `_is_legal`.
        """
        before, after = _heading_at_end(first, -1), _heading_at_end(last, 0)
        turn_deg = float(np.degrees(wrapped(after - before)))
        if abs(turn_deg) > SHARPEST_TURN_DEG:
            return None
        if not self._is_legal(first, last, turn_deg, is_junction):
            return None
        return blend(first.points[-1], before, last.points[0], after, SPACING)

    def _is_legal(
        self, first: _Lane, last: _Lane, turn_deg: float, is_junction: bool
    ) -> bool:
        """Returns whether traffic may go from one lane to another.

        A turn across the opposite direction leads from the innermost lane to
        the innermost lane, and a turn to the other side from the outermost lane
        to the outermost lane. Where traffic goes straight on, lanes keep their
        number, counted from the inside. Between one-way streets, lanes keep
        their number, counted from the outside.

        Args:
            first: the lane that traffic leaves.
            last: the lane that traffic enters.
            turn_deg: angle between the lanes, positive to the left [deg].
            is_junction: whether three or more ends of streets meet there.
        """
        lanes = (first, last)
        layouts = [self.stretches[lane.stretch].layout for lane in lanes]
        here, there = (
            layout.forward if lane.is_forward else layout.backward
            for layout, lane in zip(layouts, lanes, strict=True)
        )
        outer = (here - 1 - first.number, there - 1 - last.number)
        if all(layout.forward * layout.backward == 0 for layout in layouts):
            return outer[1] == min(outer[0], there - 1)
        if not is_junction or abs(turn_deg) <= STRAIGHT_LIMIT_DEG:
            return last.number == min(first.number, there - 1)
        if turn_deg * self.side > 0:
            return first.number == last.number == 0
        return outer == (0, 0)


def _stretches(
    streets: Sequence[Street], crossed: AbstractSet[int]
) -> Iterator[Stretch]:
    """Yields the pieces of streets with lanes, except tracks and short pieces.

    Streets are cut where they meet, and at the nodes in `crossed`.
    """
    used = [
        street
        for street in streets
        if street.tags.get("highway") != "track"
        and lane_layout(street.tags, street.width).width
    ]
    for piece in cut_at_nodes(used, crossed):
        street = piece.street
        line = shapely.LineString(piece.line)
        if line.length > SPACING:
            yield Stretch(
                street,
                _rounded_line(line, _ROUNDED_OVER),
                piece.nodes,
                lane_layout(street.tags, street.width),
            )


def _line_beside(
    middle: np.ndarray, tangent: np.ndarray, offset: float
) -> np.ndarray | None:
    """Returns points (M, 2) on a line beside another line [m].

    Args:
        middle: (N, 2) points of the other line [m].
        tangent: (N, 2) unit vectors along the other line.
        offset: distance to the right of the other line [m].

    Returns:
        The points; None if the other line bends too sharply.
    """
    right = np.column_stack([tangent[:, 1], -tangent[:, 0]])
    points = middle + offset * right
    ahead = (np.diff(points, axis=0) * tangent[1:]).sum(axis=1)
    if not ahead.min() < _SHARP_SHARE * SPACING:
        return np.asarray(points)
    parts = shapely.get_parts(shapely.LineString(middle).offset_curve(-offset))
    if not len(parts):
        return None
    longest = parts[shapely.length(parts).argmax()]
    return _rounded_line(longest, _LANE_ROUNDED_OVER)


def _rounded_line(line: shapely.LineString, window_length: float) -> np.ndarray:
    """Returns evenly spaced points (N, 2) along a line with smooth corners.

    `window_length` is the length of the running mean that rounds corners [m].
    """
    num_points = max(3, round(line.length / SPACING) + 1)
    places = np.linspace(0.0, 1.0, num_points)
    points = shapely.get_coordinates(
        shapely.line_interpolate_point(line, places, normalized=True)
    )
    window = min(int(window_length / SPACING), num_points // 3) // 2 * 2 + 1
    reach = window // 2
    # Mirrored at both ends, so that these stay in place.
    longer = np.concatenate(
        [
            2 * points[0] - points[reach:0:-1],
            points,
            2 * points[-1] - points[-2 : -reach - 2 : -1],
        ]
    )
    smooth = uniform_filter1d(longer, window, axis=0)
    return smooth[reach : reach + num_points]


def _outer_neighbours(lanes: Sequence[_Lane]) -> Mapping[int, int]:
    """Returns for a lane the number of the next lane on its outer side.

    Lanes of one direction must follow each other from the inside outwards.
    """
    return {
        number: number + 1
        for number, (lane, after) in enumerate(pairwise(lanes))
        if (lane.stretch, lane.is_forward) == (after.stretch, after.is_forward)
    }


def _heading_at_end(lane: _Lane, end: int) -> float:
    """Returns a lane's heading [rad] at its start (0) or its end (-1)."""
    a, b = lane.points[:2] if end == 0 else lane.points[-2:]
    return float(np.arctan2(*(b - a)[::-1]))


def _at_ground_level(line: np.ndarray) -> np.ndarray:
    return np.column_stack([line, np.zeros(len(line))])
