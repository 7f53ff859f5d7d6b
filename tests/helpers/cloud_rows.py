"""Messages of point clouds with rows of their own."""

from types import SimpleNamespace

import numpy as np

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
