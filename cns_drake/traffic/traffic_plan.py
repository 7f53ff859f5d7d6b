"""The planned motion of all traffic in a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.traffic.tracks import Tracks
from cns_drake.traffic.vehicle_kinds import VehicleKind


@dataclass(frozen=True)
class TrafficPlan:
    """The planned motion of vehicles and pedestrians.

    Attributes:
        kinds: kind of each of the N vehicles.
        vehicles: tracks of the vehicles, with five coordinates each: x, y, z of
            the middle of the vehicle's box on the ground [m], yaw and pitch
            [rad].
        walkers: tracks of the pedestrians, with five coordinates each: x, y, z
            on the ground [m], yaw and phase of the gait [rad].
        left_out: number of requested bodies that are left out because they
            would collide.
        positions: (K,) distances of the ego car along its path at times
            `cns_drake.motion.speed_profile.KNOT_PERIOD` apart [m]; None if the
            ego car does not follow other vehicles.
        notes: notes for the user.
    """

    kinds: tuple[VehicleKind, ...]
    vehicles: Tracks
    walkers: Tracks
    left_out: int = 0
    positions: np.ndarray | None = None
    notes: tuple[str, ...] = ()
