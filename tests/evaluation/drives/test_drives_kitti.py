from helpers.dataset_folders import (
    make_points,
    make_poses,
    stored,
    write_bytes,
    write_matrices,
    xyzi,
)
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import check_same_world, open_drive

NUM_SCANS = 6
# Forward, left, up of the LiDAR are -z... of the camera: roughly KITTI's.
X_CS = np.array(
    [
        [4.276802e-04, -9.999672e-01, -8.084491e-03, -1.198459e-02],
        [-7.210626e-03, 8.081198e-03, -9.999413e-01, -5.403984e-02],
        [9.999738e-01, 4.859485e-04, -7.206933e-03, -2.921968e-01],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def write_drive(root, *, name="07", beside=False):
    """Writes a drive; returns its folder and the poses of the LiDAR."""
    folder = root / "sequences" / name
    # The LiDAR's own poses, in its frame at the first scan.
    X_0S = make_poses(NUM_SCANS, step=0.5)
    X_0S = np.linalg.inv(X_0S[0]) @ X_0S
    for i in range(NUM_SCANS):
        write_bytes(
            folder / "velodyne" / f"{i:06d}.bin", xyzi(make_points(80, seed=i))
        )
    times = [f"{0.1036224 * i:e}" for i in range(NUM_SCANS)]
    (folder / "times.txt").write_text("\n".join(times) + "\n")
    row = " ".join(f"{value:.12e}" for value in X_CS[:3].ravel())
    projection = " ".join(["7.188560e+02"] * 12)
    (folder / "calib.txt").write_text(
        "".join(f"P{i}: {projection}\n" for i in range(4)) + f"Tr: {row}\n"
    )
    X_C0C = X_CS @ X_0S @ np.linalg.inv(X_CS)
    poses = folder / "poses.txt" if beside else root / "poses" / f"{name}.txt"
    write_matrices(poses, None, X_C0C, " ")
    return folder, X_0S


@pytest.mark.parametrize("beside", [False, True])
def test_reads_what_was_written(tmp_path, beside):
    folder, X_0S = write_drive(tmp_path, beside=beside)
    drive = open_drive(folder)
    assert drive.name == "07"
    assert drive.world_frame == f"kitti{folder.resolve()}"
    assert len(drive) == NUM_SCANS
    # Tr has six digits only: it is no exact rotation.
    np.testing.assert_allclose(drive.X_WS, X_0S, atol=1e-5)
    assert drive.stamps_ns.tolist() == [
        103_622_400 * i for i in range(NUM_SCANS)
    ]
    for i in (5, 2):
        scan = drive.scan(i)
        np.testing.assert_array_equal(
            stored(scan, "x", "y", "z"), make_points(80, seed=i)
        )
        np.testing.assert_array_equal(scan["intensity"], np.arange(80))


def test_the_world_is_upright(tmp_path):
    """A drive straight ahead on flat ground is along x of the LiDAR, not z."""
    folder, _ = write_drive(tmp_path)
    ahead = np.tile(np.eye(4), (NUM_SCANS, 1, 1))
    ahead[:, 2, 3] = 3.0 * np.arange(NUM_SCANS)  # z of the camera
    write_matrices(tmp_path / "poses" / "07.txt", None, ahead, " ")
    p_WS = open_drive(folder).X_WS[:, :3, 3]
    np.testing.assert_allclose(
        p_WS[:, 0], 3.0 * np.arange(NUM_SCANS), rtol=1e-3
    )
    assert np.abs(p_WS[:, 1:]).max() < 0.15


def test_poses_of_the_benchmark_come_first(tmp_path):
    folder, X_0S = write_drive(tmp_path)
    write_matrices(folder / "poses.txt", None, make_poses(NUM_SCANS), " ")
    np.testing.assert_allclose(open_drive(folder).X_WS, X_0S, atol=1e-5)


def test_an_identity_for_calibration(tmp_path):
    folder, X_0S = write_drive(tmp_path)
    (folder / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
    write_matrices(tmp_path / "poses" / "07.txt", None, X_0S, " ")
    np.testing.assert_allclose(open_drive(folder).X_WS, X_0S, atol=1e-15)


def test_without_calibration_poses_are_those_of_the_lidar(tmp_path):
    folder, X_0S = write_drive(tmp_path)
    (folder / "calib.txt").unlink()
    write_matrices(tmp_path / "poses" / "07.txt", None, X_0S, " ")
    drive = open_drive(folder)
    np.testing.assert_allclose(drive.X_WS, X_0S, atol=1e-15)
    assert [note.split(":")[0] for note in drive.notes] == [
        str(folder / "calib.txt")
    ]


def test_rows_of_the_numbers_of_scans(tmp_path):
    """Two scans are missing; both tables have a row for every number."""
    folder, X_0S = write_drive(tmp_path)
    for number in (1, 4):
        (folder / f"velodyne/{number:06d}.bin").unlink()
    drive = open_drive(folder)
    kept = [0, 2, 3, 5]
    np.testing.assert_allclose(drive.X_WS, X_0S[kept], atol=1e-5)
    assert drive.stamps_ns.tolist() == [103_622_400 * i for i in kept]
    np.testing.assert_array_equal(
        stored(drive.scan(1), "x", "y", "z"), make_points(80, seed=2)
    )
    assert [note.split(":")[0] for note in drive.notes] == [
        str(folder / "times.txt"),
        str(tmp_path / "poses/07.txt"),
    ]


def test_rows_of_the_scans_alone(tmp_path):
    folder, X_0S = write_drive(tmp_path)
    (folder / "velodyne/000002.bin").unlink()
    (folder / "times.txt").write_text("0.0\n0.1\n0.3\n0.4\n0.5\n")
    (folder / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
    write_matrices(tmp_path / "poses" / "07.txt", None, X_0S[:5], " ")
    drive = open_drive(folder)
    np.testing.assert_allclose(drive.X_WS, X_0S[:5], atol=1e-15)
    assert drive.stamps_ns[2] == 300_000_000
    assert drive.notes == ()


def test_scans_that_were_renumbered(tmp_path):
    """`frames.txt` names the rows of tables that are still complete."""
    folder, X_0S = write_drive(tmp_path)
    (folder / "velodyne/000000.bin").unlink()
    (folder / "velodyne/000003.bin").unlink()
    for new, old in enumerate([1, 2, 4, 5]):
        path = folder / f"velodyne/{old:06d}.bin"
        path.rename(folder / f"velodyne/{new:06d}.bin")
    (folder / "frames.txt").write_text("000001\n000002\n4\n5\n")
    drive = open_drive(folder)
    assert drive.stamps_ns.tolist() == [103_622_400 * i for i in (1, 2, 4, 5)]
    np.testing.assert_allclose(drive.X_WS, X_0S[[1, 2, 4, 5]], atol=1e-5)
    np.testing.assert_array_equal(
        stored(drive.scan(2), "x", "y", "z"), make_points(80, seed=4)
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1\n2\n4\n", "frames.txt: 3 rows for 4 scans"),
        ("1\n2\n2\n5\n", "frames.txt: row 3: 2 does not follow 2"),
        ("1\n2\n-3\n5\n", "frames.txt: row 3: '-3' is no number"),
        ("1\n2\n4\n6\n", "times.txt: 6 rows, none for scan 6"),
    ],
)
def test_numbers_that_do_not_fit(tmp_path, text, fault):
    folder, _ = write_drive(tmp_path)
    for number in (4, 5):
        (folder / f"velodyne/{number:06d}.bin").unlink()
    (folder / "frames.txt").write_text(text)
    with pytest.raises(InputError, match=fault):
        open_drive(folder)


def test_numbers_that_contradict_the_files(tmp_path):
    folder, _ = write_drive(tmp_path)
    (folder / "velodyne/000001.bin").unlink()
    (folder / "frames.txt").write_text("0\n1\n3\n4\n5\n")
    with pytest.raises(InputError, match=r"frames\.txt: other numbers than"):
        open_drive(folder)
    (folder / "velodyne/000002.bin").rename(folder / "velodyne/two.bin")
    with pytest.raises(InputError, match=r"two\.bin: the name is no number"):
        open_drive(folder)


def test_drives_in_frames_of_their_own(tmp_path):
    one, other = (
        open_drive(write_drive(tmp_path / day, name="00")[0])
        for day in ("day1", "day2")
    )
    with pytest.raises(InputError, match=r"'kitti/.*/day2/.*first_pose\.txt"):
        check_same_world(one, other)
    # However its path is written, a drive is in one world with itself.
    same = open_drive(tmp_path / "day2/../day1/sequences/00")
    check_same_world(one, same)


def test_a_drive_without_poses(tmp_path):
    folder, _ = write_drive(tmp_path, name="11")
    (tmp_path / "poses" / "11.txt").unlink()
    with pytest.raises(InputError, match=f"^{folder}: KITTI: no poses, .*11"):
        open_drive(folder)


def shorten(name):
    def change(root, folder):
        path = root / "poses" / "07.txt" if name == "poses" else folder / name
        path.write_text("".join(path.read_text().splitlines(True)[:-1]))
        return path

    return change


def repeat_time(root, folder):
    path = folder / "times.txt"
    lines = path.read_text().splitlines()
    lines[3] = lines[2]
    path.write_text("\n".join(lines))
    return path


def replace(name, old, new):
    def change(root, folder):
        path = root / "poses" / "07.txt" if name == "poses" else folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        return path

    return change


def repeat_pose(root, folder):
    path = root / "poses" / "07.txt"
    path.write_text(path.read_text() + path.read_text().splitlines()[-1])
    return path


def eleven_columns(root, folder):
    path = root / "poses" / "07.txt"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line.rsplit(" ", 1)[0] for line in lines))
    return path


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (shorten("poses"), "5 rows for 6 scans"),
        (shorten("times.txt"), "5 rows for 6 scans"),
        (repeat_time, "time: row 4 at .* is not later"),
        (replace("times.txt", "0.000000e+00", "start"), "rows for 6"),
        (replace("times.txt", "1.036224e-01", "1.03e-0-1"), "no time"),
        (replace("poses", "1.0", "5.0"), "row 1: no rotation"),
        (replace("poses", "1.0", "nan"), "row 1: a number is not finite"),
        (repeat_pose, "7 rows, but 6 in .*times.txt"),
        (eleven_columns, "rows of 11 numbers instead of 12"),
        (replace("calib.txt", "Tr:", "Tr_velo_to_cam:"), "Tr: missing"),
        (replace("calib.txt", "Tr: ", "Tr: 0 "), "Tr: 13 numbers"),
        (replace("calib.txt", "P3:", "Tr:"), "Tr: is there twice"),
        (replace("calib.txt", "P1:", "P0:"), "P0: is there twice"),
        (replace("calib.txt", "Tr: ", "Tr: x"), "Tr: could not convert 'x4"),
    ],
)
def test_the_file_that_a_fault_names_is_the_one_to_mend(
    tmp_path, change, fault
):
    folder, _ = write_drive(tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.txt")}
    path = change(tmp_path, folder)
    with pytest.raises(InputError, match=f"^{path}: .*{fault}") as info:
        open_drive(folder)
    assert "\n" not in str(info.value)
    path.write_bytes(before[path])
    assert len(open_drive(folder).X_WS)


def test_missing_files(tmp_path):
    folder, _ = write_drive(tmp_path / "times")
    (folder / "times.txt").unlink()
    with pytest.raises(InputError, match=r"times\.txt: No such file"):
        open_drive(folder)
    folder, _ = write_drive(tmp_path)
    for path in (folder / "velodyne").iterdir():
        path.unlink()
    with pytest.raises(InputError, match=r"velodyne: no scan \(\*\.bin\)"):
        open_drive(folder)


def test_a_scan_that_cannot_be_used(tmp_path):
    folder, _ = write_drive(tmp_path)
    path = folder / "velodyne" / "000001.bin"
    whole = path.read_bytes()
    write_bytes(path, whole[:-4])
    with pytest.raises(InputError, match=f"^{path}: .*cut off"):
        open_drive(folder).scan(1)
    points = make_points(4)
    points[3, 0] = 2e4
    write_bytes(path, xyzi(points))
    with pytest.raises(InputError, match=f"^{path}: x: point 3 is"):
        open_drive(folder).scan(1)
    drive = open_drive(folder)
    path.unlink()
    with pytest.raises(InputError, match=f"^{path}: No such file"):
        drive.scan(1)


def test_poses_of_a_file_replace_those_that_are_missing(tmp_path):
    folder = tmp_path / "sequences" / "11"
    for k in range(4):
        points = make_points(5, seed=k)
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", xyzi(points))
    (folder / "times.txt").write_text("0\n0.1\n0.2\n0.3\n")
    with pytest.raises(InputError, match=r"KITTI: no poses, .* --poses FILE"):
        open_drive(folder)
    tum = tmp_path / "poses.tum"
    tum.write_text("0.05 1 0 0 0 0 0 1\n0.25 3 0 0 0 0 0 1\n")
    drive = open_drive(folder, poses=tum)
    assert drive.stamps_ns.tolist() == [100_000_000, 200_000_000]
    np.testing.assert_allclose(drive.X_WS[:, 0, 3], [1.5, 2.5])
    assert tum in drive.files


def test_rows_with_numbers_of_scans_are_poses_of_these_scans(tmp_path):
    folder = tmp_path / "sequences" / "11"
    for k in (1, 2, 4, 5):
        points = make_points(5, seed=k)
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", xyzi(points))
    (folder / "times.txt").write_text("0\n0.1\n0.2\n0.3\n0.4\n0.5\n")
    path = tmp_path / "poses.txt"
    rows = [f"{k} 1 0 0 {10 * k} 0 1 0 0 0 0 1 0" for k in range(6)]
    path.write_text("\n".join(row for row in rows if row[0] != "2"))
    drive = open_drive(folder, poses=path)
    # Scan 2 is between scans 1 and 4 in time.
    np.testing.assert_allclose(drive.X_WS[:, 0, 3], [10, 20, 40, 50])
    path.write_text(rows[3])
    with pytest.raises(InputError, match=r"poses\.txt: no row has the number"):
        open_drive(folder, poses=path)
