"""The motion of all traffic in a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.traffic.tracks import Tracks
from cns_drake.traffic.vehicle_kinds import VehicleKind

# A pedestrian's box, which contains swinging limbs: length, width, height [m].
WALKER_SIZE = (0.84, 0.6, 1.8)


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
