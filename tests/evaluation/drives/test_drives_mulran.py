from helpers.dataset_folders import (
    SCAN_PERIOD_NS,
    T0_NS,
    UTM,
    interpolated,
    make_points,
    stored,
    write_bytes,
    xyzi,
)
from helpers.mulran_drive import NUM_SCANS, pose_table, scan_stamps, write_drive
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import ORIGIN, check_same_world, open_drive

# calib_base2ouster: Rz Ry Rx of 0.0001, 0.0003 and 179.6654 degrees.
X_BS = np.array(
    [
        [-9.9998295e-01, -5.8398386e-03, -5.2257060e-06, 1.7042],
        [5.8398386e-03, -9.9998295e-01, 1.7758769e-06, -0.021],
        [-5.2359878e-06, 1.7453292e-06, 1.0, 1.8047],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


@pytest.mark.parametrize("parent", ["sensor_data", ""])
def test_reads_both_layouts(tmp_path, parent):
    scans = write_drive(tmp_path / "KAIST01", parent=parent)
    drive = open_drive(tmp_path / "KAIST01")
    assert drive.name == "KAIST01"
    assert drive.world_frame == "mulran/utm-52n"
    assert drive.notes == ()
    assert drive.stamps_ns.dtype == np.int64
    assert drive.stamps_ns.tolist() == scan_stamps()
    for i in (2, 0, 4):
        np.testing.assert_array_equal(
            stored(drive.scan(i), "x", "y", "z"), scans[i]
        )
        np.testing.assert_array_equal(
            drive.scan(i)["intensity"], np.arange(100)
        )


def test_poses_are_interpolated_and_composed_with_the_mount(tmp_path):
    stamps_ns, X_UB = pose_table()
    write_drive(tmp_path / "DCC02", table=(stamps_ns, X_UB))
    X_WS = open_drive(tmp_path / "DCC02").X_WS
    for stamp, pose in zip(scan_stamps(), X_WS, strict=True):
        X_US = interpolated(stamps_ns, X_UB, stamp) @ X_BS
        X_US[:3, 3] -= ORIGIN
        np.testing.assert_allclose(pose, X_US, atol=5e-8)


def test_the_lidar_is_above_the_base(tmp_path):
    stamps_ns, X_UB = pose_table()
    X_UB[:, :3, :3] = np.eye(3)
    write_drive(tmp_path / "s", table=(stamps_ns, X_UB))
    p_WS = open_drive(tmp_path / "s").X_WS[0, :3, 3]
    p_UB = interpolated(stamps_ns, X_UB, T0_NS)[:3, 3]
    np.testing.assert_allclose(
        p_WS + ORIGIN - p_UB, [1.7042, -0.021, 1.8047], atol=1e-8
    )


def test_local_coordinates(tmp_path):
    stamps_ns, X_UB = pose_table()
    write_drive(tmp_path / "utm", table=(stamps_ns, X_UB))
    wanted = open_drive(tmp_path / "utm").X_WS
    X_UB[:, :3, 3] -= UTM
    write_drive(tmp_path / "local", table=(stamps_ns, X_UB))
    drive = open_drive(tmp_path / "local")
    wanted[:, :3, 3] -= UTM - ORIGIN
    np.testing.assert_allclose(drive.X_WS, wanted, atol=1e-8)
    write_drive(tmp_path / "day2/local", table=(stamps_ns, X_UB))
    with pytest.raises(InputError, match="poses in frame"):
        check_same_world(drive, open_drive(tmp_path / "day2/local"))
    assert drive.datum is None
    assert "no UTM coordinates" in drive.notes[-1]


def test_utm_loses_nothing(tmp_path):
    stamps_ns, X_UB = pose_table()
    # Two drives, one a thousandth of a millimetre beside the other.
    write_drive(tmp_path / "a", table=(stamps_ns, X_UB))
    X_UB[:, 1, 3] += 1e-6
    write_drive(tmp_path / "b", table=(stamps_ns, X_UB))
    a, b = (open_drive(tmp_path / name) for name in "ab")
    check_same_world(a, b)
    apart = b.X_WS[:, :3, 3] - a.X_WS[:, :3, 3]
    np.testing.assert_allclose(apart, [[0.0, 1e-6, 0.0]] * 5, atol=2e-9)
    # Single precision keeps millimetres here, unlike at 4e6 m of northing.
    single = a.X_WS[:, :3, 3].astype(np.float32)
    assert np.abs(single - a.X_WS[:, :3, 3]).max() < 1e-3


def test_points_without_a_return_are_left_out(tmp_path):
    write_drive(tmp_path / "s")
    points = make_points(50)
    points[[0, 7, 49]] = 0.0
    # The point is on an axis, but not at the origin.
    points[8] = [0.0, 0.0, 3.0]
    path = tmp_path / "s/sensor_data/Ouster" / f"{T0_NS}.bin"
    write_bytes(path, xyzi(points))
    scan = open_drive(tmp_path / "s").scan(0)
    np.testing.assert_array_equal(
        stored(scan, "x", "y", "z"), points[(points != 0.0).any(axis=1)]
    )
    assert len(scan) == 47


def test_only_a_whole_scan_has_rings_and_times(tmp_path):
    write_drive(tmp_path / "s")
    path = tmp_path / "s/sensor_data/Ouster" / f"{T0_NS}.bin"
    points = make_points(65536)
    points[5] = 0.0
    four = np.c_[points, np.ones(65536)].astype("<f4")
    write_bytes(path, four.tobytes())
    scan = open_drive(tmp_path / "s").scan(0)
    assert len(scan) == 65535
    number = np.delete(np.arange(65536), 5)
    np.testing.assert_array_equal(scan["ring"], number % 64)
    np.testing.assert_allclose(scan["t"], (number // 64) / 1024 * 1e8, atol=0.5)
    write_bytes(path, four[:-1].tobytes())
    short = open_drive(tmp_path / "s").scan(0)
    assert short.dtype.names == ("x", "y", "z", "intensity")
    assert len(short) == 65534


def test_scans_beyond_the_poses_are_left_out_and_noted(tmp_path):
    stamps_ns, X_UB = pose_table(start_ns=SCAN_PERIOD_NS - 1, number=25)
    write_drive(tmp_path / "s", table=(stamps_ns, X_UB))
    drive = open_drive(tmp_path / "s")
    assert drive.stamps_ns.tolist() == scan_stamps()[1:4]
    assert len(drive) == len(drive.X_WS) == 3
    np.testing.assert_array_equal(
        stored(drive.scan(0), "x", "y", "z"), make_points(100, seed=1)
    )
    (note,) = drive.notes
    assert "global_pose.csv: no pose for 2 of 5 scans" in note


def test_a_pose_at_the_very_stamp_serves_alone(tmp_path):
    stamps_ns = [T0_NS, T0_NS + 20 * SCAN_PERIOD_NS]
    X_UB = pose_table()[1][:2]
    write_drive(tmp_path / "s", table=(stamps_ns, X_UB))
    with pytest.raises(InputError, match="no pose for the scan"):
        open_drive(tmp_path / "s")
    # Only the first scan remains; it needs no second pose.
    for stamp in scan_stamps()[1:]:
        (tmp_path / "s/sensor_data/Ouster" / f"{stamp}.bin").unlink()
    X_WS = open_drive(tmp_path / "s").X_WS
    X_US = X_UB[0] @ X_BS
    np.testing.assert_allclose(X_WS[0, :3, 3], X_US[:3, 3] - ORIGIN, atol=1e-8)


def test_a_repeated_row_is_no_disorder(tmp_path):
    stamps_ns, X_UB = pose_table()
    twice = np.sort(np.r_[0 : len(stamps_ns), 7])
    write_drive(
        tmp_path / "s", table=([stamps_ns[i] for i in twice], X_UB[twice])
    )
    write_drive(tmp_path / "t", table=(stamps_ns, X_UB))
    np.testing.assert_array_equal(
        open_drive(tmp_path / "s").X_WS, open_drive(tmp_path / "t").X_WS
    )


def swap_rows(stamps_ns, X_UB):
    stamps_ns[10], stamps_ns[11] = stamps_ns[11], stamps_ns[10]


def mirrored(stamps_ns, X_UB):
    X_UB[:, :3, 2] *= -1.0


def lost_for_a_while(stamps_ns, X_UB):
    X_UB[3, :3, 3] = 0.0


def other_day(stamps_ns, X_UB):
    stamps_ns[:] = [stamp + 86_400_000_000_000 for stamp in stamps_ns]


def long_gap(stamps_ns, X_UB):
    stamps_ns[20:] = [stamp + 2_000_000_000 for stamp in stamps_ns[20:]]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (swap_rows, "time: pose 12 at .* is not later"),
        (mirrored, "row 1: no rotation matrix"),
        (lost_for_a_while, "easting: .* is no UTM coordinate"),
        (other_day, "no pose for any scan"),
        (long_gap, "no pose for the scan at .* 2.01 s apart"),
    ],
)
def test_poses_that_cannot_be_used(tmp_path, change, fault):
    table = pose_table()
    change(*table)
    write_drive(tmp_path / "s", table=table)
    path = tmp_path / "s" / "global_pose.csv"
    with pytest.raises(InputError, match=f"^{path}: {fault}"):
        open_drive(tmp_path / "s")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1561000444390857631,1,0,0\n", "row"),
        ("12x," + ",".join("100010001000"), "no row of numbers"),
        ("1561000444390857631," * 13, "row"),
    ],
)
def test_tables_of_another_form(tmp_path, text, fault):
    write_drive(tmp_path / "s")
    path = tmp_path / "s" / "global_pose.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=f"^{path}: .*{fault}") as info:
        open_drive(tmp_path / "s")
    assert "\n" not in str(info.value)


def test_missing_parts(tmp_path):
    write_drive(tmp_path / "s")
    (tmp_path / "s" / "global_pose.csv").rename(tmp_path / "kept.csv")
    with pytest.raises(InputError, match=r"global_pose.csv: No such file"):
        open_drive(tmp_path / "s")
    for file in (tmp_path / "s/sensor_data/Ouster").iterdir():
        file.unlink()
    with pytest.raises(InputError, match=r"Ouster: no scan \(\*\.bin\) in it"):
        open_drive(tmp_path / "s")
    (tmp_path / "t").mkdir()
    (tmp_path / "kept.csv").rename(tmp_path / "t" / "global_pose.csv")
    with pytest.raises(InputError, match="neither sensor_data/Ouster nor"):
        open_drive(tmp_path / "t")


def test_a_scan_cut_off_in_a_point(tmp_path):
    write_drive(tmp_path / "s")
    path = tmp_path / "s/sensor_data/Ouster" / f"{T0_NS}.bin"
    whole = path.read_bytes()
    for size in (len(whole) - 1, len(whole) - 15, 3):
        write_bytes(path, whole[:size])
        with pytest.raises(InputError, match=f"^{path}: {size} bytes is no"):
            open_drive(tmp_path / "s").scan(0)
    write_bytes(path, whole[:-16])
    assert len(open_drive(tmp_path / "s").scan(0)) == 99
    write_bytes(path, b"")
    assert len(open_drive(tmp_path / "s").scan(0)) == 0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_beams_without_a_return_have_no_finite_point(tmp_path, value):
    write_drive(tmp_path / "s")
    path = tmp_path / "s/sensor_data/Ouster" / f"{T0_NS}.bin"
    points = make_points(20)
    points[4, 1] = value
    write_bytes(path, xyzi(points))
    scan = open_drive(tmp_path / "s").scan(0)
    assert np.flatnonzero(~np.isfinite(scan["y"])).tolist() == [4]


def test_files_with_other_names(tmp_path):
    write_drive(tmp_path / "s")
    folder = tmp_path / "s/sensor_data/Ouster"
    write_bytes(folder / "._1.bin", b"as macOS leaves behind")
    assert len(open_drive(tmp_path / "s")) == NUM_SCANS
    write_bytes(folder / "first.bin", b"")
    with pytest.raises(InputError, match=r"'first' is no time"):
        open_drive(tmp_path / "s")
