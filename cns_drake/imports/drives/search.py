"""Searches two drives through a city that share a part of their paths.

The first drive is approximately the longest of the shortest paths between any
two places. The second drive shares the middle part of the first drive, but has
a beginning and an end of its own, which are called arms. A path is a sequence
of pieces, such as lanes of streets or cells of free space. A `WayGraph` says
which piece can follow which piece; a sequence of pieces in this graph is called
a way.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise, product

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from shapely.geometry import LineString

from cns_drake.base.errors import InputError
from cns_drake.imports.drives.free_space import FreeSpace
from cns_drake.imports.options import ImportFaults
from cns_drake.roads.lane_path import POINT_SPACING
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import make_waypoint_path

# Paths of vehicles are quintic splines (`cns_drake.motion`). The points of a
# path are their control points.
_DEGREE = 5
# The bends of a proposed drive are this many times wider than the car's
# tightest one, because the drive may be on a slope and its numbers are rounded.
_MARGIN = 1.01
# Distance between the places where bends and room are checked [m].
_STEP = 0.25
# Greatest length of a proposed drive [m].
LONGEST = 1500.0
# Least length of a proposed drive [m].
SHORTEST = 80.0

# The place (2,) of an obstacle: a bend that is too tight, or no room [m].
Obstacle = np.ndarray
# Takes places (N, 2) along a path [m]. Returns the first place (2,) without
# room for a car, or None.
Room = Callable[[np.ndarray], np.ndarray | None]
# Least length of the second drive's own arms [m].
_SHORTEST_ARM = 40.0
# Greatest length of the second drive's own arms [m].
_LONGEST_ARM = LONGEST / 3
# Shares of the first drive's length. For each of two trials: between the first
# and the second number, the second drive may join the first one; it leaves it
# between 1 minus the second number and the third number.
_SHARED = ((0.25, 0.5, 0.75), (0.0, 0.7, 1.0))
# Least share of the first drive's length that both have in common.
_LEAST_SHARED = 0.15
# Greatest number of places to join and to leave that are tried.
_MOST_PLACES = 12
# Least distance between these places [m].
_APART = 10.0
# Greatest number of ways that are tried as first drive, and as second drive.
_MOST_TRIES = 30
# Greatest number of ends that are tried to find a way that passes no place
# twice.
_MOST_ENDS = 20
# Greatest number of pieces from which ways are searched.
_MOST_STARTS = 200
# In large graphs, ways are searched from fewer pieces, so that this number of
# pieces is reached at most.
_MOST_REACHED = 400_000


@dataclass(frozen=True)
class WaypointRoute:
    """The route of a drive through an imported city.

    Attributes:
        waypoints: (N, 2) or (N, 3) places through which the car drives [m].
        path: (M, 2) closely spaced places on the path [m].
        limit: usual speed limit along the path [m/s]; None without one.
    """

    waypoints: np.ndarray
    path: np.ndarray
    limit: float | None = None

    @property
    def length(self) -> float:
        """Horizontal length of the drive [m]."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


def steerable_drive(
    waypoints: np.ndarray, room: Room | None = None, margin: float = _MARGIN
) -> WaypointRoute | Obstacle:
    """Returns the drive along waypoints, or the place (2,) of its failure.

    A drive fails at an obstacle, or at a bend that is too tight for the car. If
    a drive is too short, the result is the place in the middle of the drive.

    Args:
        waypoints: (N, 2) or (N, 3) places [m].
        room: function that takes places (M, 2) along the path, and returns the
            first place with an obstacle, or None; by default there are no
            obstacles.
        margin: least radius of a bend, as a multiple of the car's smallest
            turning radius.
    """
    waypoints = np.round(waypoints, 3)
    xyz = np.zeros((len(waypoints), 3))
    xyz[:, : waypoints.shape[1]] = waypoints
    try:
        points = make_waypoint_path(xyz, POINT_SPACING).points[:, :2]
    except InputError:
        return xyz[len(xyz) // 2, :2]
    driven, radii = driven_path(points)
    tightest = int(radii.argmin())
    if radii[tightest] < margin * TIGHTEST_RADIUS:
        return driven[tightest]
    missing = None if room is None else room(driven)
    if missing is not None:
        return missing
    drive = WaypointRoute(waypoints, points)
    return drive if drive.length >= SHORTEST else points[len(points) // 2]


def evenly_spaced(line: np.ndarray, spacing: float) -> np.ndarray:
    """Returns places (N, D) along a line (M, D), about `spacing` apart [m].

    Ends of the line are kept.
    """
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(along[-1] / spacing))
    wanted = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(wanted, along, x) for x in line.T])


def driven_path(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns places (M, 2) along a path, and the radii (M,) of its bends [m].

    The path is a spline; `points` (N, 2) are its evenly spaced control points
    [m].
    """
    reach = _DEGREE // 2
    points = np.concatenate(
        [
            2 * points[0] - points[reach:0:-1],
            points,
            2 * points[-1] - points[-2 : -reach - 2 : -1],
        ]
    )
    spline = BSpline(np.arange(len(points) + _DEGREE + 1.0), points, _DEGREE)
    first, last = float(_DEGREE), float(len(points))
    count = int((last - first) * POINT_SPACING / _STEP) + 1
    u = np.linspace(first, last, count)
    (x1, y1), (x2, y2) = spline(u, 1).T, spline(u, 2).T
    curvature = np.abs(x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3
    return spline(u), 1.0 / np.maximum(curvature, 1e-12)


class WayGraph(ABC):
    """A graph of N pieces, from which the paths of a car can be built.

    A piece is, for example, a lane from one junction to the next. A sequence of
    pieces is called a way. An edge of the graph leads from a piece to each
    piece that can follow it.

    Attributes:
        lengths: (N,) lengths of the pieces [m].
        is_open: (N,) whether a car can drive along a piece, as far as is known.
    """

    def __init__(
        self,
        lengths: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        costs: np.ndarray | None = None,
    ):
        """Links pieces: each of `before` (L,) leads into one of `after` (L,).

        `lengths` (N,) are those of the pieces [m]. `costs` (L,) are from the
        middle of one piece to the middle of the next; if None, they are lengths
        [m].
        """
        self.lengths = lengths
        if costs is None:
            costs = (lengths[before] + lengths[after]) / 2.0
        self._links = (before, after, costs)
        self.is_open = np.ones(len(lengths), dtype=bool)

    @abstractmethod
    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        """Returns (N,) bool: pieces that an arm of the second drive must avoid.

        An arm is the part of the second drive before it joins the first drive,
        or the part after it has left the first drive. Pieces to avoid are the
        pieces of the drives so far, and pieces close to those pieces.

        Args:
            pieces: numbers of the pieces of the drives so far.
            joint: piece at which the second drive joins or leaves the first
                drive; this piece is allowed.
        """

    @abstractmethod
    def is_simple(self, way: Sequence[int]) -> bool:
        """Returns whether a way visits no place twice.

        `way` is a sequence of piece numbers.
        """

    @abstractmethod
    def drive(self, way: Sequence[int]) -> WaypointRoute | Obstacle:
        """Returns the drive along a way, or the place (2,) of its failure [m].

        A drive fails at an obstacle or a bend that is too tight, see
        `steerable_drive`. `way` is a sequence of piece numbers.
        """

    @abstractmethod
    def blocked(self, way: Sequence[int], place: Obstacle) -> np.ndarray:
        """Returns the pieces of a way that an obstacle blocks.

        `way` is a sequence of piece numbers, and `place` (2,) the place of the
        obstacle [m].
        """

    def along(self, way: Sequence[int]) -> np.ndarray:
        """Returns the distance (N,) along a way to each piece's end [m]."""
        return np.cumsum(self.lengths[list(way)])

    def length(self, way: Sequence[int]) -> float:
        """Returns the length of a way [m]; 0 if the way has no pieces."""
        return float(self.along(way)[-1]) if len(way) else 0.0

    def cut(self, way: list[int], longest: float) -> list[int]:
        """Returns the beginning of a way, as a list of piece numbers.

        The result contains as many pieces as fit into `longest` [m] together,
        but at least one.
        """
        kept = int(np.searchsorted(self.along(way), longest, "right"))
        return way[: max(1, kept)]

    def links(self, closed: np.ndarray | None = None) -> csr_array:
        """Returns the costs from piece to next piece, a sparse matrix (N, N).

        By default, a cost is the length of the way between the pieces' middles
        [m]. Pieces that are not open, and pieces in the mask `closed` (N,),
        have no edges.
        """
        is_open = self.is_open if closed is None else self.is_open & ~closed
        before, after, costs = self._links
        kept = is_open[before] & is_open[after]
        size = (len(self.lengths), len(self.lengths))
        pairs = (before[kept], after[kept])
        return coo_array((costs[kept], pairs), size).tocsr()


def find_drives(graph: WayGraph) -> list[WaypointRoute]:
    """Returns two drives that share a part of their paths, if there are any.

    If no second drive is found, the list has one drive; if no drive is found,
    the list is empty.
    """
    for _ in range(_MOST_TRIES):
        way = _longest_way(graph)
        if graph.length(way) < SHORTEST:
            return []
        first = graph.drive(way)
        if isinstance(first, WaypointRoute):
            break
        graph.is_open[graph.blocked(way, first)] = False
    else:
        return []
    for candidate in islice(_second_ways(graph, way), _MOST_TRIES):
        second = graph.drive(candidate)
        if isinstance(second, WaypointRoute):
            return [first, second]
    return [first]


def _longest_way(graph: WayGraph) -> list[int]:
    """Returns approximately the longest of all shortest ways; [] if none."""
    pieces = np.flatnonzero(graph.is_open)
    if len(pieces) == 0:
        return []
    links = graph.links()
    _, part = connected_components(links, directed=False)
    largest = np.bincount(part[pieces], graph.lengths[pieces]).argmax()
    number = int(np.clip(_MOST_REACHED // len(pieces), 1, _MOST_STARTS))
    starts = [
        int((part[pieces] == largest).argmax()),
        *range(0, len(pieces), -(-len(pieces) // number))[1:],
    ]
    into = links.T.tocsr()
    best: list[int] = []
    begins: dict[int, None] = {}
    for start in (int(pieces[k]) for k in starts):
        begins[start] = None
        begins[_longest_way_from(graph, into, start)[-1]] = None
    for begin in begins:
        way = _longest_way_from(graph, links, begin)
        if graph.length(way) > graph.length(best) + 1e-6:
            best = way
    return best


def _longest_way_from(
    graph: WayGraph, links: csr_array, start: int, longest: float = LONGEST
) -> list[int]:
    """Returns the longest of the shortest ways from a piece, up to a length.

    Ways that pass a place twice do not count. Ways follow links between usable
    pieces, up to the length `longest` [m]. With transposed links, the way leads
    to the piece, in reverse order.
    """
    cost, before = dijkstra(links, indices=start, return_predecessors=True)
    cost = np.where(np.isfinite(cost), cost + graph.lengths / 2.0, -1.0)
    most = min(_MOST_ENDS, len(cost))
    ends = np.argpartition(-cost, most - 1)[:most]
    for end in ends[np.argsort(-cost[ends], kind="stable")].tolist():
        if cost[end] < 0.0:
            break
        way = [end]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        way.reverse()
        way = graph.cut(way, longest)
        if graph.is_simple(way):
            return way
    return [start]


def _second_ways(graph: WayGraph, first: list[int]) -> Iterator[list[int]]:
    """Yields ways that share the middle of the first way, the best first."""
    along = np.concatenate([[0.0], graph.along(first)])
    part = along / along[-1]
    every = np.arange(len(first))
    for low, middle, high in _SHARED:
        begins = every[(part[:-1] >= low) & (part[:-1] <= middle)]
        ends = every[(part[1:] >= 1.0 - middle) & (part[1:] <= high)][::-1]
        for begin in (*_spaced_places(begins, along), None):
            start = _nearest(part[:-1], low) if begin is None else begin
            head: list[int] = []
            if begin is not None:
                head = _longest_arm(graph, first, first[begin], backwards=True)
                if not head:
                    continue
            for end in (*_spaced_places(ends, along), None):
                stop = _nearest(part[1:], high) if end is None else end
                if begin is None and end is None:
                    continue
                if part[stop + 1] - part[start] < _LEAST_SHARED:
                    continue
                tail: list[int] = []
                if end is not None:
                    tail = _longest_arm(graph, [*first, *head], first[end])
                    if not tail:
                        continue
                way = [*head[:0:-1], *first[start : stop + 1], *tail[1:]]
                way = graph.cut(way, LONGEST)
                if graph.is_simple(way):
                    yield way


def _nearest(values: np.ndarray, wanted: float) -> int:
    return int(np.abs(values - wanted).argmin())


def _spaced_places(places: np.ndarray, along: np.ndarray) -> list[int]:
    """Returns some of the places, at least `_APART` from each other.

    They are at most `_MOST_PLACES`.
    """
    kept: list[int] = []
    for place in places.tolist():
        if not kept or abs(along[place] - along[kept[-1]]) >= _APART:
            kept.append(place)
    return kept[:: -(-len(kept) // _MOST_PLACES) or 1]


def _longest_arm(
    graph: WayGraph, used: Sequence[int], joint: int, backwards: bool = False
) -> list[int]:
    """Returns the longest way that leaves a drive at a piece, the joint.

    With `backwards`, the way ends at the joint and is in reverse order. It is
    empty if it is too short.
    """
    links = graph.links(graph.beside(np.array(used), joint))
    if backwards:
        links = links.T.tocsr()
    way = _longest_way_from(graph, links, joint, _LONGEST_ARM)
    return way if graph.length(way[1:]) >= _SHORTEST_ARM else []


# Greatest distance between waypoints, so that heights are followed, and least
# distance from corners [m].
_WAYPOINT_SPACING = 15.0
# Tolerances of waypoints relative to the path that was found, tried in turn
# [m].
_SIMPLIFICATIONS = (1.5, 1.0, 0.7, 2.0, 3.0)
# Numbers of cells in a running mean; the values were found by trial.
_STRAIGHTENED = (5, 11, 17)


def simplified_drive(
    xy: np.ndarray,
    space: FreeSpace,
    tolerances: Sequence[float] = _SIMPLIFICATIONS,
) -> WaypointRoute | Obstacle:
    """Returns a drive with few waypoints along a line, if one is possible.

    The tolerances are tried one after the other, until a drive stays in the
    free space and has no bend that is too tight for the car. If there is no
    such drive, the result is the place (2,) of the obstacle or bend in the
    last attempt [m]; see `steerable_drive`.

    Args:
        xy: (N, 2) places on the line, about 1 m apart [m].
        space: the free space.
        tolerances: distances by which the drive may deviate from the line [m].
    """
    found: WaypointRoute | Obstacle = xy[len(xy) // 2]
    for straightened, tolerance in product(_STRAIGHTENED, tolerances):
        if len(xy) < 4 * straightened:
            break
        kernel = np.ones(straightened) / straightened
        smooth = np.column_stack(
            [np.convolve(column, kernel, mode="valid") for column in xy.T]
        )
        line = LineString(smooth).simplify(tolerance)
        found = steerable_drive(
            _dense_waypoints(np.array(line.coords)), space.obstacle
        )
        if isinstance(found, WaypointRoute):
            break
    return found


def _dense_waypoints(corners: np.ndarray) -> np.ndarray:
    """Returns waypoints with additional ones between those far apart."""
    points = [corners[:1]]
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        number = int((length - _WAYPOINT_SPACING) // _WAYPOINT_SPACING)
        if number > 0:
            # Waypoints keep away from the corners, whose arcs need room.
            parts = np.linspace(0.0, 1.0, number + 2)[1:-1]
            points.append(a + parts[:, None] * (b - a))
        points.append(b[None])
    return np.concatenate(points)


def with_ground_heights(
    drives: Iterable[WaypointRoute],
    height: Callable[[np.ndarray], np.ndarray],
    faults: ImportFaults,
) -> list[WaypointRoute]:
    """Returns drives whose waypoints have the heights of the ground.

    A drive that a car cannot steer on its slopes is left out and counted.

    Args:
        drives: the drives.
        height: function that returns the heights (N,) of the ground at places
            (N, 2) [m].
        faults: counts the drives that are left out.
    """
    found = []
    for drive in drives:
        xy = np.round(drive.waypoints, 3)
        waypoints = np.column_stack([xy, height(xy)])
        if isinstance(steerable_drive(waypoints, margin=1.0), WaypointRoute):
            found.append(replace(drive, waypoints=waypoints))
        else:
            faults.add("drive too tight on its slope, left out", "drive")
    return found
