"""Tables of poses (`--poses`) in the forms of other programs."""

from decimal import Decimal

from helpers.dataset_folders import make_points, write_bytes, xyzi
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive

NAMES = "x,y,z,qx,qy,qz,qw"


def open_posed(root, lines, times=("0", "0.1", "0.2")):
    """Opens a drive of scans at `times` [s] at the poses in a table."""
    folder = root / "sequences" / "11"
    for k in range(len(times)):
        points = xyzi(make_points(5, seed=k))
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", points)
    (folder / "times.txt").write_text("\n".join(times))
    table = root / "poses.csv"
    table.write_text("\n".join(lines))
    return open_drive(folder, poses=table)


@pytest.mark.parametrize("names", ["time,x,y,z,roll,pitch,yaw", "time,x,y,z"])
def test_a_table_without_rotations_is_refused(tmp_path, names):
    row = ",".join("0" * len(names.split(",")))
    fault = r"^\S*poses\.csv: header: no qx qy qz qw$"
    with pytest.raises(InputError, match=fault):
        open_posed(tmp_path, [names, row])


# Stamps that a double cannot represent.
T0_S = 1_583_840_211
NS = [123_456_789, 223_456_789, 323_456_788]


@pytest.mark.parametrize(
    ("time", "unit_ns"),
    [
        ("#sec,nsec", None),
        ("#secs,nsecs", None),
        ("header.stamp.sec,header.stamp.nanosec", None),
        ("#timestamp [ns]", 1),
        ("timestamp_ns", 1),
        ("time [ms]", 1_000_000),
        ("timestamp_ms", 1_000_000),
        ("timestamp [us]", 1000),
        ("Time (\u00b5s)", 1000),
        ("t [\u03bcs]", 1000),
        ("t_us", 1000),
        ("time [s]", 10**9),
        ("time_sec", 10**9),
        ("time", 10**9),
    ],
)
@pytest.mark.parametrize("start_s", [0, T0_S])
def test_times_are_read_in_the_unit_of_the_header(
    tmp_path, time, unit_ns, start_s
):
    lines = [f"{time},{NAMES}"]
    for k, ns in enumerate(NS):
        stamp = Decimal(start_s * 10**9 + ns)
        words = f"{start_s},{ns}" if unit_ns is None else stamp / unit_ns
        lines.append(f"{words},{k},0,0,0,0,0,1")
    times = [f"{start_s}.{ns:09d}" for ns in NS]
    drive = open_posed(tmp_path, lines, times)
    assert drive.X_WS[:, 0, 3].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("1,1000000000", "row 1: 1000000000 ns are no part of a second"),
        ("1,-1", "row 1: -1 ns are no part of a second"),
        ("1,x", "time: 'x' is no time"),
        ("1e10,5", "'1e10' is no time"),
    ],
)
def test_seconds_and_nanoseconds_that_are_none(tmp_path, row, fault):
    lines = [f"sec,nsec,{NAMES}", f"{row},0,0,0,0,0,0,1"]
    with pytest.raises(InputError, match=rf"poses\.csv: {fault}$"):
        open_posed(tmp_path, lines)


@pytest.mark.parametrize("last", ["2", "2.0000", "2.5"])
def test_times_that_count_the_scans(tmp_path, last):
    """KISS-ICP writes numbers for times if it knows no stamps."""
    rows = [f"{t} {k} 0 0 0 0 0 1" for k, t in enumerate(["0", "1.0", last])]
    drive = open_posed(tmp_path, rows)
    # Others are times: one pose a second, ten scans a second.
    wanted = [0.0, 0.1, 0.2] if last == "2.5" else [0.0, 1.0, 2.0]
    assert drive.X_WS[:, 0, 3] == pytest.approx(wanted)


def test_one_of_the_scans_that_are_counted_has_no_pose(tmp_path):
    rows = [f"{k} {k} 0 0 0 0 0 1" for k in range(3)]
    rows[1] = "1 nan 0 0 0 0 0 1"
    drive = open_posed(tmp_path, rows, ["0", "0.1", "0.4"])
    assert drive.X_WS[:, 0, 3] == pytest.approx([0.0, 0.5, 2.0])


def table_of(times, x, quat="0 0 0 1"):
    """Returns rows of TUM's form along x [m]."""
    return [
        f"{t:.4f} {a:.4f} 0 0 {quat}" for t, a in zip(times, x, strict=True)
    ]


def test_a_stamp_that_stands_twice_is_no_fault_if_the_pose_is_one(tmp_path):
    """As in the ground truth of TUM, whose times have 0.1 ms."""
    times = [0.0, 0.05, 0.05, 0.1, 0.1, 0.2]
    x = [0.0, 0.5, 0.5013, 1.0, 1.0, 2.0]
    drive = open_posed(tmp_path, table_of(times, x))
    assert drive.X_WS[:, 0, 3].tolist() == [0.0, 1.0, 2.0]
    assert "2 poses have the time of another, up to 1.3 mm" in drive.notes[-1]


@pytest.mark.parametrize("away", [0.049, 0.051])
def test_poses_of_one_stamp_are_apart_from_5_cm_on(tmp_path, away):
    rows = table_of([0.0, 0.1, 0.1, 0.2], [0.0, 1.0, 1.0 + away, 2.0])
    if away < 0.05:
        assert open_posed(tmp_path, rows).X_WS[1, 0, 3] == 1.0
        return
    fault = r"poses\.csv: time: pose 3 at 100000000 ns .* 0\.051 m and 0 deg"
    with pytest.raises(InputError, match=fault):
        open_posed(tmp_path, rows)


def test_rows_in_any_order_are_sorted(tmp_path):
    times = np.arange(-5, 30) * 0.01
    order = np.random.default_rng(3).permutation(len(times))
    rows = table_of(times[order], 10.0 * times[order])
    drive = open_posed(tmp_path, rows)
    np.testing.assert_allclose(drive.X_WS[:, 0, 3], [0.0, 1.0, 2.0], atol=1e-9)
    assert "the poses are sorted by time" in drive.notes[-1]


def test_rows_of_two_drives_are_refused(tmp_path):
    """Two logs in one file, whose times overlap, are no trajectory."""
    times = np.arange(30) * 0.01
    rows = [
        *table_of(times, 10.0 * times),
        *table_of(times + 0.005, 10.0 * times + 40.0),
    ]
    with pytest.raises(
        InputError, match=r"pose 31 at 5000000 ns .* back and forth"
    ):
        open_posed(tmp_path, rows)


@pytest.mark.parametrize("length", [0.99, 1.01])
def test_the_length_of_a_quaternion_turns_nothing(tmp_path, length):
    """As of numbers with two digits."""
    quat = f"0 0 {0.6 * length:.3f} {0.8 * length:.3f}"
    rows = table_of([0.0, 0.1, 0.2], [0.0, 1.0, 2.0], quat)
    drive = open_posed(tmp_path, rows)
    assert drive.X_WS[0, 0, 0] == pytest.approx(0.28, abs=1e-3)
