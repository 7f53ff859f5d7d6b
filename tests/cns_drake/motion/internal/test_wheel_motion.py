"""Wheels that steer and roll without slip, against closed forms."""

from helpers.drives import (
    CAREFUL,
    helix_points,
    lane_path,
    smoothed_radius,
    wavy_points,
)
import numpy as np
import pytest

from cns_drake.motion import Trajectory
from cns_drake.motion.vehicle_motion import WheelMotion


def test_wheels_of_a_steady_bend_roll_on_circles():
    radius = 25.0
    r = smoothed_radius(25.0)
    trajectory = Trajectory(lane_path(helix_points(radius, 0, 100)), CAREFUL)
    t = trajectory.duration / 2 + np.array([0.0, 0.5])
    yaw_rate = trajectory.path_parameter(t)[1] / radius
    for x, y in ((0.0, 0.8), (0.0, -0.8), (2.8, 0.8), (2.8, -0.8)):
        wheel = WheelMotion(trajectory, (x, y, 0.3))
        steering = wheel.steering(trajectory.at(t))
        rolling = wheel.rolling(trajectory.at(t))
        # The turning centre lies at (0, r) in the vehicle frame.
        own_radius = np.hypot(r - y, x)
        np.testing.assert_allclose(steering.position, np.arctan2(x, r - y))
        np.testing.assert_allclose(steering.rate, 0.0, atol=1e-6)
        np.testing.assert_allclose(
            rolling.rate, yaw_rate * own_radius / 0.3, rtol=1e-8
        )
        rolled = rolling.position[1] - rolling.position[0]
        assert rolled == pytest.approx(0.5 * rolling.rate[0], rel=1e-8)


def test_wheel_rates_are_derivatives_of_the_angles():
    trajectory = Trajectory(lane_path(wavy_points(2)), CAREFUL)
    wheel = WheelMotion(trajectory, (2.8, -0.8, 0.33))
    t = np.linspace(1.0, trajectory.duration - 1.0, 200)
    step = 1e-4
    for turn in (wheel.steering, wheel.rolling):
        now, before, after = (
            turn(trajectory.at(t + shift)) for shift in (0.0, -step, step)
        )
        rate = (after.position - before.position) / (2 * step)
        np.testing.assert_allclose(now.rate, rate, atol=1e-5)
        acceleration = (after.rate - before.rate) / (2 * step)
        np.testing.assert_allclose(now.acceleration, acceleration, atol=1e-5)
