"""Searches two drives through a city that share a part of their paths.

The first drive is approximately the longest of the shortest paths between any
two places, of the few longest the first one that has a second drive. This
shares the middle part of the first drive, but has a beginning and an end of its
own, which are called arms. A path is a sequence of pieces, such as lanes of
streets or cells of free space. A `WayGraph` says which piece can follow which
piece; a sequence of pieces in this graph is called a way.
"""

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from worlds.imports.drives.steerable_drives import SHORTEST, WaypointRoute
from worlds.imports.drives.way_graph import WayGraph

# Greatest length of a proposed drive [m].
LONGEST = 1500.0
# Least length of the second drive's own arms [m].
_SHORTEST_ARM = 40.0
# Greatest length of the second drive's own arms [m].
_LONGEST_ARM = LONGEST / 3
# Least share of the first drive's length that both drives have in common.
_LEAST_SHARED = 0.15
# Greatest number of places at which joining is tried, and also leaving.
_MOST_PLACES = 12
# Least distance between two of these places [m].
_APART = 10.0
# Greatest number of ways that are tried as first drive, and as second drive.
_MOST_TRIES = 30
# Greatest number of first drives for which a second drive is searched.
_MOST_FIRST = 4
# Greatest number of ends that are tried to find a way that passes no place
# twice.
_MOST_ENDS = 20
# Greatest number of pieces from which ways are searched.
_MOST_STARTS = 200
# In large graphs, ways are searched from fewer pieces, so that this number of
# pieces is reached at most.
_MOST_REACHED = 400_000


# The second drive joins the first one between low and middle, and leaves it
# between 1 - middle and high: shares of the first drive's length in two trials.
_TRIALS = ((0.25, 0.5, 0.75), (0.0, 0.7, 1.0))


def find_drives(graph: WayGraph) -> list[WaypointRoute]:
    """Returns two drives that share a part of their paths, if there are any.

    If no second drive is found, the list has one drive; if no drive is found,
    the list is empty.
    """
    for _ in range(_MOST_TRIES):
        ways = _long_ways(graph)
        if not ways or graph.length(ways[0]) < SHORTEST:
            return []
        first = graph.drive(ways[0])
        if isinstance(first, WaypointRoute):
            break
        graph.is_open[graph.blocked(ways[0], first)] = False
    else:
        return []
    for way in ways[:_MOST_FIRST]:
        one = graph.drive(way)
        if isinstance(one, WaypointRoute):
            for candidate in islice(_second_ways(graph, way), _MOST_TRIES):
                second = graph.drive(candidate)
                if isinstance(second, WaypointRoute):
                    return [one, second]
    return [first]


def _long_ways(graph: WayGraph) -> list[list[int]]:
    """Returns long ways of all shortest ones, about the longest first."""
    pieces = graph.order[graph.is_open[graph.order]]
    if len(pieces) == 0:
        return []
    links = graph.links()
    _, part = connected_components(links, directed=False)
    size = np.bincount(part[pieces], graph.lengths[pieces])[part[pieces]]
    number = int(np.clip(_MOST_REACHED // len(pieces), 1, _MOST_STARTS))
    starts = [
        int((size == size.max()).argmax()),
        *range(0, len(pieces), -(-len(pieces) // number))[1:],
    ]
    into = links.T.tocsr()
    begins: dict[int, None] = {}
    for start in (int(pieces[k]) for k in starts):
        begins[start] = None
        begins[_longest_way_from(graph, into, start)[-1]] = None
    ways = [_longest_way_from(graph, links, begin) for begin in begins]
    # Micrometres are rounding errors.
    return sorted(ways, key=lambda way: -round(graph.length(way), 6))


def _longest_way_from(
    graph: WayGraph, links: csr_array, start: int, longest: float = LONGEST
) -> list[int]:
    """Returns the way from a piece to the piece that is farthest from it.

    The way is the shortest way to that piece along `links`, cut to the length
    `longest` [m]. A way that passes a place twice does not count. If the matrix
    `links` is transposed, the way leads to `start`, and is in reverse order.
    """
    cost, before = dijkstra(links, indices=start, return_predecessors=True)
    cost = np.where(np.isfinite(cost), cost + graph.lengths / 2.0, -1.0)
    most = min(_MOST_ENDS, len(cost))
    # Of equal costs, the first piece: `argpartition` takes any of them.
    ends = np.flatnonzero(cost >= np.partition(cost, -most)[-most])
    for end in ends[np.argsort(-cost[ends], kind="stable")][:most].tolist():
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
    """Yields ways that share the middle of the first way.

    In each of the `_TRIALS`, ways that join the first way early and
    leave it late come first.
    """
    along = np.concatenate([[0.0], graph.along(first)])
    part = along / along[-1]
    every = np.arange(len(first))

    def nearest(shares: np.ndarray, wanted: float) -> int:
        return int(np.abs(shares - wanted).argmin())

    for low, middle, high in _TRIALS:
        begins = every[(part[:-1] >= low) & (part[:-1] <= middle)]
        ends = every[(part[1:] >= 1.0 - middle) & (part[1:] <= high)][::-1]
        for begin in (*_spaced_places(begins, along), None):
            start = nearest(part[:-1], low) if begin is None else begin
            head: list[int] = []
            if begin is not None:
                head = _longest_arm(graph, first, first[begin], backwards=True)
                if not head:
                    continue
            for end in (*_spaced_places(ends, along), None):
                stop = nearest(part[1:], high) if end is None else end
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


def _spaced_places(places: np.ndarray, along: np.ndarray) -> list[int]:
    """Returns at most `_MOST_PLACES` of the places, `_APART` or more apart.

    A place is the index of a piece in a way. `along` contains the distance
    along the way at which each piece begins [m].
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

    With `backwards`, the way ends at the joint and is in reverse order. The
    result is empty if this way is too short.
    """
    links = graph.links(graph.beside(np.array(used), joint))
    if backwards:
        links = links.T.tocsr()
    way = _longest_way_from(graph, links, joint, _LONGEST_ARM)
    return way if graph.length(way[1:]) >= _SHORTEST_ARM else []
