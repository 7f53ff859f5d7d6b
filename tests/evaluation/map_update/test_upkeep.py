"""Maps that are updated drive by drive: walls that come and go."""

import numpy as np
import pytest

from evaluation.base import from_xyz
from evaluation.drives import Drive
from evaluation.map_update import (
    Label,
    PairLabels,
    UpkeptDrive,
    UpkeptMap,
    write_session,
)

STEP = 0.1


def wall(x, y=(-2.0, 2.0), z=(-1.0, 1.0)):
    """Points (N, 3) of a wall across x, in the middle of a map's cells."""
    ys = np.arange(y[0], y[1], STEP) + STEP / 2
    zs = np.arange(z[0], z[1], STEP) + STEP / 2
    grid = np.stack(np.meshgrid([x + STEP / 2], ys, zs), axis=-1)
    return grid.reshape(-1, 3)


class OneScan(Drive):
    """A drive of one scan, whose sensor is at the origin of the world."""

    world_frame = "map"
    datum = None

    def __init__(self, points):
        self.name = "one"
        self._points = points

    @property
    def stamps_ns(self):
        return np.zeros(1, np.int64)

    @property
    def X_WS(self):
        return np.eye(4)[None]

    def __len__(self):
        return 1

    def scan(self, index):
        return from_xyz(self._points)


@pytest.fixture
def keeper(tmp_path):
    """Updates a map by drives with given points; returns the updates."""

    def update(drives, labels):
        kept = UpkeptMap(tmp_path / "A")
        for number, points in enumerate(drives):
            session, _ = write_session(OneScan(points), tmp_path / f"B{number}")
            kept.add(session, np.ones(len(session.points), bool), labels)
        return kept.finish()

    return update


def exact(pair):
    """Labels by exact coincidence: all that the other map lacks has changed."""
    sets = [set(map(tuple, one.points.round(6))) for one in pair]
    found = []
    for own, other, changed in (
        (pair.A, sets[1], Label.GONE),
        (pair.B, sets[0], Label.NEW),
    ):
        there = [tuple(one) in other for one in own.points.round(6)]
        found.append(np.where(there, Label.KEPT, changed).astype(np.uint8))
    return PairLabels(*found)


def test_a_wall_that_is_gone_leaves_the_scans_of_older_drives(keeper):
    back, front = wall(9.0), wall(5.0)
    updates = keeper([np.concatenate([back, front]), back], exact)
    older = UpkeptDrive(OneScan(np.concatenate([back, front])), updates, 0)
    scan = older.scan(0)
    assert len(scan) == len(back)
    np.testing.assert_allclose(scan["x"], 9.0 + STEP / 2)
    assert [len(one) for one in updates.added] == [0, 0]


def test_a_new_wall_hides_what_is_behind_it(keeper):
    back, front = wall(9.0), wall(5.0)
    updates = keeper([back, np.concatenate([back, front])], exact)
    assert [len(one) for one in updates.added] == [0, len(front)]
    scan = UpkeptDrive(OneScan(back), updates, 0).scan(0)
    new = scan["x"] < 6.0
    # The wall in front spans larger angles than the scan saw.
    assert 0 < new.sum() <= len(front)
    assert np.abs(scan["z"][new]).max() <= 5.05 * 2.0 / 9.05 + STEP
    # Behind its middle, nothing is left of the wall in the back.
    far = scan[~new]
    middle = (np.abs(far["y"]) < 1.0) & (np.abs(far["z"]) < 0.5)
    assert not middle.any()
    # The newer drive has seen both itself.
    own = np.concatenate([back, front])
    newer = UpkeptDrive(OneScan(own), updates, 1).scan(0)
    np.testing.assert_array_equal(newer, from_xyz(own))


def test_what_comes_and_goes_again_is_nowhere(keeper):
    back, guest = wall(9.0), wall(5.0)
    updates = keeper([back, np.concatenate([back, guest]), back], exact)
    assert sum(map(len, updates.added)) == 0
    first = UpkeptDrive(OneScan(back), updates, 0).scan(0)
    np.testing.assert_array_equal(first, from_xyz(back))
    second = UpkeptDrive(OneScan(np.concatenate([back, guest])), updates, 1)
    np.testing.assert_array_equal(second.scan(0), from_xyz(back))


def test_without_a_change_every_scan_is_as_it_was(keeper):
    back = wall(9.0)
    updates = keeper([back] * 3, exact)
    assert len(updates.gone) == 0
    for number in range(3):
        scan = UpkeptDrive(OneScan(back), updates, number).scan(0)
        np.testing.assert_array_equal(scan, from_xyz(back))
