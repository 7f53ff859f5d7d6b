"""Conversion of points between the layouts (fields) of several programs.

`cns` is the layout of this project. `ouster` is the layout of Ouster's driver
with `ring` as uint8, as LIO-SAM and FAST-LIO2 read it; `velodyne` is
PointXYZIRT of Velodyne's ROS 2 driver; `autoware` is PointXYZIRCAEDT. Only
`cns` has fields for labels and instances; with the other layouts, labels and
instances are recorded in a second message.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.lib.recfunctions import repack_fields

from evaluation.base import NS_PER_S, arctan2

LayoutName = Literal["cns", "ouster", "velodyne", "autoware"]
_MM_PER_M = 1e3
# Limit of times that are stored as uint32 [ns].
_LONGEST_NS = 2.0**32
# Size of a number that resolves times since 1970.
_ABSOLUTE_BYTES = 8
# The latest time in a scan, if it is in nanoseconds: in seconds it would be
# later than any scan ends, and before 2001.
_NS_OF_A_SCAN = (1e6, 1e9)
# Names of fields with the times of points, by which is used first.
_TIMES = ("t", "time", "time_stamp", "timestamp")
# Units of times since 1970: nanoseconds, microseconds and seconds [ns].
_UNITS_NS = (1, 1_000, NS_PER_S)
# Echoes that a LiDAR reports -> Autoware's type of a beam's only return. There
# is none for the first one, which is of the type INVALID.
_SINGLE_TYPES = {"first": 0, "strongest": 1, "last": 2}
# Autoware's types of two returns of a beam, of which the strongest is the first
# one or the last one; and the type of a return without another one.
_STRONGEST_FIRST, _STRONGEST_LAST, _WEAK_FIRST, _WEAK_LAST, _DUAL_ONLY = range(
    3, 8
)
# Greatest sine of the angle between two returns of one beam.
_SAME_BEAM = 1e-4
# The greatest intensity of calibrated returns, and of a byte.
_FULL = 255.0


def _make_dtype(
    names: str, formats: str, offsets: list[int], size: int
) -> np.dtype:
    return np.dtype(
        {
            "names": names.split(),
            "formats": [f"<{form}" for form in formats.split()],
            "offsets": offsets,
            "itemsize": size,
        }
    )


_LAYOUTS = {
    # PCL pads a position to 16 bytes, and a point to a multiple of that.
    "ouster": _make_dtype(
        "x y z intensity t reflectivity ring ambient range",
        "f4 f4 f4 f4 u4 u2 u1 u2 u4",
        [0, 4, 8, 16, 20, 24, 26, 28, 32],
        48,
    ),
    "velodyne": _make_dtype(
        "x y z intensity ring time",
        "f4 f4 f4 f4 u2 f4",
        [0, 4, 8, 12, 16, 18],
        22,
    ),
    "autoware": _make_dtype(
        "x y z intensity return_type channel azimuth elevation distance"
        " time_stamp",
        "f4 f4 f4 u1 u1 u2 f4 f4 f4 u4",
        [0, 4, 8, 12, 13, 14, 16, 20, 24, 28],
        32,
    ),
}


def to_layout(
    points: np.ndarray,
    layout: LayoutName,
    num_rings: int | None = None,
    is_calibrated: bool = False,
    echoes: str = "strongest",
) -> np.ndarray:
    """Returns points with the fields of another layout, such as Ouster's.

    Args:
        points: (N,) with the fields x y z intensity ring t.
        layout: the layout; `cns` is that of the points.
        num_rings: number of rings of the LiDAR. If given, the layout `velodyne`
            counts rings from the lowest ring, as Velodyne's driver does.
        is_calibrated: whether the intensities are calibrated. Calibrated
            intensities are from 0 to 255, all others from 0 to 1.
        echoes: the echoes that the LiDAR reports: `first`, `strongest`, `last`
            or `dual`. Two echoes of a beam follow each other, the stronger one
            first.

    Returns:
        (N,) records. Ranges of `ouster` are in millimetres. `t` and
        `time_stamp` count nanoseconds since the message's stamp, and `time`
        counts seconds since the stamp. Azimuths are from 0 to 2 pi, and
        increase from x to y. `reflectivity` and the intensity of `autoware` are
        from 0 to 255.
    """
    if layout == "cns":
        return points
    x, y, z = (points[axis].astype(float) for axis in "xyz")
    distance = np.sqrt(x * x + y * y + z * z)
    full = _FULL if is_calibrated else 1.0
    brightness = np.rint(_FULL * np.clip(points["intensity"] / full, 0.0, 1.0))
    columns = {name: points[name] for name in points.dtype.names or ()}
    columns |= {
        "reflectivity": brightness,
        "ambient": np.zeros(len(points)),
        "range": np.rint(_MM_PER_M * distance),
        "time": points["t"] / NS_PER_S,
        "time_stamp": points["t"],
        "return_type": _return_types(points, distance, echoes),
        "channel": points["ring"],
        "azimuth": arctan2(y, x) % (2.0 * np.pi),
        "elevation": arctan2(z, np.hypot(x, y)),
        "distance": distance,
    }
    if layout == "autoware":
        columns["intensity"] = brightness
    if layout == "velodyne" and num_rings is not None:
        columns["ring"] = num_rings - 1 - points["ring"].astype(int)
    dtype = _LAYOUTS[layout]
    made = np.zeros(len(points), dtype)
    for name in dtype.names or ():
        made[name] = columns[name]
    return made


def _return_types(
    points: np.ndarray, distance: np.ndarray, echoes: str
) -> np.ndarray:
    """Returns Autoware's type (N,) of each return.

    https://github.com/autowarefoundation/autoware.core (autoware_point_types)

    Args:
        points, echoes: see `to_layout`.
        distance: (N,) distances of the points [m].
    """
    if echoes in _SINGLE_TYPES:
        return np.full(len(points), _SINGLE_TYPES[echoes])
    types = np.full(len(points), _DUAL_ONLY)
    p = np.stack([points[axis].astype(float) for axis in "xyz"], axis=1)
    before, after = p[:-1], p[1:]
    across = np.linalg.norm(np.cross(before, after), axis=1)
    is_pair = across < _SAME_BEAM * distance[:-1] * distance[1:]
    is_pair &= (before * after).sum(axis=1) > 0.0
    for name in ("ring", "t"):
        is_pair &= points[name][:-1] == points[name][1:]
    strong = np.flatnonzero(is_pair)
    is_first = distance[strong] < distance[strong + 1]
    types[strong] = np.where(is_first, _STRONGEST_FIRST, _STRONGEST_LAST)
    types[strong + 1] = np.where(is_first, _WEAK_LAST, _WEAK_FIRST)
    return types


def to_labels(points: np.ndarray) -> np.ndarray:
    """Returns only the labels and instances of points, (N,)."""
    return repack_fields(points[["label", "instance"]])


def from_layout(
    points: np.ndarray,
    labels: np.ndarray | None = None,
    is_ideal: Callable[[], bool] = lambda: False,
    stamp_ns: int | None = None,
) -> np.ndarray:
    """Converts points of any layout to the fields of the layout `cns`.

    Args:
        points: (N,) in any layout.
        labels: (N,) records with further fields of the same points, such as
            `label`; by default none.
        is_ideal: function that returns whether intensities of the `autoware`
            layout are 255 times ideal ones, as cns-drake records them. All
            others stay as they are.
        stamp_ns: time of the scan [ns]; None if times of points do not count
            from 1970.

    Returns:
        (N,) points; `points` itself if nothing changes. Fields that `cns` does
        not have are kept. In `autoware`, `channel` becomes `ring`, and ideal
        intensities are scaled to 0 to 1. The first of the fields `t`, `time`,
        `time_stamp` and `timestamp` becomes `t` [ns since the stamp]: whole
        nanoseconds of 32 bits; floating-point seconds or nanoseconds; or times
        since 1970 within a second of the stamp, as of Hesai and RoboSense. A
        field whose values fit no unit stays unchanged.

    Raises:
        ValueError: the numbers of labels and points differ.
    """
    names = points.dtype.names or ()
    columns = {name: points[name] for name in names}
    if {"time_stamp", "channel", "intensity"} <= set(names):
        columns.pop("t", None)
        columns["ring"] = columns.pop("channel")
        full = np.float32(_FULL if is_ideal() else 1.0)
        columns["intensity"] = points["intensity"] / full
    timed = next((name for name in _TIMES if name in columns), None)
    if timed is not None:
        t_ns = _since_1970(columns[timed], stamp_ns)
        if t_ns is None and timed == "time_stamp":
            t_ns = columns[timed]
        elif t_ns is None and timed != "timestamp":
            t_ns = _nanoseconds(columns[timed])
        if t_ns is not None:
            del columns[timed]
            columns["t"] = t_ns
    if labels is not None:
        if len(labels) != len(points):
            raise ValueError(f"{len(points)} points, but {len(labels)} labels")
        columns |= {name: labels[name] for name in labels.dtype.names or ()}
    fields = [
        (name, column.dtype, column.shape[1:])
        for name, column in columns.items()
    ]
    if fields == [
        (name, points[name].dtype, points[name].shape[1:]) for name in names
    ]:
        return points
    made = np.empty(len(points), fields)
    for name, column in columns.items():
        made[name] = column
    return made


def _since_1970(times: np.ndarray, stamp_ns: int | None) -> np.ndarray | None:
    """Returns times since 1970 as int32 (N,) since the stamp [ns].

    The result is None if they are none, or a second or more from the stamp.
    """
    is_exact = times.itemsize == _ABSOLUTE_BYTES and times.ndim == 1
    if stamp_ns is None or not (is_exact and len(times)):
        return None
    for unit_ns in _UNITS_NS:
        with np.errstate(invalid="ignore"):
            away = times.astype(float) * unit_ns - stamp_ns
        if (np.abs(away) < NS_PER_S).all():
            # A double has too few digits for these nanoseconds.
            whole = np.floor(times)
            rest = np.rint((times - whole).astype(float) * unit_ns)
            whole_ns = whole.astype(np.int64) * unit_ns - stamp_ns
            return (whole_ns + rest).astype(np.int32)
    return None


def _nanoseconds(times: np.ndarray) -> np.ndarray | None:
    """Returns times as nanoseconds since the stamp, if the unit is certain.

    Some drivers count backwards from the last point, or since the LiDAR began.

    Args:
        times: (N,) times of the points.

    Returns:
        (N,) uint32 [ns]; None if they are no floating-point numbers, or their
        unit is not certain.
    """
    if times.dtype.kind != "f":
        return None
    t_ns = times.astype(float)
    if not _NS_OF_A_SCAN[0] <= t_ns.max(initial=0.0) < _NS_OF_A_SCAN[1]:
        t_ns = t_ns * NS_PER_S
    if not ((t_ns >= 0.0) & (t_ns < _LONGEST_NS)).all():
        return None
    return np.rint(t_ns).astype(np.uint32)
