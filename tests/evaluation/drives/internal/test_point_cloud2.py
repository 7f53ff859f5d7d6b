"""Point clouds as other programs write them: their data count, not headers."""

from types import SimpleNamespace

import numpy as np
import pytest

from evaluation.drives.point_cloud2 import has_wrong_rows, to_points

POINTS = np.arange(36, dtype="<f4").view([(axis, "<f4") for axis in "xyz"])


def message(height=1, width=12, row_step=144, **changes):
    fields = {
        "height": height,
        "width": width,
        "point_step": 12,
        "row_step": row_step,
        "is_bigendian": False,
        "data": POINTS.tobytes(),
        "fields": [field(axis, 4 * k, 7) for k, axis in enumerate("xyz")],
    }
    return SimpleNamespace(**fields | changes)


def field(name, offset, datatype, count=1):
    return SimpleNamespace(
        name=name, offset=offset, datatype=datatype, count=count
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
    cloud = message(height, width, row_step)
    np.testing.assert_array_equal(to_points(cloud), POINTS)
    assert has_wrong_rows(cloud) != is_right


def test_rows_with_padding_need_their_step():
    rows = POINTS.view("u1").reshape(3, 48)
    padded = np.pad(rows, [(0, 0), (0, 8)], constant_values=99).tobytes()
    np.testing.assert_array_equal(
        to_points(message(3, 4, 56, data=padded)), POINTS
    )
    with pytest.raises(ValueError, match="168 bytes instead of 3 x 60"):
        to_points(message(3, 4, 60, data=padded))


def test_packed_big_endian_doubles():
    dtype = np.dtype(
        {
            "names": ["x", "y", "z", "tag"],
            "formats": [">f8", ">f8", ">f8", ">u2"],
            "offsets": [1, 9, 17, 25],
            "itemsize": 29,
        }
    )
    records = np.zeros(3, dtype=dtype)
    records["y"] = [1.5, -2.5, 1e300]
    records["tag"] = [1, 2, 65535]
    of_tag = field("tag", 25, 4, count=0)
    points = to_points(
        message(
            width=3,
            row_step=87,
            data=np.frombuffer(records.tobytes(), dtype=np.uint8),
            point_step=29,
            is_bigendian=True,
            fields=[*(field(n, dtype.fields[n][1], 8) for n in "xyz"), of_tag],
        )
    )
    for name in dtype.names:
        np.testing.assert_array_equal(points[name], records[name])


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"width": 13}, "overlap"),
        ({"height": 2}, "bytes instead of"),
        ({"fields": []}, "no field x"),
    ],
)
def test_contradictions(changes, fault):
    with pytest.raises(ValueError, match=fault):
        to_points(message(**changes))
