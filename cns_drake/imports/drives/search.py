"""Two drives through a city, which overlap in part.

The first drive is about the longest of the shortest ways. The second one shares
its middle, and leaves it by an arm at either end. A `WayGraph` defines the
pieces of a way: cells between buildings, or lanes of streets."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from cns_drake.base.errors import InputError
from cns_drake.roads.lane_path import POINT_SPACING
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import make_waypoint_path

# Paths of vehicles are quintic splines (`cns_drake.motion`), whose points are
# their control points.
_DEGREE = 5
# A proposed drive may be on a slope, with rounded numbers: its bends are this
# many times wider than the car's tightest.
_MARGIN = 1.01
# Distance of the places where bends and room are checked [m].
_STEP = 0.25
# Greatest and least length of a proposed drive [m].
LONGEST = 1500.0
SHORTEST = 80.0

# The place (2,) of an obstacle: a bend too tight, or no room [m].
Obstacle = np.ndarray
# Takes places (N, 2) along a path [m] and returns the first (2,) where a car
# has no room, or None.
Room = Callable[[np.ndarray], np.ndarray | None]
# Least and greatest length of the second drive's own arms [m].
_SHORTEST_ARM = 40.0
_LONGEST_ARM = LONGEST / 3
# Parts of the first drive: where the second one may join it (from, to), and
# where it must have left; the same for the second trial; the least part they
# share.
_SHARED = ((0.25, 0.5, 0.75), (0.0, 0.7, 1.0))
_LEAST_SHARED = 0.15
# Number of places to join and to leave that are tried, and their least distance
# [m].
_MOST_PLACES = 12
_APART = 10.0
# Number of ways that are tried as first drive, and as second drive.
_MOST_TRIES = 30
# Number of ends of ways that are tried until a way meets no place twice.
_MOST_ENDS = 20
# Number of pieces from which ways are searched; fewer in large graphs.
_MOST_STARTS = 200
_MOST_REACHED = 400_000


@dataclass(frozen=True)
class WaypointDrive:
    """A drive through a city.

    Attributes:
        waypoints: (N, 2) or (N, 3) [m].
        path: (M, 2) that a car follows [m].
        limit: the lowest speed limit on the way, or none [m/s].
    """

    waypoints: np.ndarray
    path: np.ndarray
    limit: float | None = None

    @property
    def length(self) -> float:
        """Length from above [m]."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


def steerable_drive(
    waypoints: np.ndarray, room: Room | None = None, margin: float = _MARGIN
) -> WaypointDrive | Obstacle:
    """Returns the drive along waypoints (N, 2) or (N, 3), or the obstacle [m].

    The whole path needs room, and bends a margin: their least radius, in
    tightest radii of the car.
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
    drive = WaypointDrive(waypoints, points)
    return drive if drive.length >= SHORTEST else points[len(points) // 2]


def evenly_spaced(line: np.ndarray, spacing: float) -> np.ndarray:
    """Returns places (N, D) along a line (M, D), about a spacing apart [m]."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(along[-1] / spacing))
    wanted = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(wanted, along, x) for x in line.T])


def driven_path(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the places (M, 2) of a path, and the radii (M,) of its bends.

    The control points (N, 2) of its spline are evenly spaced [m].
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
    """Pieces of way, each with its successors.

    Attributes:
        lengths: (N,) lengths of the pieces [m].
        is_open: (N,) whether a car can drive along them, as far as is known.
    """

    def __init__(
        self,
        lengths: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        costs: np.ndarray | None = None,
    ):
        """Links pieces of lengths (N,); `before` (L,) leads into `after` [m].

        Costs (L,) are from middle to middle, lengths if None [m].
        """
        self.lengths = lengths
        if costs is None:
            costs = (lengths[before] + lengths[after]) / 2.0
        self._links = (before, after, costs)
        self.is_open = np.ones(len(lengths), dtype=bool)

    @abstractmethod
    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        """Returns (N,) bool: the pieces that an arm must not use.

        Drives use some pieces; the arm begins at one of them, the joint.
        """

    @abstractmethod
    def is_simple(self, way: Sequence[int]) -> bool:
        """Returns whether a way meets no place twice."""

    @abstractmethod
    def drive(self, way: Sequence[int]) -> WaypointDrive | Obstacle:
        """Returns a drive along a way, or the obstacle on it."""

    @abstractmethod
    def blocked(self, way: Sequence[int], place: Obstacle) -> np.ndarray:
        """Returns the pieces of a way that an obstacle blocks."""

    def along(self, way: Sequence[int]) -> np.ndarray:
        """Returns (N,) how far the end of each piece lies on a way [m]."""
        return np.cumsum(self.lengths[list(way)])

    def length(self, way: Sequence[int]) -> float:
        """Returns the length of a way [m]."""
        return float(self.along(way)[-1]) if len(way) else 0.0

    def cut(self, way: list[int], longest: float) -> list[int]:
        """Returns the start of a way, up to a length [m]."""
        kept = int(np.searchsorted(self.along(way), longest, "right"))
        return way[: max(1, kept)]

    def links(self, closed: np.ndarray | None = None) -> csr_array:
        """Returns costs from piece to piece, without those closed (N,)."""
        is_open = self.is_open if closed is None else self.is_open & ~closed
        before, after, costs = self._links
        kept = is_open[before] & is_open[after]
        size = (len(self.lengths), len(self.lengths))
        pairs = (before[kept], after[kept])
        return coo_array((costs[kept], pairs), size).tocsr()


def find_drives(graph: WayGraph) -> list[WaypointDrive]:
    """Returns two drives that share a part, or one, or none."""
    for _ in range(_MOST_TRIES):
        way = _longest(graph)
        if graph.length(way) < SHORTEST:
            return []
        first = graph.drive(way)
        if isinstance(first, WaypointDrive):
            break
        graph.is_open[graph.blocked(way, first)] = False
    else:
        return []
    for candidate in islice(_seconds(graph, way), _MOST_TRIES):
        second = graph.drive(candidate)
        if isinstance(second, WaypointDrive):
            return [first, second]
    return [first]


def _longest(graph: WayGraph) -> list[int]:
    """Returns about the longest of the shortest ways, [] if there is none."""
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
        begins[_farthest(graph, into, start)[-1]] = None
    for begin in begins:
        way = _farthest(graph, links, begin)
        if graph.length(way) > graph.length(best) + 1e-6:
            best = way
    return best


def _farthest(
    graph: WayGraph, links: csr_array, start: int, longest: float = LONGEST
) -> list[int]:
    """Returns the longest way from a piece that meets no place twice.

    It follows links between usable pieces, up to a length [m]. Transposed links
    give the way to the piece, in reverse order.
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


def _seconds(graph: WayGraph, first: list[int]) -> Iterator[list[int]]:
    """Yields ways that share the middle of another, best first."""
    along = np.concatenate([[0.0], graph.along(first)])
    part = along / along[-1]
    every = np.arange(len(first))
    for low, middle, high in _SHARED:
        begins = every[(part[:-1] >= low) & (part[:-1] <= middle)]
        ends = every[(part[1:] >= 1.0 - middle) & (part[1:] <= high)][::-1]
        for begin in (*_some(begins, along), None):
            start = _nearest(part[:-1], low) if begin is None else begin
            head: list[int] = []
            if begin is not None:
                head = _arm(graph, first, first[begin], backwards=True)
                if not head:
                    continue
            for end in (*_some(ends, along), None):
                stop = _nearest(part[1:], high) if end is None else end
                if begin is None and end is None:
                    continue
                if part[stop + 1] - part[start] < _LEAST_SHARED:
                    continue
                tail: list[int] = []
                if end is not None:
                    tail = _arm(graph, [*first, *head], first[end])
                    if not tail:
                        continue
                way = [*head[:0:-1], *first[start : stop + 1], *tail[1:]]
                way = graph.cut(way, LONGEST)
                if graph.is_simple(way):
                    yield way


def _nearest(values: np.ndarray, wanted: float) -> int:
    return int(np.abs(values - wanted).argmin())


def _some(places: np.ndarray, along: np.ndarray) -> list[int]:
    """Returns at most as many places as are tried, apart from each other."""
    kept: list[int] = []
    for place in places.tolist():
        if not kept or abs(along[place] - along[kept[-1]]) >= _APART:
            kept.append(place)
    return kept[:: -(-len(kept) // _MOST_PLACES) or 1]


def _arm(
    graph: WayGraph, used: Sequence[int], joint: int, backwards: bool = False
) -> list[int]:
    """Returns the longest way from a piece in use by drives, its joint.

    Backwards it ends there, and is in reverse order. It is empty if it is too
    short.
    """
    links = graph.links(graph.beside(np.array(used), joint))
    if backwards:
        links = links.T.tocsr()
    way = _farthest(graph, links, joint, _LONGEST_ARM)
    return way if graph.length(way[1:]) >= _SHORTEST_ARM else []
