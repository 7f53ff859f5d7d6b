"""Measurements of a vehicle's motion, as structured arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# W is the world, B the vehicle on the ground, I the IMU. The pose is X_WB. Both
# velocities are those of B in W, expressed in B [m/s, rad/s].
ODOMETRY_DTYPE = np.dtype(
    [
        ("stamp_ns", "<i8"),
        ("position", "<f8", 3),
        ("quat_xyzw", "<f8", 4),
        ("velocity", "<f8", 3),
        ("angular_velocity", "<f8", 3),
    ]
)

# The orientation is R_WI; the other values are expressed in I [rad/s, m/s^2].
IMU_DTYPE = np.dtype(
    [
        ("stamp_ns", "<i8"),
        ("quat_xyzw", "<f8", 4),
        ("angular_velocity", "<f8", 3),
        ("specific_force", "<f8", 3),
    ]
)


class ImuSamples(NamedTuple):
    """Samples of an IMU that follow each other at an even rate.

    Attributes:
        first: number of the first one; that at time zero is 0.
        quat_xyzw: (N, 4) R_WI.
        angular_velocity: (N, 3) w_WI, expressed in I [rad/s].
        specific_force: (N, 3) expressed in I [m/s^2].
    """

    first: int
    quat_xyzw: np.ndarray
    angular_velocity: np.ndarray
    specific_force: np.ndarray
