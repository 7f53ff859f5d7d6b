"""Lanes of vehicles, the ways between them, crossings and walkways."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

# Distance of the points of a piece at most [m].
SPACING = 0.5
# Walkers' middles keep this distance from things beside them; that where they
# may wait and turn, on so many points at either end, is their boxes' reach [m].
_BESIDE = 0.36
_AROUND, _WAITS = 0.53, 4
# Number of places across a walkway, and least number of points along it.
_ACROSS, _ALONG = 21, 4
# Walkers step aside by this number of places from point to point.
_ASIDE = 2


@dataclass(frozen=True)
class Piece:
    """A piece of a vehicle's path: part of a lane, or a way through a junction.

    A vehicle enters a way only as a whole: it waits in the lane before it until
    all crossing ways are free.

    Attributes:
        points: (N, 3) its middle in driving direction, evenly spaced [m].
        limit: speed limit [m/s].
        is_way: whether it is a way, not a lane.
        after: numbers of the pieces that follow it.
        left, right: numbers of the lanes beside it, in the same direction;
            -1 for none.
        junction: number of the junction of a way; for a lane, of the one it
            leads to.
        phase: signal phase in which a way is green; -1 without a signal.
    """

    points: np.ndarray
    limit: float
    is_way: bool
    after: tuple[int, ...] = ()
    left: int = -1
    right: int = -1
    junction: int = -1
    phase: int = -1

    @property
    def length(self) -> float:
        steps = np.diff(self.points, axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())


@dataclass(frozen=True)
class Crossing:
    """A walkers' crossing of the lanes at one road end.

    Attributes:
        line: (2, 3) from kerb to kerb [m].
        area: where walkers are on it [m].
    """

    line: np.ndarray
    area: BaseGeometry


def make_crossing(line: np.ndarray, width: float) -> Crossing:
    """Returns a crossing of a width [m] about a line (2, 3) [m]."""
    course = LineString(line[:, :2])
    return Crossing(line, course.buffer(width / 2, cap_style="flat"))


@dataclass(frozen=True)
class Walkway:
    """A strip between two places where others begin.

    Attributes:
        points: (N, 3) its middle, evenly spaced [m].
        half_width: greatest distance of a walker from the middle [m].
        start, end: numbers of the places at its ends.
        crossing: number of the crossing that it leads over, -1 for none.
        free: (N, 2) least and greatest offset to the right that things leave
            free at each point [m]; None if that is the half width either way.
    """

    points: np.ndarray
    half_width: float
    start: int
    end: int
    crossing: int = -1
    free: np.ndarray | None = None

    @property
    def limits(self) -> np.ndarray:
        """The (N, 2) least and greatest offset to the right [m]."""
        if self.free is not None:
            return self.free
        return np.tile(
            self.half_width * np.array([-1, 1]), (len(self.points), 1)
        )


def kept_clear(
    walkways: Sequence[Walkway], things: Sequence[BaseGeometry]
) -> list[Walkway]:
    """Returns walkways that pass things, and end where these bar the way.

    Args:
        walkways: without regard to things.
        things: what stands there, seen from above [m].

    Returns:
        The rest of them; no crossing without a walkway at both ends.
    """
    tree, found = shapely.STRtree(things), []
    num_nodes = 1 + max(
        (max(way.start, way.end) for way in walkways), default=0
    )
    for way in walkways:
        points = way.points[:, :2]
        right = np.gradient(points, axis=0)[:, ::-1] * (1.0, -1.0)
        right /= np.linalg.norm(right, axis=1)[:, None]
        across = np.linspace(-way.half_width, way.half_width, _ACROSS)
        places = points[:, None] + across[:, None] * right[:, None]
        barred, around = np.zeros((2, *places.shape[:2]), int)
        for each, reach in ((barred, _BESIDE), (around, _AROUND)):
            near = tree.query(shapely.points(places).ravel(), "dwithin", reach)
            each.flat[near[0]] = 1
        ends = np.zeros(len(points), bool)
        ends[:_WAITS] = ends[-_WAITS:] = way.crossing < 0
        ends &= ~around.all(axis=1)
        barred[ends] = around[ends]
        # A walker is longer than wide, and needs a way to step aside.
        barred = maximum_filter1d(barred, 3, axis=0)
        for step in (1, -1):
            line = barred[::step]
            for row, before in zip(line[1:], line, strict=False):
                if before.all():
                    continue
                row |= minimum_filter1d(
                    before, 2 * _ASIDE + 1, mode="constant", cval=1
                )
        free = np.pad(1 - barred, ((0, 0), (1, 1)))
        limits = np.full((len(points), 2), np.nan)
        last = np.array([0, _ACROSS])
        for row, edges in enumerate(np.diff(free)):
            gaps = np.flatnonzero(edges).reshape(-1, 2)
            shared = np.minimum(gaps, last)[:, 1] - np.maximum(gaps, last)[:, 0]
            gaps = gaps[shared > 1]
            if len(gaps):
                last = max(gaps, key=np.ptp)
                limits[row] = across[last - (0, 1)]
            else:
                last = np.array([0, _ACROSS])
        bars = np.flatnonzero(np.isnan(limits[:, 0]))
        if way.crossing >= 0 and len(bars):
            continue
        for before, after in pairwise([-1, *bars.tolist(), len(points)]):
            rows, nodes = slice(before + 1, after), [way.start, way.end]
            if after - before <= _ALONG:
                continue
            for k, is_cut in enumerate((before >= 0, after < len(points))):
                if is_cut:
                    nodes[k], num_nodes = num_nodes, num_nodes + 1
            found.append(
                replace(
                    way,
                    points=way.points[rows],
                    start=nodes[0],
                    end=nodes[1],
                    free=limits[rows],
                )
            )
    # No crossing leads to where there is no walkway.
    reached = {n for w in found if w.crossing < 0 for n in (w.start, w.end)}
    return [
        way
        for way in found
        if way.crossing < 0 or {way.start, way.end} <= reached
    ]


@dataclass(frozen=True)
class LaneGraph:
    """Pieces by number, and the crossings over them.

    Attributes:
        pieces: all of them.
        crossings: where walkers cross lanes.
    """

    pieces: tuple[Piece, ...]
    crossings: tuple[Crossing, ...] = ()

    @property
    def lanes(self) -> list[int]:
        """Numbers of the pieces that are lanes."""
        return [k for k, p in enumerate(self.pieces) if not p.is_way]


def resampled(points: np.ndarray, spacing: float = SPACING) -> np.ndarray:
    """Returns evenly spaced points (N, 3) along a polyline (M, 3) [m].

    Args:
        points: corners; those that coincide with the one before are dropped.
        spacing: upper bound of the distance [m].
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    kept = np.concatenate([[True], steps > 1e-6])
    points = points[kept]
    along = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    )
    count = max(2, int(np.ceil(along[-1] / spacing)) + 1)
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, x) for x in points.T])


def without_dead_ends(pieces: Sequence[Piece]) -> list[Piece]:
    """Returns pieces on which a vehicle can drive for ever.

    Lanes that lead nowhere are removed, with the pieces that lead only to them,
    and lanes that nothing leads to.
    """
    alive = set(range(len(pieces)))
    while True:
        entered = {
            after for k in alive for after in pieces[k].after if after in alive
        }
        rest = {
            k
            for k in alive
            if k in entered and any(a in alive for a in pieces[k].after)
        }
        if rest == alive:
            break
        alive = rest
    number = {old: new for new, old in enumerate(sorted(alive))}
    return [
        replace(
            pieces[k],
            after=tuple(number[a] for a in pieces[k].after if a in alive),
            left=number.get(pieces[k].left, -1),
            right=number.get(pieces[k].right, -1),
        )
        for k in sorted(alive)
    ]
