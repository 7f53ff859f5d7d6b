"""Motions of many bodies as piecewise polynomials of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tracks:
    """N bodies with D coordinates each, known at evenly spaced times.

    Between two of these times every coordinate is a cubic polynomial, whose
    rate is continuous (Catmull and Rom's spline); before the first and after
    the last time it keeps its value.

    Attributes:
        dt: distance of the times [s].
        values: (K, N, D), angles without jumps.
        present: (K, N) whether a body is there; None if all always are. A body
            is there between two times if it is there at both.
    """

    dt: float
    values: np.ndarray
    present: np.ndarray | None = None

    @property
    def duration(self) -> float:
        """The last of the times [s]."""
        return self.dt * (len(self.values) - 1)

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates and their rates at a time, (N, D) each."""
        last = len(self.values) - 1
        inside = min(max(t / self.dt, 0.0), float(last))
        k = min(int(inside), last - 1)
        u = inside - k
        p0, p1 = self.values[k], self.values[k + 1]
        before = self.values[max(k - 1, 0)]
        after = self.values[min(k + 2, last)]
        # At both ends of the track a body is at rest.
        m0 = (p1 - before) / 2 if k > 0 else np.zeros_like(p0)
        m1 = (after - p0) / 2 if k + 2 <= last else np.zeros_like(p0)
        if self.present is not None:
            # A place at which a body is absent does not count.
            here = self.present
            alone = ~here[max(k - 1, 0)][:, None]
            m0 = np.where(alone, p1 - p0, m0)
            alone = ~here[min(k + 2, last)][:, None]
            m1 = np.where(alone, p1 - p0, m1)
        a = 2 * p0 + m0 - 2 * p1 + m1
        b = -3 * p0 - 2 * m0 + 3 * p1 - m1
        value = ((a * u + b) * u + m0) * u + p0
        rate = ((3 * a * u + 2 * b) * u + m0) / self.dt
        if not 0.0 <= t <= self.duration:
            rate = np.zeros_like(rate)
        return value, rate

    def is_present(self, t: float) -> np.ndarray:
        """Returns (N,) whether each is there at a time."""
        if self.present is None:
            return np.ones(self.values.shape[1], bool)
        last = len(self.values) - 1
        inside = min(max(t / self.dt, 0.0), float(last))
        k = min(int(inside), last - 1)
        return self.present[k] & self.present[k + 1]

    def select(self, chosen: np.ndarray) -> Tracks:
        """Returns the tracks of some bodies."""
        present = None if self.present is None else self.present[:, chosen]
        return Tracks(self.dt, self.values[:, chosen], present)
