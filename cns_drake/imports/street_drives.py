"""Two drives along streets, in their lanes, which overlap in part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cns_drake.imports.drive_search import (
    LEAST_SHARED,
    LONGEST,
    SHORTEST_ARM,
    FreeDrive,
    make_drive,
)
from cns_drake.imports.free_space import FreeSpace
from cns_drake.imports.import_report import DriveOn
from cns_drake.imports.street_lanes import (
    LaneGraph,
    Street,
    lane_path,
    make_lanes,
)

_SPACING = 1.0
# Of so many lanes at most, spread evenly, the farthest ends are looked for.
_MOST_STARTS = 200
# How much of what they are aside cars keep where they turn: some streets are
# so narrow, and corners so sharp, that they have to swing out.
_AT_TURNS = (1.0, 0.6, 0.2)
# A turn begins and ends so far from its sharpest place [m].
_TURN = 12.0
_SHARP_DEG_PER_M = 4.0
# By how much waypoints may leave the lanes, as tried [m].
_TOLERANCES = (0.2, 0.4, 0.8, 1.2)
# Means over so many metres make corners round, and what cars are aside.
_ROUND, _SMOOTH_ASIDE = 7, 15


def find_street_drives(
    streets: Sequence[Street], space: FreeSpace, drive_on: DriveOn
) -> list[FreeDrive]:
    """Returns two drives, or one, or none, as the streets allow.

    One-way streets are driven as they are to be, and all others in the
    outermost lane. The first drive is about the longest of the shortest ways;
    the second shares its middle, and begins and ends elsewhere.

    Args:
        streets: that meet where they have a node in common.
        space: where a car has room.
        drive_on: the side.
    """
    # A street with a place on another continent, by mistake, never ends.
    lanes = [one for one in make_lanes(streets) if one.length <= LONGEST]
    if not lanes:
        return []
    graph = LaneGraph(lanes)
    side = 1.0 if drive_on is DriveOn.RIGHT else -1.0
    for first in _firsts(graph):
        drive = _drive(graph, first, space, side)
        if drive is None:
            continue
        for candidate in _seconds(graph, first):
            second = _drive(graph, candidate, space, side)
            if second is not None:
                return [drive, second]
        return [drive]
    return []


def _drive(
    graph: LaneGraph, numbers: Sequence[int], space: FreeSpace, side: float
) -> FreeDrive | None:
    rows = lane_path([graph.lanes[k] for k in numbers], _SPACING)
    middle = uniform_filter1d(rows[:, :2], _ROUND, axis=0, mode="nearest")
    along = np.gradient(middle, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    bends = np.abs(np.gradient(heading)) > np.radians(_SHARP_DEG_PER_M)
    reach = int(_TURN / _SPACING)
    near = np.convolve(bends, np.ones(2 * reach + 1), mode="same") > 0
    right = np.column_stack([along[:, 1], -along[:, 0]]) * side
    for tolerance, share in product(_TOLERANCES, _AT_TURNS):
        aside = rows[:, 2] * np.where(near, share, 1.0)
        aside = uniform_filter1d(aside, _SMOOTH_ASIDE, mode="nearest")
        way = middle + aside[:, None] * right
        drive = make_drive(way, space, (tolerance,))
        if drive is not None:
            return drive
    return None


def _firsts(graph: LaneGraph) -> Iterator[list[int]]:
    """Yields ways that meet no junction twice, the longest first."""
    links = graph.links()
    step = max(1, len(graph.lanes) // _MOST_STARTS)
    found = []
    for start in range(0, len(graph.lanes), step):
        cost, before = dijkstra(
            links, indices=start, return_predecessors=True, limit=LONGEST
        )
        for end in np.argsort(-np.where(np.isfinite(cost), cost, -1.0))[:5]:
            if np.isfinite(cost[end]):
                numbers = _trace(before, start, int(end))
                length = float(graph.length[numbers].sum())
                found.append((-length, numbers))
    for _, numbers in sorted(found):
        if _is_simple(graph, numbers):
            yield numbers


def _seconds(graph: LaneGraph, first: list[int]) -> Iterator[list[int]]:
    """Yields ways that share a part of a first one, and leave the rest."""
    total = graph.length[first].sum()
    along = np.concatenate([[0.0], np.cumsum(graph.length[first])])
    ways = {graph.lanes[k].way for k in first}
    twins = [k for k, lane in enumerate(graph.lanes) if lane.way in ways]
    count = len(first)
    parts = [
        (a, b)
        for a in range(count)
        for b in range(a + 1, count + 1)
        if (b - a) < count and along[b] - along[a] >= LEAST_SHARED * total
    ]
    # About half of the first is best.
    parts.sort(key=lambda p: (abs(along[p[1]] - along[p[0]] - total / 2), p))
    for a, b in parts:
        closed = [k for k in twins if k not in (first[a], first[b - 1])]
        head = [] if a == 0 else _arm(graph, first[a], closed, True)
        tail = [] if b == count else _arm(graph, first[b - 1], closed, False)
        if head is None or tail is None:
            continue
        numbers = [*head, *first[a:b], *tail]
        if _is_simple(graph, numbers):
            yield numbers


def _arm(
    graph: LaneGraph, lane: int, closed: Sequence[int], into: bool
) -> list[int] | None:
    """Returns the longest way into a lane, or out of it, or None."""
    links: csr_array = graph.links(closed)
    if into:
        links = links.T.tocsr()
    cost, before = dijkstra(
        links, indices=lane, return_predecessors=True, limit=LONGEST / 3
    )
    end = int(np.where(np.isfinite(cost), cost, -1.0).argmax())
    numbers = _trace(before, lane, end)[1:]
    if graph.length[numbers].sum() < SHORTEST_ARM:
        return None
    return numbers[::-1] if into else numbers


def _trace(before: np.ndarray, start: int, end: int) -> list[int]:
    numbers = [end]
    while numbers[-1] != start:
        numbers.append(int(before[numbers[-1]]))
    return numbers[::-1]


def _is_simple(graph: LaneGraph, numbers: Sequence[int]) -> bool:
    lanes = [graph.lanes[k] for k in numbers]
    passed = [lane.begin for lane in lanes] + [lanes[-1].end]
    return len(set(passed)) == len(passed)
