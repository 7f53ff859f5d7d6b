"""Trajectories against closed forms, finite differences and their bounds."""

from helpers.drives import (
    CAREFUL,
    SPACING,
    check_derivatives,
    helix_points,
    lane_path,
    smoothed_radius,
    spatial_acceleration,
    spatial_velocity,
    wavy_points,
)
import numpy as np
import pytest

from cns_drake.motion import Speeds, Trajectory
from worlds.shapes import LanePath


def motion(trajectory, t):
    """Returns speed, acceleration along the path and across it."""
    u, rate, acceleration = trajectory.path_parameter(t)
    jet = trajectory.path.evaluate(u)
    v = jet.dp * rate[:, None]
    a = jet.ddp * rate[:, None] ** 2 + jet.dp * acceleration[:, None]
    tangent = jet.dp / np.linalg.norm(jet.dp, axis=1, keepdims=True)
    along = np.sum(a * tangent, axis=1)
    across = np.linalg.norm(a - along[:, None] * tangent, axis=1)
    return np.linalg.norm(v, axis=1), along, across


@pytest.mark.parametrize("slope", [0.0, 0.12])
@pytest.mark.parametrize("radius", [15.0, 40.0])
def test_a_steady_bend_is_a_circle(radius, slope):
    points = helix_points(radius, slope, 120)
    trajectory = Trajectory(lane_path(points), CAREFUL)
    t = trajectory.duration / 2
    u, rate, acceleration = (v[0] for v in trajectory.path_parameter(t))
    flat = 1 / np.hypot(1.0, slope)  # Horizontal distance per u.
    r = smoothed_radius(radius, slope)
    w = flat / radius  # Turn per u.

    # Steady: as fast as the lateral acceleration or the cruise allows.
    horizontal, vertical = r * w, slope * flat
    speed = rate * np.hypot(horizontal, vertical)
    lateral = r * (w * rate) ** 2
    assert acceleration == pytest.approx(0, abs=1e-9)
    assert 0.99 < max(lateral / 2.0, speed / 9.0) <= 1.0

    angle = 0.3 + w * u
    outward = np.array([np.cos(angle), np.sin(angle), 0])
    along = np.array([-np.sin(angle), np.cos(angle), 0])
    up = np.array([0, 0, 1.0])
    climb = np.arctan2(vertical, horizontal)
    forward = np.cos(climb) * along + np.sin(climb) * up
    X_WB = trajectory.pose(t)
    np.testing.assert_allclose(
        X_WB.translation(),
        [5.0, -7.0, 1.0 + vertical * u] + r * outward,
        atol=1e-8,
    )
    np.testing.assert_allclose(
        X_WB.rotation().matrix(),
        np.column_stack([forward, -outward, np.cross(forward, -outward)]),
        atol=1e-8,
    )
    # Aliases of the circle (see `smoothed_radius`) grow with each derivative.
    V_WB = spatial_velocity(trajectory, t)
    np.testing.assert_allclose(V_WB.rotational(), w * rate * up, atol=1e-6)
    np.testing.assert_allclose(V_WB.translational(), speed * forward, atol=1e-7)
    A_WB = spatial_acceleration(trajectory, t)
    np.testing.assert_allclose(A_WB.rotational(), np.zeros(3), atol=1e-5)
    np.testing.assert_allclose(
        A_WB.translational(), -lateral * outward, atol=1e-6
    )


def test_a_straight_drive_takes_the_time_of_bounded_acceleration():
    points = np.outer(SPACING * np.arange(201), [0.6, 0.8, 0.0])
    speeds = Speeds(
        cruise=10.0, longitudinal_acceleration=2.0, lateral_acceleration=3.0
    )
    trajectory = Trajectory(lane_path(points), speeds)
    assert trajectory.length == pytest.approx(400)
    # Without smoothing: 400 m at 10 m/s and 5 s more for speeding up and
    # braking; with it, some knots of 0.3 s more.
    assert 45.0 < trajectory.duration < 45.0 + 6 * 0.3
    start, end = trajectory.pose(0.0), trajectory.pose(trajectory.duration)
    np.testing.assert_allclose(start.translation(), [0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(end.translation(), [240, 320, 0], atol=1e-9)
    speed, _, _ = motion(trajectory, [trajectory.duration / 2])
    assert speed[0] == pytest.approx(10.0, abs=1e-9)


def test_half_of_a_small_acceleration_remains_for_speeding_up():
    # Points that are unevenly spaced take up the other half.
    bound = 0.1
    points = helix_points(12.0, 0.0, 60)
    points[::2] *= 1.01
    speeds = Speeds(
        cruise=14.0, longitudinal_acceleration=bound, lateral_acceleration=9.0
    )
    trajectory = Trajectory(lane_path(points), speeds)
    assert bound / 2 * 0.99 < trajectory.speed_profile.acceleration < bound
    t = np.arange(0.0, trajectory.duration, 0.05)
    speed, along, _ = motion(trajectory, t)
    assert np.abs(along).max() <= bound
    assert speed.max() > 0.5


def test_velocity_and_acceleration_are_derivatives_of_the_pose():
    trajectory = Trajectory(lane_path(wavy_points(1)), CAREFUL)
    times = np.linspace(1.0, trajectory.duration - 1.0, 41)
    check_derivatives(
        trajectory, times, velocity_atol=1e-6, acceleration_atol=1e-6
    )


def test_the_path_turns_without_jumps_and_without_roll():
    # Three full turns: the heading must not fall back by 2 pi.
    points = helix_points(20.0, 0.05, 200)
    turned = np.unwrap(np.arctan2(points[:, 1] + 7, points[:, 0] - 5))
    path = Trajectory(lane_path(points), CAREFUL).path
    u = np.linspace(0, path.end, 5000)
    jet = path.evaluate(u)
    assert np.abs(np.diff(jet.yaw)).max() < 0.01
    assert turned[-1] - turned[0] > 6 * np.pi
    # The curve itself turns a little less, as it is straight at its ends.
    total = jet.yaw[-1] - jet.yaw[0]
    assert total == pytest.approx(turned[-1] - turned[0], abs=0.15)
    trajectory = Trajectory(lane_path(points), CAREFUL)
    R_WB = trajectory.pose(trajectory.duration / 3).rotation().matrix()
    assert R_WB[2, 1] == pytest.approx(0.0, abs=1e-12)


def test_bounds_hold_on_hills_and_where_limits_drop():
    for seed in range(4):
        points = wavy_points(seed)
        limits = np.full(len(points), 20.0)
        limits[40:60], limits[61:64], limits[100:] = 4.0, 2.5, 6.0
        path = LanePath(points, SPACING, limits)
        trajectory = Trajectory(path, CAREFUL)
        t = np.arange(0.0, trajectory.duration, 0.002)
        speed, along, across = motion(trajectory, t)
        u = trajectory.path_parameter(t)[0]
        index = (u / SPACING).astype(int).clip(0, len(points) - 2)
        limit = np.minimum(limits[index], limits[index + 1])
        assert np.all(speed <= np.minimum(limit, CAREFUL.cruise) + 1e-9)
        assert np.abs(along).max() <= CAREFUL.longitudinal_acceleration
        assert across.max() <= CAREFUL.lateral_acceleration


def test_path_integrals():
    path = Trajectory(lane_path(helix_points(25.0, 0.0, 60)), CAREFUL).path
    travelled = path.integral(lambda jet: jet.speed)
    # Inside the bend the curve is a circle; its ends are not.
    u = np.array([20.0, 20.0 + 1e-9, 31.7, 90.0])
    arc = (u - 20.0) * smoothed_radius(25.0) / 25.0
    length = travelled(u)
    np.testing.assert_allclose(length - length[0], arc, atol=1e-9)
    fine = path.evaluate(np.linspace(0, path.end, 40001)).p
    chords = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    assert travelled(path.end) == pytest.approx(chords, abs=1e-6)
