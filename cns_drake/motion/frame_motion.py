"""Pose, velocity and acceleration of a frame in another frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base import product, rotated


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
