"""The smooth curve that a vehicle follows, and its derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.motion.splines import SplineDerivatives, make_uniform_spline
from evaluation.base import arctan2

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


# Distance between the places at which bends and integrands are evaluated [m].
# It is far below the distance of the knots, over which the curvature changes.
_STEP = 0.1


@dataclass(frozen=True)
class PathJet:
    """The path and its derivatives with respect to the path parameter u.

    A name with n leading letters `d` is an n-th derivative with respect to u.
    All attributes are arrays over N parameters.

    Attributes:
        p, dp, ddp: (N, 3) position in W [m].
        yaw, dyaw, ddyaw: heading about the z axis of W, without jumps [rad].
        climb, dclimb, ddclimb: angle of the tangent above the horizon [rad].
        speed, dspeed, ddspeed: derivative of the arc length with respect to u,
            about 1.
        turn, dturn, ddturn: rate of rotation about the vehicle's z axis with
            respect to u [rad/m].
    """

    p: np.ndarray
    dp: np.ndarray
    ddp: np.ndarray
    yaw: np.ndarray
    dyaw: np.ndarray
    ddyaw: np.ndarray
    climb: np.ndarray
    dclimb: np.ndarray
    ddclimb: np.ndarray
    speed: np.ndarray
    dspeed: np.ndarray
    ddspeed: np.ndarray
    turn: np.ndarray
    dturn: np.ndarray
    ddturn: np.ndarray


class SmoothPath:
    """A quintic B-spline along the points of a lane path.

    The points are control points: the curve does not pass through them. In a
    bend of radius r, the curve runs spacing^2 / (4 r) inside the points. The
    curvature is continuous. The parameter u runs from 0 to `end`, in metres
    along the points.

    Attributes:
        spacing: distance between neighbouring points [m].
        end: greatest value of the parameter u [m].
    """

    def __init__(self, points: np.ndarray, spacing: float):
        """Makes the path along points (N, 3) in W, `spacing` apart [m]."""
        self.spacing = spacing
        self._spline = SplineDerivatives(
            make_uniform_spline(points, spacing), 4
        )
        self.end = self._spline.end
        # Headings at the knots, without jumps, from which turns are counted.
        knots = np.arange(len(points)) * spacing
        tangents = self._spline.evaluate(knots)[1]
        self._knot_yaw = np.unwrap(arctan2(tangents[:, 1], tangents[:, 0]))

    def evaluate(self, u: ArrayLike) -> PathJet:
        """Returns the path, and its derivatives with respect to u.

        Args:
            u: (N,) path parameters, from 0 to `end` [m].
        """
        u = np.atleast_1d(np.asarray(u, dtype=float))
        p, d1, d2, d3, d4 = self._spline.evaluate(u)
        (x1, y1, z1), (x2, y2, z2) = d1.T, d2.T
        (x3, y3, z3), (x4, y4, _) = d3.T, d4.T

        # h is the squared horizontal length of the tangent. The heading follows
        # from yaw' * h = x' y'' - y' x'', and its derivative from
        # differentiating both sides.
        h = x1**2 + y1**2
        dh = 2 * (x1 * x2 + y1 * y2)
        ddh = 2 * (x2**2 + x1 * x3 + y2**2 + y1 * y3)
        cross = x1 * y2 - y1 * x2
        dcross = x1 * y3 - y1 * x3
        ddcross = x2 * y3 - y2 * x3 + x1 * y4 - y1 * x4
        dyaw = cross / h
        ddyaw = (dcross - dyaw * dh) / h
        dddyaw = (ddcross - 2 * ddyaw * dh - dyaw * ddh) / h

        # Arc length: speed^2 = p' . p'.
        s = np.sqrt(h + z1**2)
        ds = np.sum(d1 * d2, axis=1) / s
        dds = (np.sum(d2 * d2 + d1 * d3, axis=1) - ds**2) / s

        # Climb: tan(climb) = z' / r, where r is the horizontal length of the
        # tangent.
        r = np.sqrt(h)
        dr = dh / (2 * r)
        ddr = (ddh / 2 - dr**2) / r
        climb = arctan2(z1, r)
        dclimb = (z2 * r - z1 * dr) / s**2
        ddclimb = (z3 * r - z1 * ddr) / s**2 - 2 * dclimb * ds / s

        # Yaw is about the z axis of W; the vehicle's z axis is tilted by the
        # climb.
        c, sine = r / s, z1 / s
        dc = -sine * dclimb
        ddc = -c * dclimb**2 - sine * ddclimb
        return PathJet(
            p=p,
            dp=d1,
            ddp=d2,
            yaw=self._unwrapped(u, arctan2(y1, x1)),
            dyaw=dyaw,
            ddyaw=ddyaw,
            climb=climb,
            dclimb=dclimb,
            ddclimb=ddclimb,
            speed=s,
            dspeed=ds,
            ddspeed=dds,
            turn=dyaw * c,
            dturn=ddyaw * c + dyaw * dc,
            ddturn=dddyaw * c + 2 * ddyaw * dc + dyaw * ddc,
        )

    def tightest_bend(self) -> tuple[float, np.ndarray]:
        """Returns the smallest radius of curvature of the path, and its place.

        Returns:
            The radius [m], and the point (3,) of the path in W at which the
            path has this radius [m].
        """
        jet = self.evaluate(self._dense_parameters())
        curvature = np.abs(jet.turn) / jet.speed
        at = int(curvature.argmax())
        return float(1 / max(curvature[at], 1e-12)), jet.p[at]

    def integral(self, integrand: Callable[[PathJet], np.ndarray]) -> PPoly:
        """Returns the integral of a function along the path, from 0 to u.

        The result is a function of the path parameter u. The error of the
        integral is far below a micrometre if the integrand is as smooth as the
        path.

        Args:
            integrand: function that takes the path at N parameters and returns
                (N,) values.
        """
        # This import is slow.
        from scipy.interpolate import CubicSpline

        u = self._dense_parameters()
        return CubicSpline(u, integrand(self.evaluate(u))).antiderivative()

    def _dense_parameters(self) -> np.ndarray:
        steps = int(np.ceil(self.end / _STEP))
        return np.linspace(0.0, self.end, steps + 1)

    def _unwrapped(self, u: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns the yaw (N,) plus the full turns made so far [rad]."""
        index = np.rint(np.clip(u, 0.0, self.end) / self.spacing).astype(int)
        nearby = self._knot_yaw[index.clip(0, len(self._knot_yaw) - 1)]
        return yaw + 2 * np.pi * np.rint((nearby - yaw) / (2 * np.pi))
