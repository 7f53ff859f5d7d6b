"""The rows of a point cloud: what its data say counts, not its header."""

from helpers.cloud_rows import POINTS, message
import numpy as np
import pytest

from cns_drake.drives import to_points
from cns_drake.drives.point_cloud2 import has_wrong_rows


@pytest.mark.parametrize(
    ("height", "width", "row_step", "is_right"),
    [
        (1, 12, 144, True),
        (1, 12, 0, False),
        (1, 12, 999, False),
        (3, 4, 48, True),
        (3, 4, 144, False),
        (3, 4, 0, False),
    ],
)
def test_clouds_without_gaps_have_one_meaning(
    height, width, row_step, is_right
):
    cloud = message(height, width, row_step, POINTS.tobytes())
    np.testing.assert_array_equal(to_points(cloud), POINTS)
    assert has_wrong_rows(cloud) != is_right
