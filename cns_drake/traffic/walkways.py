"""Walkways: along sidewalks, round corners, and over crossings."""

from __future__ import annotations

from dataclasses import dataclass
import itertools

import numpy as np
import shapely

from cns_drake.roads.centreline import blend
from cns_drake.roads.network import Junction, RoadNetwork
from cns_drake.roads.road import ENDS, End, Road
from cns_drake.traffic.lane_graph import LaneGraph, resampled
from cns_drake.traffic.road_lanes import CROSSING_PLACE, crossing_line

# Distance of walkers from kerbs and walls, and from the edges of a crossing
# [m].
_MARGIN = 0.45
_CROSSING_HALF_WIDTH = 0.8
_LEAST_HALF_WIDTH = 0.3
# Distance of the walked strip from the kerb on any sidewalk; furniture is
# beside the kerb or the houses [m].
_WIDEST = 3.0
_SHORTEST = 1.0


@dataclass(frozen=True)
class Walkway:
    """A strip between two places where others begin.

    Attributes:
        points: (N, 3) its middle, evenly spaced [m].
        half_width: greatest distance of a walker from the middle [m].
        start, end: numbers of the places at its ends.
        crossing: number of the crossing that it leads over, -1 for none.
    """

    points: np.ndarray
    half_width: float
    start: int
    end: int
    crossing: int = -1


def make_walkways(network: RoadNetwork, graph: LaneGraph) -> list[Walkway]:
    """Returns the walkways along the roads of a network.

    Args:
        network: the roads.
        graph: of the same network; gives the crossings.
    """
    nodes: dict[tuple[str, End, int], int] = {}
    for road in network.roads.values():
        if _is_walked(road):
            for end, side in itertools.product(ENDS, (1, -1)):
                nodes[road.name, end, side] = len(nodes)
    places = {
        key: _place(network.roads[key[0]], key[1], key[2]) for key in nodes
    }
    found: list[Walkway] = []
    for road in network.roads.values():
        if not _is_walked(road):
            continue
        for side in (1, -1):
            first = road.first_station + CROSSING_PLACE
            last = road.last_station - CROSSING_PLACE
            stations = np.linspace(first, last, max(2, int(last - first)))
            line = road.evaluate(stations, side * _offset(road))[:, :3]
            line[:, 2] += road.kerb_height
            found.append(
                Walkway(
                    resampled(line),
                    _half_width(_walked_width(road)),
                    nodes[road.name, "start", side],
                    nodes[road.name, "end", side],
                )
            )
    for junction in network.junctions.values():
        found += _corners(network, junction, nodes, places)
    for k, crossing in enumerate(graph.crossings):
        for road, end in itertools.product(network.roads.values(), ENDS):
            if (road.name, end, 1) in nodes and np.allclose(
                crossing.line, crossing_line(road, end)
            ):
                left, right = (nodes[road.name, end, side] for side in (1, -1))
                line = np.array(
                    [
                        places[road.name, end, 1][:3],
                        *crossing.line,
                        places[road.name, end, -1][:3],
                    ]
                )
                found.append(
                    Walkway(
                        resampled(line), _CROSSING_HALF_WIDTH, left, right, k
                    )
                )
    # At unusual junctions, not every corner has a sidewalk.
    lanes = network.lane_area()
    shapely.prepare(lanes)
    return [
        way
        for way in found
        if way.crossing >= 0
        or not lanes.intersects(
            shapely.LineString(way.points[:, :2]).buffer(way.half_width)
        )
    ]


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


def _offset(road: Road) -> float:
    """Returns the distance of the sidewalk's strip from the centreline [m].

    The strip is on the far side, away from objects along the kerb.
    """
    return (
        road.half_width + road.sidewalk - min(_walked_width(road), _WIDEST) / 2
    )


def _place(road: Road, end: End, side: int) -> np.ndarray:
    """Returns x, y, z and heading towards the junction of a sidewalk's end."""
    station = (
        road.first_station + CROSSING_PLACE
        if end == "start"
        else road.last_station - CROSSING_PLACE
    )
    place = road.evaluate([station], side * _offset(road))[0]
    place[2] += road.kerb_height
    if end == "start":
        place[3] += np.pi
    return place


def _corners(
    network: RoadNetwork,
    junction: Junction,
    nodes: dict[tuple[str, End, int], int],
    places: dict[tuple[str, End, int], np.ndarray],
) -> list[Walkway]:
    """Returns the ways round the corners between neighbouring arms."""
    found = []
    arms = junction.arms
    for k, arm in enumerate(arms):
        after = arms[(k + 1) % len(arms)]
        if arm is after:
            continue
        # Counter-clockwise: the left side of an arm, seen from the junction,
        # then the right side of the next.
        a = (arm.road, arm.end, 1 if arm.end == "start" else -1)
        b = (after.road, after.end, -1 if after.end == "start" else 1)
        if a not in nodes or b not in nodes:
            continue
        p, q = places[a], places[b]
        line = blend(p[:2], p[3], q[:2], q[3] + np.pi, 0.5)
        z = np.linspace(p[2], q[2], len(line))
        width = min(_walked_width(network.roads[key[0]]) for key in (a, b))
        points = np.column_stack([line, z])
        if np.linalg.norm(np.diff(points, axis=0), axis=1).sum() < _SHORTEST:
            continue
        found.append(
            Walkway(resampled(points), _half_width(width), nodes[a], nodes[b])
        )
    return found
