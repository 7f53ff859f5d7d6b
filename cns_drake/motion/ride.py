"""Adds the motion of springs on a rough road to a drive."""

from __future__ import annotations

import numpy as np

from cns_drake.motion.body_ride import BodyRide
from cns_drake.motion.road_profile import RoadProfile
from cns_drake.motion.suspension import Suspension
from cns_drake.motion.trajectory import Trajectory

# The longest step [s]: a fifteenth of a period of the wheels on their tyres.
_STEP = 0.005
# The farthest that a wheel goes in a step, to resolve the profile's waves [m].
_STRIDE = 0.1
# Time for the body to come to rest at the end of the drive [s].
_AFTERWARDS = 3.0
_GRAVITY_W = np.array([0.0, 0.0, -9.81])


def ride_on_springs(
    trajectory: Trajectory, suspension: Suspension, profile: RoadProfile
) -> Trajectory:
    """Returns a drive on which the body heaves, rolls and pitches.

    The vehicle follows the same path at the same speed. Its springs feel the
    acceleration of the body's centre of mass, gravity on slopes, and the
    profile below each wheel.

    Args:
        trajectory: without ride.
        suspension: of the car.
        profile: of the road.
    """
    masses = suspension.masses
    end = trajectory.duration + _AFTERWARDS
    # The path's parameter and its length are nearly equal.
    _, speeds, _ = trajectory.path_parameter(np.arange(0.0, end, _STEP))
    step = min(_STEP, _STRIDE / speeds.max())
    frame = trajectory.path_motion(np.arange(0.0, end, step))
    # The profile at every wheel and every time.
    p_FQ_Wset = frame.R[:, :2, :2] @ masses.p_BWset.T
    p_WQset = frame.p[:, :2, None] + p_FQ_Wset
    heights = profile.heights(p_WQset.transpose(0, 2, 1).reshape(-1, 2))
    x, z = masses.center
    a_WG = frame.acceleration_at(np.array([x, 0.0, z]))
    force_F = np.einsum("nji,nj->ni", frame.R, a_WG - _GRAVITY_W)
    inputs = np.column_stack(
        [heights.reshape(len(a_WG), -1), force_F + _GRAVITY_W]
    )
    return trajectory.with_ride(
        BodyRide(*suspension.respond(inputs, step), step, x)
    )
