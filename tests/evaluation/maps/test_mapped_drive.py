from helpers.drive_files import make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation.drives import open_drive
from evaluation.maps import CELL_SIZE, MappedDrive, map_drive


@pytest.fixture
def drive(tmp_path):
    rng = np.random.default_rng(4)
    scans = [make_scan(rng.uniform(-30, 30, (200, 3))) for _ in range(12)]
    X_WBs = [yaw_pose(3.0 * i, -i, 0.1, 0.2 * i) for i in range(12)]
    write_recording(tmp_path / "drive_01", scans, X_WBs)
    return open_drive(tmp_path / "drive_01")


@pytest.mark.parametrize("asked", [[], [0], [5, 6, 7, 6, 2], [11, 0]])
def test_same_map_and_scans_for_every_reader(drive, asked):
    mapped = MappedDrive(drive, kept=3)
    for index in asked:
        np.testing.assert_array_equal(mapped.scan(index), drive.scan(index))
    expected = map_drive(drive, CELL_SIZE)
    result, fine = mapped.finish()
    np.testing.assert_array_equal(result.indices, expected.indices)
    np.testing.assert_array_equal(result.centroids_W, expected.centroids_W)
    np.testing.assert_array_equal(result.counts, expected.counts)
    np.testing.assert_array_equal(fine, MappedDrive(drive, 1).finish()[1])
    # One point remains in each occupied cube of half a metre.
    cubes = map_drive(drive, 0.5).indices
    found = np.floor((fine - [0.0, 0.0, -2.5]) / 0.5)
    assert set(map(tuple, found)) == set(map(tuple, cubes))
    assert len(fine) == len(cubes)
    assert mapped.name == "drive_01"
    assert len(mapped) == 12


def test_scans_in_order_are_read_once(drive, monkeypatch):
    read = []
    scan = drive.scan
    monkeypatch.setattr(drive, "scan", lambda i: read.append(i) or scan(i))
    mapped = MappedDrive(drive, kept=3)
    for first in (0, 2, 7):
        for index in range(first, first + 3):
            mapped.scan(index)
    mapped.finish()
    assert read == list(range(12))
