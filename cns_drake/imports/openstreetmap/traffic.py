"""The lane file of an OpenStreetMap city: lanes, signals and walkways."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from cns_drake.base import wrapped
from cns_drake.city import GRID
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.foreign_city import StreetPlaces
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.openstreetmap.street_lanes import (
    StreetTraffic,
    make_traffic_lanes,
)
from cns_drake.imports.options import DriveOn
from cns_drake.imports.streets import KERB_HEIGHT, Street, ends_at_nodes
from cns_drake.traffic import (
    Crossing,
    LaneGraph,
    Piece,
    Walkway,
    join_lanes,
    lane_text,
    make_crossing,
    resampled,
)

# Traffic stays within this distance of drives [m].
_TRAFFIC_WITHIN = 300.0
# Ways through junctions must lie on streets within this distance of drives,
# because streets with traffic extend beyond the distance of traffic [m].
_SURFACE_WITHIN = 2.0 * _TRAFFIC_WITHIN
# Half the width that a vehicle needs around the middle of its lane [m].
_HALF_WIDTH = 1.3
# What ends below this height does not stop a vehicle [m].
_LOWEST_OBSTACLE = 0.3
# What begins above this height does not stop a vehicle [m].
_HIGHEST_OBSTACLE = 3.5


def lane_text_of_streets(
    streets: Sequence[Street],
    places: StreetPlaces,
    objects: Sequence[ImportedObject],
    added: Sequence[ImportedObject],
    drives: Sequence[WaypointRoute],
    drive_on: DriveOn,
) -> str | None:
    """Returns the text of a lane file; None if there is no lane to drive on.

    The file contains the streets within 300 m of the drives. The file also
    lists details, such as parked cars, that were added beside the streets and
    stand in a lane.

    Args:
        streets: streets from the imported file.
        places: crossings, traffic signals and footpaths.
        objects: objects from the imported file.
        added: objects that were added to the imported file.
        drives: the drives, near which there is traffic.
        drive_on: side of the road on which traffic keeps.
    """
    if not drives:
        return None
    paths = shapely.MultiLineString([drive.path for drive in drives])
    lines = [shapely.LineString(street.line) for street in streets]
    near = [
        street
        for street, line in zip(streets, lines, strict=True)
        if line.dwithin(paths, _TRAFFIC_WITHIN)
    ]
    if not near:
        return None
    walks = _find_walkways(
        near, places.paths, places.crossed, _sidewalks(objects, paths)
    )
    surface = shapely.union_all(
        [
            line.buffer(street.width / 2.0, quad_segs=4)
            for street, line in zip(streets, lines, strict=True)
            if line.dwithin(paths, _SURFACE_WITHIN)
        ]
    )
    side = 1.0 if drive_on == "right" else -1.0
    traffic = make_traffic_lanes(near, set(walks.crossings), surface, side)
    free = _are_free(traffic, objects)
    right_of = traffic.beside
    if side < 0.0:
        right_of = {outer: inner for inner, outer in traffic.beside.items()}
    graph = join_lanes(
        traffic.lanes,
        [pair for pair in traffic.links if free[list(pair)].all()],
        right_of,
    )
    if not graph.pieces:
        return None
    graph = _with_signals(
        graph, _junctions_with_signals(traffic, near, places.signals)
    )
    graph = replace(graph, crossings=tuple(walks.crossings.values()))
    return lane_text(graph, walks.walkways, _in_the_way(graph, added))


def _sidewalks(
    objects: Iterable[ImportedObject], paths: BaseGeometry
) -> BaseGeometry:
    """Returns the area of sidewalks near drives in W [m].

    `paths` are the paths of the drives.
    """
    triangles = [
        one.triangles[:, :, :2]
        for one in objects
        if one.object_type == "Sidewalk"
    ]
    if not triangles:
        return shapely.Polygon()
    corners = np.round(np.concatenate(triangles), 3)
    flat = np.asarray(shapely.polygons(corners))
    near = shapely.dwithin(flat, paths, _TRAFFIC_WITHIN) & shapely.is_valid(
        flat
    )
    return shapely.union_all(flat[near], grid_size=GRID)


def _are_free(
    traffic: StreetTraffic, objects: Iterable[ImportedObject]
) -> np.ndarray:
    """Returns (L,) bool: which of L lanes no structure blocks."""
    solid = [
        one.triangles
        for one in objects
        if not one.is_ground
        and one.object_type not in ("Sidewalk", "Lane mark")
        and not one.object_type.startswith("Water")
    ]
    free = np.ones(len(traffic.lanes), bool)
    if not solid:
        return free
    triangles = np.concatenate(solid)
    z = triangles[:, :, 2]
    low = triangles[
        (z.max(axis=1) > _LOWEST_OBSTACLE) & (z.min(axis=1) < _HIGHEST_OBSTACLE)
    ]
    tree = shapely.STRtree(shapely.linearrings(low[:, [0, 1, 2, 0], :2]))
    strips = [_driven_area(lane.points) for lane in traffic.lanes]
    free[np.unique(tree.query(strips, "intersects")[0])] = False
    return free


def _driven_area(points: np.ndarray) -> BaseGeometry:
    """Returns the area that vehicles cover along the middle of a lane."""
    return shapely.LineString(points[:, :2]).buffer(
        _HALF_WIDTH, cap_style="flat", quad_segs=2
    )


def _in_the_way(graph: LaneGraph, added: Sequence[ImportedObject]) -> list[str]:
    """Returns the names of objects that stand where vehicles drive."""
    if not added:
        return []
    tree = shapely.STRtree(
        [_driven_area(piece.points) for piece in graph.pieces]
    )
    outlines = [one.structure.footprint_W for one in added]
    in_the_way = np.unique(tree.query(outlines, "intersects")[0])
    return [added[number].structure.name for number in in_the_way]


# A signal belongs to a junction within this distance [m].
_JUNCTION_WITHIN = 25.0
# A signal controls the ways of its junction that pass within this distance [m].
_WAY_WITHIN = 6.0
# A way leads across the first way of its junction if the sine of the angle
# between them is greater than this (45 deg).
_ACROSS_SINE = np.sin(np.pi / 4)


def _junctions_with_signals(
    traffic: StreetTraffic, streets: Iterable[Street], signals: np.ndarray
) -> list[BaseGeometry]:
    """Returns the places of junctions that have signals, as points.

    Args:
        traffic: the lanes, and the nodes of junctions.
        streets: the streets that meet there.
        signals: (N, 2) places of traffic signals [m].
    """
    if not len(signals):
        return []
    places = {
        node: place
        for street in streets
        for node, place in zip(street.nodes, street.line, strict=True)
    }
    junctions = shapely.points([places[node] for node in traffic.junctions])
    if not len(junctions):
        return []
    pairs = shapely.STRtree(junctions).query_nearest(
        shapely.points(signals), max_distance=_JUNCTION_WITHIN
    )
    return list(junctions[np.unique(pairs[1])])


def _with_signals(
    graph: LaneGraph, signals: Sequence[BaseGeometry]
) -> LaneGraph:
    """Returns the lanes, with signals of two phases at some junctions.

    The first phase is for the direction in which the first way of a junction
    begins, and the second phase is for the direction across. Junctions with a
    common signal become one junction.

    Args:
        graph: the lanes.
        signals: places of the junctions that get signals.
    """
    joined = _joined_junctions(_junctions_of_signals(graph, signals))
    pieces = [
        replace(piece, junction=joined.get(piece.junction, piece.junction))
        for piece in graph.pieces
    ]
    with_phases = _with_phases(pieces, frozenset(joined.values()))
    return replace(graph, pieces=tuple(with_phases))


def _junctions_of_signals(
    graph: LaneGraph, signals: Sequence[BaseGeometry]
) -> Iterator[tuple[int, int]]:
    """Yields pairs of junctions that have a common signal.

    Each way near a signal yields the signal's first junction, and the junction
    of the way, which may be the same.
    """
    ways = [piece for piece in graph.pieces if piece.is_way]
    if not signals or not ways:
        return
    lines = [shapely.LineString(way.points[:, :2]) for way in ways]
    near = shapely.STRtree(signals).query(lines, "dwithin", _WAY_WITHIN)
    first_junctions: dict[int, int] = {}
    for way, signal in near.T.tolist():
        junction = ways[way].junction
        yield first_junctions.setdefault(signal, junction), junction


def _joined_junctions(pairs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Returns for each junction in pairs the junction that it becomes part of.

    Lanes that never cross have different junctions, although they may have a
    common signal. The two junctions of a pair become one.
    """
    parents: dict[int, int] = {}

    def root(junction: int) -> int:
        while (parent := parents.setdefault(junction, junction)) != junction:
            junction = parent
        return junction

    for first, junction in pairs:
        parents[root(junction)] = root(first)
    return {junction: root(junction) for junction in parents}


def _with_phases(
    pieces: Iterable[Piece], switched: AbstractSet[int]
) -> Iterator[Piece]:
    """Yields pieces; ways through the junctions in `switched` have a phase."""
    first_headings: dict[int, float] = {}
    for piece in pieces:
        if not piece.is_way or piece.junction not in switched:
            yield piece
            continue
        step = piece.points[1] - piece.points[0]
        heading = float(np.arctan2(step[1], step[0]))
        first = first_headings.setdefault(piece.junction, heading)
        is_across = abs(np.sin(wrapped(heading - first))) > _ACROSS_SINE
        yield replace(piece, phase=int(is_across))


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


class _StreetWalkways(NamedTuple):
    """The walkways of a city: sidewalks, paths, and crossings between them.

    Attributes:
        walkways: all walkways; the walkways over crossings come last.
        crossings: node of a street -> the crossing at this node.
    """

    walkways: Sequence[Walkway]
    crossings: Mapping[int, Crossing]


def _find_walkways(
    streets: Sequence[Street],
    paths: Iterable[np.ndarray],
    crossed: Iterable[int],
    sidewalks: BaseGeometry,
) -> _StreetWalkways:
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
    return _StreetWalkways(walkways, crossings)


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
