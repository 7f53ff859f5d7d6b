"""The rows of a point cloud: what its data say counts, not its header."""

from types import SimpleNamespace

import numpy as np
import pytest

from cns_drake.base import InputError
from cns_drake.drives import to_points
from cns_drake.drives.mcap_messages import StaticTransforms
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


def test_rows_with_padding_need_their_step():
    rows = POINTS.view("u1").reshape(3, 48)
    padded = np.pad(rows, [(0, 0), (0, 8)]).tobytes()
    np.testing.assert_array_equal(to_points(message(3, 4, 56, padded)), POINTS)
    with pytest.raises(ValueError, match="168 bytes instead of 3 x 60"):
        to_points(message(3, 4, 60, padded))


def transforms(*edges):
    header = SimpleNamespace(
        frame_id="base", stamp=SimpleNamespace(sec=0, nanosec=0)
    )
    return SimpleNamespace(
        transforms=[
            SimpleNamespace(
                header=header,
                child_frame_id=child,
                transform=SimpleNamespace(
                    translation=SimpleNamespace(
                        **dict(zip("xyz", p, strict=True))
                    ),
                    rotation=SimpleNamespace(
                        **dict(zip("xyzw", q, strict=True))
                    ),
                ),
            )
            for child, p, q in edges
        ]
    )


@pytest.mark.parametrize(
    ("p", "q", "is_same"),
    [
        ((1, 2, 3), (0, 0, 0, -1), True),
        ((1, 2, 3 + 1e-15), (0, 0, 0, 1), True),
        ((1, 2, 3), (0, 0, 0, 2), True),
        ((1, 2, 3.001), (0, 0, 0, 1), False),
        ((1, 2, 3), (0, 0, 1, 0), False),
    ],
)
def test_mounts_contradict_each_other_by_their_meaning(p, q, is_same):
    first = transforms(("lidar", (1, 2, 3), (0, 0, 0, 1)))
    second = transforms(("lidar", p, q))
    if is_same:
        found = StaticTransforms([first, second], "/tf_static")
        assert found.pose("base", "lidar")[:3, 3].tolist() == [1, 2, 3]
    else:
        with pytest.raises(InputError, match="before"):
            StaticTransforms([first, second], "/tf_static")


def test_a_missing_transform_is_named_with_what_there_is():
    found = StaticTransforms(
        [transforms(("lidar", (1, 2, 3), (0, 0, 0, 1)))], "/tf_static"
    )
    with pytest.raises(InputError, match=r"from base to imu.*base to lidar"):
        found.pose("base", "imu")
