"""The painted markings of roads: lane lines, crossings, stop lines."""

from collections.abc import Iterator
import itertools

import numpy as np

from worlds.city.ground.coverings import Covering
from worlds.roads import ENDS, End, Road, RoadNetwork
from worlds.shapes import (
    Direction,
    Mesh,
    Structure,
    merge_meshes,
    sample_stations,
)

_RGB = (0.80, 0.79, 0.74)
# Paint lies this high above the road, so that they are not in one plane [m].
_THICKNESS = 0.004
# Width of a line [m].
_LINE_WIDTH = 0.14
# Usual length of a dash of a line [m].
DASH = 3.0
# Usual length of the gap between two dashes [m].
DASH_GAP = 6.0
# Lane lines are divided into pieces of at most this length, to follow curves
# [m].
_PIECE = 4.0
# On slopes all paint is divided into pieces of this length [m].
_SLOPE_PIECE = 1.0
# From a junction's edge to both sides of its crossing [m].
_CROSSING = (0.8, 3.8)
# From a junction's edge to both sides of the stop line behind its crossing [m].
_STOP_LINE = (4.8, 5.2)
# Width of a bar of a crossing [m].
_BAR = 0.5
# Distance from bar to bar [m].
_BAR_STEP = 1.1
# Roads that are shorter than this between their junctions get no markings [m].
_LEAST_LENGTH = 2 * _STOP_LINE[1] + 4.0


def marking_structure(network: RoadNetwork) -> Structure:
    """Returns the painted markings of all roads, with one part per road."""
    pieces = {}
    for name, road in network.roads.items():
        strips = list(_lane_lines(road))
        for end in ENDS:
            if _is_junction(network, road, end):
                strips += _end_marks(road, end)
        if road.length > _LEAST_LENGTH and strips:
            pieces[name] = merge_meshes(
                *(_painted_strip(road, *s) for s in strips)
            )
    lanes = network.areas.lane_area
    ground = Covering("markings", "road", lanes, _RGB, "markings")
    return ground.structure(pieces)


def _is_junction(network: RoadNetwork, road: Road, end: End) -> bool:
    """Returns whether the road ends in a junction, not just in another road."""
    return len(network.junctions[getattr(road, end)].arms) > 2


def _lane_lines(road: Road) -> Iterator[tuple[float, float, float, float]]:
    """Yields the strips of lane lines: two stations, right and left offset [m].

    The stations are where the strip begins and ends along the road.
    """
    first = road.first_station + _STOP_LINE[1]
    last = road.last_station - _STOP_LINE[1]
    for direction, count in road.lanes.items():
        for lane in range(1, count):
            inner = road.lane_offset(direction, lane)
            outer = road.lane_offset(direction, lane + 1)
            for s in np.arange(first, last - DASH, DASH + DASH_GAP).tolist():
                yield s, s + DASH, *_across((inner + outer) / 2)
    if all(road.lanes.values()) and road.median == 0:
        between = (
            road.lane_offset("forward", 1) + road.lane_offset("backward", 1)
        ) / 2
        stations = np.arange(first, last, _PIECE).tolist()
        for side in (-1, 1):
            offset = between + side * _LINE_WIDTH
            for s in stations:
                yield s, min(s + _PIECE, last), *_across(offset)


def _end_marks(
    road: Road, end: End
) -> Iterator[tuple[float, float, float, float]]:
    """Yields the strips of a crossing and of the stop line behind it [m].

    They have the same form as in `_lane_lines`.
    """
    edge = road.half_width
    for right in np.arange(-edge + 0.4, edge - _BAR, _BAR_STEP).tolist():
        # Where a median reaches into the crossing, bars are left out.
        if not road.median or abs(right + _BAR / 2) > road.median / 2 + _BAR:
            yield *_from_end(road, end, _CROSSING), right, right + _BAR
    incoming: Direction = "forward" if end == "end" else "backward"
    count = road.lanes[incoming]
    if count:
        lanes = range(1, count + 1)
        offsets = [road.lane_offset(incoming, lane) for lane in lanes]
        half = road.lane_width / 2
        yield (
            *_from_end(road, end, _STOP_LINE),
            min(offsets) - half + 0.1,
            max(offsets) + half - 0.1,
        )


def _across(offset: float) -> tuple[float, float]:
    return offset - _LINE_WIDTH / 2, offset + _LINE_WIDTH / 2


def _from_end(
    road: Road, end: End, distances: tuple[float, float]
) -> tuple[float, float]:
    near, far = distances
    if end == "start":
        return road.first_station + near, road.first_station + far
    return road.last_station - far, road.last_station - near


def _painted_strip(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns a strip of paint between two stations and two offsets [m]."""
    if np.ptp(road.height([first, (first + last) / 2, last])) > 0:
        ends = sample_stations(first, last, _SLOPE_PIECE)
        pairs = itertools.pairwise(ends)
        faces = (_painted_face(road, *pair, right, left) for pair in pairs)
        return merge_meshes(*faces)
    return _painted_face(road, first, last, right, left)


def _painted_face(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns one plane face between two stations and two offsets [m].

    The face lies above the road by the thickness of the paint.
    """
    corners = np.concatenate(
        [
            road.evaluate([first, last], right)[:, :3],
            road.evaluate([last, first], left)[:, :3],
        ]
    )
    corners[:, 2] += _THICKNESS
    return Mesh(corners, ((0, 1, 2, 3),))
