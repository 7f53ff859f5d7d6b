"""Lanes for vehicles, paths through junctions, crossings and walkways."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

# Greatest distance between the points of a piece [m].
SPACING = 0.5
# Pedestrians' middles keep this distance from objects, so that their boxes
# clear them in any direction [m].
_CLEARANCE = 0.53
# Where objects with this clearance take more than this share of a walkway's
# width, the walkway is narrow.
_NARROW_SHARE = 0.5
# On a narrow walkway, pedestrians keep this distance, as far as their sides
# need [m].
_SIDE_CLEARANCE = 0.36
# Pedestrians begin a walkway at most this many points before its first one.
_BEFORE = 4
# Number of places across a walkway.
_ACROSS = 21
# Least number of points along a walkway.
_LEAST_POINTS = 4
# Pedestrians move aside by at most this many places from one point to the next.
_ASIDE = 2
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


@dataclass(frozen=True)
class Piece:
    """A piece of a vehicle's path: part of a lane, or a path in a junction.

    A path through a junction is called a way. A vehicle waits in the lane
    before the way until all conflicting ways are free, so a vehicle never stops
    on a way.

    Attributes:
        points: (N, 3) points along the middle of the piece, in driving
            direction, evenly spaced [m].
        limit: speed limit [m/s].
        is_way: whether the piece is a way; otherwise it is part of a lane.
        after: numbers of the pieces that can follow this piece.
        left, right: numbers of the neighbouring lanes with the same direction;
            -1 for none.
        junction: number of the junction in which a way is, or to which a lane
            leads.
        phase: signal phase in which a way has green; -1 without a signal.
    """

    points: np.ndarray
    limit: float
    is_way: bool
    after: tuple[int, ...] = ()
    left: int = -1
    right: int = -1
    junction: int = -1
    phase: int = -1

    @property
    def length(self) -> float:
        return length_of(self.points)


@dataclass(frozen=True)
class Crossing:
    """A place where pedestrians cross lanes, at the end of a road or elsewhere.

    Attributes:
        line: (2, 3) from kerb to kerb, or from sidewalk to sidewalk [m].
        area: area where pedestrians are while they cross.
        marked: whether vehicles give way to waiting pedestrians. At a crossing
            without marks, which is never at the end of a road, pedestrians wait
            for a gap in the traffic.
    """

    line: np.ndarray
    area: BaseGeometry
    marked: bool = True


def make_crossing(
    line: np.ndarray, width: float, marked: bool = True
) -> Crossing:
    """Returns a crossing for pedestrians.

    Args:
        line: (2, 3) ends of the crossing's middle line [m].
        width: width of the crossing [m].
        marked: whether vehicles give way to waiting pedestrians.
    """
    course = LineString(line[:, :2])
    return Crossing(line, course.buffer(width / 2, cap_style="flat"), marked)


@dataclass(frozen=True)
class Walkway:
    """A strip on which people walk, between two places where walkways meet.

    Attributes:
        points: (N, 3) points along the middle of the strip, evenly spaced [m].
        half_width: greatest distance of a pedestrian from the middle [m].
        start, end: numbers of the places at the ends of the strip.
        crossing: number of the crossing on which the walkway lies; -1 for none.
        free: (N, 2) for each point, the two ends of the part of the width that
            is free of objects [m]: distances from the middle of the strip,
            positive to the right. None if the whole width is free.
        narrow: (N,) for each point, whether pedestrians fit only if they face
            along the walkway; None if pedestrians fit everywhere.
    """

    points: np.ndarray
    half_width: float
    start: int
    end: int
    crossing: int = -1
    free: np.ndarray | None = None
    narrow: np.ndarray | None = None

    @property
    def limits(self) -> np.ndarray:
        """Limits of pedestrians' distance from the middle, (N, 2) [m].

        Each row contains the least and the greatest distance. Distances are
        positive to the right of the middle of the strip.
        """
        if self.free is not None:
            return self.free
        sides = self.half_width * np.array([-1, 1])
        return np.tile(sides, (len(self.points), 1))

    @property
    def is_narrow(self) -> np.ndarray:
        """(N,) bool: points where the walkway is too narrow to turn around."""
        if self.narrow is not None:
            return self.narrow
        return np.zeros(len(self.points), bool)


def kept_clear(
    walkways: Sequence[Walkway], things: Sequence[BaseGeometry]
) -> list[Walkway]:
    """Leads walkways around objects, or ends them in front of objects.

    Args:
        walkways: the walkways.
        things: outlines of the objects as seen from above [m].

    Returns:
        The walkways, each with the free part of its width (`Walkway.free`), and
        cut where nobody can pass. Crossings without a walkway at each end are
        left out.
    """
    tree = shapely.STRtree(things)
    found = []
    node = 1 + max((max(way.start, way.end) for way in walkways), default=0)
    for way in walkways:
        points = _lengthened(way.points[:, :2], _BEFORE)
        right = np.gradient(points, axis=0)[:, ::-1] * (1.0, -1.0)
        right /= np.linalg.norm(right, axis=1)[:, None]
        across = np.linspace(-way.half_width, way.half_width, _ACROSS)
        places = points[:, None] + across[:, None] * right[:, None]
        seen = shapely.points(places).ravel()
        barred, around = np.zeros((2, *places.shape[:2]), int)
        for each, reach in ((barred, _SIDE_CLEARANCE), (around, _CLEARANCE)):
            each.flat[tree.query(seen, "dwithin", reach)[0]] = 1
        narrow = around.mean(axis=1) > _NARROW_SHARE
        barred[~narrow] = around[~narrow]
        # What blocks the whole width also stands in the way of pedestrians who
        # begin there.
        for line in (barred, barred[::-1]):
            for row in line[:_BEFORE][::-1]:
                if not (line[_BEFORE] | row).all():
                    line[_BEFORE] |= row
        barred = barred[_BEFORE:-_BEFORE]
        narrow = maximum_filter1d(narrow, 3)[_BEFORE:-_BEFORE]
        # A pedestrian is longer than wide, and needs some distance to move
        # aside.
        barred = maximum_filter1d(barred, 3, axis=0)
        for step in (1, -1):
            line = barred[::step]
            for row, before in zip(line[1:], line, strict=False):
                if before.all():
                    continue
                row |= minimum_filter1d(
                    before, 2 * _ASIDE + 1, mode="constant", cval=1
                )
        free = np.pad(1 - barred, ((0, 0), (1, 1)))
        limits = np.full((len(barred), 2), np.nan)
        last = np.array([0, _ACROSS])
        for row, edges in enumerate(np.diff(free)):
            gaps = np.flatnonzero(edges).reshape(-1, 2)
            shared = np.minimum(gaps, last)[:, 1] - np.maximum(gaps, last)[:, 0]
            gaps = gaps[shared > 1]
            if len(gaps):
                last = max(gaps, key=np.ptp)
                limits[row] = across[last - (0, 1)]
            else:
                last = np.array([0, _ACROSS])
        bars = np.flatnonzero(np.isnan(limits[:, 0]))
        if way.crossing >= 0 and len(bars):
            continue
        for before, after in pairwise([-1, *bars.tolist(), len(barred)]):
            rows = slice(before + 1, after)
            nodes = [way.start, way.end]
            if after - before <= _LEAST_POINTS:
                continue
            for k, is_cut in enumerate((before >= 0, after < len(barred))):
                if is_cut:
                    nodes[k] = node
                    node += 1
            found.append(
                replace(
                    way,
                    points=way.points[rows],
                    start=nodes[0],
                    end=nodes[1],
                    free=limits[rows],
                    narrow=narrow[rows],
                )
            )
    # No crossing leads to a place without a walkway.
    reached = {n for w in found if w.crossing < 0 for n in (w.start, w.end)}
    return [w for w in found if w.crossing < 0 or {w.start, w.end} <= reached]


def _lengthened(points: np.ndarray, count: int) -> np.ndarray:
    """Returns points (N, 2), continued straight by `count` at both ends."""
    more = np.arange(1, count + 1)[:, None]
    before = points[0] - more[::-1] * (points[1] - points[0])
    return np.concatenate(
        [before, points, points[-1] + more * (points[-1] - points[-2])]
    )


@dataclass(frozen=True)
class LaneGraph:
    """The lanes and paths through junctions of a map, and its crossings.

    Attributes:
        pieces: parts of lanes and paths through junctions. Their numbers are
            indices into this tuple.
        crossings: places where pedestrians cross the lanes.
    """

    pieces: tuple[Piece, ...]
    crossings: tuple[Crossing, ...] = ()

    @property
    def lanes(self) -> list[int]:
        """Numbers of the pieces that are lanes."""
        return [k for k, p in enumerate(self.pieces) if not p.is_way]


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
    sides = [k for k, way in enumerate(walkways) if way.crossing < 0]
    lines = [LineString(walkways[k].points[:, :2]) for k in sides]
    lanes = [LineString(piece.points[:, :2]) for piece in graph.pieces]
    side_tree, lane_tree, thing_tree = map(
        shapely.STRtree, (lines, lanes, things)
    )
    crossings, found = list(graph.crossings), list[Walkway]()
    # Walkway -> the row at which it is cut, and the number of the place there.
    cuts: dict[int, tuple[int, int]] = {}
    node = 1 + max((max(way.start, way.end) for way in walkways), default=0)

    def beside(p: np.ndarray, reach: np.ndarray) -> tuple[int, int] | None:
        """Returns where pedestrians who start at p step onto a walkway.

        Args:
            p: (2,) the start in W [m].
            reach: (2,) vector from p [m]. Only walkways that it crosses count.

        Returns:
            Index of the nearest walkway that `reach` crosses, and index of its
            point nearest to p. None if there is no walkway, if this point is
            near its end, or if a crossing begins on this walkway already.
        """
        ray = LineString([p, p + reach])
        near = side_tree.query(ray, "intersects")
        if not len(near):
            return None
        apart = [shapely.Point(p).distance(ray & lines[k]) for k in near]
        k = sides[near[int(np.argmin(apart))]]
        xy = walkways[k].points[:, :2]
        row = int(np.linalg.norm(xy - p, axis=1).argmin())
        margin = int(_FROM_WALKWAY_ENDS / SPACING)
        is_inside = margin <= row < len(xy) - margin
        return (k, row) if is_inside and k not in cuts else None

    def course(p: np.ndarray, q: np.ndarray, z: float) -> np.ndarray | None:
        """Returns the path (4, 3) of pedestrians across lanes, from p to q.

        Where it crosses lanes, it lies at the height `z` [m]. The result is
        None if the path would cross too many lanes, or come too close to an
        obstacle, a junction or the end of a lane.
        """
        line = LineString([p[:2], q[:2]])
        ahead = (q - p)[:2] / line.length
        over = lane_tree.query(line, "intersects")
        near = lane_tree.query(line, "dwithin", _FROM_WAYS)
        # Pedestrians wait at both ends.
        longer = LineString([p[:2] - ahead, q[:2] + ahead])
        if (
            len(over) > _MOST_LANES
            or any(graph.pieces[k].is_way for k in near)
            or len(
                thing_tree.query(
                    longer, "dwithin", _CROSSING_HALF_PATH + _CLEARANCE
                )
            )
        ):
            return None
        places = []
        for k in over:
            place = line & lanes[k]
            s = lanes[k].project(place)
            if not _FROM_LANE_ENDS < s < lanes[k].length - _FROM_LANE_ENDS:
                return None
            places.append(line.project(place))
        edges = min(places) - _HALF_LANE, max(places) + _HALF_LANE
        return np.array([p, *((*(p[:2] + s * ahead), z) for s in edges), q])

    for k in graph.lanes:
        points = graph.pieces[k].points
        margin = int(_FROM_LANE_ENDS / SPACING)
        middle = len(points) // 2
        step = int(_TRIAL_STEP / SPACING)
        first = margin + (middle - margin) % step
        rows = range(first, len(points) - margin, step)
        for row in sorted(rows, key=lambda row: abs(row - middle)):
            x, y = np.diff(points[row : row + 2, :2], axis=0)[0] / SPACING
            left = _REACH * np.array([-y, x])
            here = points[row, :2]
            one, other = beside(here, left), beside(here, -left)
            if one is None or other is None or one[0] == other[0]:
                continue
            ends = one, other
            p, q = (walkways[way].points[at] for way, at in ends)
            line = course(p, q, points[row, 2])
            if line is None:
                continue
            cuts |= {way: (at, node + i) for i, (way, at) in enumerate(ends)}
            found.append(
                Walkway(
                    resampled(line),
                    _CROSSING_HALF_PATH,
                    node,
                    node + 1,
                    len(crossings),
                )
            )
            crossings.append(
                make_crossing(line[[0, -1]], _CROSSING_WIDTH, marked=False)
            )
            node += 2
            break
    for k, way in enumerate(walkways):
        row, between = cuts.get(k, (len(way.points) - 1, way.end))
        for part, start, end in (
            (slice(0, row + 1), way.start, between),
            (slice(row, len(way.points)), between, way.end),
        )[: 1 + (k in cuts)]:
            found.append(
                replace(
                    way,
                    points=way.points[part],
                    start=start,
                    end=end,
                    free=way.limits[part],
                    narrow=way.is_narrow[part],
                )
            )
    return LaneGraph(graph.pieces, tuple(crossings)), found


def resampled(points: np.ndarray, spacing: float = SPACING) -> np.ndarray:
    """Returns evenly spaced points (N, 3) along a polyline (M, 3) [m].

    Neighbouring points are at most `spacing` apart [m]. A corner is dropped if
    it coincides with the previous corner.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    points = points[np.append(True, steps > 1e-6)]
    along = distances_along(points)
    count = max(2, int(np.ceil(along[-1] / spacing)) + 1)
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, x) for x in points.T])


def length_of(points: np.ndarray) -> float:
    """Returns the length of a line through points (N, 2 or 3) [m]."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def distances_along(points: np.ndarray) -> np.ndarray:
    """Returns the distances of a polyline's points along the polyline [m].

    The first point is at 0.

    Args:
        points: (N, 2) or (N, 3) points [m].

    Returns:
        (N,) distances [m].
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.append(0.0, np.cumsum(steps))


def without_dead_ends(pieces: Sequence[Piece]) -> list[Piece]:
    """Returns the pieces that vehicles can both reach and leave.

    Three kinds of pieces are removed: lanes that lead nowhere, pieces that lead
    only to such lanes, and pieces to which no remaining piece leads. The
    remaining pieces are numbered again.
    """
    alive = set(range(len(pieces)))
    while True:
        entered = {
            after for k in alive for after in pieces[k].after if after in alive
        }
        rest = {
            k
            for k in alive
            if k in entered and any(a in alive for a in pieces[k].after)
        }
        if rest == alive:
            break
        alive = rest
    number = {old: new for new, old in enumerate(sorted(alive))}
    return [
        replace(
            pieces[k],
            after=tuple(number[a] for a in pieces[k].after if a in alive),
            left=number.get(pieces[k].left, -1),
            right=number.get(pieces[k].right, -1),
        )
        for k in sorted(alive)
    ]
