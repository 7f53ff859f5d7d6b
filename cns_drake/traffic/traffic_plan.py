"""The motion of all traffic in a drive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from evaluation.base import parse_yaml

# A pedestrian's box, which contains swinging limbs: length, width, height [m].
WALKER_SIZE = (0.84, 0.6, 1.8)


@dataclass(frozen=True)
class VehicleKind:
    """A kind of vehicle.

    Attributes:
        name: name of the kind, with which the names of the kind's meshes begin.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        share: weight in the random choice of kinds.
        size: length, width and height of the vehicle's box, mirrors and rider
            included [m].
        axles: x of the rear and front axle from the middle of the box [m].
    """

    name: str
    semantic_class: str
    share: float
    size: tuple[float, float, float]
    axles: tuple[float, float]


_TABLE = parse_yaml(Path(__file__).with_name("vehicle_kinds.yaml").read_bytes())
KINDS = TypeAdapter(tuple[VehicleKind, ...]).validate_python(
    [{"name": name, **fields} for name, fields in _TABLE.items()]
)


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


@dataclass(frozen=True)
class TrafficPlan:
    """The motion of vehicles and pedestrians.

    Attributes:
        kinds: kind of each of the N vehicles.
        vehicles: tracks of the vehicles, with five coordinates each: x, y, z of
            the middle of the vehicle's box on the ground [m], yaw and pitch
            [rad].
        walkers: tracks of the pedestrians, with five coordinates each: x, y, z
            on the ground [m], yaw and phase of the gait [rad].
        left_out: number of bodies that are left out because they would meet the
            ego car.
        notes: notes for the user.
    """

    kinds: tuple[VehicleKind, ...]
    vehicles: Tracks
    walkers: Tracks
    left_out: int = 0
    notes: tuple[str, ...] = ()


def gait_phases(xy: np.ndarray, dt: float) -> np.ndarray:
    """Returns how the phase of pedestrians' gait grows from 0, (M, ...) [rad].

    A stride consists of two steps. The length of a stride is 0.4 m plus the
    distance walked in 0.7 s.

    Args:
        xy: (M, ..., 2) places of pedestrians at M times [m].
        dt: time between two of these times [s].
    """
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=-1) / dt
    turned = dt * (2.0 * np.pi * speed / (0.7 * speed + 0.4))
    start = np.zeros_like(xy[:1, ..., 0])
    return np.concatenate([start, np.cumsum(turned, axis=0)])
