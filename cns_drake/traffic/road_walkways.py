"""Makes walkways for traffic from the sidewalks of a road network."""

from collections.abc import Mapping, Sequence
import itertools
import math

import numpy as np
import shapely

from cns_drake.base import length_of
from cns_drake.roads import ENDS, End, Junction, Road, RoadNetwork, blend
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.polylines import resampled
from cns_drake.traffic.road_lanes import (
    CROSSING_PLACE,
    crossing_line,
    crossing_station,
)

# Distance of pedestrians from kerbs and walls [m].
_MARGIN = 0.45
# Half the width in which pedestrians walk on a crossing [m].
_CROSSING_HALF_WIDTH = 0.8
# Least half width in which pedestrians walk along a road [m].
_LEAST_HALF_WIDTH = 0.3
# Distance from the kerb at which pedestrians wait [m].
_BEFORE_KERB = 1.4
# Least length of a walkway from the walked strip to that place [m].
_SHORTEST_SPUR = 1.5
# Greatest width of the strip of a sidewalk on which pedestrians walk [m].
_WIDEST = 3.0
# Least length of a walkway [m].
_SHORTEST = 1.0


def make_walkways(network: RoadNetwork, graph: LaneGraph) -> list[Walkway]:
    """Returns the walkways of a road network.

    Walkways lead along the sidewalks, around the corners of junctions, and over
    the crossings of `graph`.
    """
    nodes: dict[tuple[str, End, int], int] = {}
    for road in network.roads.values():
        if _is_walked(road):
            for end, side in itertools.product(ENDS, (1, -1)):
                nodes[road.name, end, side] = len(nodes)
    places = {
        key: _sidewalk_end(network.roads[key[0]], *key[1:]) for key in nodes
    }
    found: list[Walkway] = []
    for road in network.roads.values():
        if not _is_walked(road):
            continue
        for side in (1, -1):
            first, last = (crossing_station(road, end) for end in ENDS)
            stations = np.linspace(first, last, max(2, int(last - first)))
            line = road.evaluate(stations, side * _strip_offset(road))[:, :3]
            line[:, 2] += road.kerb_height
            width = _half_width(_walked_width(road))
            a, b = (nodes[road.name, end, side] for end in ENDS)
            found.append(Walkway(resampled(line), width, a, b))
    for junction in network.junctions.values():
        found += _corner_walkways(network, junction, nodes, places)
    crossed = [
        (road, end, crossing_line(road, end))
        for road, end in itertools.product(network.roads.values(), ENDS)
        if (road.name, end, 1) in nodes
    ]
    found += _crossing_walkways(graph, crossed, nodes, places, len(found))
    # At unusual junctions, some corners have no sidewalk.
    lanes = network.areas.lane_area
    shapely.prepare(lanes)
    return [
        way
        for way in found
        if way.crossing >= 0
        or not lanes.intersects(
            shapely.LineString(way.points[:, :2]).buffer(way.half_width)
        )
    ]


def _crossing_walkways(
    graph: LaneGraph,
    crossed: Sequence[tuple[Road, End, np.ndarray]],
    nodes: Mapping[tuple[str, End, int], int],
    places: Mapping[tuple[str, End, int], np.ndarray],
    count: int,
) -> list[Walkway]:
    """Returns the walkways over crossings, with the ways to their kerbs.

    Args:
        graph: the lane graph with the crossings.
        crossed: for each road end where people walk, the road, the end, and the
            line of the crossing there.
        nodes: road, end and side -> number of the place at a sidewalk's end.
        places: road, end and side -> this place, see `_sidewalk_end`.
        count: number of walkways so far, from which numbers of new places
            follow.
    """
    found: list[Walkway] = []
    for k, crossing in enumerate(graph.crossings):
        for road, end, across in crossed:
            if np.allclose(crossing.line, across):
                ends = []
                for side, kerb in zip((1, -1), crossing.line, strict=True):
                    number = nodes[road.name, end, side]
                    start = places[road.name, end, side][:3]
                    ahead = kerb[:2] - start[:2]
                    distance = math.dist(kerb[:2], start[:2])
                    if distance > _BEFORE_KERB + _SHORTEST_SPUR:
                        # On a wide sidewalk, pedestrians wait at the kerb.
                        part = 1.0 - _BEFORE_KERB / distance
                        stop = np.append(start[:2] + part * ahead, start[2])
                        node = number
                        number = 2 * len(nodes) + count + len(found)
                        spur = resampled(np.array([start, stop]))
                        found.append(
                            Walkway(spur, _CROSSING_HALF_WIDTH, node, number)
                        )
                        start = stop
                    ends.append((number, start))
                (left, one), (right, other) = ends
                line = resampled(np.array([one, *crossing.line, other]))
                found.append(
                    Walkway(line, _CROSSING_HALF_WIDTH, left, right, k)
                )
    return found


def _is_walked(road: Road) -> bool:
    return (
        _half_width(_walked_width(road)) >= _LEAST_HALF_WIDTH
        and road.length > 2 * CROSSING_PLACE + _SHORTEST
    )


def _half_width(width: float) -> float:
    return min(width, _WIDEST) / 2 - _MARGIN


def _walked_width(road: Road) -> float:
    """Returns the width of a sidewalk beside its parking bays [m]."""
    return road.sidewalk - road.parking


def _strip_offset(road: Road) -> float:
    """Returns the distance of the walked strip from the centreline [m].

    The strip is on the far side of the sidewalk, away from objects along the
    kerb.
    """
    return (
        road.half_width + road.sidewalk - min(_walked_width(road), _WIDEST) / 2
    )


def _sidewalk_end(road: Road, end: End, side: int) -> np.ndarray:
    """Returns x, y, z of a sidewalk's end, and the heading to the junction."""
    place = road.evaluate(
        [crossing_station(road, end)], side * _strip_offset(road)
    )[0]
    place[2] += road.kerb_height
    if end == "start":
        place[3] += np.pi
    return place


def _corner_walkways(
    network: RoadNetwork,
    junction: Junction,
    nodes: dict[tuple[str, End, int], int],
    places: dict[tuple[str, End, int], np.ndarray],
) -> list[Walkway]:
    """Returns the walkways around the corners between neighbouring arms.

    Args:
        network: the road network.
        junction: the junction of the arms.
        nodes: road, its end and a side -> number of the place there.
        places: the same -> position of the place (3,) [m].
    """
    found = []
    arms = junction.arms
    for k, arm in enumerate(arms):
        after = arms[(k + 1) % len(arms)]
        if arm is after:
            continue
        # Counter-clockwise: seen from the junction, the left side of an arm,
        # then the right side of the next arm.
        a = (arm.road, arm.end, 1 if arm.end == "start" else -1)
        b = (after.road, after.end, -1 if after.end == "start" else 1)
        if a not in nodes or b not in nodes:
            continue
        p, q = places[a], places[b]
        line = blend(p[:2], p[3], q[:2], q[3] + np.pi, 0.5)
        z = np.linspace(p[2], q[2], len(line))
        width = min(_walked_width(network.roads[key[0]]) for key in (a, b))
        points = np.column_stack([line, z])
        if length_of(points) < _SHORTEST:
            continue
        found.append(
            Walkway(resampled(points), _half_width(width), nodes[a], nodes[b])
        )
    return found
