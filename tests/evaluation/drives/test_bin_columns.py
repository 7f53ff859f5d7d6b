"""The number of columns of `.bin` files, which have no header."""

from helpers.internal.eval_program import assert_refused, run
import numpy as np
import pytest

from cns_drake.export import export_drive
from evaluation import open_drive
from evaluation.base import InputError
from evaluation.clouds import read_cloud

NUMBERS = np.random.default_rng(5).uniform(1.0, 9.0, (60, 30)).astype("<f4")


@pytest.mark.parametrize(
    ("name", "given", "number"),
    [
        ("a.bin", None, 4),
        ("a.pcd.bin", None, 5),
        ("a.bin", 3, 3),
        ("a.bin", 6, 6),
        ("a.pcd.bin", 4, 4),
    ],
)
def test_columns_by_the_name_or_as_given(tmp_path, name, given, number):
    NUMBERS.tofile(tmp_path / name)
    notes = []
    found = read_cloud(tmp_path / name, given, notes.append)
    names = ("x", "y", "z", "intensity", "column_5", "column_6")
    assert found.dtype.names == names[:number]
    table = np.stack([found[one] for one in found.dtype.names], axis=1)
    np.testing.assert_array_equal(table, NUMBERS.reshape(-1, number))
    assert notes == []


@pytest.mark.parametrize(
    ("name", "given", "number"),
    [("a.bin", None, 4), ("a.pcd.bin", None, 5), ("a.bin", 7, 7)],
)
def test_a_size_that_does_not_fit(tmp_path, name, given, number):
    NUMBERS[0, :29].tofile(tmp_path / name)
    fault = f"{name}: 116 bytes .* of {number} float32 .*--columns N"
    with pytest.raises(InputError, match=fault) as error:
        read_cloud(tmp_path / name, given)
    assert "\n" not in str(error.value)


def test_a_point_has_three_coordinates(tmp_path):
    NUMBERS.tofile(tmp_path / "a.bin")
    for columns in (0, 2, -4):
        with pytest.raises(InputError, match=f"columns: {columns} is less"):
            read_cloud(tmp_path / "a.bin", columns)


def write_kitti(folder, scenario):
    (folder / "velodyne").mkdir(parents=True)
    NUMBERS[:, :6].tofile(folder / "velodyne" / "000000.bin")
    (folder / "times.txt").write_text("0\n")
    (folder / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (folder / "scenario.yaml").write_text(scenario)


def test_a_drive_says_its_columns(tmp_path):
    write_kitti(tmp_path / "01", "name: one\ncolumns: 6\n")
    drive = open_drive(tmp_path / "01")
    assert drive.scan(0).dtype.names[4:] == ("column_5", "column_6")
    assert len(open_drive(tmp_path / "01", columns=3).scan(0)) == 120
    # An export has the four columns of KITTI.
    again = open_drive(export_drive(drive, "kitti", tmp_path / "export"))
    for axis in "xyz":
        np.testing.assert_array_equal(again.scan(0)[axis], drive.scan(0)[axis])
    for k, value in enumerate(("2", "4.0", "true", "x")):
        folder = tmp_path / f"bad_{k}"
        write_kitti(folder, f"columns: {value}\n")
        with pytest.raises(InputError, match=r"scenario\.yaml: columns: "):
            open_drive(folder)


def test_folders_of_scans(capsys, tmp_path):
    folders = [tmp_path / name for name in ("places", "queries")]
    for folder in folders:
        folder.mkdir()
        for k in range(2):
            NUMBERS.tofile(folder / f"{k}.pcd.bin")
    words = ["scores", *folders, "--method", "solid"]
    words += ["--output", tmp_path / "a.csv"]
    assert run(capsys, *words)[0] == 0
    assert run(capsys, *words, "--columns", "6")[0] == 0
    assert_refused(capsys, [*words, "--columns", "7"], "points of 7 float32")
