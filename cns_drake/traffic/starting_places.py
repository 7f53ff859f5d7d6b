"""Places of vehicles and walkers at the start of a drive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.traffic.lane_arrays import LaneArrays
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.presence import Presence
from cns_drake.traffic.right_of_way import Permits, is_ego_far
from cns_drake.traffic.vehicle_kinds import KINDS, VehicleKind
from cns_drake.traffic.vehicle_state import CURRENT, NUM_PIECES, Vehicles
from cns_drake.traffic.walker_steps import APART, SPEED, SPREAD
from cns_drake.traffic.walker_ways import Walkers, WalkwayArrays
from cns_drake.traffic.walkways import Walkway

# Length of lane that a vehicle needs besides its own [m].
_SPACE = 9.0
# Vehicles begin with this part of the allowed speed.
_PART_OF_SPEED = 0.5
# Length of sidewalk for one walker [m].
_WALKER_SPACE = 3.0
# Number of places that are drawn before a vehicle is given up.
_TRIES = 200


def room_for_vehicles(graph: LaneGraph) -> int:
    """Returns the number of vehicles for which lanes have room to move."""
    mean = sum(kind.share * kind.size[0] for kind in KINDS)
    mean /= sum(kind.share for kind in KINDS)
    return int(
        sum(graph.pieces[k].length // (mean + 2 * _SPACE) for k in graph.lanes)
    )


def room_for_walkers(walkways: Sequence[Walkway]) -> int:
    """Returns the number of walkers for whom sidewalks have room."""
    length = sum(
        np.linalg.norm(np.diff(way.points, axis=0), axis=1).sum()
        for way in walkways
        if way.crossing < 0
    )
    return int(length // _WALKER_SPACE)


def place_vehicles(
    kinds: Sequence[VehicleKind],
    graph: LaneGraph,
    lanes: LaneArrays,
    presence: Presence,
    rng: np.random.Generator,
) -> tuple[Vehicles, list[int]]:
    """Puts vehicles into lanes, away from the ego car's first places.

    Args:
        kinds: of the N vehicles.
        graph: lanes.
        lanes: the same as arrays.
        presence: of the ego car.
        rng: draws the places.

    Returns:
        The vehicles, and the numbers of those for which a place was found.
    """
    free = np.array(graph.lanes)
    share = lanes.length[free] / lanes.length[free].sum()
    taken: dict[int, list[tuple[float, float]]] = {}
    found, paths, places = [], [], []
    for number, kind in enumerate(kinds):
        for _ in range(_TRIES):
            lane = int(rng.choice(free, p=share))
            length = lanes.length[lane]
            low = kind.size[0] + 1.0
            if length < low + 1.0:
                continue
            s = float(rng.uniform(low, length - 1.0))
            span = (s - kind.size[0] - _SPACE / 2, s + _SPACE / 2)
            if any(span[0] < b and a < span[1] for a, b in taken.get(lane, [])):
                continue
            if presence.until[0, lane] == 0.0 or not is_ego_far(
                lanes, presence, 0, lane, s
            ):
                continue
            taken.setdefault(lane, []).append(span)
            found.append(number)
            paths.append(lane)
            places.append(s)
            break
    chosen = [kinds[k] for k in found]
    count = len(found)
    path = np.full((count, NUM_PIECES), -1)
    path[:, CURRENT] = paths
    front = np.array(places, float)
    row = lanes.first[path[:, CURRENT]] + (
        front / lanes.step[path[:, CURRENT]]
    ).astype(int)
    factor = np.array([kind.speed_factor for kind in chosen])
    top = np.array([kind.top_speed for kind in chosen])
    factor = factor * rng.uniform(0.9, 1.1, count)
    left = lanes.length[path[:, CURRENT]] - front
    v = _PART_OF_SPEED * np.minimum(top, factor * lanes.speed[row])
    # Vehicles can stop before the stop line, or behind the one ahead.
    v = np.minimum(v, np.sqrt(1.5 * np.minimum(left, _SPACE / 2)))
    return Vehicles(
        length=np.array([kind.size[0] for kind in chosen], float),
        rear_axle=np.array([kind.axles[0] for kind in chosen], float),
        front_axle=np.array([kind.axles[1] for kind in chosen], float),
        factor=factor,
        top=top,
        a=np.array([kind.acceleration for kind in chosen], float),
        b=np.array([kind.deceleration for kind in chosen], float),
        headway=np.array([kind.headway for kind in chosen], float),
        large=np.array([kind.is_large for kind in chosen], bool),
        path=path,
        s=front,
        v=v,
        granted=np.zeros(count, bool),
        held=np.full(count, -1),
        since=np.full(count, np.inf),
        refused=np.zeros(count),
        left_lane=np.full(count, -1),
        change_start=np.zeros(count),
        change_length=np.ones(count),
        draws=np.zeros(count, np.int64),
    ), found


def make_walkway_arrays(walkways: Sequence[Walkway]) -> WalkwayArrays:
    """Returns walkways as arrays."""
    count = np.array([len(way.points) for way in walkways], int)
    num_nodes = max((max(w.start, w.end) for w in walkways), default=-1) + 1
    at_node: list[list[int]] = [[] for _ in range(num_nodes)]
    for k, way in enumerate(walkways):
        at_node[way.start].append(k)
        if way.end != way.start:
            at_node[way.end].append(k)
    node_count = np.array([len(ways) for ways in at_node], int)
    return WalkwayArrays(
        first=np.cumsum(count) - count,
        num_points=count,
        points=np.concatenate(
            [np.zeros((0, 3)), *(way.points for way in walkways)]
        ),
        half_width=np.array([way.half_width for way in walkways], float),
        start=np.array([way.start for way in walkways], int),
        end=np.array([way.end for way in walkways], int),
        crossing=np.array([way.crossing for way in walkways], int),
        node_first=np.cumsum(node_count) - node_count,
        node_count=node_count,
        node_ways=np.array([k for ways in at_node for k in ways], int),
    )


def place_walkers(
    count: int,
    walkways: Sequence[Walkway],
    rng: np.random.Generator,
) -> Walkers:
    """Puts walkers onto walkways, except crossings.

    Returns:
        The walkers, fewer than wanted if there is no room for all.
    """
    free = [k for k, way in enumerate(walkways) if way.crossing < 0]
    sizes = np.array([len(walkways[k].points) for k in free], float)
    rows: list[tuple[int, int, bool, np.ndarray, float]] = []
    for _ in range(count if free else 0):
        for _ in range(_TRIES):
            way = free[int(rng.choice(len(free), p=sizes / sizes.sum()))]
            points = walkways[way].points
            forward = bool(rng.integers(2))
            at = int(rng.integers(len(points) - 1))
            line = points if forward else points[::-1]
            tangent = (line[at + 1] - line[at])[:2]
            xy = line[at, :2]
            if all(np.hypot(*(xy - other[3])) > 1.5 * APART for other in rows):
                yaw = float(np.arctan2(tangent[1], tangent[0]))
                rows.append((way, at, forward, xy, yaw))
                break
    number = len(rows)
    speed = np.clip(rng.normal(SPEED, SPREAD, number), 0.6, 2.2)
    return Walkers(
        xy=np.array([row[3] for row in rows]).reshape(-1, 2),
        velocity=np.zeros((number, 2)),
        yaw=np.array([row[4] for row in rows], float),
        phase=rng.uniform(0.0, 2 * np.pi, number),
        way=np.array([row[0] for row in rows], int),
        forward=np.array([row[2] for row in rows], bool),
        at=np.array([row[1] for row in rows], int),
        speed=speed,
        aside=rng.uniform(0.1, 0.7, number),
        next_way=np.full(number, -1),
        stuck=np.zeros(number),
        draws=np.zeros(number, np.int64),
    )


def make_permits(graph: LaneGraph) -> Permits:
    """Returns permits without any holder."""
    count = len(graph.crossings)
    places = len(graph.pieces) + count
    lengths = [
        float(np.linalg.norm(c.line[1] - c.line[0])) for c in graph.crossings
    ]
    return Permits(
        small=np.zeros(places, np.int64),
        large=np.zeros(places, np.int64),
        waits=np.full(count, np.inf),
        opened=np.full(count, -np.inf),
        closed=np.full(count, -np.inf),
        lengths=np.array(lengths, float),
    )
