"""Which places of several drives are kept: closed forms on known grids."""

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.recognition import checked_keep, kept_places

CELL = 5.0


def street(number, y=1.0, first=0):
    """Positions (number, 3) of places in the middle of consecutive cells."""
    x = CELL * (np.arange(first, first + number) + 0.5)
    return np.stack([x, np.full(number, y), np.zeros(number)], axis=1)


def database(*drives):
    """Positions of the places of drives, and the number of each one's drive."""
    lengths = [len(one) for one in drives]
    return np.concatenate(drives), np.repeat(np.arange(len(drives)), lengths)


@pytest.mark.parametrize("keep", [1, 2, 3, 4, 9])
def test_the_latest_places_of_each_cell_are_kept(keep):
    """Four drives pass the same 10 cells, one place in each."""
    p_WPs, drives = database(*[street(10)] * 4)
    kept = kept_places(p_WPs, drives, keep, CELL)
    np.testing.assert_array_equal(kept, drives >= 4 - keep)


def test_a_drive_beyond_the_others_keeps_its_places():
    """The last drive covers only cells 4 to 7 of the first one's 10."""
    p_WPs, drives = database(street(10), street(4, first=4))
    kept = kept_places(p_WPs, drives, "latest", CELL)
    assert kept.tolist() == [True] * 4 + [False] * 4 + [True] * 6
    np.testing.assert_array_equal(kept, kept_places(p_WPs, drives, 1, CELL))


def test_latest_keeps_all_places_of_the_latest_drive_in_a_cell():
    p_WPs, drives = database(np.ones((3, 3)), 1.0 + np.ones((2, 3)))
    assert kept_places(p_WPs, drives, "latest", CELL).tolist() == [
        *[False] * 3,
        *[True] * 2,
    ]
    one = kept_places(p_WPs, drives, 1, CELL)
    assert one.tolist() == [False] * 4 + [True]


@pytest.mark.parametrize(("y", "is_kept"), [(4.999, False), (5.001, True)])
def test_cells_end_at_multiples_of_their_side(y, is_kept):
    p_WPs, drives = database(street(3, y=y), street(3, y=0.0))
    kept = kept_places(p_WPs, drives, "latest", CELL)
    assert kept.tolist() == [is_kept] * 3 + [True] * 3


def test_cells_cover_negative_coordinates():
    p_WPs, drives = database(street(6, first=-3), street(6, first=-3))
    kept = kept_places(p_WPs, drives, 1, CELL)
    assert kept.tolist() == [False] * 6 + [True] * 6


@pytest.mark.parametrize("keep", ["all", "latest", 1])
def test_no_place_and_all_places(keep):
    assert kept_places(np.zeros((0, 3)), np.zeros(0, int), keep, CELL).size == 0
    p_WPs, drives = database(street(7))
    assert kept_places(p_WPs, drives, keep, CELL).all()


@pytest.mark.parametrize(
    "value", [0, -1, True, False, 1.0, "2", "newest", None, [1], {}]
)
def test_what_is_no_number_of_places(value):
    with pytest.raises(InputError, match=r"^mine: .* is neither all, latest"):
        checked_keep(value, "mine")


@pytest.mark.parametrize("value", ["all", "latest", 1, 12])
def test_values_of_keep(value):
    assert checked_keep(value, "mine") == value
