"""Roads of a network: course, heights and lanes.

The course is made of lines, arcs, spirals and cubic curves: ASAM OpenDRIVE 1.7,
chapter 8, https://www.asam.net/standards/detail/opendrive"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

# Number of nodes of Gauss and Legendre's rule; exact on a panel to 1e-14 m.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# Greatest turn of a spiral's heading on a panel [rad].
_TURN = 0.5
# A road that turns more is a fault of the file [rad].
_MOST_TURN = 10_000.0
_PANELS = 64
_NEWTON_STEPS = 8


def _integral(
    rate: Callable[[np.ndarray], np.ndarray],
    begin: np.ndarray,
    size: np.ndarray,
) -> np.ndarray:
    """Returns the integrals (N,) of a rate over panels."""
    nodes = begin[:, None] + size[:, None] * (_NODES + 1.0) / 2.0
    return size / 2.0 * (rate(nodes) @ _WEIGHTS)


# A curve has `evaluate`, which returns (N, 3) u, v [m] and heading [rad] in the
# frame of its first point at distances (N,) [m], and `sharpest`, its greatest
# curvature, about [1/m].


@dataclass(frozen=True)
class Arc:
    """An arc, or a line if the curvature is 0 [1/m]."""

    curvature: float

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        half = self.curvature * ds / 2.0
        # The chord, which is straight ahead for a line.
        chord = ds * np.sinc(half / np.pi)
        return np.stack(
            [chord * np.cos(half), chord * np.sin(half), 2.0 * half], axis=1
        )

    @property
    def sharpest(self) -> float:
        return abs(self.curvature)


class Spiral:
    """A clothoid, whose curvature grows evenly."""

    def __init__(self, start: float, end: float, length: float):
        """Takes the curvature at both ends [1/m], and the length [m]."""
        self.sharpest = max(abs(start), abs(end))
        turn = self.sharpest * length
        if turn > _MOST_TURN:
            raise ValueError(f"turns by up to {turn:.0f} rad")
        self._start, self._growth = start, (end - start) / length
        panels = math.ceil(turn / _TURN) + 1
        self._panel = length / panels
        ends = np.arange(panels) * self._panel
        steps = self._steps(ends, np.full(panels, self._panel))
        before = np.cumsum(steps, axis=0) - steps
        self._before = before

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        index = np.clip(
            (ds / self._panel).astype(int), 0, len(self._before) - 1
        )
        begin = index * self._panel
        uv = self._before[index] + self._steps(begin, ds - begin)
        return np.column_stack([uv, self._heading(ds)])

    def _heading(self, s: np.ndarray) -> np.ndarray:
        return self._start * s + self._growth * s**2 / 2.0

    def _steps(self, begin: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Returns (N, 2) from s = begin (N,) on, over lengths (N,) [m]."""
        u = _integral(lambda s: np.cos(self._heading(s)), begin, length)
        v = _integral(lambda s: np.sin(self._heading(s)), begin, length)
        return np.stack([u, v], axis=1)


class Cubic:
    """A curve of two cubic polynomials of a parameter p."""

    def __init__(
        self,
        u: Sequence[float],
        v: Sequence[float],
        last: float,
        length: float,
        by_parameter: bool = False,
        stretched: bool = True,
    ):
        """Prepares the arc length.

        Args:
            u, v: four coefficients of each coordinate, of p^0 first [m].
            last: p at the end.
            length: length of the curve in the file [m].
            by_parameter: whether p is the distance itself.
            stretched: whether the whole curve is stretched to that length; else
                it ends where the length is reached.
        """
        self._u, self._v = (np.polynomial.Polynomial(one) for one in (u, v))
        self._du, self._dv = self._u.deriv(), self._v.deriv()
        self._by_parameter = by_parameter
        self._panel = last / _PANELS
        panels = np.arange(_PANELS) * self._panel
        steps = self._arc(panels, np.full(_PANELS, self._panel))
        self._reached = np.concatenate([[0.0], np.cumsum(steps)])
        whole = float(self._reached[-1])
        if not whole > 1e-9:
            raise ValueError("a curve without length")
        self._scale = whole / length if stretched else 1.0
        p = np.linspace(0.0, last, 4 * _PANELS + 1)
        turns = np.abs(np.diff(np.unwrap(self._heading(p))))
        self.sharpest = float(turns.max()) / (length / (4 * _PANELS))

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        p = ds if self._by_parameter else self._parameter(ds * self._scale)
        return np.stack([self._u(p), self._v(p), self._heading(p)], axis=1)

    def _heading(self, p: np.ndarray) -> np.ndarray:
        return np.arctan2(self._dv(p), self._du(p))

    def _speed(self, p: np.ndarray) -> np.ndarray:
        return np.hypot(self._du(p), self._dv(p))

    def _arc(self, begin: np.ndarray, size: np.ndarray) -> np.ndarray:
        return _integral(self._speed, begin, size)

    def _parameter(self, arc: np.ndarray) -> np.ndarray:
        """Returns the parameter at an arc length, by Newton's rule."""
        index = np.clip(
            np.searchsorted(self._reached, arc, side="right") - 1,
            0,
            _PANELS - 1,
        )
        low, begin = self._reached[index], index * self._panel
        whole = np.maximum(self._reached[index + 1] - low, 1e-12)
        size = (arc - low) / whole * self._panel
        for _ in range(_NEWTON_STEPS):
            speed = np.maximum(self._speed(begin + size), 1e-9)
            size = size - (self._arc(begin, size) - (arc - low)) / speed
            size = np.clip(size, -self._panel, 2.0 * self._panel)
        return begin + size


Shape = Arc | Spiral | Cubic


@dataclass(frozen=True)
class Piece:
    """One element of a plan view, from s on along the road [m].

    Its shape is in the frame of its first point in the world [m, rad].
    """

    s: float
    x: float
    y: float
    heading: float
    length: float
    shape: Shape

    def evaluate(self, s: np.ndarray) -> np.ndarray:
        """Returns (N, 3) x, y [m] and heading [rad] along the road."""
        u, v, turn = self.shape.evaluate(s - self.s).T
        c, sine = math.cos(self.heading), math.sin(self.heading)
        return np.stack(
            [
                self.x + c * u - sine * v,
                self.y + sine * u + c * v,
                self.heading + turn,
            ],
            axis=1,
        )


class Cubics:
    """A function of the distance, piece by piece a cubic polynomial."""

    def __init__(self, rows: Sequence[Sequence[float]] = ()):
        """Takes rows of a start and four coefficients, of ds^0 first."""
        table = np.array(sorted(rows, key=lambda row: row[0]), dtype=float)
        self._table = table.reshape(-1, 5)

    def __bool__(self) -> bool:
        return len(self._table) > 0

    @property
    def starts(self) -> np.ndarray:
        """Distances at which the pieces begin [m]."""
        return self._table[:, 0]

    def at(
        self, s: np.ndarray, inside: np.ndarray, is_slope: bool = False
    ) -> np.ndarray:
        """Returns the values (N,) at distances (N,), or the slopes there.

        `inside` selects the piece of each place: it differs from `s` [m] on
        both sides of a joint.
        """
        if not self:
            return np.zeros(len(s))
        index = np.searchsorted(self.starts, inside, side="right") - 1
        rows = self._table[np.maximum(index, 0)]
        ds = s - rows[:, 0]
        value = np.zeros(len(s))
        for power in range(is_slope, 4):
            factor = power if is_slope else 1
            value += factor * rows[:, 1 + power] * ds ** (power - is_slope)
        # Before the first piece there is no value.
        return np.where(index < 0, 0.0, value)

    def bend(self, start: float, end: float) -> float:
        """Returns the greatest second derivative on a stretch of one piece."""
        middle = (start + end) / 2.0
        index = int(np.searchsorted(self.starts, middle, side="right")) - 1
        if index < 0:
            return 0.0
        begin, _, _, c, d = self._table[index]
        return float(
            max(abs(2.0 * c + 6.0 * d * (s - begin)) for s in (start, end))
        )


# A function without a value anywhere.
NOWHERE = Cubics()


@dataclass(frozen=True)
class MarkLine:
    """One line of a mark whose measures the file has.

    Attributes:
        aside: distance from the border of the lane, positive to the left [m].
        start: where the first dash begins, from the start of the mark [m].
        dash, gap: lengths of a dash and of the gap after it; the line is
            continuous if the gap is 0 [m].
        width: width of the line [m].
    """

    aside: float
    start: float
    dash: float
    gap: float
    width: float


@dataclass(frozen=True)
class RoadMark:
    """A line painted on the border of a lane, in a colour of the file.

    It begins at `start` along the road [m]. A kind is such as `solid broken`;
    without lines, those usual for it are meant, each with the width [m].
    """

    start: float
    kind: str
    colour: str
    width: float
    lines: tuple[MarkLine, ...] = ()


@dataclass(frozen=True)
class Lane:
    """A lane of a section, of a type such as driving.

    Numbers count from the middle outwards, positive on the left. A lane has a
    width over the distance along the road, or a border: the distance of its
    outer edge from the middle. Its edges stand at heights above the road, where
    the file has any; `height` is the greatest one of its inner edge [m]. It may
    be level across where the road is banked, and its traffic may be reversed.
    Marks are on its outer border, one after the other.
    """

    number: int
    kind: str
    width: Cubics
    border: Cubics
    height: float
    marks: tuple[RoadMark, ...] = ()
    inner_height: Cubics = NOWHERE
    outer_height: Cubics = NOWHERE
    is_level: bool = False
    is_reversed: bool = False


@dataclass(frozen=True)
class LaneSection:
    """A stretch of road with the same lanes, from start to end [m].

    The middle one is not among its lanes by number, but has marks.
    """

    start: float
    end: float
    lanes: dict[int, Lane]
    middle_marks: tuple[RoadMark, ...] = ()


class Thing(NamedTuple):
    """A signal, or an object beside the road.

    Attributes:
        name: unique in the network.
        is_signal: whether it is a signal, and not an object.
        kind: type of the thing, in small letters.
        s, t: place along and across the road [m].
        z: height above the road [m].
        heading: heading relative to that of the road [rad].
        size: length, width, height; 0 where unknown [m].
        outline: (N, 3) corners about the place, or none: u, v, height; or
        road_outline: (N, 3) corners s, t, height; or none [m].
        is_dynamic: whether it has changing states, as lights have.
        faces_back: whether it is for the traffic against the road.
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
    is_dynamic: bool = False
    faces_back: bool = False


@dataclass(frozen=True)
class ImportedRoad:
    """A road; its name is its id in letters, digits, dots and dashes, unique.

    Pieces of its course follow one another, as do sections, stretches with the
    same lanes. The middle of the lanes lies `lane_offset` [m] to the left of
    the reference line, which has a height [m] and a roll [rad]. Limits are
    pairs of start and value of a speed limit [m, m/s]; spans are `bridge` or
    `tunnel` for each of them that the file has on it.
    """

    name: str
    junction: str | None
    length: float
    pieces: tuple[Piece, ...]
    elevation: Cubics
    superelevation: Cubics
    lane_offset: Cubics
    sections: tuple[LaneSection, ...]
    keeps_left: bool = False
    limits: tuple[tuple[float, float], ...] = ()
    things: tuple[Thing, ...] = ()
    spans: tuple[str, ...] = ()

    def reference(self, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Returns (N, 5) x, y, z, heading and roll of the reference line.

        For distances (N,) along the road [m], see `Cubics.at`.
        """
        starts = np.array([piece.s for piece in self.pieces])
        index = np.searchsorted(starts, inside, side="right") - 1
        index = np.maximum(index, 0)
        line = np.zeros((len(s), 3))
        for k in np.unique(index):
            chosen = index == k
            line[chosen] = self.pieces[k].evaluate(s[chosen])
        x, y, heading = line.T
        z = self.elevation.at(s, inside)
        roll = self.superelevation.at(s, inside)
        return np.stack([x, y, z, heading, roll], axis=1)

    def points(
        self, s: np.ndarray, inside: np.ndarray, t: np.ndarray
    ) -> np.ndarray:
        """Returns (N, 3) places t (N,) to the left of the reference line [m].

        For distances (N,) along the road [m], see `Cubics.at`.
        """
        x, y, z, heading, roll = self.reference(s, inside).T
        across = t * np.cos(roll)
        return np.stack(
            [
                x - across * np.sin(heading),
                y + across * np.cos(heading),
                z + t * np.sin(roll),
            ],
            axis=1,
        )


@dataclass(frozen=True)
class RoadMap:
    """All roads of a file, in its order.

    The reference system has the name that the file gives it. The origin is that
    of the world, in coordinates of this system [m].
    """

    roads: tuple[ImportedRoad, ...]
    reference_system: str
    origin: tuple[float, float, float]
