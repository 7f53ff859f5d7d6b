"""The ride of a vehicle: how its body heaves, rolls and pitches."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import cos, product, rotated, sin

# Heave, roll and pitch.
NUM_COORDINATES = 3


class RideMoments(NamedTuple):
    """Heave, roll and pitch of a vehicle's body at N times, with derivatives.

    Attributes:
        q: (N, 3) upward motion of the body [m], its roll about the vehicle's x
            axis [rad], and its pitch about the vehicle's y axis [rad].
        dq, ddq: (N, 3) first and second time derivatives of `q`.
        pivot: x of the point on the ground about which the body rotates [m].
    """

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    pivot: float


class BodyRide:
    """The motion X_FB(t) of a body B relative to the frame F of its path.

    At rest on a level road, B equals F. Heave, roll and pitch are given at
    evenly spaced times, with their first and second derivatives. Between these
    times, heave, roll and pitch are polynomials of degree 5, so that
    accelerations have no jumps. The body rotates about a point on the ground,
    by its pitch and then by its roll.
    """

    def __init__(
        self,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        step: float,
        pivot: float,
    ):
        """Takes the motion at evenly spaced times.

        Args:
            q: (N, 3) heave [m], roll and pitch [rad], from time zero on.
            dq, ddq: (N, 3) first and second derivatives of q.
            step: time between two rows [s].
            pivot: x in F of the axes about which the body rotates [m].
        """
        self._pivot = pivot
        from scipy.interpolate import PPoly

        times = step * np.arange(len(q))
        self._end = times[-1]
        v, a = dq * step, ddq * step**2 / 2
        # What the value and its derivatives still lack at the end, after the
        # terms up to degree 2.
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
        powers = np.reshape(
            [math.pow(step, k) for k in range(5, -1, -1)], (6, 1, 1)
        )
        spline = PPoly(np.array(coefficients) / powers, times)
        self._splines = [spline, spline.derivative(), spline.derivative(2)]

    def at(self, t: ArrayLike) -> RideMoments:
        """Returns heave, roll and pitch of the body at times (N,) [s].

        Before and after the drive, the body rests.
        """
        times = np.clip(np.atleast_1d(t), 0.0, self._end)
        q, dq, ddq = (spline(times) for spline in self._splines)
        return RideMoments(q, dq, ddq, self._pivot)


def ride_motion(moments: RideMoments) -> FrameMotion:
    """Returns the motion of the body frame B in the path frame F.

    The rotation is R_FB = R_y(pitch) R_x(roll): the body rolls about an axis
    that pitches with it.

    Args:
        moments: heave, roll and pitch at N times, with their derivatives.
    """
    heave, roll, pitch = moments.q.T
    _, droll, dpitch = moments.dq.T
    _, ddroll, ddpitch = moments.ddq.T
    zero = np.zeros_like(heave)
    (cr, sr), (cp, sp) = ((cos(a), sin(a)) for a in (roll, pitch))
    R_FB = np.array(
        [
            [cp, sp * sr, sp * cr],
            [zero, cr, -sr],
            [-sp, cp * sr, cp * cr],
        ]
    ).transpose(2, 0, 1)
    w = np.stack([droll * cp, dpitch, -droll * sp], axis=1)
    turning = droll * dpitch
    alpha = np.stack(
        [ddroll * cp - turning * sp, ddpitch, -ddroll * sp - turning * cp],
        axis=1,
    )
    # The vector from the pivot to the origin of B.
    r = -moments.pivot * R_FB[:, :, 0]
    p, v = r + np.array([moments.pivot, 0.0, 0.0]), cross(w, r)
    a = cross(alpha, r) + cross(w, v)
    for vector, values in ((p, moments.q), (v, moments.dq), (a, moments.ddq)):
        vector[:, 2] += values[:, 0]
    return FrameMotion(R_FB, p, w, v, alpha, a)


class FrameMotion(NamedTuple):
    """Pose, velocity and acceleration of a frame F in a frame E at N times.

    Attributes:
        R: (N, 3, 3) rotations R_EF.
        p: (N, 3) positions of F's origin in E [m].
        w, v: (N, 3) angular and linear velocity of F in E, expressed in E
            [rad/s, m/s].
        alpha, a: (N, 3) angular and linear acceleration of F in E, expressed in
            E [rad/s^2, m/s^2].
    """

    R: np.ndarray
    p: np.ndarray
    w: np.ndarray
    v: np.ndarray
    alpha: np.ndarray
    a: np.ndarray

    def acceleration_at(self, p_FQ: np.ndarray) -> np.ndarray:
        """Returns the accelerations (N, 3) of a point Q of frame F [m/s^2].

        Q is fixed in F, at the position `p_FQ` (3,) [m]. The accelerations are
        relative to frame E and expressed in E.
        """
        r = rotated(self.R, p_FQ[None])
        return self.a + cross(self.alpha, r) + cross(self.w, cross(self.w, r))

    def of_frame(self, motion: FrameMotion) -> FrameMotion:
        """Returns the motion in E of a frame B, from the motion of B in F.

        This object is the motion of F in E; `motion` is the motion of B in F.
        """
        p, w, v, alpha, a = (rotated(self.R, vector) for vector in motion[1:])
        rotating = cross(self.alpha, p) + cross(self.w, cross(self.w, p))
        return FrameMotion(
            R=product(self.R, motion.R),
            p=self.p + p,
            w=self.w + w,
            v=self.v + v + cross(self.w, p),
            alpha=self.alpha + alpha + cross(self.w, w),
            a=self.a + a + rotating + 2.0 * cross(self.w, v),
        )


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the cross products (N, 3) of vectors (N, 3).

    For a few vectors, this function is several times faster than `numpy.cross`.
    """
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]
