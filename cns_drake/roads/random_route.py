"""Random routes along the lanes of a road network."""

from collections import Counter, defaultdict

import numpy as np

from cns_drake.base import InputError
from cns_drake.roads.network import RoadNetwork
from cns_drake.roads.road import LaneRef
from cns_drake.roads.route import MIN_LANE_CHANGE_LENGTH, Route, RouteLeg

# How strongly roads that were not driven before are preferred.
_WEIGHT_OF_NEW = 6.0


def draw_route(
    network: RoadNetwork, length: float, rng: np.random.Generator
) -> Route:
    """Returns a random legal route, preferably along roads not yet driven.

    The total length of the route's roads is at least `length` [m].

    Raises:
        InputError: no route in the network can be continued without end.
    """
    successors = _successors(network)
    if not successors:
        raise InputError(
            "roads: every lane comes to an end, so that no endless route exists"
        )
    lanes = sorted(successors)
    lane = lanes[int(rng.integers(len(lanes)))]
    visits: Counter[str] = Counter()
    legs: list[tuple[LaneRef, int]] = []
    driven = 0.0
    while driven < length:
        visits[lane.road] += 1
        driven += network.roads[lane.road].length
        choices = successors[lane]
        weights = np.array(
            [_WEIGHT_OF_NEW ** -visits[after.road] for _, after in choices]
        )
        chosen = int(rng.choice(len(choices), p=weights / weights.sum()))
        exit_lane, after = choices[chosen]
        legs.append((lane, exit_lane))
        lane = after
    # No road follows the last one, so the drive stays in its lane.
    legs[-1] = (legs[-1][0], legs[-1][0].lane)
    return Route([_make_leg(entry, exit_lane) for entry, exit_lane in legs])


def _make_leg(entry: LaneRef, exit_lane: int) -> RouteLeg:
    lane = entry.lane if exit_lane == entry.lane else (entry.lane, exit_lane)
    return RouteLeg(road=entry.road, direction=entry.direction, lane=lane)


def _successors(
    network: RoadNetwork,
) -> dict[LaneRef, list[tuple[int, LaneRef]]]:
    """Returns for each lane how a route can continue.

    A continuation is a pair: the number of the lane in which the car leaves the
    road, and the first lane of the next road. Lanes from which no endless route
    leads on are left out.
    """
    ways = defaultdict(list)
    for junction in network.junctions:
        for way in network.connections(junction):
            ways[way.incoming].append(way.outgoing)
    successors = {}
    for lane in network.lanes():
        road = network.roads[lane.road]
        exits = [lane.lane]
        if road.length > MIN_LANE_CHANGE_LENGTH:
            exits = [*range(1, road.lanes[lane.direction] + 1)]
        successors[lane] = [
            (number, after)
            for number in exits
            for after in sorted(ways[lane._replace(lane=number)])
        ]
    while True:
        alive = {
            lane: [way for way in choices if way[1] in successors]
            for lane, choices in successors.items()
            if any(way[1] in successors for way in choices)
        }
        if alive == successors:
            return alive
        successors = alive
