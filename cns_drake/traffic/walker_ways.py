"""Walkers on walkways: where they are, and where they go next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.counted_random import uniform
from cns_drake.traffic.right_of_way import WALK_GROUP, Permits

# Walkers that cross, for each one that goes straight on, if both are possible.
_CROSSES = 0.25


class WalkwayArrays(NamedTuple):
    """W walkways, and N places where they begin and end.

    Attributes:
        first, num_points: (W,) rows of a walkway in `points`, and their number.
        points: (M, 3) [m].
        half_width: (W,) [m].
        start, end: (W,) places.
        crossing: (W,) number of the crossing, -1 for none.
        node_first, node_count: (N,) rows in `node_ways`, and their number.
        node_ways: walkways that begin or end in a place.
    """

    first: np.ndarray
    num_points: np.ndarray
    points: np.ndarray
    half_width: np.ndarray
    start: np.ndarray
    end: np.ndarray
    crossing: np.ndarray
    node_first: np.ndarray
    node_count: np.ndarray
    node_ways: np.ndarray


class Walkers(NamedTuple):
    """N walkers.

    Attributes:
        xy, velocity: (N, 2) [m, m/s].
        yaw: of their heading [rad].
        phase: of their gait [rad].
        way: their walkway.
        forward: whether they go from its start to its end.
        at: row of the walkway's points that they have reached, from its start.
        speed: wanted [m/s].
        aside: offset to the right of the middle, as a part of the half width.
        next_way: the next walkway, -1 if not drawn yet.
        stuck: time for which they have been blocked [s].
        draws: number of random numbers that each has drawn.
    """

    xy: np.ndarray
    velocity: np.ndarray
    yaw: np.ndarray
    phase: np.ndarray
    way: np.ndarray
    forward: np.ndarray
    at: np.ndarray
    speed: np.ndarray
    aside: np.ndarray
    next_way: np.ndarray
    stuck: np.ndarray
    draws: np.ndarray


@compiled
def row_of(ways: WalkwayArrays, way: int, forward: bool, at: int) -> int:
    """Returns the row of a point that is counted in walking direction."""
    at = min(max(at, 0), ways.num_points[way] - 1)
    return ways.first[way] + (at if forward else ways.num_points[way] - 1 - at)


@compiled
def tangent_of(
    ways: WalkwayArrays, way: int, forward: bool, at: int
) -> tuple[float, float]:
    """Returns the unit vector along a walkway in walking direction."""
    at = min(max(at, 0), ways.num_points[way] - 2)
    a = row_of(ways, way, forward, at)
    b = a + 1 if forward else a - 1
    x = ways.points[b, 0] - ways.points[a, 0]
    y = ways.points[b, 1] - ways.points[a, 1]
    length = np.sqrt(x * x + y * y)
    return x / length, y / length


@compiled
def distance_along(
    ways: WalkwayArrays,
    row: int,
    walkers: Walkers,
    i: int,
    direction: tuple[float, float],
) -> float:
    """Returns how far a walkway's point is ahead of a walker [m]."""
    x = ways.points[row, 0] - walkers.xy[i, 0]
    y = ways.points[row, 1] - walkers.xy[i, 1]
    return x * direction[0] + y * direction[1]


@compiled
def draw_next(ways: WalkwayArrays, walkers: Walkers, i: int, seed: int) -> None:
    """Draws the next walkway; the same one back only if there is no other."""
    way = walkers.way[i]
    node = ways.end[way] if walkers.forward[i] else ways.start[way]
    first, count = ways.node_first[node], ways.node_count[node]
    if count == 1:
        walkers.next_way[i] = way
        return
    walkers.draws[i] += 1
    total = 0.0
    for k in range(count):
        total += _liking(ways, ways.node_ways[first + k], way)
    pick = uniform(seed, i, walkers.draws[i]) * total
    for k in range(count):
        other = ways.node_ways[first + k]
        pick -= _liking(ways, other, way)
        if pick < 0.0:
            break
    walkers.next_way[i] = other


@compiled
def _liking(ways: WalkwayArrays, way: int, last: int) -> float:
    """Returns the weight of a way: few walkers cross, none goes back."""
    if way == last:
        return 0.0
    return 1.0 if ways.crossing[way] < 0 else _CROSSES


@compiled
def may_begin(
    ways: WalkwayArrays,
    permits: Permits,
    waited: np.ndarray,
    num_pieces: int,
    way: int,
    t: float,
) -> bool:
    """Returns whether a walker may begin a walkway, or has to wait."""
    c = ways.crossing[way]
    if c < 0:
        return True
    if permits.small[num_pieces + c] > 0:
        return t < permits.opened[c] + WALK_GROUP
    permits.waits[c] = min(permits.waits[c], t)
    waited[c] = True
    return False


@compiled
def height_of(ways: WalkwayArrays, walkers: Walkers, i: int) -> float:
    """Returns the height of the walkway at a walker [m]."""
    way, forward, at = walkers.way[i], walkers.forward[i], walkers.at[i]
    at = min(at, ways.num_points[way] - 2)
    a = row_of(ways, way, forward, at)
    b = a + 1 if forward else a - 1
    x = ways.points[b, 0] - ways.points[a, 0]
    y = ways.points[b, 1] - ways.points[a, 1]
    share = -distance_along(ways, a, walkers, i, (x, y)) / (x * x + y * y)
    low, high = ways.points[a, 2], ways.points[b, 2]
    return low + min(max(share, 0.0), 1.0) * (high - low)


@compiled
def begin(
    ways: WalkwayArrays,
    walkers: Walkers,
    permits: Permits,
    num_pieces: int,
    i: int,
    t: float,
) -> None:
    """Lets a walker begin its next walkway."""
    way, after = walkers.way[i], walkers.next_way[i]
    node = ways.end[way] if walkers.forward[i] else ways.start[way]
    for other, change in ((way, -1), (after, 1)):
        c = ways.crossing[other]
        if c >= 0:
            permits.small[num_pieces + c] += change
            permits.closed[c] = t
    is_back = way == after
    walkers.forward[i] = (
        not walkers.forward[i] if is_back else ways.start[after] == node
    )
    walkers.way[i] = after
    walkers.at[i] = 0
    walkers.next_way[i] = -1
