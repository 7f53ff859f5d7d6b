import struct

from helpers.dataset_folders import (
    SCAN_PERIOD_NS,
    UTM,
    make_points,
    stored,
    write_bytes,
)
from helpers.helipr_drive import (
    CHANGE_NS,
    EARLY_AEVA,
    FORMATS,
    NUM_SCANS,
    records,
    stamps,
    write_drive,
)
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import ORIGIN, check_same_world, open_drive

FIELDS = {
    "Ouster": ("intensity", "t", "reflectivity", "ring", "ambient"),
    "Velodyne": ("intensity", "ring", "time"),
    "Avia": ("reflectivity", "tag", "line", "offset_time"),
    "Aeva": (
        "reflectivity",
        "velocity",
        "time_offset_ns",
        "line_index",
        "intensity",
    ),
}


@pytest.mark.parametrize("lidar", FORMATS)
def test_reads_every_lidar(tmp_path, lidar):
    stamps_ns, X_LS = write_drive(tmp_path / "KAIST06")
    drive = open_drive(tmp_path / "KAIST06" / "LiDAR" / lidar)
    assert drive.name == f"KAIST06_{lidar}"
    assert drive.stamps_ns.tolist() == stamps_ns
    for i in (3, 0):
        scan = drive.scan(i)
        points = make_points(120, seed=i)
        _, rest = records(FORMATS[lidar], points)
        np.testing.assert_array_equal(stored(scan, "x", "y", "z"), points)
        # Written in single precision.
        np.testing.assert_allclose(
            stored(scan, *FIELDS[lidar]), rest, rtol=1e-7
        )
    expected = X_LS.copy()
    expected[:, :3, 3] += UTM - ORIGIN
    np.testing.assert_allclose(drive.X_WS, expected, atol=2e-9)
    assert drive.world_frame == "helipr/utm-52n"
    assert drive.datum == "utm-52n"
    assert drive.notes == ()


def test_aeva_changes_its_records_on_the_very_nanosecond(tmp_path):
    stamps_ns = stamps(start_ns=CHANGE_NS - SCAN_PERIOD_NS)
    assert stamps_ns[1] == CHANGE_NS
    stamps_ns[2] = CHANGE_NS + 1
    write_drive(tmp_path / "Bridge01", ("Aeva",), stamps_ns=stamps_ns)
    drive = open_drive(tmp_path / "Bridge01")
    for i in range(NUM_SCANS):
        scan = drive.scan(i)
        assert ("intensity" in scan.dtype.names) == (i >= 2)
        assert scan.itemsize == (29 if i >= 2 else 25)
        np.testing.assert_array_equal(
            stored(scan, "x", "y", "z"), make_points(120, seed=i)
        )


def test_which_lidar_is_read(tmp_path):
    write_drive(tmp_path / "all")
    assert open_drive(tmp_path / "all").name == "all_Ouster"
    assert open_drive(tmp_path / "all", "Avia").name == "all_Avia"
    # A scenario that names one LiDAR says nothing of the others.
    beside = tmp_path / "all" / "scenario.yaml"
    beside.write_text("name: walk\nlidars: {Velodyne: {preset: vlp-16}}\n")
    for lidar, rings in (("Velodyne", 16), ("Ouster", 128)):
        drive = open_drive(tmp_path / "all", lidar)
        assert drive.name == f"walk_{lidar}"
        assert drive.lidar_field.rings == rings
    write_drive(tmp_path / "one", ("Velodyne",))
    assert open_drive(tmp_path / "one").name == "one_Velodyne"
    write_drive(tmp_path / "two", ("Velodyne", "Aeva"))
    with pytest.raises(InputError, match=r"no LiDAR/Ouster .*Velodyne Aeva"):
        open_drive(tmp_path / "two")
    with pytest.raises(InputError, match="no LiDAR/Livox in it"):
        open_drive(tmp_path / "all", "Livox")


def test_local_poses_where_there_are_no_global_ones(tmp_path):
    _, X_LS = write_drive(
        tmp_path / "Town01", ("Ouster",), ground_truth=("local",)
    )
    drive = open_drive(tmp_path / "Town01")
    np.testing.assert_allclose(drive.X_WS, X_LS, atol=1e-12)
    # Each drive has a frame of its own, also if two have the same name.
    write_drive(tmp_path / "2/Town01", ("Ouster",), ground_truth=("local",))
    with pytest.raises(InputError, match="poses in frame"):
        check_same_world(drive, open_drive(tmp_path / "2/Town01"))
    assert drive.datum is None


def test_a_file_of_another_lidar(tmp_path):
    write_drive(tmp_path / "s")
    folder = tmp_path / "s" / "LiDAR"
    name = f"{stamps()[0]}.bin"
    # 11 x 26 = 13 x 22 bytes: only the content shows the format.
    data, _ = records(FORMATS["Velodyne"], make_points(13))
    write_bytes(folder / "Ouster" / name, data)
    with pytest.raises(InputError, match=f"^{folder / 'Ouster' / name}: "):
        open_drive(folder / "Ouster").scan(0)
    data, _ = records(FORMATS["Ouster"], make_points(11))
    write_bytes(folder / "Velodyne" / name, data)
    with pytest.raises(InputError, match=f"^{folder / 'Velodyne' / name}: "):
        open_drive(folder / "Velodyne").scan(0)
    # Aeva's early records, of 25 bytes, after the change.
    data, _ = records(EARLY_AEVA, make_points(30))
    write_bytes(folder / "Aeva" / name, data)
    with pytest.raises(InputError, match="no whole number of points of 29"):
        open_drive(folder / "Aeva").scan(0)
    data, _ = records(EARLY_AEVA, make_points(29 * 4))
    write_bytes(folder / "Aeva" / name, data)
    with pytest.raises(InputError, match=f"^{folder / 'Aeva' / name}: "):
        open_drive(folder / "Aeva").scan(0)


@pytest.mark.parametrize("lidar", FORMATS)
def test_the_last_point(tmp_path, lidar):
    write_drive(tmp_path / "s", (lidar,))
    folder = tmp_path / "s" / "LiDAR" / lidar
    path = folder / f"{stamps()[0]}.bin"
    whole = path.read_bytes()
    points = make_points(120, seed=0)
    scan = open_drive(folder).scan(0)
    np.testing.assert_array_equal(
        stored(scan, "x", "y", "z")[-1], points[-1].astype(float)
    )
    for cut in (1, FORMATS[lidar][1] - 1):
        write_bytes(path, whole[:-cut])
        with pytest.raises(InputError, match=f"^{path}: .* no whole number"):
            open_drive(folder).scan(0)


def edit_poses(folder, change):
    path = folder / "LiDAR_GT" / "global_Ouster_gt.txt"
    rows = [line.split() for line in path.read_text().splitlines()]
    change(rows)
    path.write_text("\n".join(" ".join(row) for row in rows) + "\n")
    return path


def zero_quaternion(rows):
    rows[2][4:] = ["0", "0", "0", "0"]


def not_utm(rows):
    rows[0][2] = "-12.0"


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (zero_quaternion, "row 3: quaternion: of length 0"),
        (not_utm, "northing: -12 m of pose 1"),
    ],
)
def test_poses_that_cannot_be_used(tmp_path, change, fault):
    write_drive(tmp_path / "s", ("Ouster",))
    path = edit_poses(tmp_path / "s", change)
    with pytest.raises(InputError, match=f"^{path}: .*{fault}") as info:
        open_drive(tmp_path / "s")
    assert "\n" not in str(info.value)


def test_missing_poses(tmp_path):
    write_drive(tmp_path / "s", ("Ouster",), ground_truth=())
    with pytest.raises(InputError, match=r"Ouster_gt.txt: No such file"):
        open_drive(tmp_path / "s")
    # Poses of another LiDAR do not help.
    write_drive(tmp_path / "s", ("Aeva",))
    with pytest.raises(InputError, match=r"Ouster_gt.txt: No such file"):
        open_drive(tmp_path / "s" / "LiDAR" / "Ouster")


def test_a_binary_file_for_poses(tmp_path):
    write_drive(tmp_path / "s", ("Ouster",))
    path = tmp_path / "s" / "LiDAR_GT" / "global_Ouster_gt.txt"
    path.write_bytes(struct.pack("<12f", *range(12)) + b"\xff\xfe\x80")
    with pytest.raises(InputError, match=f"^{path}: not a text file"):
        open_drive(tmp_path / "s")
