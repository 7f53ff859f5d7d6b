"""The rows of a point cloud: what its data say counts, not its header."""

from types import SimpleNamespace

import numpy as np
import pytest

from cns_drake.drives import to_points

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


def test_rows_with_padding_need_their_step():
    rows = POINTS.view("u1").reshape(3, 48)
    padded = np.pad(rows, [(0, 0), (0, 8)]).tobytes()
    np.testing.assert_array_equal(to_points(message(3, 4, 56, padded)), POINTS)
    with pytest.raises(ValueError, match="168 bytes instead of 3 x 60"):
        to_points(message(3, 4, 60, padded))
