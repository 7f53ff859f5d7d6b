"""The number of columns of `.bin` files, found from their values."""

from helpers.internal.eval_program import run
import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation.clouds import find_layout, read_cloud

RNG = np.random.default_rng(5)
NUM = 4000


def street():
    """Points of a street scene: ground and two walls, (NUM, 3)."""
    x = RNG.uniform(-60.0, 60.0, NUM)
    y = RNG.uniform(-12.0, 12.0, NUM)
    z = np.where(np.abs(y) > 9.0, RNG.uniform(-1.6, 9.0, NUM), -1.6)
    return np.column_stack([x, y, z])


def columns(kind):
    """Returns a cloud with the columns of a program."""
    points = street()
    even = RNG.uniform(0.0, 1.0, (NUM, 3))
    number = np.arange(NUM)
    normals = RNG.normal(size=(NUM, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return {
        "xyz": points,
        "kitti": np.c_[points, even[:, 0]],
        "bytes": np.c_[points, np.rint(255.0 * even[:, 0])],
        "nuscenes": np.c_[points, 255.0 * even[:, 0], number % 32],
        "zeros": np.c_[points, even[:, 0], np.zeros(NUM)],
        "timed": np.c_[points, even[:, 0], number % 64, number * 1e-5],
        "normals": np.c_[points, normals],
        "colours": np.c_[points, np.rint(255.0 * even)],
        "ring normals": np.c_[points, number % 64, normals],
        "ouster": np.c_[
            points, even[:, 0], number * 25e3, 9.0 * even[:, 1:], number % 128
        ],
    }[kind].astype("<f4")


@pytest.mark.parametrize("shuffled", [False, True])
@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("xyz", 3),
        ("kitti", 4),
        ("bytes", 4),
        ("nuscenes", 5),
        ("zeros", 5),
        ("timed", 6),
        ("normals", 6),
        ("colours", 6),
        ("ring normals", 7),
        ("ouster", 8),
    ],
)
def test_layouts_of_programs(tmp_path, kind, number, shuffled):
    cloud = columns(kind)
    if shuffled:
        RNG.shuffle(cloud)
    path = tmp_path / "a.bin"
    cloud.tofile(path)
    notes = []
    found = read_cloud(path, on_note=notes.append)
    assert len(found) == NUM
    np.testing.assert_array_equal(found["z"], cloud[:, 2])
    if number == 4:
        assert notes == []
    else:
        assert f"its values show {number} columns" in notes[0]
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(InputError, match=f"whole number of .* {number} float"):
        read_cloud(path)


@pytest.mark.parametrize("empty", [0.0, np.nan])
@pytest.mark.parametrize(
    ("kind", "number"),
    [("xyz", 3), ("bytes", 4), ("zeros", 5), ("timed", 6), ("ouster", 8)],
)
def test_beams_without_a_return(tmp_path, kind, number, empty):
    points = columns(kind)
    for share in (0.3, 0.5, 0.75):
        stored = np.full((round(NUM / (1.0 - share)), number), empty, "<f4")
        beams = RNG.choice(len(stored), NUM, replace=False)
        stored[np.sort(beams)] = points
        path = tmp_path / f"{share}.bin"
        stored.tofile(path)
        layout = find_layout([path])
        assert layout.columns == number
        assert "do not show" not in layout.note


def test_beams_that_alternate_are_no_columns(tmp_path):
    # A low beam, then a high one, as a VLP-16 fires.
    low, high = street(), street()
    low[:, 2] = -1.6
    high[:, 2] = RNG.uniform(3.0, 9.0, NUM)
    cloud = np.stack([low, high], axis=1).reshape(-1, 3)
    path = tmp_path / "a.bin"
    for more, number in (
        (np.zeros((2 * NUM, 0)), 3),
        (np.ones((2 * NUM, 1)), 4),
    ):
        np.c_[cloud, more].astype("<f4").tofile(path)
        assert find_layout([path]).columns == number


def test_a_number_that_is_given(tmp_path):
    path = tmp_path / "a.bin"
    columns("kitti").tofile(path)
    assert len(read_cloud(path, 8)) == NUM // 2
    with pytest.raises(InputError, match="points of 7 float32"):
        read_cloud(path, 7)


def test_values_that_show_nothing(tmp_path):
    path = tmp_path / "a.bin"
    notes = []
    # Directions at random have no column of their own.
    RNG.normal(size=(NUM, 3)).astype("<f4").tofile(path)
    with pytest.raises(InputError, match=r"a\.bin: .*--columns N"):
        read_cloud(path)
    assert len(read_cloud(path, 3)) == NUM
    np.ones((6, 4), "<f4").tofile(path)
    assert len(read_cloud(path, on_note=notes.append)) == 6
    assert "do not show" in notes.pop()
    # Only four columns fit.
    np.ones((1, 4), "<f4").tofile(path)
    assert len(read_cloud(path, on_note=notes.append)) == 1
    assert notes == []
    np.ones((1, 5), "<f4").tofile(path)
    with pytest.raises(InputError, match="whole number"):
        read_cloud(path)


def test_folders_of_scans(capsys, tmp_path):
    folders = [tmp_path / name for name in ("places", "queries")]
    for folder in folders:
        folder.mkdir()
        for k in range(2):
            columns("nuscenes").tofile(folder / f"{k}.bin")
    arguments = ["scores", *folders, "--method", "solid"]
    arguments += ["--output", tmp_path / "a.csv"]
    status, _, err = run(capsys, *arguments)
    assert status == 0
    assert err.count("its values show 5 columns") == 2
    assert run(capsys, *arguments, "--columns", "5")[0] == 0
    status, _, err = run(capsys, *arguments, "--columns", "7")
    assert status == 2
    assert "points of 7 float32" in err


@pytest.mark.parametrize("columns", [3, 4, 5, 7])
@pytest.mark.parametrize("filled", [1, 2])
def test_columns_of_zeros_show_their_number(tmp_path, columns, filled):
    """Such as scans of a line: its other coordinates are zero."""
    points = np.zeros((600, columns), "<f4")
    points[:, :filled] = 20.0 + np.arange(600)[:, None] / 600
    path = tmp_path / "000000.bin"
    points.tofile(path)
    assert find_layout([path]).columns == columns
