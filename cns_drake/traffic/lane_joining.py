"""Makes a lane graph for traffic from the lanes of an imported map."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.base import length_of
from cns_drake.traffic import lane_graph
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.polylines import SPACING, resampled

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
    ways = [way for k in long for way in _ways_from(k, after, set(long))]
    number = {k: row for row, k in enumerate(long)}
    left_of = {right: left for left, right in beside.items()}
    junction_after = _junctions(long, ways)
    pieces = [
        Piece(
            points[k][_STOP_STEPS:-_STOP_STEPS],
            merged[k].limit,
            False,
            after=tuple(
                len(long) + row for row, way in enumerate(ways) if way.lane == k
            ),
            left=number.get(left_of.get(k, -1), -1),
            right=number.get(beside.get(k, -1), -1),
            junction=junction_after[k],
        )
        for k in long
    ]
    pieces += [
        Piece(
            resampled(way.line(points)),
            min(merged[k].limit for k in (way.lane, *way.short, way.next_lane)),
            True,
            (number[way.next_lane],),
            junction=junction_after[way.lane],
        )
        for way in ways
    ]
    return LaneGraph(tuple(lane_graph.without_dead_ends(pieces)))


class _Way(NamedTuple):
    """A path from one long lane to the next, by the numbers of the lanes.

    Attributes:
        lane: the lane from which the way leads.
        short: the short lanes of the way.
        next_lane: the lane to which the way leads.
    """

    lane: int
    short: tuple[int, ...]
    next_lane: int

    def line(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Returns the line (N, 3) from the stop line to the next lane [m].

        Args:
            points: (M, 3) points of each lane.
        """
        tail = points[self.lane][-_STOP_STEPS - 1 :]
        head = points[self.next_lane][: _STOP_STEPS + 1]
        return np.concatenate([tail, *(points[k] for k in self.short), head])


def _junctions(long: Sequence[int], ways: Iterable[_Way]) -> dict[int, int]:
    """Returns the number of the junction at the end of each long lane.

    Ways that share a short lane, the lane from which they lead, or the lane to
    which they lead, are in the same junction.
    """
    # Places in the same junction, as trees: place -> its parent.
    parents: dict[tuple[int, str], tuple[int, str]] = {}

    def root(place: tuple[int, str]) -> tuple[int, str]:
        """Returns the place that stands for the junction of a place."""
        while (parent := parents.get(place, place)) != place:
            place = parent
        return place

    for way in ways:
        whole = ((k, "whole") for k in way.short)
        for place in ((way.next_lane, "start"), *whole):
            parents[root(place)] = root((way.lane, "end"))
    roots = {k: root((k, "end")) for k in long}
    number = {key: row for row, key in enumerate(dict.fromkeys(roots.values()))}
    return {k: number[key] for k, key in roots.items()}


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
    """Joins lanes of which each leads only to the next.

    Args:
        lanes: the lanes.
        links: pairs of lane numbers; the second lane follows the first.
        right_of: number of a lane -> number of the next lane on its right.

    Returns:
        The joined lanes; the numbers of the lanes that follow each; and number
        of a joined lane -> number of the one on its right.
    """
    after: list[list[int]] = [[] for _ in lanes]
    before: list[list[int]] = [[] for _ in lanes]
    for first, second in links:
        after[first].append(second)
        before[second].append(first)

    chains = _chains(lanes, after, before)
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


def _ways_from(
    lane: int, after: Sequence[Sequence[int]], long: set[int]
) -> Iterator[_Way]:
    """Yields the ways from a long lane.

    Each long lane is reached in one way: the first of the ways with the fewest
    short lanes.
    """
    waiting: list[tuple[int, ...]] = [()]
    reached: set[int] = set()
    while waiting:
        short = waiting.pop(0)
        for k in after[short[-1] if short else lane]:
            if k in reached:
                continue
            reached.add(k)
            if k in long:
                yield _Way(lane, short, k)
            elif len(short) < _MOST_SHORT:
                waiting.append((*short, k))


def _chains(
    lanes: Sequence[DirectedLane],
    after: Sequence[Sequence[int]],
    before: Sequence[Sequence[int]],
) -> list[list[int]]:
    """Returns chains of lanes of which each leads only to the next.

    Each lane is in one chain. Lanes that connect others stay by themselves.

    Args:
        lanes: the lanes.
        after: the lanes that follow each lane.
        before: the lanes that lead to each lane.
    """

    def goes_on(k: int) -> bool:
        """Returns whether a lane and the next one are in one chain."""
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
    return chains
