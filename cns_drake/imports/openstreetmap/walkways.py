"""Walkways beside imported streets, and crossings between them."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise, product

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from cns_drake.imports.foreign_city import Street
from cns_drake.traffic.lane_graph import (
    Crossing,
    Walkway,
    make_crossing,
    resampled,
)

# From the kerb to the middle of a walked strip, half its width, and its least
# distance from the edges of a sidewalk [m].
_FROM_KERB, _HALF_WIDTH, _FROM_EDGE = 1.3, 0.3, 0.55
_SHORTEST = 4.0
# A crossing or another strip begins within this distance of a strip [m].
_NEAR, _NEAR_END = 1.5, 4.0
_CROSSING_WIDTH, _CROSSING_HALF_WIDTH = 2.4, 0.8


class StreetWalkways:
    """Strips of sidewalks and paths, and the crossings that join them.

    Attributes:
        walkways: all of them.
        crossings: number of a street's node -> the crossing there.
    """

    def __init__(
        self,
        streets: Sequence[Street],
        paths: Iterable[np.ndarray],
        crossed: Iterable[int],
        sidewalks: BaseGeometry,
        height: float,
    ):
        """Finds the walkways.

        Args:
            streets: for cars.
            paths: (N, 2) middles of ways for people [m].
            crossed: nodes of streets at which people cross.
            sidewalks: area of sidewalks and paths.
            height: how high sidewalks stand above the streets [m].
        """
        walked = sidewalks.buffer(-_FROM_EDGE, quad_segs=2)
        shapely.prepare(walked)
        self._walked, self._height = walked, height
        lines = [*_beside(streets), *map(shapely.LineString, paths)]
        self._strips = [
            strip
            for piece in _pieces(lines, walked)
            for strip in shapely.get_parts(piece)
            if strip.geom_type == "LineString" and strip.length >= _SHORTEST
        ]
        self._tree = shapely.STRtree(self._strips)
        self._nodes: dict[tuple[int, float], int] = {}
        self.crossings: dict[int, Crossing] = {}
        over = []
        arms: Counter[int] = Counter()
        for street in streets:
            last = len(street.nodes) - 1
            for k, node in enumerate(street.nodes):
                arms[node] += 1 if k in (0, last) else 2
        wanted = {node for node in crossed if arms[node] <= 2}
        for street in streets:
            for k, node in enumerate(street.nodes):
                if node not in wanted or node in self.crossings:
                    continue
                found = self._crossing(street, k)
                if found is not None:
                    self.crossings[node], ends = found
                    over.append(ends)
        links = list(self._links())
        self.walkways = [
            *self._walkways(),
            *(self._way(a, b) for a, b in links),
            *(self._way(a, b, number) for number, (a, b) in enumerate(over)),
        ]

    def _crossing(
        self, street: Street, k: int
    ) -> tuple[Crossing, tuple[tuple[int, float], tuple[int, float]]] | None:
        """Returns a crossing and its places on strips; None without strips."""
        line = street.line
        along = line[min(k + 1, len(line) - 1)] - line[max(k - 1, 0)]
        if not along.any():
            return None
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        half = street.width / 2.0
        first, last = (
            self._on_strip(line[k] + side * (half + _FROM_KERB) * left)
            for side in (1.0, -1.0)
        )
        if first is None or last is None or first[0] == last[0]:
            return None
        self._node(first)
        self._node(last)
        kerbs = np.array([line[k] + side * half * left for side in (1.0, -1.0)])
        course = np.column_stack([kerbs, np.zeros(2)])
        return make_crossing(course, _CROSSING_WIDTH), (first, last)

    def _on_strip(self, place: np.ndarray) -> tuple[int, float] | None:
        point = shapely.Point(place)
        near = self._tree.query_nearest(point, max_distance=_NEAR)
        if not len(near):
            return None
        number = int(near[0])
        return number, float(self._strips[number].project(point))

    def _node(self, place: tuple[int, float]) -> int:
        return self._nodes.setdefault(place, len(self._nodes))

    def _links(
        self,
    ) -> Iterator[tuple[tuple[int, float], tuple[int, float]]]:
        """Yields pairs of ends of strips between which people can walk."""
        ends = [
            (k, s)
            for k, strip in enumerate(self._strips)
            for s in (0.0, float(strip.length))
        ]
        places = [self._strips[k].interpolate(s) for k, s in ends]
        if not places:
            return
        tree = shapely.STRtree(places)
        rows, columns = tree.query(places, "dwithin", _NEAR_END)
        for a, b in zip(rows.tolist(), columns.tolist(), strict=True):
            way = shapely.LineString([places[a], places[b]])
            if (
                a < b
                and ends[a][0] != ends[b][0]
                and way.length > 0.5
                and self._walked.covers(way)
            ):
                self._node(ends[a])
                self._node(ends[b])
                yield ends[a], ends[b]

    def _walkways(self) -> Iterator[Walkway]:
        """Yields the strips, cut where others begin."""
        cuts: defaultdict[int, set[float]] = defaultdict(set)
        for k, s in self._nodes:
            cuts[k].add(s)
        for k, strip in enumerate(self._strips):
            for a, b in pairwise(sorted(cuts[k] | {0.0, float(strip.length)})):
                if b - a < 0.5:
                    # Walkers of both places take the same piece.
                    self._nodes[k, b] = self._node((k, a))
                    continue
                part = substring(strip, a, b)
                yield self._walkway(
                    shapely.get_coordinates(part), (k, a), (k, b)
                )

    def _way(
        self, a: tuple[int, float], b: tuple[int, float], crossing: int = -1
    ) -> Walkway:
        places = [self._strips[k].interpolate(s) for k, s in (a, b)]
        return self._walkway(shapely.get_coordinates(places), a, b, crossing)

    def _walkway(
        self,
        line: np.ndarray,
        a: tuple[int, float],
        b: tuple[int, float],
        crossing: int = -1,
    ) -> Walkway:
        height = np.full(len(line), self._height)
        return Walkway(
            resampled(np.column_stack([line, height])),
            _HALF_WIDTH if crossing < 0 else _CROSSING_HALF_WIDTH,
            self._node(a),
            self._node(b),
            crossing,
        )


def _pieces(
    lines: Sequence[BaseGeometry], area: BaseGeometry
) -> Iterator[BaseGeometry]:
    """Yields the part of each line that is in an area."""
    parts = shapely.get_parts(area)
    tree = shapely.STRtree(parts)
    for line in lines:
        # With the whole area, each intersection would look at all its edges.
        near = np.sort(tree.query(line, "intersects"))
        yield line.intersection(shapely.MultiPolygon(list(parts[near])))


def _beside(streets: Iterable[Street]) -> Iterator[BaseGeometry]:
    """Yields lines in the middle of the sidewalks of streets."""
    for street, side in product(streets, (1.0, -1.0)):
        offset = side * (street.width / 2.0 + _FROM_KERB)
        course = shapely.LineString(street.line)
        yield from shapely.get_parts(course.offset_curve(offset))
