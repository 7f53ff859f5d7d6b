"""The rows of a point cloud: what its data say counts, not its header."""

from helpers.cloud_rows import POINTS, message
import numpy as np
import pytest

from cns_drake.drives import to_points


def test_rows_with_padding_need_their_step():
    rows = POINTS.view("u1").reshape(3, 48)
    padded = np.pad(rows, [(0, 0), (0, 8)]).tobytes()
    np.testing.assert_array_equal(to_points(message(3, 4, 56, padded)), POINTS)
    with pytest.raises(ValueError, match="168 bytes instead of 3 x 60"):
        to_points(message(3, 4, 60, padded))
