"""Polylines: lengths, and evenly spaced points."""

import numpy as np
import pytest

from cns_drake.base import distances_along, length_of
from cns_drake.traffic import resampled

# A 3-4-5 triangle's two short sides, and a vertical one of 2 m.
CORNERS = np.array([[0, 0, 1], [3, 0, 1], [3, 4, 1], [3, 4, 3]], float)


def test_lengths():
    assert length_of(CORNERS) == pytest.approx(9.0)
    assert length_of(CORNERS[:, :2]) == pytest.approx(7.0)
    np.testing.assert_allclose(distances_along(CORNERS), [0, 3, 7, 9])


@pytest.mark.parametrize(
    ("spacing", "count"), [(9.0, 2), (8.9, 3), (1.0, 10), (0.99, 11), (20, 2)]
)
def test_points_are_evenly_spaced_along_the_line(spacing, count):
    found = resampled(CORNERS, spacing)
    assert len(found) == count
    np.testing.assert_array_equal(found[[0, -1]], CORNERS[[0, -1]])
    if count == 10:
        np.testing.assert_allclose(
            found[[2, 4, 8]], [[2, 0, 1], [3, 1, 1], [3, 4, 2]]
        )
    # A repeated corner changes nothing.
    doubled = np.repeat(CORNERS, 2, axis=0)
    np.testing.assert_array_equal(resampled(doubled, spacing), found)
