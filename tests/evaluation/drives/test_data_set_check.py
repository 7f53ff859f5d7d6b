"""The public check of data sets, on every layout and on what goes wrong."""

import re

from helpers.dataset_folders import write_matrices, write_quaternions
from helpers.drive_files import yaw_pose
from helpers.drive_folders import (
    NUM_SCANS,
    STAMPS_NS,
    WRITERS,
    X_WB,
    kitti,
    mulran,
)
import numpy as np
import pytest

from evaluation import check_data_set, data_set_checks, open_drive
from evaluation.base import InputError, poses
from evaluation.drives import data_sets


def scene(p_WS):
    """Returns points of walls, poles and the ground around a place in W."""
    rng = np.random.default_rng(3)
    parts = [rng.uniform([-40, -40, 0], [60, 40, 0], (2500, 3))]
    for _ in range(30):
        foot = [*rng.uniform([-35, -30], [50, 30]), 0.0]
        size = [*rng.choice([[9.0, 0.02], [0.02, 9.0], [0.1, 0.1]]), 6.0]
        parts.append(rng.uniform(size=(80, 3)) * size + foot)
    return np.concatenate(parts) + p_WS - [0.0, 0.0, 1.6]


def scans_in(X_WS):
    """Returns what a LiDAR measures at each pose, in its frame S."""
    points = scene(X_WS[0, :3, 3])
    found = []
    for X in X_WS:
        p_S = (points - X[:3, 3]) @ X[:3, :3]
        found.append(p_S[np.linalg.norm(p_S, axis=1) < 60.0])
    return found


def test_every_data_set_is_checked():
    assert set(WRITERS) == {title.split()[0] for title in data_sets()}


@pytest.mark.parametrize("name", WRITERS)
def test_a_correct_drive_passes(tmp_path, name):
    folder = tmp_path / "drive_01"
    write = WRITERS[name]
    # What the LiDAR measures follows from its poses, as the reader has them.
    write(folder, [np.ones((50, 3))] * NUM_SCANS)
    write(folder, scans_in(open_drive(folder).X_WS))
    check_data_set(folder)
    check_data_set(str(folder))
    check_data_set(open_drive(folder))
    for check in data_set_checks:
        check(str(folder))


def test_options_of_a_drive(tmp_path):
    folder = tmp_path / "00"
    wrong = X_WB.copy()
    wrong[:, :3, 3] *= 1e-3
    kitti(folder, SCANS, wrong)
    kilometres = "00: poses: .* in kilometres"
    with pytest.raises(InputError, match=rf"^{folder.parent}/{kilometres}"):
        check_data_set(folder, columns=4)
    with pytest.raises(InputError, match=f"^{kilometres}"):
        check_data_set(open_drive(folder))
    right = tmp_path / "poses.tum"
    write_quaternions(right, STAMPS_NS * 1e-9, X_WB, " ")
    check_data_set(str(folder), poses=str(right))
    with pytest.raises(InputError, match="00: poses: the drive is open"):
        check_data_set(open_drive(folder), poses=right)
    with pytest.raises(InputError, match="00: has one LiDAR, not a 'roof'"):
        check_data_set(folder, lidar="roof")


SCANS = scans_in(X_WB)
# A rotation by 90 deg about z.
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TRANSPOSED = np.block(
    [[X_WB[:, :3, :3].transpose(0, 2, 1), X_WB[:, :3, 3:]], [X_WB[:, 3:]]]
)


@pytest.mark.parametrize(
    ("fault", "scans", "more"),
    [
        ("in metres", [30.0 * one for one in SCANS], {}),
        ("in metres", [one / 1000.0 for one in SCANS], {}),
        ("does the z axis", [one * [1, -1, -1] for one in SCANS], {}),
        ("without points", [one[:0] for one in SCANS], {}),
        ("inverted", SCANS, {"X_WS": poses.inverse(X_WB)}),
        ("in one frame already", [SCANS[0]] * NUM_SCANS, {}),
        ("points are in feet", [one / 0.3048 for one in SCANS], {}),
        ("points to the left", [one @ TURN for one in SCANS], {}),
        ("points to the right", [one @ TURN.T for one in SCANS], {}),
        ("points to the back", [one * [-1, -1, 1] for one in SCANS], {}),
        ("y is mirrored", [one * [1, -1, 1] for one in SCANS], {}),
        ("rotations are transposed", SCANS, {"X_WS": TRANSPOSED}),
        ("without points", [one * np.nan for one in SCANS], {}),
        ("every 1e-07 s", SCANS, {"times": 1e-7 * np.arange(NUM_SCANS)}),
        (
            "moves at 150000 m/s",
            SCANS,
            {"X_WS": np.array([yaw_pose(15e3 * k, 0, 0, 0) for k in range(8)])},
        ),
        ("instead of two", SCANS[:1], {"X_WS": X_WB[:1], "times": [0.0]}),
        ("not later", SCANS, {"times": np.zeros(NUM_SCANS)}),
    ],
)
def test_a_wrong_drive_is_refused_in_one_line(tmp_path, fault, scans, more):
    folder = tmp_path / "00"
    kitti(folder, scans, **more)
    with pytest.raises(InputError, match=fault) as raised:
        check_data_set(folder)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e3, "every 100 s: numbers in milliseconds"),
        (1e6, r"every 100000 s: numbers in microseconds"),
        (1e9, r"every 1e\+08 s: numbers in nanoseconds"),
    ],
)
def test_the_unit_of_times_in_seconds(tmp_path, factor, said):
    kitti(tmp_path / "00", SCANS, times=1e-9 * STAMPS_NS * factor)
    said = rf"00: times.txt: a scan {said}\? They must be in seconds$"
    with pytest.raises(InputError, match=said):
        check_data_set(tmp_path / "00")


def test_the_unit_of_times_in_nanoseconds(tmp_path, monkeypatch):
    drive = tmp_path / "drive"
    mulran(drive, SCANS)
    opened = open_drive(drive)
    monkeypatch.setattr(type(opened), "stamps_ns", STAMPS_NS // 10**3)
    said = "drive: times: a scan every 0.0001 s: numbers in microseconds"
    with pytest.raises(InputError, match=rf"{said}\? They must be in nano"):
        data_set_checks[2](opened)


@pytest.mark.parametrize(
    ("fault", "change"),
    [
        ("in kilometres", 1e-3),
        ("in feet", 1 / 0.3048),
        ("have no scale", 1 / 150),
        ("axes of a camera", [[0, -1, 0], [0, 0, -1], [1, 0, 0]]),
        ("x axis points to the left", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ("turned by 20 deg", yaw_pose(0, 0, 0, np.radians(20))[:3, :3]),
    ],
)
def test_the_cure_that_a_fault_names_helps(tmp_path, fault, change):
    X_PS = np.eye(4)
    X_WP = X_WB.copy()
    if np.ndim(change):
        X_PS[:3, :3] = change
        X_WP = X_PS @ X_WB @ poses.inverse(X_PS)
    else:
        X_WP[:, :3, 3] *= change
    kitti(tmp_path / "00", SCANS, X_WP)
    with pytest.raises(InputError, match=fault) as raised:
        check_data_set(tmp_path / "00")
    message = str(raised.value)
    if np.ndim(change):
        (line,) = re.findall(r"Tr: [-.0-9e ]+", message)
        (tmp_path / "00/calib.txt").write_text(f"{line.strip()}\n")
    else:
        X_WP[:, :3, 3] *= float(message.rpartition(" by ")[2])
        kitti(tmp_path / "00", SCANS, X_WP)
    check_data_set(tmp_path / "00")


CAMERA = np.eye(4)
CAMERA[:3, :3] = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
CAMERA[:3, 3] = [0.0, -0.08, -0.27]


@pytest.mark.parametrize(
    ("applied", "X_PS", "said"),
    [
        # Poses of the LiDAR, beside the file of KITTI.
        (CAMERA, np.eye(4), "of the LiDAR already"),
        # What is left to correct is 30 and 90 deg.
        (yaw_pose(0, 0, 0, 0.3), yaw_pose(0, 0, 0, 0.3 + np.pi / 6), "by 30"),
        (
            yaw_pose(0, 0, 0, 0.3),
            yaw_pose(0, 0, 0, 0.3 + np.pi / 2),
            "axis points to the left",
        ),
    ],
)
def test_a_cure_takes_the_place_of_the_tr_that_is_there(
    tmp_path, applied, X_PS, said
):
    folder = tmp_path / "00"
    kitti(folder, SCANS, X_PS @ X_WB @ poses.inverse(X_PS))
    numbers = " ".join(map(str, applied[:3].ravel()))
    (folder / "calib.txt").write_text(f"Tr: {numbers}\n")
    with pytest.raises(InputError, match=said) as raised:
        check_data_set(folder)
    (line,) = re.findall(r"Tr: [-.0-9e ]+", str(raised.value))
    found = np.reshape([float(one) for one in line.split()[1:]], (3, 4))
    np.testing.assert_allclose(found[:, :3], X_PS[:3, :3], atol=0.01)
    (folder / "calib.txt").write_text(f"{line.strip()}\n")
    check_data_set(folder)


@pytest.mark.parametrize(
    ("scans", "X_WS", "said"),
    [
        ([SCANS[0]] * NUM_SCANS, X_WB[:1].repeat(NUM_SCANS, 0), "by 1 m"),
        ([one[::50] for one in SCANS], X_WB, "can be registered"),
    ],
)
def test_what_cannot_be_checked_is_said(tmp_path, capsys, scans, X_WS, said):
    kitti(tmp_path / "00", scans, X_WS)
    check_data_set(tmp_path / "00")
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("00: frames: not checked: ")
    assert said in line


def test_poses_that_stand_still_while_scans_move(tmp_path):
    kitti(tmp_path / "00", SCANS, X_WB[:1].repeat(NUM_SCANS, 0))
    with pytest.raises(InputError, match="all alike, but the scans move by"):
        check_data_set(tmp_path / "00")


def test_beams_without_a_return_are_left_out(tmp_path):
    missed = np.full((40, 3), np.nan)
    kitti(tmp_path / "00", [np.concatenate([one, missed]) for one in SCANS])
    check_data_set(tmp_path / "00")


def test_a_scan_with_a_wrong_pose_is_left_out(tmp_path):
    folder = tmp_path / "00"
    X_WS = X_WB.copy()
    X_WS[5, :2, 3] += [4.6e6, -1e6]
    kitti(folder, SCANS, X_WS)
    said = r"scan 5 lies 47\d{5} m from scan 4; leave out the scan"
    with pytest.raises(InputError, match=said):
        check_data_set(folder)
    (folder / "velodyne" / "000005.bin").unlink()
    check_data_set(folder)


def test_poses_that_hang_down(tmp_path):
    """KITTI's frame is that of the first scan, so another layout shows it."""
    folder = tmp_path / "drive"
    mulran(folder, SCANS)
    flipped = X_WB @ np.diag([1.0, -1.0, -1.0, 1.0])
    write_matrices(folder / "global_pose.csv", STAMPS_NS, flipped)
    with pytest.raises(InputError, match="z axis points down"):
        check_data_set(folder)


@pytest.mark.parametrize(
    ("lidars", "fault"),
    [
        ("[vlp-16]", "lidars: not a mapping"),
        ("{roof: vlp-16}", "lidars: not a mapping"),
        ("{roof: {preset: vlp16}}", "preset: .* did you mean vlp-16"),
        ("{roof: {unit: 16}}", "lidars.roof: unit: not a mapping"),
        ("{roof: {unit: {columns: 16}}}", "lidars.roof: unit: ranges: "),
        ("{roof: {unit: none.yaml}}", "lidars.roof: .*none.yaml: No such file"),
        (
            "{roof: {unit: a.yaml, preset: cns}}",
            "lidars.roof: unit: give",
        ),
        ("{roof: {preset: cns, rings: 0}}", "lidars.roof: rings: 0 is no"),
        ("{roof: {rings: 100000000000}}", "lidars.roof: rings: 1000"),
        ("{roof: {rings: many}}", "lidars.roof: rings: 'many' is no"),
    ],
)
def test_a_lidar_that_cannot_be(tmp_path, lidars, fault):
    folder = tmp_path / "00"
    kitti(folder, SCANS)
    (folder / "scenario.yaml").write_text("lidars: {roof: {preset: vlp-16}}")
    check_data_set(folder)
    (folder / "scenario.yaml").write_text(f"lidars: {lidars}")
    with pytest.raises(InputError, match=fault) as raised:
        check_data_set(folder)
    assert "\n" not in str(raised.value)


def test_what_is_no_drive(tmp_path):
    with pytest.raises(InputError, match="not a recorded drive"):
        check_data_set(tmp_path)
    with pytest.raises(InputError, match="no such file"):
        check_data_set(tmp_path / "nowhere")


def test_the_lidar_whose_name_is_the_longest_end(tmp_path):
    """A drive `town_roof_b` is of the LiDAR `roof_b`, not of `b`."""
    folder = tmp_path / "00"
    kitti(folder, SCANS)
    (folder / "scenario.yaml").write_text(
        "name: town_roof_b\n"
        "lidars: {b: {preset: cns}, roof_b: {preset: vlp-16}, roof: {}}"
    )
    drive = open_drive(folder)
    assert drive.lidar_section == {"preset": "vlp-16"}
    assert drive.lidar_field == (16, -15.0, 15.0)
