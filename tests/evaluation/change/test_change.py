import dataclasses
import math

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import compare_maps
import numpy as np
import pytest

from evaluation.base import InputError, from_xyz
from evaluation.change import DriveMap, map_source
from evaluation.drives import open_drive
from evaluation.maps import CELL_SIZE, voxelise


def make_town(blocks):
    """Returns the points of a street with some of its blocks, in the world."""
    rng = np.random.default_rng(12)
    ground = rng.uniform([-60, -60], [160, 60], (9000, 2))
    parts = [np.c_[ground, np.zeros(9000)]]
    for block in range(8):
        corner = [-50.0 + 25.0 * block, 20.0 if block % 2 else -35.0, 0.0]
        box = rng.uniform(size=(900, 3)) * [15.0, 15.0, 25.0] + corner
        if block in blocks:
            parts.append(box)
    return np.concatenate(parts)


TOWN = {"early": make_town({0, 2, 3, 6, 7}), "late": make_town(range(8))}
ROUTE = {"south": -4.0, "north": 4.0}


def drive(folder, stage, route, reach=70.0, **options):
    """Records a drive along a straight route, seeing up to `reach`."""
    scans, X_WBs = [], []
    for x in np.arange(0.0, 100.0, 10.0):
        X_WB = yaw_pose(x, ROUTE[route], 0.0, 0.1)
        p = (TOWN[stage] - X_WB[:3, 3]) @ X_WB[:3, :3]
        p = p[np.linalg.norm(p, axis=1) < reach]
        scans.append(make_scan(p - [0.0, 0.0, 1.6]))
        X_WBs.append(X_WB)
    write_recording(folder, scans, X_WBs, **options)
    return folder


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    return {
        (stage, route): map_source(
            open_drive(drive(folder / f"{stage}_{route}", stage, route))
        )
        for stage in TOWN
        for route in ROUTE
    }


def test_what_is_built_shows_and_routes_alone_do_not(drives):
    report = compare_maps(drives["early", "south"], drives["late", "north"])
    assert report.change.symmetric > 0.03
    same_stage = compare_maps(drives["late", "south"], drives["late", "north"])
    assert same_stage.change.symmetric < 0.01


@pytest.mark.parametrize(
    ("control", "partner"),
    [
        # A's route in B's stage, then B's route in A's stage.
        (("late", "south"), ("late", "north")),
        (("early", "north"), ("early", "south")),
    ],
)
def test_control_is_compared_within_its_stage(drives, control, partner):
    a, b = drives["early", "south"], drives["late", "north"]
    report = compare_maps(a, b, drives[control])
    expected = compare_maps(drives[control], drives[partner]).change.symmetric
    assert report.control.symmetric == expected
    assert report.control_names == ("_".join(control), "_".join(partner))
    values = report.to_json()["no_change"]
    assert values["tcr_sym"] == expected
    assert values["between"] == list(report.control_names)


def _built_town(built, seed=3):
    """Returns a larger town on flat ground, just above z = 0, as generated."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform([0, 0], [148, 148], (13_500, 2))
    parts = [np.c_[ground, np.full(len(ground), 0.0004)]]
    for block in range(16):
        x, y = 36.0 * (block % 4) + 6.3, 36.0 * (block // 4) + 6.7
        size = np.array([18.0, 18.0, 12.0 + 9.0 * (block % 5)])
        box = rng.uniform(size=(3000, 3))
        side = rng.integers(0, 2, 3000)
        box[np.arange(3000), side] = rng.integers(0, 2, 3000)
        if block % 2 or built:
            parts.append(box * size + [x, y, 0.0])
    return np.concatenate(parts)


def _town_survey(points):
    return DriveMap("town", voxelise(from_xyz(points), CELL_SIZE)[0])


@pytest.fixture(scope="module")
def usual():
    towns = _built_town(False), _built_town(True)
    return towns, compare_maps(*map(_town_survey, towns))


@pytest.mark.parametrize(
    ("of_both", "of_one", "noise"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.001), 0.0),
        ((0.0, 0.0, 0.0), (0.0, 0.0, -0.001), 0.0),
        ((0.0, 0.0, 0.0), (0.003, -0.002, 0.0045), 0.0),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.05), 0.0),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.01),
        ((0.0, 0.0, 0.01), (0.0, 0.0, 0.0), 0.0),
    ],
    ids=["up", "down", "aligned", "higher", "noise", "both"],
)
def test_what_no_scan_can_measure_leaves_the_change(
    usual, of_both, of_one, noise
):
    """Errors of heights, alignments and ranges do not matter."""
    (a, b), report = usual
    before = report.change.symmetric
    errors = np.random.default_rng(0).normal(0.0, noise, b.shape)
    moved = a + np.array(of_both), b + np.add(of_both, of_one) + errors
    after = compare_maps(*map(_town_survey, moved)).change.symmetric
    assert before > 0.1
    assert after == pytest.approx(before, abs=0.002)


def test_control_on_a_third_route(tmp_path, drives):
    other = drive(tmp_path / "other", "late", "south", reach=50.0)
    shifted = map_source(open_drive(other))
    a, b = drives["early", "south"], drives["late", "north"]

    def aside(y):
        positions = shifted.positions + np.array([0.0, y, 0.0])
        return dataclasses.replace(shifted, positions=positions)

    for y in (0.0, 0.99):
        compare_maps(a, b, aside(y))
    with pytest.raises(InputError, match=r"other: .* neither route: 1\.0 m"):
        compare_maps(a, b, aside(1.01))
    # No drive passes within the coverage radius of the other.
    masked = compare_maps(a, aside(500.0)).to_json()["coverage_masked"]
    assert math.isnan(masked["tcr_sym"])
    assert "no point of either map" in masked["reason"]


def test_other_worlds_are_refused(tmp_path, drives):
    utm = drive(tmp_path / "utm", "late", "south", world_frame="utm")
    other = map_source(open_drive(utm))
    with pytest.raises(InputError, match="frame 'utm'"):
        compare_maps(drives["early", "south"], other)
