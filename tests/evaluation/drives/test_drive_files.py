"""The files that a reader names are those that it opens."""

import os
import pickle
import shutil
import sys

from helpers import drive_folders, helipr_drive, mulran_drive
from helpers.dataset_folders import (
    make_points,
    make_poses,
    write_bytes,
    write_matrices,
    write_quaternions,
    xyzi,
)
from helpers.drive_files import make_scan, write_recording
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import MovedDrive, RecordingSource, open_drive

MATRIX = "matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.6, 0, 0, 0, 1]\n"
_opened: list[str] | None = None


def _listen(event, arguments):
    if event == "open" and _opened is not None:
        _opened.append(str(arguments[0]))


sys.addaudithook(_listen)


def mcap(root):
    folder = root / "town_01"
    scan = make_scan(np.full((4, 3), 2.0))
    write_recording(folder, [scan] * 2, [np.eye(4)] * 2)
    return folder


def mulran(root):
    mulran_drive.write_drive(root / "KAIST01")
    return root / "KAIST01"


def helipr(root):
    helipr_drive.write_drive(root / "KAIST05")
    return root / "KAIST05"


def nclt(root):
    folder = root / "2012-01-08"
    drive_folders.nclt(folder, [np.ones((5, 3))] * 8)
    (root / "ground_truth").mkdir(exist_ok=True)
    table = root / "groundtruth_2012-01-08.csv"
    table.rename(root / "ground_truth" / table.name)
    return folder


def boreas(root):
    folder = root / "boreas-2021-08-05-13-34"
    drive_folders.boreas(folder, [np.ones((5, 3))] * 8)
    return folder


def kitti(root):
    folder = root / "sequences" / "07"
    for k in range(3):
        points = make_points(5, seed=k)
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", xyzi(points))
        write_bytes(folder / "labels" / f"{k:06d}.label", bytes(range(20)))
    (folder / "times.txt").write_text("0\n1\n2\n")
    (folder / "frames.txt").write_text("0\n1\n2\n")
    (folder / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
    (folder / "scenario.yaml").write_text("map: town\nstage: '01'\n")
    (folder / "structures.json").write_text("[]")
    write_matrices(folder / "first_pose.txt", None, make_poses(1), " ")
    write_matrices(root / "poses" / "07.txt", None, make_poses(3), " ")
    return folder


def cns(root):
    folder = root / "Metropolis" / "01"
    stamps = [1000, 2000, 3000]
    header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n"
    pcd = f"{header}POINTS 1\nDATA ascii\n1 2 3\n".encode()
    for stamp in stamps:
        write_bytes(folder / "pcd" / f"{stamp}.pcd", pcd)
    write_quaternions(folder / "gt.csv", stamps, make_poses(3), ",")
    (folder / "imu.csv").write_text("1000,0,0,0,1,0,0,0,0,0,9.81\n")
    (folder / "scenario.yaml").write_text("map: town\nstage: '01'\n")
    (root / "transformation_lidar.yaml").write_text(MATRIX)
    return folder


EVERY = (mcap, mulran, helipr, nclt, boreas, kitti, cns)


def test_a_moved_drive_goes_to_other_processes(tmp_path):
    drive = open_drive(mcap(tmp_path))
    moved = MovedDrive(drive, drive.X_WS + 1.0, "other", None)
    again = pickle.loads(pickle.dumps(moved))
    np.testing.assert_array_equal(again.X_WS, moved.X_WS)
    assert again.world_frame == "other"


def opened_by(action):
    """Returns the real paths of the files that a function opens."""
    global _opened
    _opened = []
    try:
        action()
        return {os.path.realpath(path) for path in _opened}
    finally:
        _opened = None


@pytest.mark.parametrize("write", EVERY, ids=lambda write: write.__name__)
def test_every_file_that_is_opened_is_named(tmp_path, write):
    folder = write(tmp_path)

    def use():
        drive = open_drive(folder)
        assert sum(map(len, drive)) > 0
        for name in ("notes", "scenario", "instances", "imu", "motion"):
            getattr(drive, name)

    inside = os.path.realpath(tmp_path)
    opened = {path for path in opened_by(use) if path.startswith(inside)}
    files = open_drive(folder).files
    assert opened == {os.path.realpath(path) for path in files}
    first = RecordingSource(folder).identity()
    files[-1].write_bytes(files[-1].read_bytes()[::-1])
    try:
        assert RecordingSource(folder).identity() != first
    except InputError:  # A recording that is written backwards.
        assert write is mcap


def test_corrected_poses_are_another_drive(tmp_path):
    folder = kitti(tmp_path)
    first = RecordingSource(folder).identity()
    table = tmp_path / "poses" / "07.txt"
    table.write_text(table.read_text().replace("0", "00", 1))
    second = RecordingSource(folder).identity()
    assert second != first
    # The LiDAR's mount lies two folders above the drive.
    folder = cns(tmp_path / "cns")
    first = RecordingSource(folder).identity()
    mount = tmp_path / "cns" / "transformation_lidar.yaml"
    mount.write_text(MATRIX.replace("1.6", "1.7"))
    assert RecordingSource(folder).identity() != first


def test_a_link_stands_for_its_target(tmp_path):
    folder = kitti(tmp_path)
    scans = folder / "velodyne"
    scans.rename(tmp_path / "elsewhere")
    scans.symlink_to(tmp_path / "elsewhere")
    first = RecordingSource(folder).identity()
    (tmp_path / "elsewhere" / "000001.bin").write_bytes(xyzi(make_points(5, 9)))
    assert RecordingSource(folder).identity() != first


@pytest.mark.parametrize("write", EVERY, ids=lambda write: write.__name__)
@pytest.mark.parametrize("whole", [True, False])
def test_a_drive_has_the_name_that_it_is_given(tmp_path, write, whole):
    """A link to the data on another disk, which has other names.

    Either the whole data set lies there, or the drive's folder alone, whose
    tables then lie beside the link.
    """
    original = write(tmp_path / "plain")
    wanted = open_drive(original)
    here, disk = tmp_path / "here", tmp_path / "disk" / "volume" / "x"
    shutil.copytree(tmp_path / "plain", here)
    folder = here / original.relative_to(tmp_path / "plain")
    moved = here if whole else folder
    disk.parent.mkdir(parents=True)
    moved.rename(disk)
    moved.symlink_to(disk)
    drive = open_drive(folder)
    assert (drive.name, len(drive)) == (wanted.name, len(wanted))
    assert drive.scenario == wanted.scenario
    np.testing.assert_array_equal(drive.X_WS, wanted.X_WS)


@pytest.mark.parametrize("write", EVERY, ids=lambda write: write.__name__)
def test_a_link_may_have_a_name_of_its_own(tmp_path, write):
    """Tables are then found beside the target, too."""
    original = write(tmp_path / "plain")
    (tmp_path / "mine").symlink_to(original)
    drive, wanted = open_drive(tmp_path / "mine"), open_drive(original)
    np.testing.assert_array_equal(drive.X_WS, wanted.X_WS)
    if write not in (kitti, cns):  # Their scenarios name them.
        assert "mine" in drive.name


@pytest.mark.parametrize("write", EVERY[1:], ids=lambda write: write.__name__)
def test_a_scenario_names_a_drive(tmp_path, write):
    folder = write(tmp_path)
    (folder / "scenario.yaml").write_text("name: rainy_07\n")
    drive = open_drive(folder)
    # Each LiDAR of HeLiPR is a drive.
    lidar = "_Ouster" if write is helipr else ""
    assert (drive.name, drive.session) == (f"rainy_07{lidar}", "rainy_07")


def test_the_one_of_two_tables_that_is_read_is_named(tmp_path):
    folder = kitti(tmp_path)
    common = tmp_path / "poses" / "07.txt"
    own = folder / "poses.txt"
    own.write_bytes(common.read_bytes())
    assert open_drive(folder, columns=4).notes == ()
    write_matrices(own, None, make_poses(3, seed=5), " ")
    assert f"{common}: read; not read: {own}" in open_drive(folder).notes
    # NCLT's ground truth, beside the session and in a folder.
    folder = nclt(tmp_path)
    common = tmp_path / "ground_truth" / "groundtruth_2012-01-08.csv"
    own = tmp_path / "groundtruth_2012-01-08.csv"
    own.symlink_to(common)
    assert open_drive(folder).notes == ()
    own.unlink()
    own.write_text(common.read_text().replace("-3.0", "-4.0"))
    assert open_drive(folder).notes == (f"{own}: read; not read: {common}",)


def test_the_one_of_two_folders_or_mounts_that_is_read_is_named(tmp_path):
    folder = cns(tmp_path)
    (folder / "LiDAR").mkdir()
    nearer = folder.parent / "transformation_lidar.yaml"
    nearer.write_text(MATRIX.replace("1.6", "1.8"))
    read = (folder / "pcd", nearer)
    others = (folder / "LiDAR", tmp_path / "transformation_lidar.yaml")
    assert open_drive(folder).notes == tuple(
        f"{one}: read; not read: {other}"
        for one, other in zip(read, others, strict=True)
    )
    folder = mulran(tmp_path)
    (folder / "Ouster").mkdir()
    assert open_drive(folder).notes[0] == (
        f"{folder / 'sensor_data/Ouster'}: read; not read: {folder / 'Ouster'}"
    )


GROUND_TRUTH = {
    mulran: "global_pose.csv",
    helipr: "LiDAR_GT/*",
    nclt: "../ground_truth/*",
    boreas: "applanix/lidar_poses.csv",
    cns: "gt.csv",
}


@pytest.mark.parametrize("form", ["matrices", "numbers", "times"])
@pytest.mark.parametrize("is_cut", [True, False])
@pytest.mark.parametrize("write", GROUND_TRUTH, ids=lambda one: one.__name__)
def test_given_poses_are_read_instead_of_ground_truth(
    tmp_path, write, is_cut, form
):
    """They are those of all scans, even of scans without ground truth."""
    folder = write(tmp_path)
    every = open_drive(folder).stamps_ns
    for table in folder.glob(GROUND_TRUTH[write]):
        lines = table.read_text().splitlines(keepends=True)
        table.unlink()
        if is_cut:
            table.write_text("".join(lines[len(lines) // 2 :]))
    path, X_WS = tmp_path / "given.txt", make_poses(len(every), seed=7)
    if form == "times":
        write_quaternions(path, every.astype("U") + "e-9", X_WS)
    else:
        numbers = range(len(every)) if form == "numbers" else None
        write_matrices(path, numbers, X_WS, " ")
    drive = open_drive(folder, poses=str(path))
    assert drive.stamps_ns.tolist() == every.tolist()
    np.testing.assert_allclose(drive.X_WS, X_WS, atol=1e-12)
    assert drive.world_frame == f"poses{path}"
    assert drive.datum is None
    assert path in drive.files


def test_a_gap_of_given_poses_needs_an_option(tmp_path):
    folder, path = kitti(tmp_path), tmp_path / "given.txt"
    write_quaternions(path, ["-0.1", "2.1"], make_poses(2))
    said = r"2\.2 s apart, more than 1 s \(--pose-gap SECONDS allows more\)"
    with pytest.raises(InputError, match=said):
        open_drive(folder, poses=path)
    assert len(open_drive(folder, poses=path, pose_gap=2.3)) == 3


def test_given_poses_of_some_scans(tmp_path):
    """Numbers count all scans, and scans outside of the poses are left out."""
    folder, path = mulran(tmp_path), tmp_path / "given.txt"
    every = open_drive(folder)
    write_matrices(path, [1, 2], make_poses(2, seed=7), " ")
    drive = open_drive(folder, poses=path)
    assert drive.stamps_ns.tolist() == every.stamps_ns[1:3].tolist()
    np.testing.assert_array_equal(drive.scan(0), every.scan(1))
    assert any("no pose for 3 of 5 scans" in note for note in drive.notes)
