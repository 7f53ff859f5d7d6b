"""The motion of one frame in another, at many times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class FrameMotion(NamedTuple):
    """Pose, velocity and acceleration of a frame F in a frame E at N times.

    Attributes:
        R: (N, 3, 3) rotation R_EF.
        p: (N, 3) place of F's origin [m].
        w, v: (N, 3) angular [rad/s] and linear velocity [m/s], in E.
        alpha, a: (N, 3) angular [rad/s^2] and linear acceleration [m/s^2], in
            E.
    """

    R: np.ndarray
    p: np.ndarray
    w: np.ndarray
    v: np.ndarray
    alpha: np.ndarray
    a: np.ndarray

    def acceleration_at(self, p_FQ: np.ndarray) -> np.ndarray:
        """Returns (N, 3) accelerations of a point Q fixed in F [m/s^2]."""
        r = self.R @ p_FQ
        return self.a + cross(self.alpha, r) + cross(self.w, cross(self.w, r))

    def of_frame(self, motion: FrameMotion) -> FrameMotion:
        """Returns the motion in E of a frame B that moves in F.

        Args:
            motion: of B in F.
        """
        p, w, v, alpha, a = (
            np.einsum("nij,nj->ni", self.R, vector) for vector in motion[1:]
        )
        rotating = cross(self.alpha, p) + cross(self.w, cross(self.w, p))
        return FrameMotion(
            R=self.R @ motion.R,
            p=self.p + p,
            w=self.w + w,
            v=self.v + v + cross(self.w, p),
            alpha=self.alpha + alpha + cross(self.w, w),
            a=self.a + a + rotating + 2.0 * cross(self.w, v),
        )


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the (N, 3) cross products of (N, 3) vectors.

    For a few vectors it takes a fraction of the time of `numpy.cross`.
    """
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]
