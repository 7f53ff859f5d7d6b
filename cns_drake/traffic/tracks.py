"""Tracks of moving bodies: their places at evenly spaced times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tracks:
    """The tracks of N bodies: D coordinates each, at evenly spaced times.

    Between two of these times, every coordinate is a cubic polynomial with a
    continuous rate (Catmull-Rom spline). In the first and the last interval of
    a body, the coordinate is a parabola; before the first and after the last
    time, the coordinate is a straight line.

    Attributes:
        dt: time between two of the times [s].
        values: (K, N, D) coordinates; angles have no jumps.
        present: (K, N) bool, whether a body exists at each time; None if all
            bodies always exist. Between two times, a body exists if the body
            exists at both times.
    """

    dt: float
    values: np.ndarray
    present: np.ndarray | None = None

    @property
    def duration(self) -> float:
        """The time of the last entry [s]."""
        return self.dt * (len(self.values) - 1)

    def at(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the bodies' coordinates at a time t [s], and their rates.

        The rates are first time derivatives. Both results are (N, D); for
        several times (T,), they are (T, N, D).
        """
        k, u, beyond = self._interval(t)
        p0, p1 = self.values[k], self.values[k + 1]
        before, is_before = self._coordinates_at_step(k - 1)
        after, is_after = self._coordinates_at_step(k + 2)
        step = p1 - p0
        m1 = np.where(is_after, (after - p0) / 2, step)
        m0 = np.where(is_before, (p1 - before) / 2, 2 * step - m1)
        m1 = np.where(is_after, m1, 2 * step - m0)
        a, b = m0 + m1 - 2 * step, 3 * step - 2 * m0 - m1
        value = ((a * u + b) * u + m0) * u + p0
        rate = (3 * a * u + 2 * b) * u + m0
        return value + beyond * rate, rate / self.dt

    def _coordinates_at_step(
        self, k: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates at steps (...), and whether bodies are there.

        The coordinates are (..., N, D). The second array is bool, and has the
        same number of axes. No body is there before the first step or after the
        last step.
        """
        row = np.clip(k, 0, len(self.values) - 1)
        there = (k == row)[..., None]
        if self.present is not None:
            there = there & self.present[row]
        return self.values[row], there[..., None]

    def is_present(self, t: float | np.ndarray) -> np.ndarray:
        """Returns which bodies exist, (N,) bool, at a time [s].

        For several times (T,), the result is (T, N).
        """
        k, *_ = self._interval(t)
        if self.present is None:
            return np.ones((*k.shape, self.values.shape[1]), bool)
        return self.present[k] & self.present[k + 1]

    def _interval(self, t: float | np.ndarray) -> tuple[np.ndarray, ...]:
        """Returns each time's interval, and the position of the time, in steps.

        The results are the number of the interval; the position in the
        interval, from 0 to 1; and how far the time lies before the first step
        (negative) or after the last step (positive), otherwise 0. The second
        and third result have two more axes than the times.
        """
        last = len(self.values) - 1
        steps = np.asarray(t, float) / self.dt
        inside = np.clip(steps, 0.0, float(last))
        k = np.minimum(inside.astype(int), last - 1)
        return (
            k,
            (inside - k)[..., None, None],
            (steps - inside)[..., None, None],
        )

    def select(self, chosen: np.ndarray) -> Tracks:
        """Returns the tracks of some bodies, given their indices."""
        present = None if self.present is None else self.present[:, chosen]
        return Tracks(self.dt, self.values[:, chosen], present)
