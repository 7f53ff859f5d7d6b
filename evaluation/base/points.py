"""Point clouds as structured arrays: one record per point.

A cloud has at least the scalar fields `x`, `y` and `z` [m]; other fields of a
file (intensity, ring, label) keep their names and types. All readers return
scans and maps in this form.
"""

import numpy as np
from numpy.typing import DTypeLike

from evaluation.base.errors import InputError

# No LiDAR sees that far; larger numbers are not coordinates [m].
FARTHEST_RETURN = 10_000.0
# Greatest instance id of a structure, in 16 bits.
MAX_INSTANCE = 2**16 - 1
# SemanticKITTI's class of moving objects that have no moving class of their
# own.
OTHER_MOVING_ID = 259
_XYZI = ("x", "y", "z", "intensity")


def xyz(points: np.ndarray, dtype: DTypeLike = np.float64) -> np.ndarray:
    """Returns the coordinates of a cloud of N points as a new (N, 3) array."""
    coordinates = np.empty((len(points), 3), dtype=dtype)
    # NumPy warns when it converts some NaN.
    with np.errstate(invalid="ignore"):
        for axis, name in enumerate("xyz"):
            coordinates[:, axis] = points[name]
    return coordinates


def check_range(points: np.ndarray, limit: float, first: int = 0) -> None:
    """Raises an error if a coordinate is too large to be real.

    Such coordinates come from misread bytes. Values that are not finite are
    allowed, because many sensors store such values for beams without a return.

    Args:
        points: (N,) structured array.
        limit: absolute value that every coordinate must stay below [m].
        first: index of the first point in its file, for the message.

    Raises:
        ValueError: a coordinate reaches the limit.
    """
    for name in "xyz":
        # Some limits exceed half precision, which would warn of an overflow.
        with np.errstate(over="ignore", invalid="ignore"):
            far = (np.abs(points[name]) >= limit) & np.isfinite(points[name])
        if far.any():
            place = int(far.argmax())
            raise ValueError(
                f"{name}: point {first + place} is at {points[name][place]:g} m"
            )


def from_xyz(coordinates: np.ndarray) -> np.ndarray:
    """Returns points with the given coordinates (N, 3).

    Args:
        coordinates: (N, 3) or (N, 4) floating point; a fourth column is
            the intensity.

    Returns:
        Structured array of shape (N,): a view of `coordinates` if their order
        in memory allows it, and a copy otherwise.
    """
    names = _XYZI[: coordinates.shape[1]]
    contiguous = np.ascontiguousarray(coordinates)
    dtype = np.dtype([(name, contiguous.dtype) for name in names])
    return contiguous.view(dtype).reshape(len(coordinates))


def to_xyzi(scan: np.ndarray) -> np.ndarray:
    """Returns x, y, z and intensity of a scan as (N, 4) little-endian float32.

    The intensity is 0 if the scan has none.
    """
    xyzi = np.zeros((len(scan), 4), dtype="<f4")
    for column, name in enumerate(_XYZI):
        if name in (scan.dtype.names or ()):
            xyzi[:, column] = scan[name]
    return xyzi


def encode_bin(scan: np.ndarray) -> bytes:
    """Returns a scan as KITTI stores it: float32 x y z intensity."""
    return to_xyzi(scan).tobytes()


def encode_pcd(scan: np.ndarray) -> bytes:
    """Returns a scan as a binary PCD file of float32 x y z intensity."""
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\n"
        "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
        f"COUNT 1 1 1 1\nWIDTH {len(scan)}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(scan)}\nDATA binary\n"
    )
    return header.encode() + encode_bin(scan)


def read_only(array: np.ndarray) -> np.ndarray:
    """Returns a view of an array, through which nothing can be written."""
    view = array.view()
    view.flags.writeable = False
    return view


def check_instances(num_structures: int) -> None:
    """Checks that there are instance ids for all structures of a world.

    Raises:
        InputError: there are more structures than instance ids.
    """
    if num_structures > MAX_INSTANCE:
        raise InputError(
            f"the world has {num_structures} structures, but an instance id "
            f"has room for {MAX_INSTANCE}"
        )
