"""Paint on the carriageway: lane lines, stop lines, crossings."""

from __future__ import annotations

from collections.abc import Iterator
import itertools

import numpy as np

from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.ground.streets import as_structure
from cns_drake.roads.centreline import sample_stations
from cns_drake.roads.network import RoadNetwork
from cns_drake.roads.road import ENDS, Direction, End, Road

_RGB = (0.80, 0.79, 0.74)
# Paint lies this high, so that it is not in one plane with the road [m].
_THICKNESS = 0.004
_LINE_WIDTH = 0.14
# Length of a dash of a lane line and of the gap behind it [m].
_DASH, _GAP = 3.0, 6.0
# Middle lines are drawn in pieces, so that they follow curves [m].
_PIECE = 4.0
# On slopes all paint is laid in pieces of this length [m].
_SLOPE_PIECE = 1.0
# From a junction's edge to its crossing, and to the stop line behind [m].
_CROSSING = (0.8, 3.8)
_STOP_LINE = (4.8, 5.2)
# Width of a bar of a crossing, and distance from bar to bar [m].
_BAR, _BAR_STEP = 0.5, 1.1
# Roads shorter than this between their junctions get no markings [m].
_LEAST_LENGTH = 2 * _STOP_LINE[1] + 4.0


def marking_structure(network: RoadNetwork) -> Structure:
    """Returns the paint of all roads, one part a road."""
    pieces = {}
    for name, road in network.roads.items():
        strips = [
            *_lane_lines(road),
            *(
                strip
                for end in ENDS
                if _is_junction(network, road, end)
                for strip in _end_marks(road, end)
            ),
        ]
        if road.length > _LEAST_LENGTH and strips:
            pieces[name] = merge_meshes(*(_strip(road, *s) for s in strips))
    return as_structure("markings", "road", pieces, network.lane_area(), _RGB)


def _is_junction(network: RoadNetwork, road: Road, end: End) -> bool:
    """Returns whether a node is a junction, and not one road going on."""
    return len(network.junctions[getattr(road, end)].arms) > 2


def _lane_lines(road: Road) -> Iterator[tuple[float, float, float, float]]:
    """Yields strips: first and last station, right and left offset."""
    first = road.first_station + _STOP_LINE[1]
    last = road.last_station - _STOP_LINE[1]
    for direction, count in road.lanes.items():
        for lane in range(1, count):
            inner = road.lane_offset(direction, lane)
            outer = road.lane_offset(direction, lane + 1)
            for s in np.arange(first, last - _DASH, _DASH + _GAP).tolist():
                yield s, s + _DASH, *_across((inner + outer) / 2)
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
    """Yields the strips of a crossing and the stop line behind it."""
    edge = road.half_width
    for right in np.arange(-edge + 0.4, edge - _BAR, _BAR_STEP).tolist():
        # A median may reach into the crossing: its bars stay away.
        if not road.median or abs(right + _BAR / 2) > road.median / 2 + _BAR:
            yield *_from_end(road, end, _CROSSING), right, right + _BAR
    incoming: Direction = "forward" if end == "end" else "backward"
    count = road.lanes[incoming]
    if count:
        offsets = [
            road.lane_offset(incoming, lane) for lane in range(1, count + 1)
        ]
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


def _strip(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns the area between two stations and two offsets."""
    if np.ptp(road.height([first, (first + last) / 2, last])) > 0:
        ends = sample_stations(first, last, _SLOPE_PIECE)
        return merge_meshes(
            *(
                _quadrilateral(road, a, b, right, left)
                for a, b in itertools.pairwise(ends)
            )
        )
    return _quadrilateral(road, first, last, right, left)


def _quadrilateral(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns the plane face between two stations and two offsets."""
    corners = np.concatenate(
        [
            road.evaluate([first, last], right)[:, :3],
            road.evaluate([last, first], left)[:, :3],
        ]
    )
    corners[:, 2] += _THICKNESS
    return Mesh(corners, ((0, 1, 2, 3),))
