"""Where people walk in a city of OpenStreetMap: sidewalks, paths, crossings."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from cns_drake.imports.streets import KERB_HEIGHT, Street, ends_at_nodes
from cns_drake.traffic import Crossing, Walkway, make_crossing, resampled

# Distance from the kerb to the middle of a walked strip [m].
_FROM_KERB = 1.3
# Half the width of a walked strip [m].
_HALF_STRIP = 0.3
# Least distance of a walked strip from the edges of a sidewalk [m].
_FROM_EDGE = 0.55
# Least length of a walked strip [m].
_LEAST_STRIP = 4.0
# A crossing begins within this distance of a strip [m].
_STRIP_WITHIN = 1.5
# People walk from the end of a strip to the end of another within this distance
# [m].
_NEXT_END_WITHIN = 4.0
# Two places on strips that are closer than this are one place for pedestrians
# [m].
_SAME_PLACE = 0.5
_CROSSING_WIDTH = 2.4
# Half the width of the pedestrians' path on a crossing [m].
_CROSSING_HALF_PATH = 0.8


# A place on a strip: the number of the strip, and the distance along it [m].
_Place = tuple[int, float]


class StreetWalkways(NamedTuple):
    """The walkways of a city: sidewalks, paths, and crossings between them.

    Attributes:
        walkways: all walkways; the walkways over crossings come last.
        crossings: node of a street -> the crossing at this node.
    """

    walkways: Sequence[Walkway]
    crossings: Mapping[int, Crossing]


def find_walkways(
    streets: Sequence[Street],
    paths: Iterable[np.ndarray],
    crossed: Iterable[int],
    sidewalks: BaseGeometry,
) -> StreetWalkways:
    """Returns the walkways of a city.

    Args:
        streets: the streets.
        paths: middle lines (N, 2) of ways for people [m].
        crossed: nodes of streets at which people cross.
        sidewalks: area of sidewalks and paths in W [m].
    """
    walked = sidewalks.buffer(-_FROM_EDGE, quad_segs=2)
    shapely.prepare(walked)
    lines = [*_sidewalk_lines(streets), *map(shapely.LineString, paths)]
    strips = _Strips(
        [
            strip
            for piece in _parts_in_area(lines, walked)
            for strip in shapely.get_parts(piece)
            if strip.geom_type == "LineString" and strip.length >= _LEAST_STRIP
        ]
    )
    crossings: dict[int, Crossing] = {}
    ends_of_crossings = []
    num_ends = ends_at_nodes(streets)
    # At a junction, a crossing would lead over several streets.
    wanted = {node for node in crossed if num_ends[node] <= 2}
    for street in streets:
        for k, node in enumerate(street.nodes):
            if node not in wanted or node in crossings:
                continue
            crossing_and_ends = strips.crossing(street, k)
            if crossing_and_ends is not None:
                crossings[node], ends = crossing_and_ends
                ends_of_crossings.append(ends)
    links = list(strips.links(walked))
    walkways = [
        *strips.walkways(),
        *(strips.way(a, b) for a, b in links),
        *(
            strips.way(a, b, number)
            for number, (a, b) in enumerate(ends_of_crossings)
        ),
    ]
    return StreetWalkways(walkways, crossings)


@dataclass(frozen=True)
class _Strips:
    """The strips along which people walk, and the places where ways begin.

    Attributes:
        lines: middle line of each strip in W [m].
        nodes: place on a strip -> number of the node at this place. Nodes are
            added when ways that begin or end at their places are made.
    """

    lines: Sequence[shapely.LineString]
    nodes: dict[_Place, int] = field(default_factory=dict)

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.lines)

    def crossing(
        self, street: Street, k: int
    ) -> tuple[Crossing, tuple[_Place, _Place]] | None:
        """Returns a crossing of a street, and its two ends on strips.

        The crossing is at the k-th point of the street. The result is None if
        there is no strip on either side of the street.
        """
        line = street.line
        along = line[min(k + 1, len(line) - 1)] - line[max(k - 1, 0)]
        if not along.any():
            return None
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        half = street.width / 2.0
        first, last = (
            self._nearest_place(line[k] + side * (half + _FROM_KERB) * left)
            for side in (1.0, -1.0)
        )
        if first is None or last is None or first[0] == last[0]:
            return None
        self._node_at(first)
        self._node_at(last)
        kerbs = np.array([line[k] + side * half * left for side in (1.0, -1.0)])
        course = np.column_stack([kerbs, np.zeros(2)])
        return make_crossing(course, _CROSSING_WIDTH), (first, last)

    def _nearest_place(self, place: np.ndarray) -> _Place | None:
        """Returns the place on a strip nearest to a place (2,) in W [m].

        The result is None if no strip is near.
        """
        point = shapely.Point(place)
        near = self._tree.query_nearest(point, max_distance=_STRIP_WITHIN)
        if not len(near):
            return None
        number = int(near[0])
        return number, float(self.lines[number].project(point))

    def _node_at(self, place: _Place) -> int:
        """Returns the number of the node at a place, a new one if necessary."""
        return self.nodes.setdefault(place, len(self.nodes))

    def links(self, walked: BaseGeometry) -> Iterator[tuple[_Place, _Place]]:
        """Yields pairs of ends of strips, if people can walk between the ends.

        `walked` is the area on which people can walk, in frame W [m].
        """
        ends = [
            (k, s)
            for k, strip in enumerate(self.lines)
            for s in (0.0, float(strip.length))
        ]
        places = [self.lines[k].interpolate(s) for k, s in ends]
        if not places:
            return
        tree = shapely.STRtree(places)
        rows, columns = tree.query(places, "dwithin", _NEXT_END_WITHIN)
        for a, b in zip(rows.tolist(), columns.tolist(), strict=True):
            way = shapely.LineString([places[a], places[b]])
            if (
                a < b
                and ends[a][0] != ends[b][0]
                and way.length > _SAME_PLACE
                and walked.covers(way)
            ):
                self._node_at(ends[a])
                self._node_at(ends[b])
                yield ends[a], ends[b]

    def walkways(self) -> Iterator[Walkway]:
        """Yields the strips as walkways, divided where other walkways begin."""
        cuts: defaultdict[int, set[float]] = defaultdict(set)
        for k, s in self.nodes:
            cuts[k].add(s)
        for k, strip in enumerate(self.lines):
            for a, b in pairwise(sorted(cuts[k] | {0.0, float(strip.length)})):
                if b - a < _SAME_PLACE:
                    # Pedestrians between the same two places use the same
                    # piece.
                    self.nodes[k, b] = self._node_at((k, a))
                    continue
                part = substring(strip, a, b)
                yield self._walkway(
                    shapely.get_coordinates(part), (k, a), (k, b)
                )

    def way(self, a: _Place, b: _Place, crossing: int = -1) -> Walkway:
        """Returns the straight walkway between two places on strips.

        `crossing` is the number of the crossing that it leads over; -1 for
        none.
        """
        places = [self.lines[k].interpolate(s) for k, s in (a, b)]
        return self._walkway(shapely.get_coordinates(places), a, b, crossing)

    def _walkway(
        self, line: np.ndarray, a: _Place, b: _Place, crossing: int = -1
    ) -> Walkway:
        """Returns the walkway along a line (N, 2) from place a to place b."""
        height = np.full(len(line), KERB_HEIGHT)
        return Walkway(
            resampled(np.column_stack([line, height])),
            _HALF_STRIP if crossing < 0 else _CROSSING_HALF_PATH,
            self._node_at(a),
            self._node_at(b),
            crossing,
        )


def _parts_in_area(
    lines: Sequence[BaseGeometry], area: BaseGeometry
) -> Iterator[BaseGeometry]:
    """Yields the part of each line that is in an area."""
    parts = shapely.get_parts(area)
    tree = shapely.STRtree(parts)
    for line in lines:
        # Intersecting with the whole area would test all its edges each time.
        near = np.sort(tree.query(line, "intersects"))
        yield line.intersection(shapely.MultiPolygon(list(parts[near])))


def _sidewalk_lines(streets: Iterable[Street]) -> Iterator[BaseGeometry]:
    """Yields the middle lines of sidewalks along streets."""
    for street, side in product(streets, (1.0, -1.0)):
        offset = side * (street.width / 2.0 + _FROM_KERB)
        course = shapely.LineString(street.line)
        yield from shapely.get_parts(course.offset_curve(offset))
