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

    def at(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates and their rates.

        Args:
            t: a time, or (T,) times [s].

        Returns:
            (N, D) each; of several times (T, N, D).
        """
        last = len(self.values) - 1
        k, u = self._interval(t)
        u = u[..., None, None]
        first = (k == 0)[..., None, None]
        final = (k + 2 > last)[..., None, None]
        p0, p1 = self.values[k], self.values[k + 1]
        before = self.values[np.maximum(k - 1, 0)]
        after = self.values[np.minimum(k + 2, last)]
        # At both ends of the track a body is at rest.
        m0 = np.where(first, 0.0, (p1 - before) / 2)
        m1 = np.where(final, 0.0, (after - p0) / 2)
        if self.present is not None:
            # A place at which a body is absent does not count.
            alone = ~self.present[np.maximum(k - 1, 0)][..., None]
            m0 = np.where(alone, p1 - p0, m0)
            alone = ~self.present[np.minimum(k + 2, last)][..., None]
            m1 = np.where(alone, p1 - p0, m1)
        a = 2 * p0 + m0 - 2 * p1 + m1
        b = -3 * p0 - 2 * m0 + 3 * p1 - m1
        value = ((a * u + b) * u + m0) * u + p0
        rate = ((3 * a * u + 2 * b) * u + m0) / self.dt
        rests = (np.asarray(t) < 0.0) | (np.asarray(t) > self.duration)
        return value, np.where(rests[..., None, None], 0.0, rate)

    def is_present(self, t: float | np.ndarray) -> np.ndarray:
        """Returns whether each body is there at a time, (N,) or (T, N)."""
        k, _ = self._interval(t)
        if self.present is None:
            return np.ones((*k.shape, self.values.shape[1]), bool)
        return self.present[k] & self.present[k + 1]

    def _interval(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the interval of each time, and its place in there."""
        last = len(self.values) - 1
        inside = np.clip(np.asarray(t, float) / self.dt, 0.0, float(last))
        k = np.minimum(inside.astype(int), last - 1)
        return k, inside - k

    def select(self, chosen: np.ndarray) -> Tracks:
        """Returns the tracks of some bodies."""
        present = None if self.present is None else self.present[:, chosen]
        return Tracks(self.dt, self.values[:, chosen], present)
