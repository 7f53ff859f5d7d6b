"""The speed along a path: within limits, with continuous acceleration."""

from typing import NamedTuple

import numpy as np
from pydrake.trajectories import BsplineTrajectory

from cns_drake.motion.path_geometry import SmoothPath
from cns_drake.motion.splines import REACH, make_uniform_spline
from cns_drake.roads import Speeds

# Distance between the knots of the time scaling [s]. The acceleration changes
# within about two of them, so the jerk stays near (acceleration / knot period).
KNOT_PERIOD = 0.3
# Distance between the places at which the limits are evaluated [m].
_STEP = 0.1
# Margin for places in between: the limits are smooth over several metres.
_MARGIN = 0.998
# The smoothed drive is ahead of the original one by less than this [m].
_SMOOTHING_SLACK = 0.2


class SpeedProfile(NamedTuple):
    """Speeds of the fastest permitted drive along a path, from rest to rest.

    Attributes:
        u: (N,) evenly spaced places on the path [m].
        speed: (N,) speeds at these places [m/s].
        acceleration: bound on the acceleration [m/s^2].
    """

    u: np.ndarray
    speed: np.ndarray
    acceleration: float


def make_time_scaling(positions: np.ndarray) -> BsplineTrajectory:
    """Returns the path parameter of a drive as a smooth function of time.

    Args:
        positions: (N,) path parameters [m] at evenly spaced times, one for each
            `KNOT_PERIOD` [s]. The first three are equal, and the last three are
            equal, so that the drive starts and ends at rest.
    """
    return make_uniform_spline(positions[:, None], KNOT_PERIOD)


def find_speed_profile(
    path: SmoothPath, speed_limits: np.ndarray, speeds: Speeds
) -> SpeedProfile:
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
    return SpeedProfile(u, speed, acceleration)


def drive_positions(profile: SpeedProfile) -> np.ndarray:
    """Returns the drive's positions on its path at evenly spaced times.

    Args:
        profile: speeds of the drive along the path.

    Returns:
        (N,) path parameters [m], one for each `KNOT_PERIOD`, for
        `make_time_scaling`. The first few and the last few are equal, because
        the drive starts and ends at rest.
    """
    u, speed, _ = profile
    times = np.concatenate(
        [[0.0], np.cumsum(2 * np.diff(u) / (speed[1:] + speed[:-1]))]
    )
    # With REACH knots of rest at both ends, the spline is at rest there, too.
    knots = int(np.ceil(times[-1] / KNOT_PERIOD)) + 2 * REACH
    drive_times = (np.arange(knots + 1) - REACH) * KNOT_PERIOD
    return _positions_at(drive_times, times, u, speed)


def _widened_limits(limit: np.ndarray, step: float) -> np.ndarray:
    """Returns limits (N,) that also hold some time before and after each place.

    If a drive keeps the limit v of a place within the distance T * v of the
    place, its speed is at most v from the time T before the place until the
    time T after it.
    """
    period = (REACH + 1) * KNOT_PERIOD
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
