"""What a yaw or an offset between two frames gives, and what registration says.

The paper's Table I may contain such a yaw; a reader of TCR_sym cannot know.
"""

from dataclasses import replace

import numpy as np
import pytest

from evaluation.base import from_xyz, poses
from evaluation.change import (
    ChangeReport,
    DriveMap,
    registered_change,
    temporal_change,
)
from evaluation.maps import CELL_SIZE, VoxelAccumulator
from evaluation.recognition import numbers_of


def make_city(seed=3, num_houses=40):
    """Points on ground of 360 m, and on the walls of houses."""
    rng = np.random.default_rng(seed)
    parts = [np.c_[rng.uniform(-180, 180, (30_000, 2)), np.zeros(30_000)]]
    for _ in range(num_houses):
        centre, yaw = rng.uniform(-165, 165, 2), rng.uniform(0.0, np.pi)
        size = rng.uniform([8, 8, 8], [20, 20, 40])
        walls = rng.uniform(-0.5, 0.5, (1500, 3))
        side = rng.integers(2, size=1500)
        walls[np.arange(1500), side] = rng.choice((-0.5, 0.5), 1500)
        walls = walls * size + [0.0, 0.0, 0.5 * size[2]]
        parts.append(poses.transform(poses.yaw_pose(yaw, *centre), walls))
    return parts


CITY = make_city()


def drive_map(parts, name="map", X_WS=None):
    accumulator = VoxelAccumulator(CELL_SIZE)
    accumulator.add(from_xyz(np.concatenate(parts)), X_WS)
    return DriveMap(name, accumulator.to_map())


def tcr_sym(a, b):
    return temporal_change(
        a.voxels.merged().centroids_W, b.voxels.merged().centroids_W
    ).symmetric


@pytest.mark.parametrize(
    ("X_BW", "yaw_deg"),
    [
        (poses.yaw_pose(np.radians(1.8)), -1.8),
        (poses.yaw_pose(np.radians(-2.5), 0.4, -0.7, 0.3), 2.5),
        (poses.yaw_pose(0.0, 1.5, 0.0, 1.5), 0.0),
    ],
)
def test_frames_that_differ_are_found(X_BW, yaw_deg):
    a, b = drive_map(CITY, "a"), drive_map(CITY, "b", X_BW)
    apparent = tcr_sym(a, b)
    found = registered_change(a, b)
    X_AB = np.linalg.inv(X_BW)
    np.testing.assert_allclose(found.offset, X_AB[:3, 3], atol=0.15)
    assert found.yaw_deg == pytest.approx(yaw_deg, abs=0.05)
    # An unchanged city on another grid of voxels.
    assert found.symmetric < 0.02
    assert apparent > found.symmetric


def test_an_apparent_change_grows_with_the_yaw():
    """As a reader sees who cannot register: Table I against Figure 1."""
    a = drive_map(CITY)
    values = [
        tcr_sym(a, drive_map(CITY, X_WS=poses.yaw_pose(np.radians(yaw))))
        for yaw in (0.0, 1.0, 1.5, 2.0, 2.5)
    ]
    assert values[0] == 0.0
    assert values == sorted(values)
    assert values[-1] > 0.05


def test_change_stays_change():
    changed = [CITY[0], *CITY[15:], *make_city(4, 15)[1:]]
    a, b = drive_map(CITY), drive_map(changed)
    found = registered_change(a, b)
    assert abs(found.yaw_deg) < 0.02
    assert np.abs(found.offset).max() < 0.05
    assert found.symmetric == pytest.approx(tcr_sym(a, b), abs=0.01)
    assert found.symmetric > 0.05


def test_far_from_the_origin_of_the_world():
    """Coordinates as UTM has them; the yaw is about the frame's origin."""
    X_WA = poses.yaw_pose(0.0, 4.2e5, 5.1e6)
    X_WB = X_WA @ poses.yaw_pose(np.radians(1.0), 0.5, 0.2)
    found = registered_change(
        drive_map(CITY, X_WS=X_WA), drive_map(CITY, X_WS=X_WB)
    )
    X_AB = X_WA @ np.linalg.inv(X_WB)
    assert found.yaw_deg == pytest.approx(-1.0, abs=0.05)
    middle = np.array([[4.2e5, 5.1e6, 0.0]])
    np.testing.assert_allclose(
        poses.transform(found.X_AB, middle),
        poses.transform(X_AB, middle),
        atol=0.15,
    )


def values_of(report):
    return {n.metric: n.value for n in numbers_of("change", report)}


@pytest.mark.parametrize("yaw_deg", [20.0, 90.0])
def test_frames_that_differ_too_much_stay(yaw_deg):
    """A pose at which little fits would explain nothing."""
    turned = drive_map(CITY, X_WS=poses.yaw_pose(np.radians(yaw_deg)))
    found = registered_change(drive_map(CITY), turned)
    assert np.array_equal(found.X_AB, np.eye(4))


def test_what_cannot_be_registered():
    few = drive_map([np.eye(3)])
    assert registered_change(few, drive_map(CITY)) is None
    # Ground alone fits everywhere, and stays where it is.
    ground = drive_map(CITY[:1])
    found = registered_change(ground, ground)
    assert np.array_equal(found.X_AB, np.eye(4))
    assert found.symmetric == 0.0


def test_a_note_says_when_frames_would_explain_change():
    a, b = drive_map(CITY, "a"), drive_map(CITY, "b", poses.yaw_pose(0.03))
    change = temporal_change(
        a.voxels.merged().centroids_W, b.voxels.merged().centroids_W
    )
    report = ChangeReport("a", "b", change)
    assert report.note is None
    assert "tcr_sym_registered" not in values_of(report)
    found = registered_change(a, b)
    report = replace(report, registered=found)
    assert "of a and b differ by a yaw of -1.72 deg" in report.note
    values = values_of(report)
    assert values["tcr_sym_registered"] == found.symmetric
    assert values["registration_yaw_deg"] == pytest.approx(-1.72, abs=0.03)
    assert len(report.to_json()["registration_xyz_m"]) == 3
    # Below the limit, nothing is said.
    same = replace(found, symmetric=change.symmetric - 0.0199)
    assert replace(report, registered=same).note is None
    # Nor if nothing can be compared.
    no_points = [
        np.zeros(len(one.voxels.merged().centroids_W), bool) for one in (a, b)
    ]
    report = replace(report, change=change.restricted(*no_points))
    assert np.isnan(report.change.symmetric)
    assert report.note is None
