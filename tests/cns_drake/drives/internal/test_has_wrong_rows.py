"""The rows of a point cloud: what its data say counts, not its header."""

from types import SimpleNamespace

import numpy as np
import pytest

from cns_drake.drives import to_points
from cns_drake.drives.point_cloud2 import has_wrong_rows

DTYPE = np.dtype([(axis, "<f4") for axis in "xyz"])
POINTS = np.arange(36, dtype="<f4").view(DTYPE)


def message(height, width, row_step, data):
    return SimpleNamespace(
        height=height,
        width=width,
        point_step=12,
        row_step=row_step,
        is_bigendian=False,
        data=data,
        fields=[
            SimpleNamespace(name=axis, offset=4 * k, datatype=7, count=1)
            for k, axis in enumerate("xyz")
        ],
    )


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
