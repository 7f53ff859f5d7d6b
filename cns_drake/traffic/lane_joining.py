"""Makes a lane graph for traffic from the lanes of an imported map."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.traffic import lane_graph
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.polylines import SPACING, length_of, resampled

# A lane must have room for any vehicle. A shorter lane is part of the ways that
# lead over it [m].
_SHORTEST_LANE = 14.0
# Distance from a stop line to the end of its lane, in steps of `SPACING`.
_STOP_STEPS = 2
# Greatest number of short lanes in a way.
_MOST_SHORT = 8


class DirectedLane(NamedTuple):
    """A lane of a map, in its driving direction.

    Attributes:
        points: (N, 3) points along the middle of the lane [m].
        limit: speed limit [m/s].
        connects: whether the lane is in a junction, where it connects two
            lanes.
    """

    points: np.ndarray
    limit: float
    connects: bool


def join_lanes(
    lanes: Sequence[DirectedLane],
    links: Iterable[tuple[int, int]],
    right_of: Mapping[int, int] | None = None,
) -> LaneGraph:
    """Returns the lane graph of a map's lanes, cut into pieces for traffic.

    The graph has no signals and no crossings. The graph is empty if all lanes
    lead to dead ends.

    Args:
        lanes: the lanes, numbered from 0.
        links: pairs of lane numbers; the second lane follows the first.
        right_of: number of a lane -> number of the next lane on its right with
            the same direction. None if vehicles do not change lanes.
    """
    merged, after, beside = _merged_lanes(lanes, links, right_of or {})
    points = [resampled(lane.points) for lane in merged]
    long = [
        k
        for k, lane in enumerate(merged)
        if not lane.connects and SPACING * len(points[k]) >= _SHORTEST_LANE
    ]
    number = {k: row for row, k in enumerate(long)}
    left_of = {right: left for left, right in beside.items()}
    # Places in the same junction, as trees: place -> its parent.
    parents: dict[tuple[int, str], tuple[int, str]] = {}

    def cluster(place: tuple[int, str]) -> tuple[int, str]:
        while (parent := parents.get(place, place)) != place:
            place = parent
        return place

    ways = []
    for k in long:
        for short, last in _ways(k, after, set(long)):
            tail = points[k][-_STOP_STEPS - 1 :]
            head = points[last][: _STOP_STEPS + 1]
            between = (points[one] for one in short)
            line = np.concatenate([tail, *between, head])
            limit = min(merged[one].limit for one in (k, *short, last))
            ways.append((k, last, line, limit))
            for place in ((last, "start"), *((one, "whole") for one in short)):
                parents[cluster(place)] = cluster((k, "end"))
    keys = dict.fromkeys(cluster((k, "end")) for k in long)
    junctions = {key: row for row, key in enumerate(keys)}
    pieces = [
        Piece(
            points[k][_STOP_STEPS:-_STOP_STEPS],
            merged[k].limit,
            False,
            after=tuple(
                len(long) + row for row, way in enumerate(ways) if way[0] == k
            ),
            left=number.get(left_of.get(k, -1), -1),
            right=number.get(beside.get(k, -1), -1),
            junction=junctions[cluster((k, "end"))],
        )
        for k in long
    ]
    pieces += [
        Piece(
            resampled(line),
            limit,
            True,
            (number[last],),
            junction=junctions[cluster((k, "end"))],
        )
        for k, last, line, limit in ways
    ]
    return LaneGraph(tuple(lane_graph.without_dead_ends(pieces)))


def usual_limit(limits: ArrayLike, lengths: ArrayLike) -> float:
    """Returns the median of limits (N,), weighted with their lengths (N,)."""
    order = np.argsort(limits)
    reached = np.cumsum(np.asarray(lengths)[order])
    middle = np.searchsorted(reached, reached[-1] / 2.0)
    return float(np.asarray(limits)[order][middle])


def _merged_lanes(
    lanes: Sequence[DirectedLane],
    links: Iterable[tuple[int, int]],
    right_of: Mapping[int, int],
) -> tuple[list[DirectedLane], list[list[int]], dict[int, int]]:
    """Returns joined lanes, their successors, and the lanes on their right."""
    after: list[list[int]] = [[] for _ in lanes]
    before: list[list[int]] = [[] for _ in lanes]
    for first, second in links:
        after[first].append(second)
        before[second].append(first)

    def goes_on(k: int) -> bool:
        if len(after[k]) != 1:
            return False
        (other,) = after[k]
        connects = lanes[k].connects or lanes[other].connects
        return len(before[other]) == 1 and other != k and not connects

    chains: list[list[int]] = []
    placed: set[int] = set()
    heads = [
        k
        for k in range(len(lanes))
        if len(before[k]) != 1 or not goes_on(before[k][0])
    ]
    # After the heads, only rings are left, which may begin anywhere.
    for head in (*heads, *range(len(lanes))):
        if head in placed:
            continue
        chain = [head]
        placed.add(head)
        while goes_on(chain[-1]) and after[chain[-1]][0] not in placed:
            chain.append(after[chain[-1]][0])
            placed.add(chain[-1])
        chains.append(chain)
    number = {chain[0]: row for row, chain in enumerate(chains)}
    merged = [
        DirectedLane(
            np.concatenate([lanes[k].points for k in chain]),
            usual_limit(
                [lanes[k].limit for k in chain],
                [length_of(lanes[k].points) for k in chain],
            ),
            lanes[chain[0]].connects,
        )
        for chain in chains
    ]
    following = [
        [number[k] for k in after[chain[-1]] if k in number] for chain in chains
    ]
    beside = {
        row: number[right]
        for row, chain in enumerate(chains)
        if (right := right_of.get(chain[0], -1)) in number
        and right_of.get(chain[-1], -1) == chains[number[right]][-1]
    }
    return merged, following, beside


def _ways(
    first: int, after: Sequence[Sequence[int]], long: set[int]
) -> Iterator[tuple[tuple[int, ...], int]]:
    """Yields the short lanes after a lane, and the long lane after them.

    Each long lane is reached in one way: the first of the ways with the fewest
    short lanes.
    """
    waiting: list[tuple[int, ...]] = [()]
    reached: set[int] = set()
    while waiting:
        short = waiting.pop(0)
        for k in after[short[-1] if short else first]:
            if k in reached:
                continue
            reached.add(k)
            if k in long:
                yield short, k
            elif len(short) < _MOST_SHORT:
                waiting.append((*short, k))
