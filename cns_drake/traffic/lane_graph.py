"""The lane graph: lanes, paths through junctions, crossings and walkways."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cns_drake.base import length_of


@dataclass(frozen=True)
class Piece:
    """A piece of a vehicle's path: part of a lane, or a path in a junction.

    A path through a junction is called a way. A vehicle waits in the lane
    before the way until all conflicting ways are free, so a vehicle never stops
    on a way.

    Attributes:
        points: (N, 3) points along the middle of the piece, in driving
            direction, evenly spaced [m].
        limit: speed limit [m/s].
        is_way: whether the piece is a way; otherwise the piece is part of a
            lane.
        after: numbers of the pieces that can follow this piece.
        left, right: numbers of the neighbouring lanes with the same direction;
            -1 for none.
        junction: number of the junction in which a way is, or to which a lane
            leads.
        phase: signal phase in which a way has green; -1 without a signal.
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
        return length_of(self.points)


@dataclass(frozen=True)
class Crossing:
    """A place where pedestrians cross lanes, at the end of a road or elsewhere.

    Attributes:
        line: (2, 3) from kerb to kerb, or from sidewalk to sidewalk [m].
        area: area where pedestrians are while they cross.
        marked: whether vehicles give way to waiting pedestrians. At a crossing
            without marks, which is never at the end of a road, pedestrians wait
            for a gap in the traffic.
    """

    line: np.ndarray
    area: BaseGeometry
    marked: bool = True


def make_crossing(
    line: np.ndarray, width: float, marked: bool = True
) -> Crossing:
    """Returns a crossing for pedestrians.

    Args:
        line: (2, 3) ends of the crossing's middle line [m].
        width: width of the crossing [m].
        marked: whether vehicles give way to waiting pedestrians.
    """
    course = LineString(line[:, :2])
    return Crossing(line, course.buffer(width / 2, cap_style="flat"), marked)


@dataclass(frozen=True)
class Walkway:
    """A strip on which people walk, between two places where walkways meet.

    Attributes:
        points: (N, 3) points along the middle of the strip, evenly spaced [m].
        half_width: greatest distance of a pedestrian from the middle [m].
        start, end: numbers of the places at the ends of the strip.
        crossing: number of the crossing on which the walkway lies; -1 for none.
        free: (N, 2) for each point, the two ends of the part of the width that
            is free of objects [m]: distances from the middle of the strip,
            positive to the right. None if the whole width is free.
        narrow: (N,) for each point, whether pedestrians fit only if they face
            along the walkway; None if pedestrians fit everywhere.
    """

    points: np.ndarray
    half_width: float
    start: int
    end: int
    crossing: int = -1
    free: np.ndarray | None = None
    narrow: np.ndarray | None = None

    @property
    def limits(self) -> np.ndarray:
        """Limits of pedestrians' distance from the middle, (N, 2) [m].

        Each row contains the least and the greatest distance. Distances are
        positive to the right of the middle of the strip.
        """
        if self.free is not None:
            return self.free
        sides = self.half_width * np.array([-1, 1])
        return np.tile(sides, (len(self.points), 1))

    @property
    def is_narrow(self) -> np.ndarray:
        """(N,) bool: points where the walkway is too narrow to turn around."""
        if self.narrow is not None:
            return self.narrow
        return np.zeros(len(self.points), bool)


def new_places(walkways: Iterable[Walkway]) -> Iterator[int]:
    """Yields numbers for further places where walkways meet or end."""
    return count(
        1 + max((max(way.start, way.end) for way in walkways), default=0)
    )


@dataclass(frozen=True)
class LaneGraph:
    """The lanes and paths through junctions of a map, and its crossings.

    Attributes:
        pieces: parts of lanes and paths through junctions. The numbers of
            pieces are indices into this tuple.
        crossings: places where pedestrians cross the lanes.
    """

    pieces: tuple[Piece, ...]
    crossings: tuple[Crossing, ...] = ()

    @property
    def lanes(self) -> list[int]:
        """Numbers of the pieces that are lanes."""
        return [k for k, p in enumerate(self.pieces) if not p.is_way]


def without_dead_ends(pieces: Sequence[Piece]) -> list[Piece]:
    """Returns the pieces that vehicles can both reach and leave.

    Three kinds of pieces are removed: lanes that lead nowhere, pieces that lead
    only to such lanes, and pieces to which no remaining piece leads. The
    remaining pieces are numbered again.
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
