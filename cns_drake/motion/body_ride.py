"""How a body on springs moves against the path that it follows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from scipy.interpolate import PPoly
from scipy.spatial.transform import Rotation

# Heave, roll and pitch.
NUM_COORDINATES = 3

_X, _Y, _Z = np.eye(3)


class RideMoments(NamedTuple):
    """Heave, roll and pitch at N times.

    Attributes:
        q: (N, 3) heave of the body, upwards [m], roll and pitch about x and y
            of the vehicle [rad].
        dq, ddq: (N, 3) derivatives by time.
        pivot: x of the point on the ground about which it turns [m].
    """

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    pivot: float


class BodyRide:
    """The motion X_FB(t) of a body B against the frame F of its path.

    At rest on a level road B is F. Its heave, roll and pitch are polynomials
    of degree 5 between even times, at which they have given values and two
    derivatives: the accelerations have no jumps. The body turns about a point
    on the ground, by its pitch and then by its roll.
    """

    def __init__(
        self,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        step: float,
        pivot: float,
    ):
        """Makes the motion.

        Args:
            q: (N, 3) heave [m], roll and pitch [rad].
            dq: (N, 3) their rates.
            ddq: (N, 3) their accelerations.
            step: between the N times [s], the first of which is zero.
            pivot: x in F of the point about which the body turns [m].
        """
        self._pivot = pivot
        times = step * np.arange(len(q))
        self._end = times[-1]
        v, a = dq * step, ddq * step**2 / 2
        # What degree 2 leaves of the value and its derivatives at the end.
        rest = q[1:] - q[:-1] - v[:-1] - a[:-1]
        drest = v[1:] - v[:-1] - 2 * a[:-1]
        ddrest = a[1:] - a[:-1]
        coefficients = [
            6 * rest - 3 * drest + ddrest,
            -15 * rest + 7 * drest - 2 * ddrest,
            10 * rest - 4 * drest + ddrest,
            a[:-1],
            v[:-1],
            q[:-1],
        ]
        powers = step ** np.arange(5, -1, -1)[:, None, None]
        spline = PPoly(np.array(coefficients) / powers, times)
        self._splines = [spline, spline.derivative(), spline.derivative(2)]

    def at(self, t: ArrayLike) -> RideMoments:
        """Returns heave, roll and pitch at (N,) times; at the ends it rests."""
        times = np.clip(np.atleast_1d(t), 0.0, self._end)
        q, dq, ddq = (spline(times) for spline in self._splines)
        return RideMoments(q, dq, ddq, self._pivot)


def ride_poses(moments: RideMoments) -> tuple[np.ndarray, np.ndarray]:
    """Returns R_FB (N, 3, 3) and p_FB (N, 3) [m]."""
    heave, roll, pitch = moments.q.T
    pitch_roll = np.stack([pitch, roll], axis=1)
    R_FB = Rotation.from_euler("YX", pitch_roll).as_matrix()
    p_FB = moments.pivot * (_X - R_FB[:, :, 0])
    p_FB[:, 2] += heave
    return R_FB, p_FB


def ride_pose(moments: RideMoments, row: int = 0) -> RigidTransform:
    """Returns X_FB at one of several times."""
    _, p_FB = ride_poses(moments)
    _, roll, pitch = moments.q[row]
    return RigidTransform(RollPitchYaw(roll, pitch, 0.0), p_FB[row])


def ride_velocity(moments: RideMoments) -> SpatialVelocity:
    """Returns V_FB in F at the first time [rad/s, m/s]."""
    w, _ = _rotation_rates(moments)
    r = _from_pivot(moments)
    return SpatialVelocity(w, moments.dq[0, 0] * _Z + np.cross(w, r))


def ride_acceleration(moments: RideMoments) -> SpatialAcceleration:
    """Returns A_FB in F at the first time [rad/s^2, m/s^2]."""
    w, alpha = _rotation_rates(moments)
    r = _from_pivot(moments)
    a = moments.ddq[0, 0] * _Z + np.cross(alpha, r)
    return SpatialAcceleration(alpha, a + np.cross(w, np.cross(w, r)))


def _rotation_rates(moments: RideMoments) -> tuple[np.ndarray, np.ndarray]:
    """Returns angular velocity and acceleration of B in F."""
    pitch = moments.q[0, 2]
    _, droll, dpitch = moments.dq[0]
    _, ddroll, ddpitch = moments.ddq[0]
    # The roll axis turns with the pitch.
    axis = np.cos(pitch) * _X - np.sin(pitch) * _Z
    w = dpitch * _Y + droll * axis
    alpha = ddpitch * _Y + ddroll * axis + droll * dpitch * np.cross(_Y, axis)
    return w, alpha


def _from_pivot(moments: RideMoments) -> np.ndarray:
    """Returns where the origin of B is, as seen from the pivot, in F."""
    R_FB, _ = ride_poses(moments)
    return -moments.pivot * R_FB[0, :, 0]
