"""Measurements of a vehicle's motion, as structured arrays."""

from __future__ import annotations

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
