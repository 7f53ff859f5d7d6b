"""Plane curves of lines and arcs: centrelines, and turns between lanes."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import arctan2, cos, power, sin, tan, wrapped

# The arcs at both ends of a segment may need this much more than its length, so
# that they can meet in one point although corners are given in centimetres
# [m].
_FIT_TOLERANCE = 0.02
# Two directions are joined by an arc if the sine of the angle between them is
# greater, and by a cubic curve otherwise.
_LEAST_SINE = 0.2
# The same for the distance from the nearer end to the corner [m].
_LEAST_TANGENT = 0.5


@dataclass(frozen=True)
class _Piece:
    """A line (curvature 0) or an arc that begins at `start` [m, rad, 1/m]."""

    start: np.ndarray
    heading: float
    curvature: float
    length: float

    def evaluate(self, s: np.ndarray) -> np.ndarray:
        """Returns x, y [m] and heading [rad], (N, 3), at arc lengths s (N,)."""
        heading = self.heading + self.curvature * s
        # The length of an arc's chord follows from sin(x)/x, and its direction
        # is the mean heading. This form also holds for a line.
        half = self.curvature * s / 2
        # As in `numpy.sinc`, 1e-20 avoids a division by zero.
        angle = np.pi * np.where(half == 0.0, 1e-20, half / np.pi)
        chord = s * (sin(angle) / angle)
        x = self.start[0] + chord * cos(self.heading + half)
        y = self.start[1] + chord * sin(self.heading + half)
        return np.stack([x, y, heading], axis=1)


class Centreline:
    """The centreline of a road: a polyline with corners rounded by arcs."""

    def __init__(self, points: ArrayLike, radii: ArrayLike) -> None:
        """Rounds the corners of a polyline by arcs.

        Args:
            points: (N, 2) points of the polyline [m].
            radii: (N - 2,) radii of the arcs at its inner corners [m].

        Raises:
            ValueError: the arc of a corner does not fit between its neighbours,
                or two consecutive points coincide.
        """
        points = np.asarray(points, dtype=float)
        radii = np.asarray(radii, dtype=float)
        edges = np.diff(points, axis=0)
        lengths = np.hypot(edges[:, 0], edges[:, 1])
        if np.any(lengths < 1e-6):
            raise ValueError("two consecutive points coincide")
        headings = arctan2(edges[:, 1], edges[:, 0])
        turns = wrapped(np.diff(headings))
        tangents = np.concatenate(
            [[0.0], radii * np.abs(tan(turns / 2)), [0.0]]
        )
        spare = lengths - tangents[:-1] - tangents[1:]
        for segment in np.flatnonzero(spare < -_FIT_TOLERANCE):
            raise ValueError(
                f"the rounded corners at both ends of segment {segment} need "
                f"{lengths[segment] - spare[segment]:.2f} m, it is "
                f"{lengths[segment]:.2f} m long"
            )
        self._pieces: list[_Piece] = []
        position = points[0]
        heading = headings[0]
        for k, straight in enumerate(np.maximum(spare, 0.0)):
            self._append_piece(position, heading, 0.0, straight)
            if k < len(turns):
                corner = points[k + 1]
                tangent = tangents[k + 1]
                if tangent > 0:
                    begin = corner - tangent * _direction(heading)
                    curvature = np.sign(turns[k]) / radii[k]
                    length = abs(turns[k]) * radii[k]
                    self._append_piece(begin, heading, curvature, length)
                heading = headings[k + 1]
                position = corner + tangent * _direction(heading)
        self._ends = np.cumsum([piece.length for piece in self._pieces])

    def _append_piece(
        self, start: np.ndarray, heading: float, curvature: float, length: float
    ) -> None:
        if length > 0:
            self._pieces.append(_Piece(start, heading, curvature, length))

    @property
    def length(self) -> float:
        """Length of the centreline [m]."""
        return float(self._ends[-1])

    def evaluate(self, s: ArrayLike) -> np.ndarray:
        """Returns x, y [m] and heading [rad], (N, 3), at arc lengths s (N,)."""
        s = np.asarray(s, dtype=float).clip(0.0, self.length)
        index = np.searchsorted(self._ends, s, side="left")
        index = np.minimum(index, len(self._pieces) - 1)
        result = np.empty((len(s), 3))
        # Sorted once, since comparing all of s with each piece takes minutes if
        # there are many of both.
        order = np.argsort(index, kind="stable")
        found, first = np.unique(index[order], return_index=True)
        groups = np.split(order, first[1:])
        for k, chosen in zip(found.tolist(), groups, strict=False):
            piece = self._pieces[k]
            local = s[chosen] - (self._ends[k] - piece.length)
            result[chosen] = piece.evaluate(local)
        return result


def sample_stations(start: float, end: float, spacing: float) -> np.ndarray:
    """Returns evenly spaced arc lengths (N,) from `start` to `end` [m].

    Both ends are included. The arc lengths are at most `spacing` apart [m].
    """
    count = max(2, int(np.ceil((end - start) / spacing - 1e-9)) + 1)
    return np.linspace(start, end, count)


def blend(
    p_start: ArrayLike,
    heading_start: float,
    p_end: ArrayLike,
    heading_end: float,
    spacing: float = 1.0,
    max_radius: float = np.inf,
) -> np.ndarray:
    """Returns a smooth curve (N, 2) from one directed point to another [m].

    The curve includes both points. If the line straight ahead of the start
    meets the line behind the end, the curve consists of these two lines and the
    widest allowed arc that touches both lines: drivers turn in this way.
    Otherwise, for example between parallel lanes, the curve is a cubic Hermite
    curve.

    Args:
        p_start: (2,) the first point [m].
        heading_start: direction of the curve at the first point [rad].
        p_end: (2,) the last point [m].
        heading_end: direction of the curve at the last point [rad].
        spacing: approximate distance between two points of the curve [m].
        max_radius: greatest radius of the arc [m].
    """
    p_start, p_end = np.asarray(p_start, float), np.asarray(p_end, float)
    d_start = _direction(heading_start)
    d_end = _direction(heading_end)
    sine = d_start[0] * d_end[1] - d_start[1] * d_end[0]
    gap = p_end - p_start
    if abs(sine) > _LEAST_SINE:
        ahead = (gap[0] * d_end[1] - gap[1] * d_end[0]) / sine
        behind = (d_start[0] * gap[1] - d_start[1] * gap[0]) / sine
        tangent = min(ahead, behind)
        if tangent > _LEAST_TANGENT:
            cosine = d_start[0] * d_end[0] + d_start[1] * d_end[1]
            widest = tangent / math.tan(math.atan2(abs(sine), cosine) / 2)
            corner = p_start + ahead * d_start
            radius = min(widest, max_radius)
            curve = Centreline([p_start, corner, p_end], [radius])
            stations = sample_stations(0.0, curve.length, spacing)
            return curve.evaluate(stations)[:, :2]
    distance = float(np.hypot(*gap))
    u = sample_stations(0.0, 1.0, spacing / max(distance, spacing))[:, None]
    cube = power(u, 3)
    return (
        (2 * cube - 3 * u**2 + 1) * p_start
        + (cube - 2 * u**2 + u) * distance * d_start
        + (3 * u**2 - 2 * cube) * p_end
        + (cube - u**2) * distance * d_end
    )


def _direction(heading: float) -> np.ndarray:
    return np.array([math.cos(heading), math.sin(heading)])
