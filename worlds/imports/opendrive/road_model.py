"""Roads of a network: course, heights, lanes with marks, signals and objects.

Source: ASAM OpenDRIVE 1.7, https://www.asam.net/standards/detail/opendrive
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from evaluation.base import cos, power, sin
from worlds.imports.opendrive.curves import Shape


@dataclass(frozen=True)
class CoursePiece:
    """One element of a road's course in plan view.

    Attributes:
        s: distance along the road at which the element begins [m].
        x: x of the element's first point in W [m].
        y: y of the element's first point in W [m].
        heading: heading at the element's first point in W [rad].
        length: length of the element [m].
        shape: the curve, in the frame of the element's first point.
    """

    s: float
    x: float
    y: float
    heading: float
    length: float
    shape: Shape

    def evaluate(self, s: np.ndarray) -> np.ndarray:
        """Returns x, y [m] and heading [rad] in W, (N, 3).

        Args:
            s: (N,) distances along the road [m].
        """
        u, v, turn = self.shape.evaluate(s - self.s).T
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return np.stack(
            [
                self.x + cosine * u - sine * v,
                self.y + sine * u + cosine * v,
                self.heading + turn,
            ],
            axis=1,
        )


class _CubicPieces(NamedTuple):
    """The cubic piece at each of N distances along a road.

    Attributes:
        is_there: (N,) bool: whether there is a piece.
        ds: (N,) distance from the start of the piece [m].
        coefficients: (N, 4) coefficients, beginning with that of ds^0.
    """

    is_there: np.ndarray
    ds: np.ndarray
    coefficients: np.ndarray


class Cubics:
    """A piecewise cubic function of the distance along a road.

    An object is false if it has no pieces.
    """

    def __init__(self, rows: Sequence[Sequence[float]] = ()):
        """Takes rows: a piece's start and four coefficients, of ds^0 first."""
        table = np.array(sorted(rows, key=lambda row: row[0]), dtype=float)
        self._table = table.reshape(-1, 5)

    def __bool__(self) -> bool:
        return len(self._table) > 0

    @property
    def starts(self) -> np.ndarray:
        """Distances along the road at which the cubic pieces begin [m]."""
        return self._table[:, 0]

    def at(self, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Returns the function's values (N,), which are 0 before all pieces.

        Args:
            s: (N,) distances along the road [m] at which the function is
                evaluated.
            inside: (N,) for each distance, any point of the cubic piece that is
                used [m]. This is usually `s`. At a joint, a point before or
                after `s` selects the piece before or after the joint.
        """
        pieces = self._pieces_at(s, inside)
        value = np.zeros(len(s))
        for degree in range(4):
            value += pieces.coefficients[:, degree] * power(pieces.ds, degree)
        return np.where(pieces.is_there, value, 0.0)

    def slopes(self, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Returns the function's first derivatives (N,).

        The derivatives are 0 before all pieces. `s` and `inside` are as in
        `at`.
        """
        pieces = self._pieces_at(s, inside)
        value = np.zeros(len(s))
        for degree in range(1, 4):
            factor = degree * pieces.coefficients[:, degree]
            value += factor * power(pieces.ds, degree - 1)
        return np.where(pieces.is_there, value, 0.0)

    def _pieces_at(self, s: np.ndarray, inside: np.ndarray) -> _CubicPieces:
        """Returns the piece at each distance; `s` and `inside` as in `at`."""
        if not self:
            none = np.zeros(len(s), bool)
            return _CubicPieces(none, s, np.zeros((len(s), 4)))
        index = np.searchsorted(self.starts, inside, side="right") - 1
        rows = self._table[np.maximum(index, 0)]
        return _CubicPieces(index >= 0, s - rows[:, 0], rows[:, 1:])

    def bend(self, start: float, end: float) -> float:
        """Returns the greatest absolute second derivative of the function.

        The result is for the stretch of road from `start` to `end` [m], which
        must lie within one cubic piece.
        """
        middle = (start + end) / 2.0
        index = int(np.searchsorted(self.starts, middle, side="right")) - 1
        if index < 0:
            return 0.0
        begin, _, _, c, d = self._table[index]
        return float(
            max(abs(2.0 * c + 6.0 * d * (s - begin)) for s in (start, end))
        )


# A function that is 0 everywhere.
ZERO = Cubics()


@dataclass(frozen=True)
class MarkLine:
    """One line of a road mark, with its dimensions from the file.

    Attributes:
        aside: lateral offset from the border of the lane, positive to the left
            [m].
        start: distance from the start of the mark to the first dash [m].
        dash: length of a dash [m].
        gap: length of the gap after a dash [m]; 0 for a continuous line.
        width: width of the line [m].
    """

    aside: float
    start: float
    dash: float
    gap: float
    width: float


@dataclass(frozen=True)
class RoadMark:
    """A mark painted on the border of a lane.

    Attributes:
        start: distance along the road at which the mark begins [m].
        kind: type of the mark, such as `solid broken`.
        colour: colour in the file.
        width: width of a line without a width of its own [m].
        lines: the lines in the file; if empty, the mark has the lines that are
            usual for its type.
    """

    start: float
    kind: str
    colour: str
    width: float
    lines: tuple[MarkLine, ...] = ()


@dataclass(frozen=True)
class Lane:
    """A lane of a road section.

    A lane has either a width or a border, as functions of the distance along
    the road.

    Attributes:
        number: number counted from the middle of the road outwards, positive on
            the left.
        kind: type of the lane, such as driving.
        width: width [m].
        border: distance from the middle of the road to the lane's outer edge
            [m].
        height: greatest height of the inner edge along the lane [m].
        marks: marks on the lane's outer border, one after the other.
        inner_height: height of the inner edge above the road [m], if the file
            states it.
        outer_height: height of the outer edge above the road [m], if the file
            states it.
        is_level: whether the lane is not banked even where the road is.
        is_reversed: whether traffic drives against the usual direction.
    """

    number: int
    kind: str
    width: Cubics
    border: Cubics
    height: float
    marks: tuple[RoadMark, ...] = ()
    inner_height: Cubics = ZERO
    outer_height: Cubics = ZERO
    is_level: bool = False
    is_reversed: bool = False


@dataclass(frozen=True)
class LaneSection:
    """A stretch of road with the same lanes.

    Attributes:
        start: distance along the road at which the stretch begins [m].
        end: distance along the road at which the stretch ends [m].
        lanes: lane number -> lane. The middle lane 0, which has only marks, is
            not included.
        middle_marks: marks of the middle lane 0.
    """

    start: float
    end: float
    lanes: dict[int, Lane]
    middle_marks: tuple[RoadMark, ...] = ()


class Span(NamedTuple):
    """A stretch of a road that is a bridge or a tunnel.

    Attributes:
        kind: `bridge` or `tunnel`.
        start, end: distances along the road [m].
    """

    kind: str
    start: float
    end: float


class Thing(NamedTuple):
    """A signal, or an object beside the road.

    Attributes:
        name: name of the thing, unique in the network.
        is_signal: whether the thing is a signal; otherwise the thing is an
            object.
        kind: type of the thing, in lower case.
        s, t: coordinates along and across the road [m].
        z: height above the road [m].
        heading: heading relative to the heading of the road [rad].
        size: length, width and height; 0 where unknown [m].
        outline: (N, 4) corners [m]: u, v, height of the corner's foot above the
            foot of the object, and height of the corner above its own foot.
            None if not in the file.
        road_outline: (N, 4) corners [m]: s, t, height of the corner's foot
            above the road, and height of the corner above its own foot. None if
            not in the file.
        is_open: whether the outline is a line, not the edge of an area.
        swept: (2, 5) s, t, height of the foot above the road, width and height
            [m] at both ends of an object without gaps along the road, such as a
            wall; None for other objects.
        is_dynamic: whether the state can change, as for a traffic light.
        faces_back: whether the thing is for traffic against the direction of
            the road.
    """

    name: str
    is_signal: bool
    kind: str
    s: float
    t: float
    z: float
    heading: float
    size: tuple[float, float, float]
    outline: np.ndarray | None = None
    road_outline: np.ndarray | None = None
    is_open: bool = False
    swept: np.ndarray | None = None
    is_dynamic: bool = False
    faces_back: bool = False


@dataclass(frozen=True)
class ImportedRoad:
    """A road of an OpenDRIVE network.

    Attributes:
        name: unique name, made from the id: letters, digits, dots and dashes.
        junction: name of the junction to which the road belongs; None without
            one.
        length: length of the road [m].
        pieces: pieces of the road's course, one after the other.
        elevation: height of the reference line [m].
        superelevation: roll of the reference line [rad].
        lane_offset: distance from the reference line to the middle of the
            lanes, positive to the left [m].
        sections: stretches with the same lanes, one after the other.
        keeps_left: whether traffic keeps left.
        limits: speed limit [m/s]; 0 where it is unknown.
        things: signals and objects.
        spans: bridges and tunnels on the road.
    """

    name: str
    junction: str | None
    length: float
    pieces: tuple[CoursePiece, ...]
    elevation: Cubics
    superelevation: Cubics
    lane_offset: Cubics
    sections: tuple[LaneSection, ...]
    keeps_left: bool = False
    limits: Cubics = ZERO
    things: tuple[Thing, ...] = ()
    spans: tuple[Span, ...] = ()

    def reference(self, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Returns x, y, z [m], heading and roll [rad] of the reference line.

        The result has the shape (N, 5).

        Args:
            s: (N,) distances along the road [m].
            inside: (N,) distances that select the piece of the road, usually
                equal to `s`. At a joint between two pieces, a distance slightly
                before or after `s` selects the piece before or after the joint.
        """
        starts = np.array([piece.s for piece in self.pieces])
        index = np.searchsorted(starts, inside, side="right") - 1
        index = np.maximum(index, 0)
        line = np.zeros((len(s), 3))
        for number in np.unique(index):
            on_piece = index == number
            line[on_piece] = self.pieces[number].evaluate(s[on_piece])
        x, y, heading = line.T
        z = self.elevation.at(s, inside)
        roll = self.superelevation.at(s, inside)
        return np.stack([x, y, z, heading, roll], axis=1)

    def points(
        self, s: np.ndarray, inside: np.ndarray, t: np.ndarray
    ) -> np.ndarray:
        """Returns places (N, 3) beside the reference line, in W [m].

        Args:
            s: (N,) distances along the road [m].
            inside: (N,) distances that select the piece of the road, usually
                equal to `s` (see `Cubics.at`).
            t: (N,) distances to the left of the reference line [m].
        """
        x, y, z, heading, roll = self.reference(s, inside).T
        across = t * cos(roll)
        return np.stack(
            [
                x - across * sin(heading),
                y + across * cos(heading),
                z + t * sin(roll),
            ],
            axis=1,
        )


@dataclass(frozen=True)
class RoadMap:
    """All roads of an OpenDRIVE file, in the order of the file.

    Attributes:
        roads: the roads.
        reference_system: name of the reference system in the file.
        origin: origin of W in coordinates of this system [m].
        num_roads: number of roads in the file, with those that are left out.
    """

    roads: tuple[ImportedRoad, ...]
    reference_system: str
    origin: tuple[float, float, float]
    num_roads: int
