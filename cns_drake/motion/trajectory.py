"""A vehicle's trajectory: pose, velocity and acceleration at any time."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.trajectories import BsplineTrajectory
from scipy.spatial.transform import Rotation

from cns_drake.motion.body_ride import (
    BodyRide,
    FrameMotion,
    RideMoments,
    cross,
    ride_motion,
)
from cns_drake.motion.path_geometry import PathJet, SmoothPath
from cns_drake.motion.speeds import Speeds
from cns_drake.motion.splines import (
    REACH,
    SplineDerivatives,
    make_uniform_spline,
)
from evaluation.base import cos, product, rotated, sin
from worlds.shapes import LanePath

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
    jet: PathJet
    ride: RideMoments | None


class Trajectory:
    """The motion X_WB(t) of a vehicle along a lane path.

    F is the frame of the path: its origin on the ground follows the path, x
    points along the tangent of the path, and y horizontally to the left. On a
    slope, F pitches with the road; F never rolls. The vehicle frame B equals F,
    unless the body moves on springs relative to F. Velocities and accelerations
    are exact derivatives of splines, and not differences of samples. The motion
    starts and ends at rest.

    Attributes:
        path: the smooth path of F's origin.
        speed_profile: speed along the path.
    """

    def __init__(self, lane_path: LanePath, speeds: Speeds):
        self.path = SmoothPath(lane_path.points, lane_path.spacing)
        self.speed_profile = _find_speed_profile(
            self.path, lane_path.speed_limits, speeds
        )
        self._time_scaling = SplineDerivatives(
            _make_time_scaling(_drive_positions(self.speed_profile)),
            2,
        )
        self._travelled = self.path.integral(lambda jet: jet.speed)
        self._ride: BodyRide | None = None

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
        R_WF = _path_rotations(jet)
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


def _path_rotations(jet: PathJet) -> np.ndarray:
    yaw_pitch = np.stack([jet.yaw, -jet.climb], axis=1)
    # Capital letters: one after the other, about the axes of the vehicle.
    return Rotation.from_euler("ZY", yaw_pitch).as_matrix()


def _path_motion(
    jet: PathJet, rate: np.ndarray, acceleration: np.ndarray
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
        R=_path_rotations(jet),
        p=jet.p,
        w=yaw_rate[:, None] * _UP + pitch_rate[:, None] * left,
        v=jet.dp * rate,
        alpha=ddyaw[:, None] * _UP - ddclimb[:, None] * left + turning,
        a=jet.ddp * rate**2 + jet.dp * acceleration,
    )


# Distance between the knots of the time scaling [s]. The acceleration changes
# within about two of them, so the jerk stays near (acceleration / knot period).
_KNOT_PERIOD = 0.3
# Distance between the places at which the limits are evaluated [m].
_STEP = 0.1
# Margin for places in between: the limits are smooth over several metres.
_MARGIN = 0.998
# The smoothed drive is ahead of the original one by less than this [m].
_SMOOTHING_SLACK = 0.2


class _SpeedProfile(NamedTuple):
    """Speeds of the fastest permitted drive along a path, from rest to rest.

    Attributes:
        u: (N,) evenly spaced places on the path [m].
        speed: (N,) speeds at these places [m/s].
        acceleration: bound on the acceleration [m/s^2].
    """

    u: np.ndarray
    speed: np.ndarray
    acceleration: float


def _make_time_scaling(positions: np.ndarray) -> BsplineTrajectory:
    """Returns the path parameter of a drive as a smooth function of time.

    Args:
        positions: (N,) path parameters [m] at evenly spaced times, one for each
            `_KNOT_PERIOD` [s]. The first three are equal, and the last three
            are equal, so that the drive starts and ends at rest.
    """
    return make_uniform_spline(positions[:, None], _KNOT_PERIOD)


def _find_speed_profile(
    path: SmoothPath, speed_limits: np.ndarray, speeds: Speeds
) -> _SpeedProfile:
    """Returns the speeds of the fastest drive along a path within all limits.

    The drive starts and ends at rest. The acceleration is piecewise constant.

    Args:
        path: the path.
        speed_limits: (N,) speed limit at each control point of the path [m/s].
        speeds: limits of the speed, and of the longitudinal and the lateral
            acceleration.
    """
    # Later, the positions of this drive at evenly spaced times become the
    # control points of a quintic B-spline u(t). At each time, u' is a weighted
    # mean of the drive's speed, and u'' of its acceleration, over at most
    # REACH + 1 knot periods before and after. A limit on the acceleration
    # therefore also holds for u''; a limit on the speed holds for u' only if
    # the drive keeps it for as long, see `_widened_limits`.
    #
    # |p'| <= 1, so that a limit on u' also limits the speed. The acceleration
    # differs from u'' by a term that is subtracted from the limit.
    u = np.linspace(0.0, path.end, max(2, int(np.ceil(path.end / _STEP)) + 1))
    jet = path.evaluate(u)
    bending = np.linalg.norm(np.cross(jet.dp, jet.ddp), axis=1) / jet.speed
    lateral = np.sqrt(
        _MARGIN * speeds.lateral_acceleration / np.maximum(bending, 1e-9)
    )
    limit = np.minimum(lateral, speeds.cruise)
    # At each place, the lower of the limits at both ends of its interval.
    knot = (u / path.spacing).astype(int).clip(0, len(speed_limits) - 2)
    limit = np.minimum(limit, speed_limits[knot])
    limit = np.minimum(limit, speed_limits[knot + 1])
    # Along the path v = |p'| u', and therefore v' = |p'| u'' + |p'|' u'^2. The
    # second term may take up half of the acceleration.
    half = speeds.longitudinal_acceleration / 2.0
    stretch = np.maximum(np.abs(jet.dspeed), 1e-9)
    limit = np.minimum(limit, np.sqrt(half / stretch))
    limit = _widened_limits(limit, u[1])
    second_term = np.max(np.abs(jet.dspeed) * limit**2)
    acceleration = _MARGIN * speeds.longitudinal_acceleration - second_term
    speed = np.sqrt(_reachable_squares(limit**2, acceleration, u[1]))
    return _SpeedProfile(u, speed, acceleration)


def _drive_positions(profile: _SpeedProfile) -> np.ndarray:
    """Returns the drive's positions on its path at evenly spaced times.

    Returns:
        (N,) path parameters [m], one for each `_KNOT_PERIOD`, for
        `_make_time_scaling`. The first few and the last few are equal, because
        the drive starts and ends at rest.
    """
    u, speed, _ = profile
    times = np.concatenate(
        [[0.0], np.cumsum(2 * np.diff(u) / (speed[1:] + speed[:-1]))]
    )
    # With REACH knots of rest at both ends, the spline is at rest there, too.
    knots = int(np.ceil(times[-1] / _KNOT_PERIOD)) + 2 * REACH
    drive_times = (np.arange(knots + 1) - REACH) * _KNOT_PERIOD
    return _positions_at(drive_times, times, u, speed)


def _widened_limits(limit: np.ndarray, step: float) -> np.ndarray:
    """Returns limits (N,) that also hold some time before and after each place.

    If a drive keeps the limit v of a place within the distance T * v of the
    place, its speed is at most v from the time T before the place until the
    time T after it.
    """
    period = (REACH + 1) * _KNOT_PERIOD
    reach = np.ceil((period * limit + _SMOOTHING_SLACK) / step).astype(int)
    result = limit.copy()
    for shift in range(1, int(reach.max()) + 1):
        spread = np.where(reach >= shift, limit, np.inf)
        result[:-shift] = np.minimum(result[:-shift], spread[shift:])
        result[shift:] = np.minimum(result[shift:], spread[:-shift])
    return result


def _reachable_squares(
    squared_limit: np.ndarray, acceleration: float, step: float
) -> np.ndarray:
    """Returns the greatest squared speeds within limits, from rest to rest."""
    gain = 2 * acceleration * step
    squared = squared_limit.copy()
    squared[0] = squared[-1] = 0.0
    for k in range(1, len(squared)):
        squared[k] = min(squared[k], squared[k - 1] + gain)
    for k in range(len(squared) - 2, -1, -1):
        squared[k] = min(squared[k], squared[k + 1] + gain)
    return squared


def _positions_at(
    wanted: np.ndarray, times: np.ndarray, u: np.ndarray, speed: np.ndarray
) -> np.ndarray:
    """Returns positions at wanted times; the drive rests before and after."""
    wanted = np.clip(wanted, 0.0, times[-1])
    k = np.searchsorted(times, wanted, side="right") - 1
    k = k.clip(0, len(times) - 2)
    elapsed = wanted - times[k]
    acceleration = (speed[k + 1] - speed[k]) / (times[k + 1] - times[k])
    return u[k] + speed[k] * elapsed + acceleration * elapsed**2 / 2
