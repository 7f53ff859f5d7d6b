"""Dead reckoning from an IMU."""

import numpy as np
from scipy.spatial.transform import Rotation

_GRAVITY_W = np.array([0.0, 0.0, -9.81])


def integrate_imu(force, rate, period, X_WI):
    """Returns positions (N, 3) of an IMU from rest by the trapezoidal rule.

    Args:
        force: (N, 3) specific force at even times [m/s^2].
        rate: (N, 3) angular velocity [rad/s].
        period: between these times [s].
        X_WI: its first pose.
    """
    R = Rotation.from_matrix(X_WI.rotation().matrix())
    p, v = X_WI.translation(), np.zeros(3)
    places = [p]
    for i in range(len(force) - 1):
        R_next = R * Rotation.from_rotvec(period * (rate[i] + rate[i + 1]) / 2)
        a = R.apply(force[i]) + _GRAVITY_W
        a_next = R_next.apply(force[i + 1]) + _GRAVITY_W
        p = p + v * period + (2 * a + a_next) * period**2 / 6
        v = v + (a + a_next) * period / 2
        R = R_next
        places.append(p)
    return np.array(places)
