"""The points of PointCloud2 messages as arrays."""

import itertools
from typing import Any

import numpy as np

# Datatype constant of sensor_msgs/msg/PointField -> NumPy type, without the
# order of bytes.
_DATATYPES = dict(
    enumerate(["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"], start=1)
)
_LIVOX = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("t", "<u4"),
    ]
)


def point_field_datatype(dtype: np.dtype) -> int:
    """Returns PointField's constant for a scalar type of NumPy.

    Raises:
        ValueError: if PointField has none.
    """
    for constant, name in _DATATYPES.items():
        if dtype == np.dtype(f"<{name}"):
            return constant
    raise ValueError(f"a point cloud cannot hold numbers of type {dtype}")


def to_points(message: Any) -> np.ndarray:
    """Returns a PointCloud2's points as an array.

    The points are not copied, unless there is padding between rows.

    Args:
        message: a deserialised PointCloud2, with any fields and padding.

    Returns:
        Structured array of shape (height * width,) under the message's field
        names.

    Raises:
        ValueError: if the message contradicts itself, or has no adjacent scalar
            floating-point fields `x`, `y` and `z`.
    """
    dtype = _record_type(message)
    for name in "xyz":
        if name not in (dtype.names or ()) or dtype[name].kind != "f":
            raise ValueError(f"the point cloud has no field {name} of floats")
    _check_separate(dtype)
    return _records(message, dtype)


def livox_points(message: Any) -> np.ndarray:
    """Returns the points of a message of Livox's drivers, (N,).

    Lines are rings, and reflectivities are intensities. `t` is the time since
    the message's stamp [ns].
    """
    return np.array(
        [
            (p.x, p.y, p.z, p.reflectivity, p.line, p.offset_time)
            for p in message.points
        ],
        _LIVOX,
    )


def is_dense(message: Any) -> bool:
    """Returns whether a PointCloud2's points follow each other without gaps.

    The data then have one meaning only, whatever `row_step` says. Drivers write
    0 there, or forget to change it when they remove points.
    """
    size = message.width * message.height * message.point_step
    return bool(len(message.data) == size)


def has_wrong_rows(message: Any) -> bool:
    """Returns whether the `row_step` of a cloud without gaps is wrong."""
    is_right = message.row_step == message.width * message.point_step
    return is_dense(message) and not is_right


def to_records(message: Any) -> np.ndarray:
    """Returns the points of a message sensor_msgs/msg/PointCloud2 as records.

    The points need not have coordinates.

    Returns:
        (height * width,) structured array with the fields of the message.

    Raises:
        ValueError: if the message contradicts itself.
    """
    return _records(message, _record_type(message))


def _records(message: Any, dtype: np.dtype) -> np.ndarray:
    """Returns the points of a message as records of a dtype."""
    data = np.frombuffer(message.data, dtype=np.uint8)
    if is_dense(message):
        return data.view(dtype) if len(data) else np.zeros(0, dtype)
    if message.row_step < message.width * message.point_step:
        raise ValueError("the point cloud's rows overlap")
    if len(data) != message.height * message.row_step:
        raise ValueError(
            f"the point cloud has {len(data)} bytes instead of"
            f" {message.height} x {message.row_step} (height x row_step) or"
            f" {message.width} x {message.height} x {message.point_step} (width"
            " x height x point_step)"
        )
    rows = data.reshape(message.height, message.row_step)
    used = rows[:, : message.width * message.point_step]
    return np.ascontiguousarray(used).reshape(-1).view(dtype)


def _check_separate(dtype: np.dtype) -> None:
    """Refuses coordinates that share bytes."""
    assert dtype.fields is not None  # There are x, y and z.
    places = sorted((dtype.fields[n][1], n, dtype[n].itemsize) for n in "xyz")
    for (start, name, size), (following, other, _) in itertools.pairwise(
        places
    ):
        if start + size > following:
            raise ValueError(
                f"the point cloud's fields {name} at byte {start} and {other}"
                f" at byte {following} overlap"
            )


def _record_type(message: Any) -> np.dtype:
    """Returns the dtype of a message's points, with the message's fields."""
    order = ">" if message.is_bigendian else "<"
    names: list[str] = []
    formats: list[tuple] = []
    for field in message.fields:
        if field.datatype not in _DATATYPES:
            raise ValueError(
                f"the point cloud's field {field.name} has the unknown"
                f" datatype {field.datatype}"
            )
        scalar = order + _DATATYPES[field.datatype]
        if field.name in names:
            raise ValueError(
                f"the point cloud's field {field.name} is there twice"
            )
        names.append(field.name)
        # Some writers leave the count of a scalar at zero.
        shape = (field.count,) if field.count > 1 else ()
        formats.append((scalar, shape))
        end = field.offset + np.dtype(formats[-1]).itemsize
        if end > message.point_step:
            raise ValueError(
                f"the point cloud's field {field.name} ends at byte {end} of"
                f" points of {message.point_step}"
            )
    return np.dtype(
        {
            "names": names,
            "formats": formats,
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
