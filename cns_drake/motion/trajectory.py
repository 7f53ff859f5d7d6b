"""A vehicle's trajectory: pose, velocity and acceleration at any time."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from scipy.spatial.transform import Rotation

from cns_drake.base.elementary import cos, product, rotated, sin
from cns_drake.motion import path_geometry, speed_profile
from cns_drake.roads.lane_path import LanePath, Speeds


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


# Heave, roll and pitch.
NUM_COORDINATES = 3


class RideMoments(NamedTuple):
    """Heave, roll and pitch of a vehicle's body at N times, with derivatives.

    Attributes:
        q: (N, 3) upward motion of the body [m], and its roll and pitch about
            the x and y axis of the vehicle [rad].
        dq, ddq: (N, 3) first and second time derivatives of `q`.
        pivot: x of the point on the ground about which the body rotates [m].
    """

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    pivot: float


class BodyRide:
    """The motion X_FB(t) of a body B relative to the frame F of its path.

    At rest on a level road, B equals F. Heave, roll and pitch and their first
    and second derivatives are given at evenly spaced times. Between these times
    they are polynomials of degree 5, so that accelerations have no jumps. The
    body rotates about a point on the ground, by its pitch and then by its roll.
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
            [float(step) ** k for k in range(5, -1, -1)], (6, 1, 1)
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


_UP = np.array([[0.0, 0.0, 1.0]])


class Moments(NamedTuple):
    """The state of a drive at N times, from which all motion is computed.

    Attributes:
        u: (N,) path parameters of the vehicle [m].
        rate, acceleration: (N,) first and second time derivatives of `u` [m/s,
            m/s^2].
        jet: the path and its derivatives at these parameters.
        ride: motion of the body on its springs relative to the path; None for a
            rigid vehicle.
    """

    u: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    jet: path_geometry.PathJet
    ride: RideMoments | None


class Trajectory:
    """The motion X_WB(t) of a vehicle along a lane path.

    F is the frame of the path: its origin on the ground follows the path, x
    points along the tangent of the path, and y horizontally to the left. On a
    slope, F pitches with the road; F never rolls. The vehicle frame B equals F,
    unless the body moves on springs relative to F. Velocities and accelerations
    are exact derivatives of splines, and not differences of samples. The motion
    starts and ends at rest.
    """

    def __init__(self, lane_path: LanePath, speeds: Speeds):
        self.path = path_geometry.SmoothPath(
            lane_path.points, lane_path.spacing
        )
        self.speed_profile = speed_profile.find_speed_profile(
            self.path, lane_path.speed_limits, speeds
        )
        self._time_scaling = path_geometry.SplineDerivatives(
            speed_profile.make_time_scaling(
                speed_profile.drive_positions(self.speed_profile)
            ),
            2,
        )
        self._travelled = self.path.integral(lambda jet: jet.speed)
        self._ride: BodyRide | None = None

    def with_positions(self, positions: np.ndarray) -> Trajectory:
        """Returns a drive along the same path with another timing.

        Args:
            positions: (N,) path parameters [m] at evenly spaced times, see
                `cns_drake.motion.speed_profile.make_time_scaling`.
        """
        drive = copy.copy(self)
        drive._time_scaling = path_geometry.SplineDerivatives(
            speed_profile.make_time_scaling(positions), 2
        )
        return drive

    def with_ride(self, ride: BodyRide) -> Trajectory:
        """Returns the trajectory with heave, roll and pitch of the vehicle."""
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
        return float(self._travelled(self.path.end))

    def path_parameter(self, t: ArrayLike) -> list[np.ndarray]:
        """Returns path parameter u, u' and u'', each (N,), at times (N,)."""
        values = self._time_scaling.evaluate(np.atleast_1d(t))
        return [value[:, 0] for value in values]

    def at(self, t: ArrayLike) -> Moments:
        """Returns the state of the drive at times (N,) [s]."""
        u, rate, acceleration = self.path_parameter(t)
        ride = None if self._ride is None else self._ride.at(t)
        return Moments(u, rate, acceleration, self.path.evaluate(u), ride)

    def path_motion(self, t: ArrayLike) -> FrameMotion:
        """Returns the motion of the path frame F in W at times (N,)."""
        u, rate, acceleration = self.path_parameter(t)
        return _path_motion(self.path.evaluate(u), rate, acceleration)

    def body_motion(self, t: ArrayLike) -> FrameMotion:
        """Returns the motion of the vehicle frame B in W at times (N,)."""
        motion = self.path_motion(t)
        if self._ride is None:
            return motion
        return motion.of_frame(ride_motion(self._ride.at(t)))

    def travelled(self, t: ArrayLike) -> np.ndarray:
        """Returns the distances (N,) travelled at times (N,) [m]."""
        return self._travelled(self.path_parameter(t)[0])

    def positions(self, t: ArrayLike) -> np.ndarray:
        """Returns the positions p_WF (N, 3) on the path at times (N,) [m]."""
        return self.path.evaluate(self.path_parameter(t)[0]).p

    def pose(self, t: float) -> RigidTransform:
        """Returns the pose X_WB at a time [s]."""
        return pose_at(self.at(t))

    def poses(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Returns R_WB (N, 3, 3) and p_WB (N, 3) [m] at times (N,)."""
        jet = self.path.evaluate(self.path_parameter(t)[0])
        R_WF = _rotations(jet)
        if self._ride is None:
            return R_WF, jet.p
        ride = ride_motion(self._ride.at(t))
        return product(R_WF, ride.R), jet.p + rotated(R_WF, ride.p)


def pose_at(moments: Moments, row: int = 0) -> RigidTransform:
    """Returns the pose X_WB at the time with the index `row` in `moments`."""
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
    """Returns X_WB and the motion of B in W, both at N times."""
    motion = _path_motion(moments.jet, moments.rate, moments.acceleration)
    if moments.ride is None:
        return [pose_at(moments, k) for k in range(len(moments.u))], motion
    motion = motion.of_frame(ride_motion(moments.ride))
    X_WBs = [
        RigidTransform(RotationMatrix(R), p)
        for R, p in zip(motion.R, motion.p, strict=True)
    ]
    return X_WBs, motion


def _rotations(jet: path_geometry.PathJet) -> np.ndarray:
    yaw_pitch = np.stack([jet.yaw, -jet.climb], axis=1)
    # Capital letters: one after the other, about the axes of the vehicle.
    return Rotation.from_euler("ZY", yaw_pitch).as_matrix()


def _path_motion(
    jet: path_geometry.PathJet, rate: np.ndarray, acceleration: np.ndarray
) -> FrameMotion:
    """Returns the motion of F in W; for the arguments, see `Moments`."""
    yaw_rate, pitch_rate = jet.dyaw * rate, -jet.dclimb * rate
    ddyaw = jet.ddyaw * rate**2 + jet.dyaw * acceleration
    ddclimb = jet.ddclimb * rate**2 + jet.dclimb * acceleration
    # The pitch axis, to the left, rotates with the vehicle.
    zero = np.zeros_like(jet.yaw)
    left = np.stack([-sin(jet.yaw), cos(jet.yaw), zero], axis=1)
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
