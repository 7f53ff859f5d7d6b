"""The curves of a road's course in plan view: lines, arcs, spirals and cubics.

Source: ASAM OpenDRIVE 1.7, chapter 8,
https://www.asam.net/standards/detail/opendrive
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

import numpy as np

from evaluation.base import arctan2, cos, dot, sin, sinc

# Nodes of the Gauss-Legendre rule; it is exact on a panel to 1e-14 m.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# Greatest change of a spiral's heading on a panel [rad].
_PANEL_TURN = 0.5
# If a road turns by more than this, the file is at fault [rad].
_MOST_TURN = 10_000.0
# Number of panels on which the arc length of a cubic curve is integrated.
_PANELS = 64
# Number of steps of Newton's method for the parameter at an arc length.
_NEWTON_STEPS = 8
# Number of intervals on which the sharpest bend of a cubic curve is searched.
_INTERVALS = 4 * _PANELS
# Curves must be longer than this [m].
_LEAST_LENGTH = 1e-9
# Least divisors, where a curve stands still: length of a panel [m], and speed
# [m per unit of the parameter].
_LEAST_PANEL = 1e-12
_LEAST_SPEED = 1e-9


def _integral(
    rate: Callable[[np.ndarray], np.ndarray],
    begin: np.ndarray,
    size: np.ndarray,
) -> np.ndarray:
    """Returns the integrals (N,) of a rate from `begin` over `size` (N,)."""
    nodes = begin[:, None] + size[:, None] * (_NODES + 1.0) / 2.0
    return size / 2.0 * dot(rate(nodes), _WEIGHTS)


@dataclass(frozen=True)
class Arc:
    """A circular arc in a road's reference line.

    With a `curvature` of 0 [1/m] it is a straight line.
    """

    curvature: float

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        """Returns u, v [m] and heading [rad], (N, 3), as `Shape` says."""
        half = self.curvature * ds / 2.0
        # The chord, which for a line points straight ahead.
        chord = ds * sinc(half / np.pi)
        return np.stack(
            [chord * cos(half), chord * sin(half), 2.0 * half], axis=1
        )

    @property
    def sharpest(self) -> float:
        """Greatest curvature [1/m]."""
        return abs(self.curvature)


class Spiral:
    """A clothoid in a road's course: its curvature changes linearly."""

    def __init__(self, start: float, end: float, length: float):
        """Takes the curvature at both ends [1/m], and the length [m]."""
        self.sharpest = max(abs(start), abs(end))
        turn = self.sharpest * length
        if turn > _MOST_TURN:
            raise ValueError(f"turns by up to {turn:.0f} rad")
        self._start = start
        self._growth = (end - start) / length
        panels = math.ceil(turn / _PANEL_TURN) + 1
        self._panel = length / panels
        ends = np.arange(panels) * self._panel
        steps = self._steps(ends, np.full(panels, self._panel))
        before = np.cumsum(steps, axis=0) - steps
        self._before = before

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        """Returns u, v [m] and heading [rad], (N, 3), as `Shape` says."""
        index = np.clip(
            (ds / self._panel).astype(int), 0, len(self._before) - 1
        )
        begin = index * self._panel
        uv = self._before[index] + self._steps(begin, ds - begin)
        return np.column_stack([uv, self._heading(ds)])

    def _heading(self, s: np.ndarray) -> np.ndarray:
        return self._start * s + self._growth * s**2 / 2.0

    def _steps(self, begin: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Returns displacements (N, 2) from `begin` over lengths (N,) [m]."""
        u = _integral(lambda s: cos(self._heading(s)), begin, length)
        v = _integral(lambda s: sin(self._heading(s)), begin, length)
        return np.stack([u, v], axis=1)


class Cubic:
    """A curve in a road's course, given by cubic polynomials u(p) and v(p)."""

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
            u, v: four coefficients of each coordinate, beginning with the
                coefficient of p^0 [m].
            last: p at the end.
            length: length of the curve in the file [m].
            by_parameter: whether p is the distance along the curve.
            stretched: whether the whole curve is stretched to `length`;
                otherwise it ends where `length` is reached.
        """
        self._u, self._v = (np.polynomial.Polynomial(c) for c in (u, v))
        self._du, self._dv = self._u.deriv(), self._v.deriv()
        self._by_parameter = by_parameter
        self._panel = last / _PANELS
        panels = np.arange(_PANELS) * self._panel
        steps = self._arc(panels, np.full(_PANELS, self._panel))
        self._reached = np.concatenate([[0.0], np.cumsum(steps)])
        whole = float(self._reached[-1])
        if not whole > _LEAST_LENGTH:
            raise ValueError("a curve without length")
        self._scale = whole / length if stretched else 1.0
        p = np.linspace(0.0, last, _INTERVALS + 1)
        turns = np.abs(np.diff(np.unwrap(self._heading(p))))
        self.sharpest = float(turns.max()) / (length / _INTERVALS)

    def evaluate(self, ds: np.ndarray) -> np.ndarray:
        """Returns u, v [m] and heading [rad], (N, 3), as `Shape` says."""
        p = ds if self._by_parameter else self._parameter(ds * self._scale)
        return np.stack([self._u(p), self._v(p), self._heading(p)], axis=1)

    def _heading(self, p: np.ndarray) -> np.ndarray:
        return arctan2(self._dv(p), self._du(p))

    def _speed(self, p: np.ndarray) -> np.ndarray:
        return np.hypot(self._du(p), self._dv(p))

    def _arc(self, begin: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Returns arc lengths (N,) from `begin` over parameters `size` [m]."""
        return _integral(self._speed, begin, size)

    def _parameter(self, arc: np.ndarray) -> np.ndarray:
        """Returns the parameter at an arc length, by Newton's method."""
        index = np.clip(
            np.searchsorted(self._reached, arc, side="right") - 1,
            0,
            _PANELS - 1,
        )
        low = self._reached[index]
        begin = index * self._panel
        whole = np.maximum(self._reached[index + 1] - low, _LEAST_PANEL)
        size = (arc - low) / whole * self._panel
        for _ in range(_NEWTON_STEPS):
            speed = np.maximum(self._speed(begin + size), _LEAST_SPEED)
            size = size - (self._arc(begin, size) - (arc - low)) / speed
            size = np.clip(size, -self._panel, 2.0 * self._panel)
        return begin + size


# A curve. Its `evaluate` returns (N, 3) u, v [m] and heading [rad] at distances
# (N,) [m], in the frame of its first point. Its `sharpest` is approximately its
# greatest curvature [1/m].
Shape = Arc | Spiral | Cubic
