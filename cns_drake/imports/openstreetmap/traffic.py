"""Makes lanes for traffic from OpenStreetMap streets."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.angles import wrapped
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.foreign_city import (
    SHARPEST_TURN_DEG,
    Imported,
    Street,
    StreetPlaces,
    cut_at_nodes,
)
from cns_drake.imports.openstreetmap import tags
from cns_drake.imports.openstreetmap.walkways import find_walkways
from cns_drake.imports.options import DriveOn
from cns_drake.roads.centreline import blend
from cns_drake.traffic import lane_graph
from cns_drake.traffic.lane_file import lane_text
from cns_drake.traffic.lane_joining import DirectedLane, join_lanes
from cns_drake.traffic.polylines import SPACING

# A way through a junction is a turn if its heading changes by more than this.
_STRAIGHT_DEG = 35.0
# Length of the running mean that rounds the corners of a street [m].
_ROUNDED_OVER = 7.0
# Length of the running mean that rounds a lane on the inner side of a sharp
# bend [m].
_LANE_ROUNDED_OVER = 4.0
# A bend is sharp if a lane's points would be less than this share of their
# usual distance apart, or fold over.
_SHARP_SHARE = 0.2
# Lanes end at this distance from the corner of two streets [m].
_BEFORE_CORNER = 1.0
# They end at least this far from a place where just one street continues [m].
_BEFORE_JOINT = 3.0
# They end at most this far from either [m].
_FARTHEST_STOP = 25.0
# Least length of a lane between two junctions [m].
_SHORTEST = 1.0
# The direction of a street's end is that of its last piece of this length [m].
_ARM = 6.0
# An end of a stretch: the number of the stretch, and 0 for its start or -1 for
# its end.
_Arm = tuple[int, int]
# Traffic stays within this distance of drives [m].
_WITHIN = 300.0
# Half the width that a vehicle needs around the middle of its lane [m].
_HALF_WIDTH = 1.3
# A signal belongs to a junction within this distance [m].
_JUNCTION_WITHIN = 25.0
# It belongs to the junction's ways that pass within this distance [m].
_WAY_WITHIN = 6.0
# What ends below this height does not stop a vehicle [m].
_LOWEST_OBSTACLE = 0.3
# What begins above this height does not stop a vehicle [m].
_HIGHEST_OBSTACLE = 3.5


@dataclass(frozen=True)
class Stretch:
    """A street between two junctions, with its lanes.

    Attributes:
        street: the street, which may extend beyond the junctions.
        line: (N, 2) middle of the street, with rounded corners and evenly
            spaced points [m].
        nodes: nodes at the first and at the last point of `line`.
        layout: numbers and width of the lanes.
    """

    street: Street
    line: np.ndarray
    nodes: tuple[int, int]
    layout: tags.LaneLayout

    @cached_property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.line, axis=0), axis=1).sum())

    def heading(self, end: int) -> float:
        """Returns the direction of the stretch at an end of the stretch [rad].

        The direction points away from this end, along the stretch. `end` is 0
        for the first point and -1 for the last.
        """
        line = self.line if end == 0 else self.line[::-1]
        reach = min(len(line) - 1, max(1, round(_ARM / SPACING)))
        return float(np.arctan2(*(line[reach] - line[0])[::-1]))


@dataclass(frozen=True)
class _Lane:
    """A lane of a stretch, with points (N, 2) in driving direction [m].

    Number 0 is the innermost lane of its direction.
    """

    stretch: int
    is_forward: bool
    number: int
    points: np.ndarray

    @property
    def exit_arm(self) -> _Arm:
        return self.stretch, -1 if self.is_forward else 0

    @property
    def entry_arm(self) -> _Arm:
        return self.stretch, 0 if self.is_forward else -1


class StreetTraffic(NamedTuple):
    """The lanes of streets, and which lane leads into which.

    Attributes:
        lanes: lanes of streets, followed by lanes through junctions.
        links: pairs of lanes; the second lane of a pair follows the first lane.
        beside: lane -> the neighbouring lane on the outer side, with the same
            direction.
        junctions: nodes at which three or more ends of streets meet.
    """

    lanes: Sequence[DirectedLane]
    links: Sequence[tuple[int, int]]
    beside: Mapping[int, int]
    junctions: Sequence[int]


def make_traffic_lanes(
    streets: Sequence[Street],
    crossed: AbstractSet[int],
    surface: BaseGeometry,
    side: float,
) -> StreetTraffic:
    """Returns the lanes of streets that meet at common nodes.

    Args:
        streets: the streets.
        crossed: nodes at which people cross.
        surface: surface of all streets in W [m]. Ways through junctions that
            leave this surface are left out.
        side: 1 if traffic keeps right, and -1 if it keeps left.
    """
    stretches = list(_stretches(streets, crossed))
    arms: defaultdict[int, list[_Arm]] = defaultdict(list)
    for k, stretch in enumerate(stretches):
        for end, node in zip((0, -1), stretch.nodes, strict=True):
            arms[node].append((k, end))
    meeting = _MeetingStreets(stretches, arms, crossed, side)
    drawn = list(meeting.lanes())
    lanes = [
        DirectedLane(
            _level(lane.points),
            tags.speed_limit(
                stretches[lane.stretch].street.tags, lane.is_forward
            ),
            False,
        )
        for lane in drawn
    ]
    links: list[tuple[int, int]] = []
    shapely.prepare(surface)
    for first, last, is_junction, line in meeting.ways(drawn):
        if not surface.covers(shapely.LineString(line)):
            continue
        links += [(first, len(lanes)), (len(lanes), last)]
        limit = min(lanes[k].limit for k in (first, last))
        lanes.append(DirectedLane(_level(line), limit, is_junction))
    junctions = [node for node, ends in arms.items() if len(ends) > 2]
    return StreetTraffic(lanes, links, _beside(drawn), junctions)


@dataclass(frozen=True)
class _MeetingStreets:
    """Streets, cut where they meet.

    Attributes:
        stretches: the pieces of the streets.
        arms: node -> the ends of stretches there.
        crossed: nodes at which people cross.
        side: 1 if traffic keeps right, and -1 if it keeps left.
    """

    stretches: Sequence[Stretch]
    arms: Mapping[int, Sequence[_Arm]]
    crossed: AbstractSet[int]
    side: float

    def setback(self, arm: _Arm) -> float:
        """Returns how far before an end of a stretch its lanes stop [m].

        `arm` is a pair: the number of the stretch; and 0 for the end where its
        line starts, or -1 for the other end.
        """
        stretch = self.stretches[arm[0]]
        wanted = [self._wanted_setback((arm[0], end)) for end in (0, -1)]
        room = max(stretch.length - _SHORTEST, 0.0)
        return wanted[arm[1]] * min(1.0, room / sum(wanted))

    def _wanted_setback(self, arm: _Arm) -> float:
        stretch = self.stretches[arm[0]]
        arms = self.arms[stretch.nodes[arm[1]]]
        is_joint = len(arms) < 3
        reach = _BEFORE_JOINT if is_joint else _BEFORE_CORNER
        half = stretch.street.width / 2.0
        for other in arms:
            if other == arm:
                continue
            crossed = self.stretches[other[0]]
            wide = crossed.street.width / 2.0
            angle = abs(
                wrapped(crossed.heading(other[1]) - stretch.heading(arm[1]))
            )
            # The corner where the edges of both streets meet.
            if is_joint:
                corner = max(wide, half) / max(np.tan(angle / 2.0), 0.1)
            else:
                corner = (wide + half * np.cos(angle)) / max(np.sin(angle), 0.1)
                corner += _BEFORE_CORNER
            reach = max(reach, corner)
        return float(min(reach, _FARTHEST_STOP))

    def lanes(self) -> Iterator[_Lane]:
        """Yields the lanes of all stretches."""
        for k, stretch in enumerate(self.stretches):
            along = np.linspace(0.0, stretch.length, len(stretch.line))
            low = self.setback((k, 0))
            high = stretch.length - self.setback((k, -1))
            places = np.linspace(
                low, high, max(2, int((high - low) / SPACING) + 1)
            )
            middle = np.column_stack(
                [np.interp(places, along, x) for x in stretch.line.T]
            )
            tangent = np.gradient(stretch.line, axis=0)
            tangent = np.column_stack(
                [np.interp(places, along, x) for x in tangent.T]
            )
            tangent /= np.linalg.norm(tangent, axis=1)[:, None]
            right = np.column_stack([tangent[:, 1], -tangent[:, 0]])
            for is_forward, count in (
                (True, stretch.layout.forward),
                (False, stretch.layout.backward),
            ):
                for number in range(count):
                    offset = stretch.layout.offset(is_forward, number)
                    offset *= self.side * (1.0 if is_forward else -1.0)
                    points = middle + offset * right
                    ahead = (np.diff(points, axis=0) * tangent[1:]).sum(axis=1)
                    if ahead.min() < _SHARP_SHARE * SPACING:
                        parts = shapely.get_parts(
                            shapely.LineString(middle).offset_curve(-offset)
                        )
                        if not len(parts):
                            continue
                        longest = parts[shapely.length(parts).argmax()]
                        points = _rounded_line(longest, _LANE_ROUNDED_OVER)
                    yield _Lane(
                        k,
                        is_forward,
                        number,
                        points if is_forward else points[::-1],
                    )

    def ways(
        self, lanes: Sequence[_Lane]
    ) -> Iterator[tuple[int, int, bool, np.ndarray]]:
        """Yields ways: lane, next lane, whether it is in a junction, line."""
        leaving: defaultdict[_Arm, list[int]] = defaultdict(list)
        entering: defaultdict[_Arm, list[int]] = defaultdict(list)
        for k, lane in enumerate(lanes):
            leaving[lane.entry_arm].append(k)
            entering[lane.exit_arm].append(k)
        for node, arms in self.arms.items():
            # Vehicles enter a crossing as they would enter a junction.
            is_entered = len(arms) > 2 or node in self.crossed
            for a, b in product(arms, arms):
                if a == b:
                    continue
                # So they do where a street loses a lane.
                is_junction = is_entered or len(entering[a]) > len(leaving[b])
                for first, last in product(entering[a], leaving[b]):
                    one, other = lanes[first], lanes[last]
                    before, after = _direction(one, -1), _direction(other, 0)
                    turn = float(np.degrees(wrapped(after - before)))
                    if abs(turn) > SHARPEST_TURN_DEG:
                        continue
                    if not self._is_legal(one, other, turn, len(arms) > 2):
                        continue
                    line = blend(
                        one.points[-1], before, other.points[0], after, SPACING
                    )
                    yield first, last, is_junction, line

    def _is_legal(
        self, first: _Lane, last: _Lane, turn_deg: float, is_junction: bool
    ) -> bool:
        """Returns whether traffic may go from one lane to another.

        A turn across the opposite direction leads from the innermost lane to
        the innermost one, and a turn to the other side from the outermost to
        the outermost. Straight on, lanes keep their number, counted from the
        inside. Between one-way streets, they keep it counted from the outside.
        """
        layouts = [self.stretches[one.stretch].layout for one in (first, last)]
        here, there = (
            layout.forward if one.is_forward else layout.backward
            for layout, one in zip(layouts, (first, last), strict=True)
        )
        outer = (here - 1 - first.number, there - 1 - last.number)
        if all(layout.forward * layout.backward == 0 for layout in layouts):
            return outer[1] == min(outer[0], there - 1)
        if not is_junction or abs(turn_deg) <= _STRAIGHT_DEG:
            return last.number == min(first.number, there - 1)
        if turn_deg * self.side > 0:
            return first.number == last.number == 0
        return outer == (0, 0)


def _stretches(
    streets: Sequence[Street], crossed: AbstractSet[int]
) -> Iterator[Stretch]:
    used = [
        street
        for street in streets
        if street.tags.get("highway") != "track"
        and tags.lane_layout(street.tags, street.width).width
    ]
    for street, line, ends in cut_at_nodes(used, crossed):
        if shapely.LineString(line).length > SPACING:
            layout = tags.lane_layout(street.tags, street.width)
            yield Stretch(
                street,
                _rounded_line(shapely.LineString(line), _ROUNDED_OVER),
                ends,
                layout,
            )


def _rounded_line(line: shapely.LineString, window_length: float) -> np.ndarray:
    """Returns evenly spaced points (N, 2) along a line with smooth corners.

    `window_length` is the length of the running mean that rounds them [m].
    """
    count = max(3, round(line.length / SPACING) + 1)
    places = np.linspace(0.0, 1.0, count)
    points = shapely.get_coordinates(
        shapely.line_interpolate_point(line, places, normalized=True)
    )
    window = min(int(window_length / SPACING), count // 3) // 2 * 2 + 1
    reach = window // 2
    # Mirrored at both ends, so that these stay in place.
    longer = np.concatenate(
        [
            2 * points[0] - points[reach:0:-1],
            points,
            2 * points[-1] - points[-2 : -reach - 2 : -1],
        ]
    )
    smooth = uniform_filter1d(longer, window, axis=0)
    return smooth[reach : reach + count]


def _beside(lanes: Sequence[_Lane]) -> Mapping[int, int]:
    # Lanes of one direction, in order from the inside outwards.
    return {
        k: k + 1
        for k, (one, other) in enumerate(pairwise(lanes))
        if (one.stretch, one.is_forward) == (other.stretch, other.is_forward)
    }


def _direction(lane: _Lane, end: int) -> float:
    a, b = lane.points[:2] if end == 0 else lane.points[-2:]
    return float(np.arctan2(*(b - a)[::-1]))


def _level(line: np.ndarray) -> np.ndarray:
    return np.column_stack([line, np.zeros(len(line))])


def lanes_of_streets(
    streets: Sequence[Street],
    places: StreetPlaces,
    structures: Sequence[Imported],
    added: Sequence[Imported],
    drives: Sequence[WaypointRoute],
    drive_on: DriveOn,
) -> str | None:
    """Returns the text of a lane file; None if there is no lane to drive on.

    The file contains the streets within 300 m of the drives. The file also
    lists objects, such as parked cars, that were added beside the streets and
    stand in a lane.

    Args:
        streets: streets from the imported file.
        places: crossings, traffic signals and footpaths.
        structures: structures from the imported file.
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
        if line.dwithin(paths, _WITHIN)
    ]
    if not near:
        return None
    walks = find_walkways(
        near, places.paths, places.crossed, _sidewalks(structures, paths)
    )
    surface = shapely.union_all(
        [
            line.buffer(street.width / 2.0, 4)
            for street, line in zip(streets, lines, strict=True)
            if line.dwithin(paths, 2.0 * _WITHIN)
        ]
    )
    side = 1.0 if drive_on == "right" else -1.0
    traffic = make_traffic_lanes(near, set(walks.crossings), surface, side)
    free = _are_free(traffic, structures)
    outer = traffic.beside
    graph = join_lanes(
        traffic.lanes,
        [pair for pair in traffic.links if free[list(pair)].all()],
        outer if side > 0 else {b: a for a, b in outer.items()},
    )
    if not graph.pieces:
        return None
    graph = _with_signals(graph, _signals(traffic, near, places.signals))
    graph = replace(graph, crossings=tuple(walks.crossings.values()))
    return lane_text(graph, walks.walkways, _in_the_way(graph, added))


def _sidewalks(
    structures: Iterable[Imported], paths: BaseGeometry
) -> BaseGeometry:
    """Returns the area of sidewalks near drives."""
    triangles = [
        one.triangles[:, :, :2] for one in structures if one.kind == "Sidewalk"
    ]
    if not triangles:
        return shapely.Polygon()
    corners = np.round(np.concatenate(triangles), 3)
    flat = np.asarray(shapely.polygons(corners))
    near = shapely.dwithin(flat, paths, _WITHIN) & shapely.is_valid(flat)
    return shapely.union_all(flat[near], grid_size=0.001)


def _are_free(
    traffic: StreetTraffic, structures: Iterable[Imported]
) -> np.ndarray:
    """Returns (L,) which lanes are free of everything in the file."""
    solid = [
        one.triangles
        for one in structures
        if not one.is_ground
        and one.kind not in ("Sidewalk", "Lane mark")
        and not one.kind.startswith("Water")
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
    """Returns the area that vehicles on the middle line of a lane cover."""
    return shapely.LineString(points[:, :2]).buffer(
        _HALF_WIDTH, cap_style="flat", quad_segs=2
    )


def _in_the_way(
    graph: lane_graph.LaneGraph, added: Sequence[Imported]
) -> list[str]:
    """Returns the names of objects that stand where vehicles drive."""
    if not added:
        return []
    tree = shapely.STRtree(
        [_driven_area(piece.points) for piece in graph.pieces]
    )
    outlines = [one.structure.footprint_W for one in added]
    hit = np.unique(tree.query(outlines, "intersects")[0])
    return [added[k].structure.name for k in hit]


def _signals(
    traffic: StreetTraffic, streets: Iterable[Street], signals: np.ndarray
) -> list[BaseGeometry]:
    """Returns the places of junctions that have signals."""
    if not len(signals):
        return []
    places = {
        node: street.line[k]
        for street in streets
        for k, node in enumerate(street.nodes)
    }
    junctions = shapely.points([places[n] for n in traffic.junctions])
    if not len(junctions):
        return []
    pairs = shapely.STRtree(junctions).query_nearest(
        shapely.points(signals), max_distance=_JUNCTION_WITHIN
    )
    return list(junctions[np.unique(pairs[1])])


def _with_signals(
    graph: lane_graph.LaneGraph, signals: Sequence[BaseGeometry]
) -> lane_graph.LaneGraph:
    """Returns the lanes, with signals of two phases at some junctions.

    The first phase is for the direction from which the junction is first
    entered, the second for the direction across it.
    """
    ways = [k for k, piece in enumerate(graph.pieces) if piece.is_way]
    if not signals or not ways:
        return graph
    lines = [shapely.LineString(graph.pieces[k].points[:, :2]) for k in ways]
    near = shapely.STRtree(signals).query(lines, "dwithin", _WAY_WITHIN)
    # Lanes that never cross have different junctions, which a common signal
    # joins.
    group = {piece.junction: piece.junction for piece in graph.pieces}
    controlled: dict[int, int] = {}
    for k, signal in near.T.tolist():
        junction = graph.pieces[ways[k]].junction
        first = group[controlled.setdefault(signal, junction)]
        joined = group[junction]
        group = {a: first if b == joined else b for a, b in group.items()}
    switched = {group[k] for k in controlled.values()}
    pieces = list(graph.pieces)
    axes: dict[int, float] = {}
    for k, piece in enumerate(pieces):
        junction = group[piece.junction]
        pieces[k] = replace(piece, junction=junction)
        if not piece.is_way or junction not in switched:
            continue
        step = piece.points[1] - piece.points[0]
        heading = float(np.arctan2(step[1], step[0]))
        axis = axes.setdefault(junction, heading)
        across = abs(np.sin(wrapped(heading - axis))) > np.sin(np.pi / 4)
        pieces[k] = replace(pieces[k], phase=int(across))
    return replace(graph, pieces=tuple(pieces))
