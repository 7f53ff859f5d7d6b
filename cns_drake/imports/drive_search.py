"""Two drives through a city, which overlap in part.

The first drive is about the longest of the shortest ways. The second one shares
its middle, and leaves it by an arm at either end. A `WayGraph` defines the
pieces of a way: cells between buildings, or lanes of streets.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from cns_drake.imports.waypoint_drives import (
    LONGEST,
    SHORTEST,
    Obstacle,
    WaypointDrive,
)

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


class WayGraph(ABC):
    """Pieces of way, each with its successors.

    Attributes:
        lengths: (N,) of the pieces [m].
    """

    def __init__(
        self,
        lengths: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        costs: np.ndarray | None = None,
    ):
        """Makes the graph.

        Args:
            lengths: (N,) of the pieces [m].
            before, after: (L,) numbers of pieces; `before` leads into `after`.
            costs: (L,) from middle to middle; the length if None [m].
        """
        self.lengths = lengths
        if costs is None:
            costs = (lengths[before] + lengths[after]) / 2.0
        self._links = (before, after, costs)
        self._is_open = np.ones(len(lengths), dtype=bool)

    @abstractmethod
    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        """Returns (N,) bool: the pieces that an arm must not use.

        Args:
            pieces: the pieces in use by drives.
            joint: the piece among them where the arm begins.
        """

    @abstractmethod
    def is_simple(self, way: Sequence[int]) -> bool:
        """Returns whether a way meets no place twice."""

    @abstractmethod
    def drive(self, way: Sequence[int]) -> WaypointDrive | Obstacle:
        """Returns a drive along a way, or the obstacle on it."""

    @abstractmethod
    def blocked(self, way: Sequence[int], place: np.ndarray) -> np.ndarray:
        """Returns the pieces of a way that an obstacle at (2,) blocks."""

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
        is_open = self._is_open if closed is None else self._is_open & ~closed
        before, after, costs = self._links
        kept = is_open[before] & is_open[after]
        size = (len(self.lengths), len(self.lengths))
        pairs = (before[kept], after[kept])
        return coo_array((costs[kept], pairs), size).tocsr()

    def close(self, pieces: np.ndarray) -> None:
        """Removes pieces that no car can drive along."""
        self._is_open[pieces] = False

    def open_pieces(self) -> np.ndarray:
        """Returns the numbers of the pieces that are not closed."""
        return np.flatnonzero(self._is_open)


def find_drives(graph: WayGraph) -> list[WaypointDrive]:
    """Returns two drives that share a part, or one, or none."""
    for _ in range(_MOST_TRIES):
        way = _longest(graph)
        if graph.length(way) < SHORTEST:
            return []
        first = graph.drive(way)
        if isinstance(first, WaypointDrive):
            break
        graph.close(graph.blocked(way, first.place))
    else:
        return []
    for candidate in islice(_seconds(graph, way), _MOST_TRIES):
        second = graph.drive(candidate)
        if isinstance(second, WaypointDrive):
            return [first, second]
    return [first]


def _longest(graph: WayGraph) -> list[int]:
    """Returns about the longest of the shortest ways, [] if there is none."""
    pieces = graph.open_pieces()
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

    Args:
        graph: of all pieces.
        links: of the usable pieces; transposed links give the way to the piece,
            in reverse order.
        start: the piece.
        longest: greatest length of the returned way [m].
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
            start = begin if begin is not None else _nearest(part[:-1], low)
            head: list[int] = []
            if begin is not None:
                head = _arm(graph, first, first[begin], backwards=True)
                if not head:
                    continue
            for end in (*_some(ends, along), None):
                stop = end if end is not None else _nearest(part[1:], high)
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
    """Returns the longest way from a piece, or to it.

    Args:
        graph: of all pieces.
        used: pieces of the drives.
        joint: the piece among them where the way begins.
        backwards: whether it ends there instead.

    Returns:
        The way from the joint on, backwards if it ends there; empty if it is
        too short.
    """
    links = graph.links(graph.beside(np.array(used), joint))
    if backwards:
        links = links.T.tocsr()
    way = _farthest(graph, links, joint, _LONGEST_ARM)
    return way if graph.length(way[1:]) >= _SHORTEST_ARM else []
