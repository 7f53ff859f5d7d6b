"""Point clouds of a recording, serialised as ROS 2 messages.

The messages of a sensor differ only in their stamp and their points. The other
bytes are made once, by the usual serialiser, and kept.
"""

import functools
import struct

import numpy as np

from cns_drake.base import NS_PER_S
from cns_drake.drives import (
    POINT_CLOUD,
    make_message,
    point_field_datatype,
    serialize,
)
from cns_drake.recording import messages

# Placeholder for the numbers that change in a message that is made once. It is
# a valid number of nanoseconds, and cannot occur in a text.
_PLACEHOLDER = 0x3A17C0DE


def encode_point_cloud(
    points: np.ndarray, frame_id: str, stamp_ns: int
) -> bytes:
    """Returns a PointCloud2 whose records are `points`, serialised as CDR.

    The cloud is unordered (height 1) and dense: rays without a return have no
    record.

    Args:
        points: structured array of shape (N,), little-endian scalar fields;
            each becomes a point field under its own name and offset.
            Padding is written as zeros, so that equal points give equal
            bytes.
    """
    size = points.dtype.itemsize
    rows = np.ascontiguousarray(points).view(np.uint8).reshape(-1, size)
    _, padding = _point_fields(points.dtype)
    if any(rows[:, column].any() for column in padding):
        rows = rows.copy()
        for column in padding:
            rows[:, column] = 0
    start, middle, steps, end = _cloud_frame(points.dtype, frame_id)
    stamp = struct.pack("=iI", *divmod(stamp_ns, NS_PER_S))
    width, length = (struct.pack("=I", n) for n in (len(rows), rows.nbytes))
    # The data follow their length twice: of a row, and of the whole. Records
    # are copied once here, and three times by the serialiser.
    return b"".join(
        [start, stamp, middle, width, steps, length, length, rows.data, end]
    )


@functools.cache
def _cloud_frame(dtype: np.dtype, frame_id: str) -> list[bytes]:
    """Returns the constant bytes of a cloud's message, without the data.

    They are the pieces between stamp, width, row step and data.
    """
    data = serialize(
        make_message(
            POINT_CLOUD,
            header=messages.make_header(
                frame_id, _PLACEHOLDER * NS_PER_S + _PLACEHOLDER
            ),
            height=1,
            width=_PLACEHOLDER,
            fields=_point_fields(dtype)[0],
            point_step=dtype.itemsize,
            row_step=_PLACEHOLDER,
            is_dense=True,
        )
    )
    start, _, middle, steps, end = data.split(struct.pack("=I", _PLACEHOLDER))
    # The message ends with the length of the data, the data and one byte.
    return [start, middle, steps, end[-1:]]


@functools.cache
def _point_fields(dtype: np.dtype) -> tuple[list[tuple], list[int]]:
    """Returns PointFields of records, and offsets of bytes in no field."""
    fields = []
    padding = set(range(dtype.itemsize))
    for name, (scalar, offset, *_) in (dtype.fields or {}).items():
        padding.difference_update(range(offset, offset + scalar.itemsize))
        fields.append((name, offset, point_field_datatype(scalar), 1))
    return fields, sorted(padding)
