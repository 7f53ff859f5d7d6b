"""Where a vehicle is, how it moves and accelerates at every time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from scipy.spatial.transform import Rotation

from cns_drake.motion.path_geometry import (
    PathIntegral,
    PathJet,
    PathSection,
    SmoothPath,
)
from cns_drake.motion.speed_profile import make_time_scaling
from cns_drake.motion.speeds import Speeds
from cns_drake.motion.uniform_spline import SplineDerivatives
from cns_drake.roads.lane_path import LanePath

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class AngleMotion:
    """An angle [rad], its rate [rad/s] and acceleration [rad/s^2]."""

    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


class Moments(NamedTuple):
    """The path at N times, from which everything else follows.

    Attributes:
        u: (N,) path parameters.
        rate: (N,) their rates [1/s].
        acceleration: (N,) their accelerations [1/s^2].
        jet: the path there.
        section: the path that leads up to them, for integrals along it.
    """

    u: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    jet: PathJet
    section: PathSection


class Trajectory:
    """The motion X_WB(t) of a vehicle along a lane path.

    B is the vehicle frame: its origin on the ground follows the path, x
    along the tangent, y horizontal to the left. On a slope the pitch follows
    the road; there is no roll. The motion is exact: derivatives are taken
    of the splines, not of samples. It starts and ends at rest.
    """

    def __init__(self, lane_path: LanePath, speeds: Speeds):
        """Makes the trajectory."""
        self._path = SmoothPath(lane_path.points, lane_path.spacing)
        self._time_scaling = SplineDerivatives(
            make_time_scaling(self._path, lane_path.speed_limits, speeds), 2
        )
        self._travelled = PathIntegral(self._path, lambda jet: jet.speed)

    @property
    def duration(self) -> float:
        """The time from rest to rest [s]."""
        return self._time_scaling.end

    @property
    def length(self) -> float:
        """The length of the path [m]."""
        return self._travelled.total

    @property
    def path(self) -> SmoothPath:
        """The path."""
        return self._path

    def path_parameter(self, t: ArrayLike) -> list[np.ndarray]:
        """Returns the path parameter u and its rates u', u'' at (N,) times."""
        values = self._time_scaling.evaluate(np.atleast_1d(t))
        return [value[:, 0] for value in values]

    def at(self, t: ArrayLike) -> Moments:
        """Returns the path at (N,) times."""
        u, rate, acceleration = self.path_parameter(t)
        jet, section = self._path.evaluate_with_section(u)
        return Moments(u, rate, acceleration, jet, section)

    def travelled(self, t: ArrayLike) -> np.ndarray:
        """Returns the (N,) distances travelled at (N,) times [m]."""
        return self._travelled.evaluate(self.at(t).section)

    def positions(self, t: ArrayLike) -> np.ndarray:
        """Returns the (N, 3) positions p_WB at (N,) times [m]."""
        return self._path.evaluate(self.path_parameter(t)[0]).p

    def pose(self, t: float) -> RigidTransform:
        """Returns X_WB at a time."""
        return pose_at(self.at(t))

    def poses(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Returns R_WB (N, 3, 3) and p_WB (N, 3) [m] at (N,) times."""
        jet = self._path.evaluate(self.path_parameter(t)[0])
        yaw_pitch = np.stack([jet.yaw, -jet.climb], axis=1)
        # Capitals: about the axes of the vehicle, one after the other.
        return Rotation.from_euler("ZY", yaw_pitch).as_matrix(), jet.p

    def spatial_velocity(self, t: float) -> SpatialVelocity:
        """Returns V_WB, expressed in the world [rad/s, m/s]."""
        return spatial_velocity_at(self.at(t))

    def spatial_acceleration(self, t: float) -> SpatialAcceleration:
        """Returns A_WB, expressed in the world [rad/s^2, m/s^2]."""
        return spatial_acceleration_at(self.at(t))


def pose_at(moments: Moments, row: int = 0) -> RigidTransform:
    """Returns X_WB at one of several times."""
    jet = moments.jet
    return RigidTransform(
        RollPitchYaw(0.0, -jet.climb[row], jet.yaw[row]), jet.p[row]
    )


def spatial_velocity_at(moment: Moments) -> SpatialVelocity:
    """Returns V_WB at one time, expressed in the world [rad/s, m/s]."""
    jet, rate = moment.jet, moment.rate[0]
    yaw_rate, pitch_rate = jet.dyaw[0] * rate, -jet.dclimb[0] * rate
    w = yaw_rate * _UP + pitch_rate * _left(jet)
    return SpatialVelocity(w, jet.dp[0] * rate)


def spatial_acceleration_at(moment: Moments) -> SpatialAcceleration:
    """Returns A_WB at one time, in the world [rad/s^2, m/s^2]."""
    jet, rate = moment.jet, moment.rate[0]
    acceleration = moment.acceleration[0]
    yaw_rate, pitch_rate = jet.dyaw[0] * rate, -jet.dclimb[0] * rate
    left = _left(jet)
    alpha = (
        (jet.ddyaw[0] * rate**2 + jet.dyaw[0] * acceleration) * _UP
        - (jet.ddclimb[0] * rate**2 + jet.dclimb[0] * acceleration) * left
        # The pitch axis turns with the vehicle.
        + yaw_rate * pitch_rate * np.cross(_UP, left)
    )
    a = jet.ddp[0] * rate**2 + jet.dp[0] * acceleration
    return SpatialAcceleration(alpha, a)


def _left(jet: PathJet) -> np.ndarray:
    return np.array([-np.sin(jet.yaw[0]), np.cos(jet.yaw[0]), 0.0])


class WheelMotion:
    """Steering and rolling of one wheel that does not slip.

    The wheel's centre is at p_BC = (x, y, r) in the vehicle frame, r its
    radius. With path speed s, turn rate m about the vehicle's z and steering
    angle d (all per path parameter), the ground below the wheel passes with
    (s - m y, m x): tan(d) = m x / (s - m y), so a wheel on the rear axle
    (x = 0) needs no steering, and it rolls by the length of that vector
    divided by r.
    """

    def __init__(self, trajectory: Trajectory, p_BC: np.ndarray):
        """Prepares the wheel.

        Args:
            trajectory: of the vehicle.
            p_BC: position of the wheel's centre in the vehicle frame [m].
        """
        self._x, self._y, self._radius = p_BC
        self._rolled = PathIntegral(
            trajectory.path, lambda jet: np.hypot(*self._ground_velocity(jet))
        )

    def _ground_velocity(self, jet: PathJet) -> tuple[np.ndarray, np.ndarray]:
        return jet.speed - jet.turn * self._y, jet.turn * self._x

    def steering(self, moments: Moments) -> AngleMotion:
        """Returns the steering at (N,) times, positive to the left."""
        _, rate, acceleration, jet, _ = moments
        a, b, da, db, dda, ddb = self._ground_motion(jet)
        squared = a**2 + b**2
        dsquared = 2.0 * (a * da + b * db)
        dsteer = (a * db - b * da) / squared
        ddsteer = (a * ddb - b * dda - dsteer * dsquared) / squared
        return AngleMotion(
            angle=np.arctan2(b, a),
            rate=dsteer * rate,
            acceleration=ddsteer * rate**2 + dsteer * acceleration,
        )

    def rolling(self, moments: Moments) -> AngleMotion:
        """Returns the rolling at (N,) times.

        It is positive forwards and zero at the start.
        """
        _, rate, acceleration, jet, section = moments
        a, b, da, db, _, _ = self._ground_motion(jet)
        g = np.hypot(a, b)
        dg = (a * da + b * db) / g
        return AngleMotion(
            angle=self._rolled.evaluate(section) / self._radius,
            rate=g * rate / self._radius,
            acceleration=(dg * rate**2 + g * acceleration) / self._radius,
        )

    def _ground_motion(self, jet: PathJet) -> tuple[np.ndarray, ...]:
        """Returns the ground's velocity and its two derivatives by u."""
        return (
            *self._ground_velocity(jet),
            jet.dspeed - jet.dturn * self._y,
            jet.dturn * self._x,
            jet.ddspeed - jet.ddturn * self._y,
            jet.ddturn * self._x,
        )
