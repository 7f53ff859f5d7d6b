"""Vehicles that stand in queues in all lanes between junctions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set

import numpy as np
import shapely

from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath
from cns_drake.traffic.traffic_plan import (
    KINDS,
    Tracks,
    TrafficPlan,
    VehicleKind,
)
from evaluation.base import arcsin, arctan2, distances_along
from worlds.roads import ENDS, Connection, End, LaneRef, Road, RoadNetwork

# Least and greatest gap between vehicles in a queue [m].
_GAPS = (1.5, 3.5)
# Least distance of a vehicle from the ego car that passes it [m].
_LETS_PASS = 0.4
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


def plan_queues(
    network: RoadNetwork,
    *,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Plans vehicles that stand in queues in all lanes between junctions.

    A vehicle is absent while the ego car is at the vehicle's place.

    Args:
        network: the roads.
        seed: seed by which kinds of vehicles, and gaps between them, are
            sampled.
        duration: duration of the drive [s].
        ego: function that takes times (K,) [s], and returns positions (K, 2)
            [m] and headings (K,) [rad] of the ego car.
        ego_box: the rectangle on the ground that the ego car covers.
    """
    rng = np.random.default_rng(seed)
    shares = np.array([kind.share for kind in KINDS])
    shares /= shares.sum()
    kinds, rows = [], []
    for lane in map(shapely.LineString, _lanes(network)):
        end = lane.length - float(rng.uniform(*_GAPS))
        while True:
            kind = KINDS[int(rng.choice(len(KINDS), size=1, p=shares)[0])]
            begin = end - kind.size[0]
            if begin < 0.0:
                break
            # Both axles stand on the lane; slopes are assumed to be small.
            rear, front = (
                shapely.get_coordinates(
                    lane.interpolate(begin + kind.size[0] / 2 + axle),
                    include_z=True,
                )[0]
                for axle in kind.axles
            )
            middle = rear + (front - rear) * (
                -kind.axles[0] / (kind.axles[1] - kind.axles[0])
            )
            x, y, z = (front - rear) / np.linalg.norm(front - rear)
            kinds.append(kind)
            rows.append([*middle, float(arctan2(y, x)), -float(arcsin(z))])
            end = begin - float(rng.uniform(*_GAPS))
    places = np.array(rows).reshape(-1, 5)
    times = np.arange(0.0, duration + 2 * STEP, STEP)
    present = ~_passed(kinds, places, ego_box.corners(*ego(times)))
    tracks = Tracks(STEP, np.tile(places, (len(times), 1, 1)), present)
    walkers = Tracks(STEP, np.zeros((len(times), 0, 5)))
    return TrafficPlan(tuple(kinds), tracks, walkers)


def _lanes(network: RoadNetwork) -> Iterator[np.ndarray]:
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


def _passed(
    kinds: Sequence[VehicleKind], places: np.ndarray, corners: np.ndarray
) -> np.ndarray:
    """Returns which vehicles the ego car passes at each step, (K, N) bool.

    Args:
        kinds: kinds of the N vehicles.
        places: (N, 5) places of the vehicles, as in `TrafficPlan.vehicles`.
        corners: (K, 4, 2) corners of the ego car's box at each step [m].
    """
    boxes = [
        EgoBox(-kind.size[0] / 2, kind.size[0] / 2, kind.size[1] / 2).corners(
            row[None, :2], row[3:4]
        )[0]
        for kind, row in zip(kinds, places, strict=True)
    ]
    tree = shapely.STRtree(shapely.polygons(boxes) if boxes else [])
    step, near = tree.query(shapely.polygons(corners), "dwithin", _LETS_PASS)
    passed = np.zeros((len(corners), len(kinds)), bool)
    # A vehicle does not disappear during a revolution of a LiDAR. The margin of
    # one step keeps the vehicle absent in revolutions that begin before the
    # pass, or end after it.
    for shift in (-1, 0, 1):
        passed[np.clip(step + shift, 0, len(corners) - 1), near] = True
    return passed
