"""Streets as lanes of one direction, and their connections."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

# Sharpest turn from one street into another.
SHARPEST_TURN_DEG = 125.0


@dataclass(frozen=True)
class Street:
    """A street of a map; cars drive along its line, against it, or both.

    Attributes:
        line: (N, 2) its middle [m].
        nodes: number of each place; streets with a common number meet there.
        forward, backward: whether it is driven along its line, and against.
        aside: from its middle to that of the outermost lane [m].
        width: of its carriageway; 0 if unknown [m].
        name: of its element in the file.
        tags: its tags in the file.
    """

    line: np.ndarray
    nodes: tuple[int, ...]
    forward: bool
    backward: bool
    aside: float
    width: float = 0.0
    name: str = ""
    tags: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Lane:
    """A lane from one junction to the next.

    Attributes:
        line: (N, 2) the middle of its street, in driving direction [m].
        begin, end: numbers of the junctions.
        aside: offset of the lane to the right of that line [m].
        way: number of the piece of street; its other lane has the same one.
    """

    line: np.ndarray
    begin: int
    end: int
    aside: float
    way: int

    @property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.line, axis=0), axis=1).sum())


def make_lanes(streets: Sequence[Street]) -> list[Lane]:
    """Returns the lanes of streets that meet."""
    uses: defaultdict[int, int] = defaultdict(int)
    for street in streets:
        for node in street.nodes:
            uses[node] += 1
    lanes: list[Lane] = []
    way = 0
    for street in streets:
        last = len(street.nodes) - 1
        cuts = [
            k
            for k, node in enumerate(street.nodes)
            if k in (0, last) or uses[node] > 1
        ]
        for first, after in pairwise(cuts):
            line = street.line[first : after + 1]
            begin, end = street.nodes[first], street.nodes[after]
            way += 1
            if street.forward:
                lanes.append(Lane(line, begin, end, street.aside, way))
            if street.backward:
                lanes.append(Lane(line[::-1], end, begin, street.aside, way))
    return [lane for lane in lanes if lane.length > 0.0]


def lane_links(lanes: Sequence[Lane]) -> tuple[np.ndarray, np.ndarray]:
    """Returns pairs of lane numbers; the first lane leads into the second."""
    starts: defaultdict[int, list[int]] = defaultdict(list)
    for number, lane in enumerate(lanes):
        starts[lane.begin].append(number)
    pairs = [
        (number, after)
        for number, lane in enumerate(lanes)
        for after in starts[lane.end]
        if _leads_on(lane, lanes[after])
    ]
    before, after = np.array(pairs, dtype=int).reshape(-1, 2).T
    return before, after


def _leads_on(lane: Lane, after: Lane) -> bool:
    if lane.way == after.way:
        return False
    a, b = lane.line[-1] - lane.line[-2], after.line[1] - after.line[0]
    cross, dot = a[0] * b[1] - a[1] * b[0], a @ b
    return bool(abs(np.degrees(np.arctan2(cross, dot))) <= SHARPEST_TURN_DEG)


def lane_path(lanes: Sequence[Lane], spacing: float) -> np.ndarray:
    """Returns a line along lanes: x, y and lateral offset (N, 3) [m].

    Args:
        lanes: each leads into the next.
        spacing: about the distance of the points [m].
    """
    rows = list(_rows(lanes, spacing))
    kept = [rows[0]] + [
        row
        for before, row in pairwise(rows)
        if np.hypot(row[0] - before[0], row[1] - before[1]) > 1e-6
    ]
    return np.array(kept)


def _rows(
    lanes: Sequence[Lane], spacing: float
) -> Iterator[tuple[float, float, float]]:
    for lane in lanes:
        steps = np.linalg.norm(np.diff(lane.line, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        count = max(2, round(along[-1] / spacing) + 1)
        wanted = np.linspace(0.0, along[-1], count)
        x, y = (np.interp(wanted, along, axis) for axis in lane.line.T)
        yield from zip(x, y, np.full(count, lane.aside), strict=True)
