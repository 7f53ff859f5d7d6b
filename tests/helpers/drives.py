"""Paths of known shape and shipped drives, for several tests."""

import numpy as np
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
import yaml

from cns_drake.motion import Speeds, Trajectory
from cns_drake.scenarios import Scenario
from worlds.maps import recordable_drives
from worlds.roads import load_road_network, make_lane_path
from worlds.shapes import LanePath

SPACING = 2.0
NO_LIMIT = 100.0


def lane_path(points) -> LanePath:
    """Returns a path without speed limits along evenly spaced points."""
    points = np.asarray(points, dtype=float)
    return LanePath(points, SPACING, np.full(len(points), NO_LIMIT))


def spatial_velocity(trajectory: Trajectory, t: float) -> SpatialVelocity:
    """Returns V_WB, expressed in the world [rad/s, m/s]."""
    motion = trajectory.body_motion(t)
    return SpatialVelocity(motion.w[0], motion.v[0])


def spatial_acceleration(
    trajectory: Trajectory, t: float
) -> SpatialAcceleration:
    """Returns A_WB, expressed in the world [rad/s^2, m/s^2]."""
    motion = trajectory.body_motion(t)
    return SpatialAcceleration(motion.alpha[0], motion.a[0])


def helix_points(radius, slope, count, start=0.3) -> np.ndarray:
    """Returns points on a left-hand bend that climbs steadily.

    Args:
        radius: of the bend seen from above [m].
        slope: height per horizontal distance.
        count: number of points, SPACING apart along the helix.
        start: polar angle of the first [rad].
    """
    arc = SPACING / np.hypot(1.0, slope) * np.arange(count)
    angle = start + arc / radius
    return np.stack(
        [
            5.0 + radius * np.cos(angle),
            -7.0 + radius * np.sin(angle),
            1.0 + slope * arc,
        ],
        axis=1,
    )


def smoothed_radius(radius, slope=0.0) -> float:
    """Returns the radius of the quintic spline on `helix_points`.

    A uniform B-spline of order 6 multiplies a sampled wave of angular
    frequency w by sinc(w h / 2)^6 (its Fourier transform); aliases are
    weaker by (h / (2 pi r))^6 and do not matter here.
    """
    x = SPACING / np.hypot(1.0, slope) / (2 * radius)
    return radius * (np.sin(x) / x) ** 6


def wavy_points(seed) -> np.ndarray:
    """Returns a random smooth road with bends and slopes, from a seed."""
    rng = np.random.default_rng(seed)
    s = SPACING * np.arange(150)
    heading, height = np.zeros_like(s), np.zeros_like(s)
    for _ in range(4):
        length = rng.uniform(60, 200)
        phase = rng.uniform(0, 2 * np.pi)
        heading += rng.uniform(0.2, 0.5) * np.sin(
            2 * np.pi * s / length + phase
        )
        height += rng.uniform(0.3, 1.0) * np.sin(2 * np.pi * s / length + phase)
    flat = np.sqrt(SPACING**2 - np.diff(height, prepend=height[0]) ** 2)
    x = np.cumsum(flat * np.cos(heading))
    y = np.cumsum(flat * np.sin(heading))
    return np.stack([x, y, height], axis=1)


def check_derivatives(trajectory, times, *, velocity_atol, acceleration_atol):
    """Checks velocities and accelerations against differences of the poses."""
    step = 1e-4
    for t in times:
        before, now, after = (trajectory.pose(t + k * step) for k in (-1, 0, 1))
        V = spatial_velocity(trajectory, t)
        v = (after.translation() - before.translation()) / (2 * step)
        np.testing.assert_allclose(V.translational(), v, atol=velocity_atol)
        dR = after.rotation().matrix() - before.rotation().matrix()
        w_cross = dR / (2 * step) @ now.rotation().matrix().T
        w = [w_cross[2, 1], w_cross[0, 2], w_cross[1, 0]]
        np.testing.assert_allclose(V.rotational(), w, atol=velocity_atol)

        A = spatial_acceleration(trajectory, t)
        V_before, V_after = (
            spatial_velocity(trajectory, t + k * step) for k in (-1, 1)
        )
        change = (V_after.get_coeffs() - V_before.get_coeffs()) / (2 * step)
        np.testing.assert_allclose(
            A.get_coeffs(), change, atol=acceleration_atol
        )


def shipped_drive(name) -> tuple[Scenario, LanePath, Trajectory]:
    values = yaml.safe_load(recordable_drives()[name].read_text())
    scenario = Scenario.model_validate({"name": name, **values})
    network = load_road_network(scenario.folder.roads)
    path = make_lane_path(
        network, scenario.route, SPACING, aside=scenario.aside
    )
    return scenario, path, Trajectory(path, scenario.speeds)


CAREFUL = Speeds(
    cruise=9.0, longitudinal_acceleration=1.5, lateral_acceleration=2.0
)
