"""Crossings without marks, where pedestrians cross narrow streets."""

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cns_drake.traffic.lane_graph import (
    LaneGraph,
    Walkway,
    make_crossing,
    new_places,
)
from cns_drake.traffic.polylines import SPACING, resampled
from cns_drake.traffic.walkway_clearing import CLEARANCE

# A crossing without marks leads over at most this many lanes.
_MOST_LANES = 4
# Least distance of such a crossing from the ends of lanes, so that the front of
# a vehicle on it is not yet in another lane [m].
_FROM_LANE_ENDS = 15.0
# Least distance of such a crossing from ways [m].
_FROM_WAYS = 5.0
# Least distance of such a crossing from the ends of walkways [m].
_FROM_WALKWAY_ENDS = 4.0
# Width of such a crossing [m].
_CROSSING_WIDTH = 2.4
# Half the width of the pedestrians' path on such a crossing [m].
_CROSSING_HALF_PATH = 0.5
# Half the width of a lane [m].
_HALF_LANE = 1.75
# Greatest distance of a walkway from a lane that a crossing leads over [m].
_REACH = 20.0
# Distance between the places of a lane where a crossing is tried [m].
_TRIAL_STEP = 2.0


def with_unmarked_crossings(
    graph: LaneGraph,
    walkways: Sequence[Walkway],
    things: Sequence[BaseGeometry] = (),
) -> tuple[LaneGraph, list[Walkway]]:
    """Adds crossings without marks, for pedestrians on narrow streets.

    A crossing is added as near as possible to the middle of a lane, if there is
    a walkway on both sides of the street and no object in between. Each walkway
    has at most one such crossing.

    Args:
        graph: the lanes.
        walkways: the walkways.
        things: outlines of objects as seen from above [m].

    Returns:
        The graph with the additional crossings; and the walkways, which are cut
        where these crossings begin and end, with new walkways over the
        crossings.
    """
    street = _Surroundings(graph, walkways, things)
    crossings = list(graph.crossings)
    found: list[Walkway] = []
    # Walkway -> the row at which it is cut, and the number of the place there.
    cuts: dict[int, tuple[int, int]] = {}
    places = new_places(walkways)
    for lane in graph.lanes:
        best = street.path_near_middle(lane, cuts)
        if best is None:
            continue
        path, (first, second) = best
        start = next(places)
        end = next(places)
        for (number, row), place in ((first, start), (second, end)):
            cuts[number] = (row, place)
        found.append(
            Walkway(
                resampled(path), _CROSSING_HALF_PATH, start, end, len(crossings)
            )
        )
        crossings.append(
            make_crossing(path[[0, -1]], _CROSSING_WIDTH, marked=False)
        )
    for k, way in enumerate(walkways):
        found += _halves(way, *cuts[k]) if k in cuts else [way]
    return LaneGraph(graph.pieces, tuple(crossings)), found


def _halves(way: Walkway, row: int, place: int) -> list[Walkway]:
    """Returns the parts of a walkway before and after a place on it.

    Args:
        way: the walkway.
        row: index of the walkway's point at the place.
        place: number of the place.
    """
    return [
        replace(
            way,
            points=way.points[rows],
            start=start,
            end=end,
            free=way.limits[rows],
            narrow=way.is_narrow[rows],
        )
        for rows, start, end in (
            (slice(0, row + 1), way.start, place),
            (slice(row, len(way.points)), place, way.end),
        )
    ]


class _Surroundings:
    """Lanes, walkways and objects of a map, searchable by position.

    Args:
        graph: the lanes.
        walkways: the walkways.
        things: outlines of objects as seen from above [m].
    """

    def __init__(
        self,
        graph: LaneGraph,
        walkways: Sequence[Walkway],
        things: Sequence[BaseGeometry],
    ):
        self._graph = graph
        self._walkways = walkways
        # Numbers of the walkways that lie on no crossing.
        self._sides = [k for k, way in enumerate(walkways) if way.crossing < 0]
        self._side_lines = [
            LineString(walkways[k].points[:, :2]) for k in self._sides
        ]
        self._lanes = [
            LineString(piece.points[:, :2]) for piece in graph.pieces
        ]
        self._side_tree = shapely.STRtree(self._side_lines)
        self._lane_tree = shapely.STRtree(self._lanes)
        self._thing_tree = shapely.STRtree(things)

    def path_near_middle(
        self, lane: int, taken: Container[int]
    ) -> tuple[np.ndarray, tuple[tuple[int, int], tuple[int, int]]] | None:
        """Returns the possible crossing that is nearest to a lane's middle.

        Args:
            lane: number of the lane.
            taken: numbers of walkways where no further crossing may begin.

        Returns:
            The path (4, 3) of pedestrians across the street [m]; and for each
            end of the path, the number of the walkway there and the index of
            the walkway's point. None if no crossing is possible.
        """
        points = self._graph.pieces[lane].points
        margin = int(_FROM_LANE_ENDS / SPACING)
        middle = len(points) // 2
        step = int(_TRIAL_STEP / SPACING)
        first = margin + (middle - margin) % step
        rows = range(first, len(points) - margin, step)
        for row in sorted(rows, key=lambda row: abs(row - middle)):
            x, y = np.diff(points[row : row + 2, :2], axis=0)[0] / SPACING
            left = _REACH * np.array([-y, x])
            here = points[row, :2]
            one = self._beside(here, left, taken)
            other = self._beside(here, -left, taken)
            if one is None or other is None or one[0] == other[0]:
                continue
            p, q = (self._walkways[way].points[at] for way, at in (one, other))
            path = self._path_across(p, q, points[row, 2])
            if path is not None:
                return path, (one, other)
        return None

    def _beside(
        self, p: np.ndarray, reach: np.ndarray, taken: Container[int]
    ) -> tuple[int, int] | None:
        """Returns where pedestrians who start at p step onto a walkway.

        Args:
            p: (2,) the start in W [m].
            reach: (2,) vector from p [m]. Only walkways that it crosses count.
            taken: numbers of walkways where no further crossing may begin.

        Returns:
            Number of the nearest walkway that `reach` crosses, and index of its
            point nearest to p. None if there is no walkway, if this point is
            near its end, or if the walkway is taken.
        """
        ray = LineString([p, p + reach])
        near = self._side_tree.query(ray, "intersects")
        if not len(near):
            return None
        apart = [
            shapely.Point(p).distance(ray & self._side_lines[k]) for k in near
        ]
        k = self._sides[near[int(np.argmin(apart))]]
        xy = self._walkways[k].points[:, :2]
        row = int(np.linalg.norm(xy - p, axis=1).argmin())
        margin = int(_FROM_WALKWAY_ENDS / SPACING)
        is_inside = margin <= row < len(xy) - margin
        return (k, row) if is_inside and k not in taken else None

    def _path_across(
        self, p: np.ndarray, q: np.ndarray, z: float
    ) -> np.ndarray | None:
        """Returns the path (4, 3) of pedestrians across lanes, from p to q.

        Where it crosses lanes, it lies at the height `z` [m]. The result is
        None if the path would cross too many lanes, or come too close to an
        obstacle, a junction or the end of a lane.

        Args:
            p: (3,) the start in W [m].
            q: (3,) the end in W [m].
            z: height of the lanes in W [m].
        """
        line = LineString([p[:2], q[:2]])
        ahead = (q - p)[:2] / line.length
        over = self._lane_tree.query(line, "intersects")
        near = self._lane_tree.query(line, "dwithin", _FROM_WAYS)
        # Pedestrians wait at both ends.
        longer = LineString([p[:2] - ahead, q[:2] + ahead])
        apart = _CROSSING_HALF_PATH + CLEARANCE
        if (
            len(over) > _MOST_LANES
            or any(self._graph.pieces[k].is_way for k in near)
            or len(self._thing_tree.query(longer, "dwithin", apart))
        ):
            return None
        along = []
        for k in over:
            place = line & self._lanes[k]
            s = self._lanes[k].project(place)
            last = self._lanes[k].length - _FROM_LANE_ENDS
            if not _FROM_LANE_ENDS < s < last:
                return None
            along.append(line.project(place))
        edges = min(along) - _HALF_LANE, max(along) + _HALF_LANE
        return np.array([p, *((*(p[:2] + s * ahead), z) for s in edges), q])
