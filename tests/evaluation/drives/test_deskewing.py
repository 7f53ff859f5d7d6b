"""Times of points in the units and types of drivers, and what they move."""

from helpers.drive_files import T0_NS, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import deskew, open_drive

NUM = 200
# A turn takes 100 ms, in which the vehicle drives 1 m.
TURN = 0.1
SECONDS = np.arange(NUM) / NUM * TURN


def record(folder, name, kind, values, *, x_m=lambda t: 10.0 * t, later=()):
    dtype = [(axis, "<f4") for axis in "xyz"] + [(name, kind)]
    scan = np.zeros(NUM, dtype)
    scan["x"] = 20.0
    scan[name] = values
    poses = {
        T0_NS + round(t * 1e9): yaw_pose(x_m(t), 0.0, 0.0, 0.0)
        for t in [k * TURN for k in range(6)] + [*later]
    }
    stamps_ns = list(poses)
    return write_recording(
        folder / "s",
        [scan] * 6,
        list(poses.values())[:6],
        stamps_ns=stamps_ns[:6],
        later_poses={stamp: poses[stamp] for stamp in stamps_ns[6:]},
    )


@pytest.mark.parametrize(
    ("name", "kind", "scale"),
    [
        ("t", "<u4", 1e9),
        ("t", "<f4", 1.0),
        ("t", "<f8", 1.0),
        ("t", "<f4", 1e9),
        ("t", "<f8", 1e9),
        ("time", "<f4", 1.0),
        ("time", "<f8", 1.0),
        ("time", "<f8", 1e9),
    ],
)
def test_times_that_are_certain(tmp_path, name, kind, scale):
    drive = open_drive(record(tmp_path, name, kind, SECONDS * scale))
    scan = drive.scan(2)
    assert scan["t"].dtype == np.uint32
    np.testing.assert_allclose(scan["t"], SECONDS * 1e9, rtol=0, atol=8)
    # Within a turn the points come nearer as the LiDAR does.
    np.testing.assert_allclose(
        deskew(drive, 2)["x"], 20.0 + SECONDS / TURN, atol=1e-5
    )


@pytest.mark.parametrize(
    ("name", "kind", "values"),
    [
        ("t", "<u4", SECONDS * 1e6),
        ("t", "<f4", SECONDS * 1e6),
        ("t", "<f4", SECONDS * 1e3),
        ("t", "<f4", SECONDS - TURN),
        ("t", "<f4", np.full(NUM, np.nan)),
        ("time", "<f4", SECONDS - TURN),
        ("time", "<f4", SECONDS * 1e3),
        ("timestamp", "<f8", SECONDS + T0_NS * 1e-9 - 10.0),
    ],
)
def test_times_that_are_not(tmp_path, name, kind, values):
    drive = open_drive(record(tmp_path, name, kind, values))
    scan = drive.scan(2)
    np.testing.assert_array_equal(scan[name], values.astype(kind))
    with pytest.raises(
        InputError, match=r"^s: scan 2: (no field t|t: from|t: float)"
    ):
        deskew(drive, 2)


@pytest.mark.parametrize("start_s", [-TURN, 0.0])
@pytest.mark.parametrize(
    ("name", "kind", "unit_ns"),
    [
        ("timestamp", "<f8", 10**9),  # Hesai, RoboSense
        ("timestamp", "<f8", 1),  # Livox
        ("time_stamp", "<f8", 10**9),  # Autoware's PointXYZIRADRT
        ("t", "<f8", 10**9),
        ("time", "<f8", 1000),
    ],
)
def test_times_since_1970(tmp_path, name, kind, unit_ns, start_s):
    """Of sensors whose stamp is at the start or at the end of a turn."""
    since_ns = np.rint((start_s + SECONDS) * 1e9).astype(np.int64)
    absolute_ns = T0_NS + round(2 * TURN * 1e9) + since_ns
    values = absolute_ns if unit_ns == 1 else absolute_ns / unit_ns
    drive = open_drive(record(tmp_path, name, kind, values))
    scan = drive.scan(2)
    assert name == "t" or name not in scan.dtype.names
    # Doubles of these times are up to 256 ns apart.
    np.testing.assert_allclose(scan["t"], since_ns, rtol=0, atol=256)
    np.testing.assert_allclose(
        deskew(drive, 2)["x"], 20.0 + (start_s + SECONDS) / TURN, atol=1e-5
    )


def test_the_pose_at_the_stamp_is_interpolated_if_none_is_there(tmp_path):
    """Of odometry with 10 Hz whose stamps are those of no scan."""
    poses = [yaw_pose(10.0 * k * TURN, 0.0, 0.0, 0.0) for k in range(8)]
    scan = np.zeros(NUM, [(axis, "<f4") for axis in "xyz"] + [("t", "<u4")])
    scan["x"], scan["t"] = 20.0, np.rint(SECONDS * 1e9)
    stamps = [T0_NS + round(k * TURN * 1e9) for k in range(8)]
    path = write_recording(
        tmp_path / "s",
        [scan] * 8,
        poses,
        stamps_ns=stamps,
        odometry_shift_ns=-round(0.4 * TURN * 1e9),
    )
    np.testing.assert_allclose(
        deskew(open_drive(path), 3)["x"], 20.0 + SECONDS / TURN, atol=1e-5
    )


def test_points_measured_at_once(tmp_path):
    drive = open_drive(record(tmp_path, "t", "<u4", np.zeros(NUM)))
    np.testing.assert_array_equal(deskew(drive, 2), drive.scan(2))


def test_the_last_scan_is_corrected_by_the_poses_on_tf(tmp_path):
    # The vehicle begins to brake when the last scan does.
    def x_m(t):
        return 10.0 * t - 400.0 * max(0.0, t - 0.5) ** 3

    later = np.arange(0.51, 0.61, 0.01)
    path = record(tmp_path, "t", "<u4", SECONDS * 1e9, x_m=x_m, later=later)
    moved = [x_m(0.5 + t) - x_m(0.5) for t in SECONDS]
    np.testing.assert_allclose(
        deskew(open_drive(path), 5)["x"], np.add(20.0, moved), atol=5e-4
    )


@pytest.mark.parametrize(("start", "is_far"), [(0.05, False), (0.4, True)])
def test_times_that_lie_outside_of_the_scan_are_refused(
    tmp_path, start, is_far
):
    """As of a driver whose times grow from message to message."""
    values = np.rint((start + SECONDS) * 1e9)
    drive = open_drive(record(tmp_path, "t", "<u4", values))
    if not is_far:
        assert len(deskew(drive, 2)) == NUM
        return
    fault = r"t: the points lie from 0\.4 to 0\.5 s after the stamp, outside"
    with pytest.raises(InputError, match=fault):
        deskew(drive, 2)


@pytest.mark.parametrize(
    ("name", "values", "why"),
    [
        ("time", SECONDS - TURN, "times before the stamp"),
        ("timestamp", 1.6e9 + SECONDS, "times since 1970"),
        ("timestamp", 0.0 * SECONDS, "the same for all points"),
        ("time_offset", SECONDS, "of an unknown unit"),
    ],
)
def test_a_field_of_times_that_is_not_used_is_named(
    tmp_path, name, values, why
):
    drive = open_drive(record(tmp_path, name, "<f8", values))
    fault = rf"no field t, .*; the field {name} \(float64\) is not used: {why}"
    with pytest.raises(InputError, match=fault):
        deskew(drive, 2)
