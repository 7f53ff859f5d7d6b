"""Pose, velocity and acceleration of a vehicle at every time."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from scipy.spatial.transform import Rotation

from cns_drake.motion.body_ride import (
    BodyRide,
    RideMoments,
    ride_motion,
)
from cns_drake.motion.frame_motion import FrameMotion, cross
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

_UP = np.array([[0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class JointMotion:
    """An angle [rad] or a distance [m], its rate and its acceleration."""

    position: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


class Moments(NamedTuple):
    """The path at N times; all motion is computed from it.

    Attributes:
        u: (N,) path parameters.
        rate: (N,) their rates [1/s].
        acceleration: (N,) their accelerations [1/s^2].
        jet: the path there.
        section: the sections of path before them, for integrals.
        ride: the motion of the body against the path; None if it is rigid.
    """

    u: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    jet: PathJet
    section: PathSection
    ride: RideMoments | None


class Trajectory:
    """The motion X_WB(t) of a vehicle along a lane path.

    F is the frame of the path: its origin on the ground follows the path, x
    along the tangent, y horizontal to the left. On a slope the pitch follows
    the road; there is no roll. The vehicle frame B is F, unless a ride on
    springs moves it against F. The motion is exact: derivatives are taken of
    the splines, not of samples. It starts and ends at rest.
    """

    def __init__(self, lane_path: LanePath, speeds: Speeds):
        """Makes the trajectory."""
        self._path = SmoothPath(lane_path.points, lane_path.spacing)
        self._time_scaling = SplineDerivatives(
            make_time_scaling(self._path, lane_path.speed_limits, speeds), 2
        )
        self._travelled = PathIntegral(self._path, lambda jet: jet.speed)
        self._ride: BodyRide | None = None

    def with_ride(self, ride: BodyRide) -> Trajectory:
        """Returns the same drive with a body that moves against its path."""
        riding = copy.copy(self)
        riding._ride = ride
        return riding

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
        ride = None if self._ride is None else self._ride.at(t)
        return Moments(u, rate, acceleration, jet, section, ride)

    def path_motion(self, t: ArrayLike) -> FrameMotion:
        """Returns the path frame F's motion in the world at (N,) times."""
        u, rate, acceleration = self.path_parameter(t)
        return _path_motion(self._path.evaluate(u), rate, acceleration)

    def body_motion(self, t: ArrayLike) -> FrameMotion:
        """Returns the vehicle frame B's motion in the world at (N,) times."""
        motion = self.path_motion(t)
        if self._ride is None:
            return motion
        return motion.of_frame(ride_motion(self._ride.at(t)))

    def travelled(self, t: ArrayLike) -> np.ndarray:
        """Returns the (N,) distances travelled at (N,) times [m]."""
        return self._travelled.evaluate(self.at(t).section)

    def positions(self, t: ArrayLike) -> np.ndarray:
        """Returns the (N, 3) positions p_WF on the path at (N,) times [m]."""
        return self._path.evaluate(self.path_parameter(t)[0]).p

    def pose(self, t: float) -> RigidTransform:
        """Returns X_WB at a time."""
        return pose_at(self.at(t))

    def poses(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Returns R_WB (N, 3, 3) and p_WB (N, 3) [m] at (N,) times."""
        jet = self._path.evaluate(self.path_parameter(t)[0])
        R_WF = _rotations(jet)
        if self._ride is None:
            return R_WF, jet.p
        ride = ride_motion(self._ride.at(t))
        return R_WF @ ride.R, jet.p + np.einsum("nij,nj->ni", R_WF, ride.p)

    def spatial_velocity(self, t: float) -> SpatialVelocity:
        """Returns V_WB, expressed in the world [rad/s, m/s]."""
        motion = self.body_motion(t)
        return SpatialVelocity(motion.w[0], motion.v[0])

    def spatial_acceleration(self, t: float) -> SpatialAcceleration:
        """Returns A_WB, expressed in the world [rad/s^2, m/s^2]."""
        motion = self.body_motion(t)
        return SpatialAcceleration(motion.alpha[0], motion.a[0])


def pose_at(moments: Moments, row: int = 0) -> RigidTransform:
    """Returns X_WB at one of several times."""
    jet = moments.jet
    X_WF = RigidTransform(
        RollPitchYaw(0.0, -jet.climb[row], jet.yaw[row]), jet.p[row]
    )
    if moments.ride is None:
        return X_WF
    ride = ride_motion(moments.ride)
    return X_WF @ RigidTransform(RotationMatrix(ride.R[row]), ride.p[row])


def poses_and_motion(
    moments: Moments,
) -> tuple[list[RigidTransform], FrameMotion]:
    """Returns X_WB at N times, and the motion of B in the world."""
    motion = _path_motion(moments.jet, moments.rate, moments.acceleration)
    if moments.ride is None:
        return [pose_at(moments, k) for k in range(len(moments.u))], motion
    motion = motion.of_frame(ride_motion(moments.ride))
    X_WBs = [
        RigidTransform(RotationMatrix(R), p)
        for R, p in zip(motion.R, motion.p, strict=True)
    ]
    return X_WBs, motion


def _rotations(jet: PathJet) -> np.ndarray:
    yaw_pitch = np.stack([jet.yaw, -jet.climb], axis=1)
    # Capital letters: about the axes of the vehicle in turn.
    return Rotation.from_euler("ZY", yaw_pitch).as_matrix()


def _path_motion(
    jet: PathJet, rate: np.ndarray, acceleration: np.ndarray
) -> FrameMotion:
    """Returns the motion of the path's frame F in the world.

    Args:
        jet: the path at N places.
        rate: (N,) rates of its parameter [1/s].
        acceleration: (N,) their rates [1/s^2].
    """
    yaw_rate, pitch_rate = jet.dyaw * rate, -jet.dclimb * rate
    ddyaw = jet.ddyaw * rate**2 + jet.dyaw * acceleration
    ddclimb = jet.ddclimb * rate**2 + jet.dclimb * acceleration
    # The pitch axis, to the left, turns with the vehicle.
    zero = np.zeros_like(jet.yaw)
    left = np.stack([-np.sin(jet.yaw), np.cos(jet.yaw), zero], axis=1)
    turning = (yaw_rate * pitch_rate)[:, None] * cross(_UP, left)
    rate, acceleration = rate[:, None], acceleration[:, None]
    return FrameMotion(
        R=_rotations(jet),
        p=jet.p,
        w=yaw_rate[:, None] * _UP + pitch_rate[:, None] * left,
        v=jet.dp * rate,
        alpha=ddyaw[:, None] * _UP - ddclimb[:, None] * left + turning,
        a=jet.ddp * rate**2 + jet.dp * acceleration,
    )


class WheelMotion:
    """Steering, rolling and travel of one wheel that does not slip.

    The wheel's centre is at p_BC = (x, y, r) in the vehicle frame, r its
    radius. With path speed s, turn rate m about the vehicle's z and steering
    angle d (all per path parameter), the ground below the wheel passes with
    (s - m y, m x): tan(d) = m x / (s - m y), so a wheel on the rear axle
    (x = 0) needs no steering, and it rolls by the length of that vector
    divided by r.

    While a ride moves the body, the wheel stays on the drawn ground: it travels
    up in the body by as much as the body comes down there. That is exact for
    small angles, and within a millimetre for 3 degrees. Steering and rolling
    are those without a ride.
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

    def steering(self, moments: Moments) -> JointMotion:
        """Returns the steering at (N,) times, positive to the left."""
        rate, acceleration, jet = moments[1:4]
        a, b, da, db, dda, ddb = self._ground_motion(jet)
        squared = a**2 + b**2
        dsquared = 2.0 * (a * da + b * db)
        dsteer = (a * db - b * da) / squared
        ddsteer = (a * ddb - b * dda - dsteer * dsquared) / squared
        return JointMotion(
            position=np.arctan2(b, a),
            rate=dsteer * rate,
            acceleration=ddsteer * rate**2 + dsteer * acceleration,
        )

    def rolling(self, moments: Moments) -> JointMotion:
        """Returns the rolling at (N,) times.

        It is positive forwards and zero at the start.
        """
        rate, acceleration, jet, section = moments[1:5]
        a, b, da, db, _, _ = self._ground_motion(jet)
        g = np.hypot(a, b)
        dg = (a * da + b * db) / g
        return JointMotion(
            position=self._rolled.evaluate(section) / self._radius,
            rate=g * rate / self._radius,
            acceleration=(dg * rate**2 + g * acceleration) / self._radius,
        )

    def travel(self, moments: Moments) -> JointMotion:
        """Returns the travel upwards in the body at (N,) times [m]."""
        ride = moments.ride
        if ride is None:
            still = np.zeros_like(moments.u)
            return JointMotion(still, still, still)
        down = np.array([-1.0, -self._y, self._x - ride.pivot])
        # One product of all rows would round by their number.
        return JointMotion(
            *(
                (one[:, None] @ down)[:, 0]
                for one in (ride.q, ride.dq, ride.ddq)
            )
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
