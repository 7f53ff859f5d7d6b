"""Sessions in NCLT's layout, written by struct and read back."""

import struct

from helpers.dataset_folders import stored, write_bytes
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.study import find_recordings

T0_US = 1_326_030_975_726_043
STEP_US = 200_000
DATE = "2012-01-08"
# What a file holds of a point: x y z as steps of 5 mm from -100 m.
HITS = [(20400, 19800, 20040, 31, 0), (0, 65535, 19640, 255, 31)]
# The same, in the body's frame: forward, right, down [m].
BODY = np.array([[2.0, -1.0, 0.2], [-100.0, 227.675, -1.8]])


def euler(roll, pitch, yaw):
    """Returns Rz(yaw) Ry(pitch) Rx(roll), written out."""
    (a, b, c), (x, y, z) = (
        np.cos([roll, pitch, yaw]),
        np.sin([roll, pitch, yaw]),
    )
    return np.array(
        [
            [c * b, c * y * x - z * a, c * y * a + z * x],
            [z * b, z * y * x + c * a, z * y * a - c * x],
            [-y, b * x, b * a],
        ]
    )


def write_session(root, *, rows=None, hits=HITS, place=""):
    """Writes a session of three scans with a pose each; returns its folder."""
    folder = root / DATE
    data = b"".join(struct.pack("<HHHBB", *hit) for hit in hits)
    for k in range(3):
        stamp = T0_US + k * STEP_US
        write_bytes(folder / "velodyne_sync" / f"{stamp}.bin", data)
    if rows is None:
        rows = [
            (T0_US + k * STEP_US, 10.0 + k, 20.0, -3.0, 0.1, -0.2, 0.3 * k)
            for k in range(3)
        ]
    text = "\n".join(",".join(map(repr, row)) for row in rows)
    path = folder / place / f"groundtruth_{DATE}.csv"
    write_bytes(path, f"{text}\n".encode())
    return folder


@pytest.mark.parametrize("place", ["", "..", "../ground_truth"])
def test_a_point_is_where_it_was_measured(tmp_path, place):
    drive = open_drive(write_session(tmp_path, place=place))
    assert drive.name == DATE
    assert drive.world_frame == "nclt"
    assert drive.lidar_field.rings == 32
    assert drive.notes == ()
    first = (T0_US * 1000, (T0_US + STEP_US) * 1000)
    assert tuple(drive.stamps_ns[:2].tolist()) == first
    scan = drive.scan(1)
    p_S = np.c_[stored(scan, "x", "y", "z"), np.ones(2)]
    p_W = (drive.X_WS[1] @ p_S.T).T[:, :3]
    north, east, down = (
        euler(0.1, -0.2, 0.3) @ BODY.T + np.c_[[11.0, 20.0, -3.0]]
    )
    np.testing.assert_allclose(p_W, np.c_[east, north, -down], atol=2e-5)


def test_scans_are_seen_from_the_lidar(tmp_path):
    drive = open_drive(write_session(tmp_path))
    scan = drive.scan(0)
    # The LiDAR is 0.957 m above the body, whose z points down.
    wanted = BODY - [0.002, -0.004, -0.957]
    wanted[:, 1:] *= -1.0
    np.testing.assert_allclose(stored(scan, "x", "y", "z"), wanted, atol=1e-5)
    assert scan["intensity"].tolist() == [31, 255]
    # The unit hangs upside down: its first laser is the highest one.
    assert scan["ring"].tolist() == [31, 0]
    field = drive.lidar_field
    assert (field.lowest_deg, field.highest_deg) == (-10.67, 30.67)


def test_the_order_of_the_lasers(tmp_path):
    hits = [(20000, 20000, 20000, 1, laser) for laser in range(32)]
    scan = open_drive(write_session(tmp_path, hits=hits)).scan(0)
    # They fire as 0, 16, 1, 17 and so on, counted downwards.
    wanted = 31 - np.ravel([(k, k + 16) for k in range(16)])
    np.testing.assert_array_equal(scan["ring"], wanted)


def test_poses_between_rows_and_rows_without_a_pose(tmp_path):
    nan = float("nan")
    rows = [
        (T0_US - 5, nan, nan, nan, nan, nan, nan),
        (T0_US - 1000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (T0_US + 499_000, 5.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    ]
    drive = open_drive(write_session(tmp_path, rows=rows))
    assert "1 poses without numbers or rotation are left" in drive.notes[0]
    north = drive.X_WS[1, 1, 3] - 0.002 * np.cos(0.402) - 0.004 * np.sin(0.402)
    assert north == pytest.approx(201 / 500 * 5.0, abs=1e-9)
    heading = np.arctan2(drive.X_WS[1, 0, 0], drive.X_WS[1, 1, 0])
    assert heading == pytest.approx(0.402, abs=1e-9)


def test_faults_are_named(tmp_path):
    folder = write_session(tmp_path)
    write_session(tmp_path, hits=[(20000, 20000, 20000, 1, 32)])
    with pytest.raises(InputError, match="laser: 32 is not below 32"):
        open_drive(folder).scan(0)
    table = folder / f"groundtruth_{DATE}.csv"
    table.write_text("1,2,3\n")
    with pytest.raises(InputError, match="row 1: 3 columns instead of 7"):
        open_drive(folder)
    table.write_text(f"{T0_US},nan,0,0,0,0,0\n")
    with pytest.raises(InputError, match="no row without NaN"):
        open_drive(folder)
    table.unlink()
    with pytest.raises(InputError, match=f"NCLT: no groundtruth_{DATE}.csv"):
        open_drive(folder)
    with pytest.raises(InputError, match="one LiDAR, not a 'top'"):
        open_drive(folder, "top")
    packets = tmp_path / "2012-02-02"
    write_bytes(packets / "velodyne_hits.bin", b"")
    with pytest.raises(InputError, match="velodyne_sync"):
        open_drive(packets)


def test_a_report_finds_sessions_by_their_dates(tmp_path):
    write_session(tmp_path, place="../ground_truth")
    (found,) = find_recordings(tmp_path)
    assert (found.name, found.map_name, found.stage) == (DATE, "nclt", DATE)
    beside = tmp_path / DATE / "scenario.yaml"
    beside.write_text("map: campus\nstage: winter\n")
    (found,) = find_recordings(tmp_path)
    assert (found.map_name, found.stage) == ("campus", "winter")
    drive = open_drive(beside.parent)
    assert beside in drive.files
    assert drive.lidar_field.rings == 32
