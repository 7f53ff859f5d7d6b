"""Drivers who wander and change lanes, against closed forms and real drives."""

from helpers.small_map import box_visual, scenario_values, world_text
import numpy as np
import pytest
from scipy.spatial import cKDTree
import shapely
import yaml

from cns_drake.scenarios import (
    DriverConfig,
    load_scenario,
    make_scenario,
    plan_drive,
)
from worlds.roads import load_road_network
from worlds.shapes import FINE_SPACING, LanePath, driven_path, kerbs

NOTHING = shapely.STRtree([])
# Absolute lateral offsets of two real drives along one route: the quantiles of
# 50, 75, 90, 95 and 99 % of Boreas 2021-08-05 and 2021-09-02 (pyboreas), and of
# MulRan KAIST 01 and 02 [m].
QUANTILES = np.array([0.50, 0.75, 0.90, 0.95, 0.99])
REAL_OFFSETS = {
    "boreas": (0.33, 0.64, 1.53, 2.82, 3.48),
    "kaist": (0.37, 1.11, 2.44, 2.83, 3.14),
}


def straight(length, beside=(0.0, 0.0)):
    x = np.arange(0.0, length, FINE_SPACING)
    points = np.column_stack([x, np.zeros((len(x), 2))])
    lanes = np.tile(beside, (len(x), 1))
    return LanePath(points, FINE_SPACING, np.full(len(x), np.inf), lanes)


def with_driver(scenario, **fields):
    return scenario.model_copy(update={"driver": DriverConfig(**fields)})


def positions(trajectory, spacing):
    """Returns (N, 2) places and directions about every so many metres."""
    t = np.arange(0.0, trajectory.duration, 0.05)
    travelled = trajectory.travelled(t)
    wanted = np.arange(0.0, travelled[-1], spacing)
    R, p = trajectory.poses(np.interp(wanted, travelled, t))
    return p[:, :2], R[:, :2, 0]


def test_a_departing_path_keeps_limits_ends_and_heights():
    path = straight(500.0, (3.5, 0.0))
    driver = {"wander": 0.3, "wander_length": 50.0, "lane_changes": 5.0}
    path.points[:, 2] = 0.02 * path.points[:, 0]
    moved = driven_path(
        path, 2.0, NOTHING, "test", rng=np.random.default_rng(5), **driver
    )
    assert moved.spacing == pytest.approx(2.0, rel=0.01)
    np.testing.assert_allclose(moved.points[[0, -1], 0], [0.0, 499.5], atol=0.1)
    np.testing.assert_allclose(
        moved.points[:, 2], 0.02 * moved.points[:, 0], atol=0.01
    )
    assert np.ptp(moved.points[:, 1]) > 0.3


@pytest.mark.slow
def test_a_driver_follows_from_seed_or_name_alone(small_map):
    values = scenario_values(small_map)
    values["route"] = values["route"][:5]
    scenario = make_scenario(values, "test")

    def points(**fields):
        return plan_drive(with_driver(scenario, **fields)).positions([8, 16])

    np.testing.assert_array_equal(
        points(seed=5, wander_length=99.0),
        plan_drive(scenario).positions([8, 16]),
    )
    plain, seeded = points(wander=0.3), points(wander=0.3, seed=5)
    np.testing.assert_array_equal(seeded, points(wander=0.3, seed=5))
    assert np.abs(seeded - plain).max() > 0.02
    other = scenario.model_copy(update={"name": "other"})
    moved = plan_drive(with_driver(other, wander=0.3)).positions([8, 16])
    assert np.abs(plain - moved).max() > 0.02
    named = plan_drive(with_driver(other, wander=0.3, seed=scenario.name))
    np.testing.assert_array_equal(plain, named.positions([8, 16]))


@pytest.mark.slow
def real_driver(scenario, seed):
    seeded = scenario.with_fields({"driver": {"seed": seed}}, "test")
    return seeded.with_driver("real")


@pytest.mark.parametrize(
    ("name", "seed"), [("downtown_03", 1), ("riverside_01", 2)]
)
def test_drivers_keep_clear_of_kerbs(name, seed):
    scenario = load_scenario(name)
    network = load_road_network(scenario.folder.roads)
    trajectory = plan_drive(real_driver(scenario, seed))
    p, along = positions(trajectory, 1.0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    left = np.column_stack([-along[:, 1], along[:, 0]])
    # The car of `vehicle.sdf`, mirrors included.
    corners = [
        p + x * along + y * left
        for x, y in ((-1.0, -1.03), (3.7, -1.03), (3.7, 1.03), (-1.0, 1.03))
    ]
    cars = shapely.polygons(np.stack(corners, axis=1))
    near, _ = kerbs(network.areas.lane_area).query(cars, "dwithin", 0.3)
    assert len(near) == 0
    still = positions(plan_drive(scenario), 1.0)[0]
    assert np.quantile(cKDTree(still).query(p)[0], 0.9) > 0.2


@pytest.mark.slow
@pytest.mark.night
def test_pairs_of_drives_differ_as_real_ones_do():
    scenario = load_scenario("metropolis_04")
    offsets = []
    for seed in range(0, 10, 2):
        drives = [
            positions(
                plan_drive(real_driver(scenario, one)),
                spacing,
            )
            for one, spacing in ((seed, 5.0), (seed + 1, 0.25))
        ]
        (p, along), (p_B, along_B) = drives
        # Places in another direction are far away.
        tree = cKDTree(np.hstack([p_B, 30 * along_B]))
        distance, nearest = tree.query(np.hstack([p, 30 * along]))
        ahead = p_B[nearest] - p
        across = along[:, 0] * ahead[:, 1] - along[:, 1] * ahead[:, 0]
        offsets.append(np.abs(across[distance < 12.0]))
    pooled = np.concatenate(offsets)
    for real in REAL_OFFSETS.values():
        parts = np.array([np.mean(pooled <= one) for one in real])
        assert np.abs(parts - QUANTILES).max() <= 0.1
    assert 0.08 < np.mean(pooled > 1.5) < 0.2


def test_along_waypoints_walls_and_kerbs_bound_the_wander(tmp_path):
    visuals = [
        box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (400, 400, 1)),
        box_visual("kerb/r", (0, -1.9, 0.07, 0, 0, 0), (300, 0.4, 0.16)),
        box_visual("wall/l", (0, 2.0, 1.0, 0, 0, 0), (300, 0.4, 2.0)),
    ]
    (tmp_path / "yard.sdf").write_text(world_text(visuals))
    (tmp_path / "tour.csv").write_text("x,y\n-140,0\n140,0\n")
    values = {
        "world": "yard.sdf",
        "waypoints": "tour.csv",
        "speeds": {"cruise": 10.0},
        "driver": {"wander": 0.35, "wander_length": 20.0, "seed": 1},
    }
    (tmp_path / "drive.yaml").write_text(yaml.safe_dump(values))
    y = positions(plan_drive(load_scenario(tmp_path / "drive.yaml")), 1.0)[0]
    # From the kerb at -1.7 m and the wall at 1.8 m to a car of 1.03 m.
    assert y[:, 1].min() >= -1.7 + 1.33
    assert y[:, 1].max() <= 1.8 - 1.33
    assert np.ptp(y[:, 1]) > 0.3
