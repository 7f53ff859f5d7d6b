"""Lanes between stop lines, in which vehicles can wait."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set

import numpy as np

from evaluation.base import distances_along
from worlds.roads.network import Connection, RoadNetwork
from worlds.roads.road import ENDS, End, Road
from worlds.shapes import LaneRef

# Distance of stop lines from the end of a road with a crossing, and without one
# [m].
_STOP_LINE = 4.5
_STOP_LINE_ALONE = 1.0
# Least number of arms of a junction with crossings.
_FEWEST_ARMS = 3
# Vehicles queue in lanes that are at least this long between stop lines [m].
_SHORTEST_LANE = 14.0
# Greatest number of junctions between two such lanes.
_MOST_JUNCTIONS = 4
# Greatest distance between the points of a lane [m].
_SPACING = 0.5
# Points nearer than this to the end of a lane are left out [m].
_AT_END = 1e-3


def lanes_between_stop_lines(network: RoadNetwork) -> Iterator[np.ndarray]:
    """Yields the points (N, 3) of lanes between stop lines [m].

    The points are evenly spaced, in driving direction.
    """
    cut_off = {
        (road.name, end): _stop_line(network, road, end)
        for road in network.roads.values()
        for end in ENDS
    }
    long = [
        lane
        for lane in network.lanes()
        if network.roads[lane.road].length
        - sum(cut_off[lane.road, end] for end in ENDS)
        >= _SHORTEST_LANE
    ]
    for lane in _passable(network, long):
        line = network.roads[lane.road].lane_centreline(*lane[1:], _SPACING)
        along = distances_along(line)
        first, last = ENDS if lane.direction == "forward" else ENDS[::-1]
        low = cut_off[lane.road, first]
        high = along[-1] - cut_off[lane.road, last]
        inside = along[(along > low + _AT_END) & (along < high - _AT_END)]
        line = _places_along(line, np.array([low, *inside, high]))
        length = distances_along(line)[-1]
        count = max(2, int(np.ceil(length / _SPACING)) + 1)
        yield _places_along(line, np.linspace(0.0, length, count))


def _passable(network: RoadNetwork, lanes: list[LaneRef]) -> list[LaneRef]:
    """Returns those of some lanes that vehicles can both reach and leave."""
    after: dict[LaneRef, list[Connection]] = defaultdict(list)
    for name in network.junctions:
        for connection in network.connections(name):
            after[connection.incoming].append(connection)
    followers = {lane: _next_lanes(after, lane, set(lanes)) for lane in lanes}
    while True:
        entered = {one for lane in lanes for one in followers[lane]}
        left = [
            lane
            for lane in lanes
            if lane in entered and followers[lane].intersection(lanes)
        ]
        if left == lanes:
            return lanes
        lanes = left


def _next_lanes(
    after: Mapping[LaneRef, Sequence[Connection]],
    lane: LaneRef,
    wanted: Set[LaneRef],
) -> set[LaneRef]:
    """Returns the first of the wanted lanes that follow a lane.

    No way to them passes a junction twice, or more than four.

    Args:
        after: lane -> connections that begin at its exit.
        lane: the lane.
        wanted: the lanes that end a way.
    """
    found: set[LaneRef] = set()
    waiting: list[tuple[LaneRef, frozenset[str]]] = [(lane, frozenset())]
    while waiting:
        here, passed = waiting.pop()
        if len(passed) == _MOST_JUNCTIONS:
            continue
        for one in after.get(here, ()):
            if one.junction in passed:
                continue
            if one.outgoing in wanted:
                found.add(one.outgoing)
            else:
                waiting.append((one.outgoing, passed | {one.junction}))
    return found


def _stop_line(network: RoadNetwork, road: Road, end: End) -> float:
    """Returns the distance of the stop line from the end of a road [m]."""
    junction = network.junctions[road.start if end == "start" else road.end]
    crosses = (
        len(junction.arms) >= _FEWEST_ARMS and road.length >= 2 * _STOP_LINE
    )
    return _STOP_LINE if crosses else _STOP_LINE_ALONE


def _places_along(line: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Returns the places (M, 3) at distances (M,) along a line (N, 3) [m]."""
    known = distances_along(line)
    return np.column_stack([np.interp(along, known, x) for x in line.T])
