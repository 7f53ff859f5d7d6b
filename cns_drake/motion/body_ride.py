"""The motion of a sprung body relative to its path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.motion.frame_motion import FrameMotion, cross

# Heave, roll and pitch.
NUM_COORDINATES = 3


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

    At rest on a level road B is F. Its heave, roll and pitch are polynomials of
    degree 5 between even times, where values and two derivatives are given. The
    accelerations have no jumps. The body turns about a point on the ground, by
    its pitch and then by its roll.
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
        from scipy.interpolate import PPoly

        times = step * np.arange(len(q))
        self._end = times[-1]
        v, a = dq * step, ddq * step**2 / 2
        # Remainders of the value and its derivatives at the end, after degree
        # 2.
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


def ride_motion(moments: RideMoments) -> FrameMotion:
    """Returns how B moves in F.

    With R = R_y(pitch) R_x(roll), the roll axis turns with the pitch.
    """
    heave, roll, pitch = moments.q.T
    _, droll, dpitch = moments.dq.T
    _, ddroll, ddpitch = moments.ddq.T
    zero = np.zeros_like(heave)
    (cr, sr), (cp, sp) = ((np.cos(a), np.sin(a)) for a in (roll, pitch))
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
