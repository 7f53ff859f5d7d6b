"""Poses are compared by what they mean."""

import numpy as np
import pytest

from evaluation.base import poses


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        ((0, 0, 0, 1), (0, 0, 0, 1), True),
        ((0, 0, 0, 1), (0, 0, 0, -1), True),
        ((0.6, 0, 0, 0.8), (-0.6, 0, 0, -0.8), True),
        ((0.6, 0, 0, 0.8), (1.2, 0, 0, 1.6), True),
        ((0.6, 0, 0, 0.8), (0.6, 0, 1e-15, 0.8), True),
        ((0.6, 0, 0, 0.8), (-0.6, 0, 0, 0.8), False),
        ((0, 0, 0, 1), (0, 0, 1e-3, 1), False),
        ((np.nan,) * 4, (np.nan,) * 4, True),
        ((np.nan,) * 4, (0, 0, 0, 1), False),
        ((0, 0, 0, 0), (0, 0, 0, 1), False),
    ],
)
def test_quaternions_are_one_rotation(one, other, is_same):
    assert poses.same_turns(one, other) == is_same
    assert poses.same_turns(other, one) == is_same


def test_positions_are_equal_up_to_rounding():
    assert poses.same_numbers((355000.0, 4e6, 1.0), (355000.0, 4e6, 1 + 1e-15))
    assert not poses.same_numbers((0.0, 0.0, 0.0), (0.0, 0.0, 1e-3))
