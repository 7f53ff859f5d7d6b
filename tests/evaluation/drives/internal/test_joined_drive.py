"""Several drives as one: two halves of a drive are the whole."""

from functools import partial

import numpy as np
import pytest

from evaluation.base import InputError, from_xyz
from evaluation.drives import Drive, JoinedDrive
from evaluation.localisation import Settings, make_map
from evaluation.localisation.localisation_map import map_frames
from evaluation.recognition import DescribedScans, joined_scans


class Straight(Drive):
    """A drive along x; each scan has a few points of its own."""

    def __init__(self, first, number, y=0.0, world_frame="map"):
        self.name = f"from_{first}"
        self.world_frame = world_frame
        self._first = first
        self._number = number
        self._y = y

    def __len__(self):
        return self._number

    @property
    def stamps_ns(self):
        return np.arange(self._number) * 100_000_000

    @property
    def X_WS(self):
        X_WS = np.tile(np.eye(4), (self._number, 1, 1))
        X_WS[:, 0, 3] = self._first + np.arange(self._number)
        X_WS[:, 1, 3] = self._y
        return X_WS

    def scan(self, index):
        rng = np.random.default_rng(self._first + index)
        return from_xyz(rng.uniform(-5.0, 5.0, (30, 3)))


def joined(*drives):
    return JoinedDrive([partial(Straight, *one) for one in drives])


def test_two_halves_are_the_whole():
    whole, halves = Straight(0, 20), joined((0, 8), (8, 12))
    assert len(halves) == len(whole)
    np.testing.assert_array_equal(halves.X_WS, whole.X_WS)
    for frame in (0, 7, 8, 19, 3):  # Also back to the first drive.
        np.testing.assert_array_equal(halves.scan(frame), whole.scan(frame))
    assert (np.diff(halves.stamps_ns) > 0).all()
    frames = [map_frames(one) for one in (whole, halves)]
    np.testing.assert_array_equal(*frames)
    settings = Settings()
    maps = [make_map(one, settings) for one in (whole, halves)]
    np.testing.assert_array_equal(*(one.surface.points for one in maps))


def test_each_drive_is_sampled_from_its_start():
    """By 3 m: the first drive ends 1 m after a sample, and jumps back."""
    halves = joined((0, 8), (0, 5))
    assert halves.sampled(3.0).tolist() == [0, 3, 6, 8, 11]
    assert halves.drive_of(np.array([0, 7, 8, 12])).tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize("keep", ["latest", 1])
def test_the_map_is_made_of_the_scans_that_are_kept(keep):
    both = joined((0, 8), (0, 5))
    frames = map_frames(both, keep)
    # The second drive covers the first 5 m anew.
    assert frames.tolist() == [5, 6, 7, 8, 9, 10, 11, 12]
    assert map_frames(both).tolist() == [*range(13)]


def test_drives_of_other_worlds_are_refused():
    with pytest.raises(InputError, match="poses in frame 'other"):
        joined((0, 3), (3, 3, 0.0, "other"))


def test_places_of_two_halves_are_those_of_the_whole():
    rng = np.random.default_rng(1)
    number = 11
    whole = DescribedScans(
        np.arange(number),
        np.arange(number),
        rng.random((number, 4, 4)),
        list(range(number)),
        [rng.random((3, 3)) for _ in range(number)],
    )
    halves = [whole.chosen(np.arange(4)), whole.chosen(np.arange(4, number))]
    found = joined_scans(halves, [0, 0])
    for name in ("frames", "stamps_ns", "X_WS"):
        np.testing.assert_array_equal(
            *(getattr(o, name) for o in (found, whole))
        )
    assert found.descriptors == whole.descriptors
    np.testing.assert_array_equal(found.clouds, whole.clouds)
    assert found.drive_of.tolist() == [0] * 4 + [1] * 7
    # A third drive is another one.
    again = joined_scans([found], [0])
    np.testing.assert_array_equal(again.drive_of, found.drive_of)
    more = joined_scans([found, whole], [0, 0])
    assert more.drive_of.tolist() == [0] * 4 + [1] * 7 + [2] * number
