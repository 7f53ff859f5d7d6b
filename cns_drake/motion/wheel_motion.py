"""The motion of a wheel on a vehicle: steering, rolling, suspension travel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.elementary import arctan2
from cns_drake.motion.path_geometry import PathJet
from cns_drake.motion.trajectory import Moments, Trajectory


class JointMotion(NamedTuple):
    """The motion of a joint at N times: three arrays (N,).

    `position` is the angle [rad] or the distance [m]; `rate` and `acceleration`
    are its first and second time derivatives.
    """

    position: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


class WheelMotion:
    """Steering, rolling and suspension travel of a wheel without slip.

    The wheel's centre is at p_BC = (x, y, r) in the vehicle frame, where r is
    the wheel's radius. Let s be the vehicle's speed and m its turn rate about
    the z axis, both per unit of the path parameter. The velocity of the wheel
    over the ground is then v = (s - m y, m x), expressed in the vehicle frame.
    The wheel rolls in this direction: tan(d) = m x / (s - m y) gives its
    steering angle d, so that a wheel on the rear axle (x = 0) is not steered.
    The rolling rate is the length of v divided by r.

    While the body moves on its springs, the wheel stays on the road's surface
    in the world: relative to the body, it moves up by as much as the body moves
    down at the wheel. The error of this relation vanishes for small angles, and
    is within a millimetre at 3 degrees. Steering and rolling do not depend on
    the motion on springs.
    """

    def __init__(self, trajectory: Trajectory, p_BC: np.ndarray):
        """Takes the trajectory, and the wheel's centre p_BC (3,) [m]."""
        self._x, self._y, self._radius = p_BC
        self._rolled = trajectory.path.integral(
            lambda jet: np.hypot(*self._ground_velocity(jet))
        )

    def _ground_velocity(self, jet: PathJet) -> tuple[np.ndarray, np.ndarray]:
        return jet.speed - jet.turn * self._y, jet.turn * self._x

    def steering(self, moments: Moments) -> JointMotion:
        """Returns the wheel's steering angle at N times, with derivatives.

        The angle [rad] is positive to the left.
        """
        rate, acceleration, jet = moments[1:4]
        a, b, da, db, dda, ddb = self._ground_motion(jet)
        squared = a**2 + b**2
        dsquared = 2.0 * (a * da + b * db)
        dsteer = (a * db - b * da) / squared
        ddsteer = (a * ddb - b * dda - dsteer * dsquared) / squared
        return JointMotion(
            position=arctan2(b, a),
            rate=dsteer * rate,
            acceleration=ddsteer * rate**2 + dsteer * acceleration,
        )

    def rolling(self, moments: Moments) -> JointMotion:
        """Returns the wheel's rolling angle at N times, with derivatives.

        The angle [rad] is zero at the start and grows when the vehicle drives
        forwards.
        """
        u, rate, acceleration, jet = moments[:4]
        a, b, da, db, _, _ = self._ground_motion(jet)
        g = np.hypot(a, b)
        dg = (a * da + b * db) / g
        return JointMotion(
            position=self._rolled(u) / self._radius,
            rate=g * rate / self._radius,
            acceleration=(dg * rate**2 + g * acceleration) / self._radius,
        )

    def travel(self, moments: Moments) -> JointMotion:
        """Returns the suspension travel of the wheel at N times [m].

        This is the upward motion of the wheel relative to the body. The travel
        is zero for a vehicle without springs.
        """
        ride = moments.ride
        if ride is None:
            still = np.zeros_like(moments.u)
            return JointMotion(still, still, still)
        # In a fixed order, since the rounding of a matrix product depends on
        # the number of rows.
        return JointMotion(
            *(
                (self._x - ride.pivot) * pitch - self._y * roll - heave
                for heave, roll, pitch in (ride.q.T, ride.dq.T, ride.ddq.T)
            )
        )

    def _ground_motion(self, jet: PathJet) -> tuple[np.ndarray, ...]:
        """Returns the velocity of the ground, and two derivatives by u."""
        return (
            *self._ground_velocity(jet),
            jet.dspeed - jet.dturn * self._y,
            jet.dturn * self._x,
            jet.ddspeed - jet.ddturn * self._y,
            jet.ddturn * self._x,
        )
