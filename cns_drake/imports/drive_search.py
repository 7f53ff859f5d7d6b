"""Two drives through the free space of a city, which overlap in part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree
from shapely.geometry import LineString

from cns_drake.base.errors import InputError
from cns_drake.imports.free_space import CELL, FreeSpace
from cns_drake.motion.control_points import POINT_SPACING
from cns_drake.motion.path_geometry import SmoothPath
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import make_waypoint_path

# A path keeps away from walls as far as this [m].
_COMFORT = 6.0
# How much of the clearance the car that follows a path may lose [m].
_SLACK = 0.6
# No drive is longer, and none shorter [m].
LONGEST = 1500.0
_SHORTEST = 80.0
# What the second drive has to itself at either end, at least [m].
SHORTEST_ARM = 30.0
# The part of the first drive that the second shares.
_SHARED = (0.25, 0.75)
LEAST_SHARED = 0.15
# The rest of it is left by so much [m].
_APART = 10.0
# Between waypoints at most, for the height; and from corners at least [m].
_WAYPOINT_SPACING = 15.0
# By how much waypoints may leave the path that was found, as tried [m].
_SIMPLIFICATIONS = (1.5, 1.0, 0.7, 2.0, 3.0)
# Of a running mean over so many cells, as tried.
_STRAIGHTENED = (5, 11, 17)


@dataclass(frozen=True)
class FreeDrive:
    """A drive that has room.

    Attributes:
        waypoints: (N, 2) [m].
        path: (M, 2) that a car follows [m].
    """

    waypoints: np.ndarray
    path: np.ndarray

    @property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


class _Graph:
    """Cells with room, each linked to the eight beside it."""

    def __init__(self, space: FreeSpace):
        wide = space.clearance >= space.least
        self.row, self.column = np.nonzero(wide)
        self.xy = space.middle(self.row, self.column)
        number = np.full(wide.shape, -1)
        number[wide] = np.arange(len(self.row))
        clearance = space.clearance[wide]
        # The nearer a wall, the dearer, up to four times.
        price = 1.0 + (1.0 - np.minimum(clearance / _COMFORT, 1.0)) * 3.0
        starts, ends = [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            a = number[: wide.shape[0] - down]
            b = number[down:]
            if right > 0:
                a, b = a[:, :-1], b[:, 1:]
            elif right < 0:
                a, b = a[:, 1:], b[:, :-1]
            linked = (a >= 0) & (b >= 0)
            starts.append(a[linked])
            ends.append(b[linked])
        start, end = np.concatenate(starts), np.concatenate(ends)
        length = np.linalg.norm(self.xy[start] - self.xy[end], axis=1)
        cost = length * (price[start] + price[end]) / 2.0
        size = len(self.row)
        self.links = coo_array((cost, (start, end)), (size, size)).tocsr()

    def without(self, closed: np.ndarray) -> coo_array:
        """Returns the links between cells that are not closed (N,) bool."""
        links = self.links.tocoo()
        open_ = ~closed[links.row] & ~closed[links.col]
        return coo_array(
            (links.data[open_], (links.row[open_], links.col[open_])),
            links.shape,
        ).tocsr()

    def farthest(self, links: coo_array, start: int) -> np.ndarray:
        """Returns the cells from a start to the farthest that it reaches."""
        cost, before = dijkstra(
            links, directed=False, indices=start, return_predecessors=True
        )
        at = int(np.where(np.isfinite(cost), cost, -1.0).argmax())
        cells = [at]
        while at != start:
            at = int(before[at])
            cells.append(at)
        return np.array(cells[::-1])


def find_drives(space: FreeSpace) -> list[FreeDrive]:
    """Returns two drives, or one, or none, as there is room.

    The first is about the longest of the shortest paths: it meets no place
    twice. The second shares its middle, and begins and ends elsewhere.
    """
    graph = _Graph(space)
    if len(graph.row) == 0:
        return []
    _, part = connected_components(graph.links, directed=False)
    start = int((part == np.bincount(part).argmax()).argmax())
    end = int(graph.farthest(graph.links, start)[-1])
    cells = _shortened(graph, graph.farthest(graph.links, end))
    first = make_drive(graph.xy[cells], space)
    if first is None:
        return []
    for candidate in _seconds(graph, cells):
        second = make_drive(graph.xy[candidate], space)
        if second is not None:
            return [first, second]
    return [first]


def _travelled(xy: np.ndarray) -> np.ndarray:
    steps = np.linalg.norm(np.diff(xy, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _shortened(graph: _Graph, cells: np.ndarray) -> np.ndarray:
    return cells[_travelled(graph.xy[cells]) <= LONGEST]


def _seconds(graph: _Graph, cells: np.ndarray) -> Iterator[np.ndarray]:
    """Yields paths that share a part of a drive, best first."""
    along = _travelled(graph.xy[cells])
    first, last = np.searchsorted(along, np.array(_SHARED) * along[-1])
    shared = np.arange(first, last + 1)
    half, step = len(shared) // 2, max(1, int(_APART / CELL))
    # Where it leaves the first drive, a street must lead away.
    nothing = np.zeros(0, dtype=int)
    for k in (*shared[:half:step], None):
        head = nothing if k is None else _away(graph, cells, k, nothing)
        if head is None:
            continue
        for m in (*shared[: half - 1 : -step], None):
            tail = nothing if m is None else _away(graph, cells, m, head)
            if tail is None or (k is None and m is None):
                continue
            begin = first if k is None else k
            end = last if m is None else m
            if along[end] - along[begin] < LEAST_SHARED * along[-1]:
                continue
            parts = [head[:0:-1], cells[begin : end + 1], tail[1:]]
            yield _shortened(graph, np.concatenate(parts))


def _away(
    graph: _Graph, cells: np.ndarray, k: int, taken: np.ndarray
) -> np.ndarray | None:
    """Returns a path that leaves a drive at one of its cells, or None."""
    driven = graph.xy[np.concatenate([cells, taken])]
    from_drive, _ = cKDTree(driven).query(graph.xy, distance_upper_bound=_APART)
    here = np.linalg.norm(graph.xy - graph.xy[cells[k]], axis=1)
    closed = np.isfinite(from_drive) & (here > 1.5 * _APART)
    path = graph.farthest(graph.without(closed), int(cells[k]))
    length = _travelled(graph.xy[path])[-1]
    if length < SHORTEST_ARM:
        return None
    return path[_travelled(graph.xy[path]) <= LONGEST / 3]


def make_drive(
    xy: np.ndarray,
    space: FreeSpace,
    tolerances: Sequence[float] = _SIMPLIFICATIONS,
) -> FreeDrive | None:
    """Returns a drive with as few waypoints as there is room, or None.

    Args:
        xy: (N, 2) places that it is to pass, about 1 m apart [m].
        space: where a car has room.
        tolerances: by how much its waypoints may leave them, as tried [m].
    """
    for straightened, tolerance in product(_STRAIGHTENED, tolerances):
        if len(xy) < 4 * straightened:
            return None
        kernel = np.ones(straightened) / straightened
        smooth = np.column_stack(
            [np.convolve(column, kernel, mode="valid") for column in xy.T]
        )
        line = LineString(smooth).simplify(tolerance)
        waypoints = _densified(np.array(line.coords))
        xyz = np.column_stack([waypoints, np.zeros(len(waypoints))])
        try:
            path = make_waypoint_path(xyz, POINT_SPACING)
        except InputError:
            continue
        bend, _ = SmoothPath(path.points, path.spacing).tightest_bend()
        points = path.points[:, :2]
        if (
            bend >= TIGHTEST_RADIUS
            and (space.clearance_at(points) >= space.least - _SLACK).all()
        ):
            drive = FreeDrive(waypoints, points)
            return drive if drive.length >= _SHORTEST else None
    return None


def _densified(corners: np.ndarray) -> np.ndarray:
    """Returns waypoints with others between those that lie far apart."""
    points = [corners[:1]]
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        number = int((length - _WAYPOINT_SPACING) // _WAYPOINT_SPACING)
        if number > 0:
            # None near the corners, whose arcs need room.
            parts = np.linspace(0.0, 1.0, number + 2)[1:-1]
            points.append(a + parts[:, None] * (b - a))
        points.append(b[None])
    return np.concatenate(points)
