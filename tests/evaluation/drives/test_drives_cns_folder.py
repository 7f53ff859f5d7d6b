from helpers.dataset_folders import (
    make_points,
    make_poses,
    stored,
    write_bytes,
    write_pcd,
    write_quaternions,
)
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import check_same_world, open_drive

T0_NS = 1_700_000_000_000_000_001
NUM_SCANS = 5
HALF = np.sqrt(0.5)
UPRIGHT = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1.6], [0, 0, 0, 1.0]])
# Turned by 90 degrees about z, and moved.
TURNED = np.array(
    [[0, -1, 0, 0.25], [1, 0, 0, -0.5], [0, 0, 1, 1.75], [0, 0, 0, 1.0]]
)


def write_drive(
    root,
    *,
    place=("Metropolis", "01"),
    folder="pcd",
    names=None,
    times=None,
    header="",
    mount="matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.6, 0, 0, 0, 1]\n",
):
    """Writes a drive; returns its folder and the poses of the vehicle."""
    drive = root.joinpath(*place)
    stamps = [T0_NS + 50_000_000 * i for i in range(NUM_SCANS)]
    X_WB = make_poses(NUM_SCANS)
    for i, name in enumerate(stamps if names is None else names):
        write_pcd(drive / folder / f"{name}.pcd", make_points(60, seed=i))
    write_quaternions(
        drive / "gt.csv", stamps if times is None else times, X_WB, ",", header
    )
    imu = [f"{stamp},0,0,0,1,0,0,0,0,0,9.81" for stamp in stamps]
    (drive / "imu.csv").write_text("\n".join(imu) + "\n")
    if mount is not None:
        (root / "transformation_lidar.yaml").write_text(mount)
        (root / "transformation_imu.yaml").write_text(
            "matrix: [1, 0, 0, -1, 0, 1, 0, 0, 0, 0, 1, 1.6, 0, 0, 0, 1]\n"
        )
    return drive, X_WB


@pytest.mark.parametrize("folder", ["pcd", "LiDAR"])
def test_reads_what_was_written(tmp_path, folder):
    path, X_WB = write_drive(tmp_path, folder=folder)
    drive = open_drive(path)
    assert drive.name == "metropolis_01"
    assert drive.world_frame == "map"
    assert drive.stamps_ns.tolist() == [
        T0_NS + 50_000_000 * i for i in range(NUM_SCANS)
    ]
    np.testing.assert_allclose(drive.X_WS, X_WB @ UPRIGHT, atol=1e-12)
    for i in (4, 1):
        scan = drive.scan(i)
        np.testing.assert_array_equal(
            stored(scan, "x", "y", "z"), make_points(60, seed=i)
        )
        np.testing.assert_array_equal(scan["intensity"], np.arange(60))


def test_the_folders_name_map_and_stage(tmp_path):
    def drive(*place):
        return open_drive(write_drive(tmp_path, place=place)[0])

    first = drive("Metropolis", "01")
    assert first.scenario == {"map": "metropolis", "stage": "01"}
    check_same_world(first, drive("Metropolis", "04"))
    with pytest.raises(InputError, match="through riverside"):
        check_same_world(first, drive("Riverside", "01"))


def test_a_drive_on_its_own(tmp_path):
    """Without files in the folders above, the mount is the data set's."""
    path, X_WB = write_drive(tmp_path, place=("my_drive",), mount=None)
    drive = open_drive(path)
    assert drive.name == "my_drive"
    assert drive.scenario is None
    np.testing.assert_allclose(drive.X_WS, X_WB @ UPRIGHT, atol=1e-12)
    (path / "transformation_lidar.yaml").write_text(
        "[[0, -1, 0, 0.25], [1, 0, 0, -0.5], [0, 0, 1, 1.75]]\n"
    )
    np.testing.assert_allclose(open_drive(path).X_WS, X_WB @ TURNED, atol=1e-12)


@pytest.mark.parametrize(
    "mount",
    [
        "T: [0, -1, 0, 0.25, 1, 0, 0, -0.5, 0, 0, 1, 1.75, 0, 0, 0, 1]",
        "lidar:\n  frame: base\n  T:\n    - [0, -1, 0, 0.25]\n"
        "    - [1, 0, 0, -0.5]\n    - [0, 0, 1, 1.75]\n    - [0, 0, 0, 1]",
        "%YAML:1.0\n---\nextrinsic: !!opencv-matrix\n   rows: 4\n   cols: 4\n"
        "   dt: d\n   data: [0., -1., 0., 0.25, 1., 0., 0., -0.5,\n"
        "          0., 0., 1., 1.75, 0., 0., 0., 1.]",
        f"translation: [0.25, -0.5, 1.75]\nrotation: [0, 0, {HALF}, {HALF}]",
        "Translation: {x: 0.25, y: -0.5, z: 1.75}\n"
        f"Rotation: {{x: 0, y: 0, z: {HALF}, w: {HALF}}}",
        "translation: [0.25, -0.5, 1.75]\n"
        "rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
    ],
)
def test_notations_of_the_mount(tmp_path, mount):
    drive, X_WB = write_drive(tmp_path, mount=mount)
    np.testing.assert_allclose(
        open_drive(drive).X_WS, X_WB @ TURNED, atol=1e-12
    )


@pytest.mark.parametrize(
    ("mount", "fault"),
    [
        ("", "no transformation"),
        ("T: [1, 2", "flow sequence"),
        ("T: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1.6]", "inverse"),
        ("T: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.6, 0, 1, 0, 1]", "last row"),
        ("translation: [0, 0, 1.6]\nrotation: [0, 0, 0]", "3 numbers"),
        ("translation: [0, 0, 1.6]\nrotation: [0, 0, 0, 0]", "quaternion"),
    ],
)
def test_mounts_that_cannot_be_used(tmp_path, mount, fault):
    drive, _ = write_drive(tmp_path, mount=mount)
    path = tmp_path / "transformation_lidar.yaml"
    with pytest.raises(InputError, match=f"^{path}: .*{fault}"):
        open_drive(drive)


@pytest.mark.parametrize(
    ("names", "times"),
    [
        # Seconds, written with different numbers of digits.
        (
            ["12.05", "12.1", "12.15", "12.2", "12.25"],
            ["12.050000", "1.21e1", "12.15", "12.200", "12.25"],
        ),
        # Nanoseconds that were stored as a double.
        (None, [f"{1.7e9 + 0.05 * i:.9f}" for i in range(NUM_SCANS)]),
    ],
)
def test_notations_of_the_time(tmp_path, names, times):
    path, X_WB = write_drive(
        tmp_path, names=names, times=times, header="time,x,y,z,qx,qy,qz,qw"
    )
    drive = open_drive(path)
    np.testing.assert_allclose(drive.X_WS, X_WB @ UPRIGHT, atol=1e-12)
    np.testing.assert_allclose(np.diff(drive.stamps_ns), 50_000_000, atol=300)


def test_scans_that_cannot_be_used(tmp_path):
    drive, _ = write_drive(tmp_path)
    path = drive / "pcd" / f"{T0_NS}.pcd"
    whole = path.read_bytes()
    write_bytes(path, whole[:-5])
    with pytest.raises(InputError, match=f"^{path}: cut off"):
        open_drive(drive).scan(0)
    write_bytes(path, b"\x00" * 64)
    with pytest.raises(InputError, match=f"^{path}: not a PCD file"):
        open_drive(drive).scan(0)
    points = make_points(5)
    points[2, 0] = 2e4
    write_pcd(path, points)
    with pytest.raises(InputError, match=f"^{path}: x: point 2 is"):
        open_drive(drive).scan(0)


def test_missing_parts(tmp_path):
    drive, _ = write_drive(tmp_path)
    (drive / "gt.csv").unlink()
    with pytest.raises(InputError, match=r"gt.csv: No such file"):
        open_drive(drive)
    drive, _ = write_drive(tmp_path / "other")
    for path in (drive / "pcd").iterdir():
        path.unlink()
    with pytest.raises(InputError, match=r"pcd: no scan \(\*\.pcd\)"):
        open_drive(drive)
    (drive / "pcd").rmdir()
    with pytest.raises(InputError, match="neither pcd nor LiDAR"):
        open_drive(drive)


def test_a_folder_of_two_formats(tmp_path):
    drive, _ = write_drive(tmp_path)
    (drive / "velodyne").mkdir()
    with pytest.raises(InputError, match=r"several formats \(CNS, KITTI"):
        open_drive(drive)


def test_a_viewpoint_of_the_scans_is_named(tmp_path):
    drive, _ = write_drive(tmp_path)
    assert open_drive(drive).notes == ()
    for path in (drive / "pcd").iterdir():
        data = path.read_bytes().replace(
            b"VIEWPOINT 0 0 0 1", b"VIEWPOINT 0 0 1.6 1"
        )
        path.write_bytes(data)
    (note,) = open_drive(drive).notes
    assert "VIEWPOINT is not applied" in note
