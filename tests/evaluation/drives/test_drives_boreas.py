"""Drives in Boreas' layout, written by struct and read back."""

import struct

from helpers.dataset_folders import stored, write_bytes
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.study import find_recordings

T0_US = 1_628_184_886_518_266
HEADER = (
    "GPSTime,easting,northing,altitude,vel_east,vel_north,vel_up,roll,pitch,"
    "heading,angvel_z,angvel_y,angvel_x"
)
POINTS = [
    (4.0, -2.0, 0.5, 17.0, 127.0, -0.05),
    (10.0, 3.0, -1.5, 255.0, 0.0, 0.0125),
]


def seen_from_above(roll, pitch, yaw):
    """Returns R_SW as the development kit makes it: by three passive turns."""
    (a, b, c), (x, y, z) = (
        np.cos([roll, pitch, yaw]),
        np.sin([roll, pitch, yaw]),
    )
    about_x = np.array([[1, 0, 0], [0, a, x], [0, -x, a]])
    about_y = np.array([[b, 0, -y], [0, 1, 0], [y, 0, b]])
    about_z = np.array([[c, z, 0], [-z, c, 0], [0, 0, 1]])
    return about_x @ about_y @ about_z


def write_drive(root, *, origin=(5.0, -7.0, 2.0), angles=(0.02, -0.03, 0.7)):
    folder = root / "boreas-2021-08-05-13-34"
    lines = [HEADER]
    for k in range(3):
        stamp = T0_US + 100_000 * k
        data = b"".join(struct.pack("<6f", *point) for point in POINTS)
        write_bytes(folder / "lidar" / f"{stamp}.bin", data)
        east, north, up = origin
        cells = (east + 0.8 * k, north, up, 8.0, 0.0, 0.0, *angles, 0, 0, 0)
        lines.append(",".join(map(str, (stamp, *cells))))
    text = "\n".join(lines) + "\n"
    write_bytes(folder / "applanix" / "lidar_poses.csv", text.encode())
    return folder


def test_scans_and_poses(tmp_path):
    drive = open_drive(write_drive(tmp_path))
    assert drive.name == "boreas-2021-08-05-13-34"
    assert drive.world_frame == "boreas/enu"
    assert drive.lidar_field.rings == 128
    assert drive.notes == ()
    assert drive.stamps_ns.tolist() == [
        (T0_US + 100_000 * k) * 1000 for k in range(3)
    ]
    scan = drive.scan(2)
    names = ("x", "y", "z", "intensity", "laser")
    np.testing.assert_array_equal(
        stored(scan, *names), np.array(POINTS)[:, :5].astype("<f4")
    )
    # Times are nanoseconds from the middle of the turn.
    np.testing.assert_allclose(scan["t"], [-50_000_000, 12_500_000], atol=5)
    X_WS = drive.X_WS[2]
    np.testing.assert_allclose(
        X_WS[:3, :3], seen_from_above(0.02, -0.03, 0.7), atol=1e-12
    )
    np.testing.assert_allclose(X_WS[:3, 3], [6.6, -7.0, 2.0])


def test_the_grid_has_a_nearer_origin(tmp_path):
    grid = (623_425.5, 4_848_821.0, 153.85)
    drive = open_drive(write_drive(tmp_path, origin=grid))
    assert drive.world_frame == "boreas/utm-17n"
    np.testing.assert_allclose(drive.X_WS[0, :3, 3], [3425.5, 3821.0, 153.85])


def test_faults_are_named(tmp_path):
    folder = write_drive(tmp_path)
    scan = folder / "lidar" / f"{T0_US}.bin"
    scan.write_bytes(struct.pack("<6f", 1, 2, 3, 4, 128, 0))
    with pytest.raises(InputError, match="laser: 128"):
        open_drive(folder).scan(0)
    scan.write_bytes(bytes(25))
    with pytest.raises(InputError, match=f"{T0_US}.bin: 25 bytes"):
        open_drive(folder).scan(0)
    scan.rename(scan.with_name("first.bin"))
    with pytest.raises(InputError, match=r"named \*.bin: 'first' is no time"):
        open_drive(folder)


def test_a_report_finds_drives_by_their_dates(tmp_path):
    folder = write_drive(tmp_path)
    (found,) = find_recordings(tmp_path)
    assert found.path == folder
    assert (found.map_name, found.stage) == ("boreas", "2021-08-05-13-34")
