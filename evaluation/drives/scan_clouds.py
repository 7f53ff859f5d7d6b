"""The cloud at a frame: one scan or several merged scans, limited to a range.

The range of a point is the greatest absolute value of its x, y and z in the
frame of the sensor. The paper limits points to a range of 100 m.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base import InputError, poses
from cns_drake.base import points as clouds
from cns_drake.drives import Drive
from evaluation.drives.query_sensor import QuerySensor


def within_cube(points: np.ndarray, half_extent: float) -> np.ndarray:
    """Returns which points (N, 3) are finite and within a range, (N,) bool.

    Args:
        points: (N, 3) points in the frame of the sensor [m].
        half_extent: greatest absolute value of each coordinate [m].
    """
    # One column at a time, because NumPy reduces slowly along a short axis. A
    # comparison with NaN is false, so NaN is out of range.
    x, y, z = np.abs(points.T)
    return (x <= half_extent) & (y <= half_extent) & (z <= half_extent)


def cloud_at(
    drive: Drive,
    frame: int,
    num_scans: int,
    half_extent: float,
    fields: tuple[str, ...] = (),
    num_before: int = 0,
    sensor: QuerySensor | None = None,
) -> np.ndarray:
    """Returns the point cloud at a frame: one scan, or several scans merged.

    Args:
        drive: the drive.
        frame: number of the frame.
        num_scans: number of consecutive scans that are merged. At the ends of
            the drive, fewer scans are merged.
        half_extent: greatest absolute x, y and z of a point in the sensor's
            frame [m].
        fields: names of further fields of the points, besides x, y and z.
        num_before: how many of the scans come before the frame.
        sensor: rotation and occluded sector that are applied to the sensor;
            None to use the sensor as recorded.

    Returns:
        (N, 3) float64 points in the sensor's frame at that frame. If fields are
        requested, a structured array (N,) of float64 x, y, z and the fields.
        The array is read-only, since several methods may share it.

    Raises:
        InputError: if the scans lack a field.
    """
    first = max(frame - num_before, 0)
    end = min(frame - num_before + num_scans, len(drive))
    X_WS = drive.X_WS
    X_FS0 = None
    if sensor is not None and sensor.X_SQ is not None:
        X_FS0 = poses.inverse(sensor.X_SQ)
    X_S0W = poses.inverse(X_WS[frame])

    def cropped_scan(index: int) -> np.ndarray:
        scan = drive.scan(index)
        if sensor is not None:
            scan = sensor.without_hidden(scan)
        X_FS = X_FS0
        if index != frame:
            X_FS = X_S0W @ X_WS[index]
            if X_FS0 is not None:
                X_FS = X_FS0 @ X_FS
        if not fields:
            return cropped(scan, half_extent, X_FS)
        return cropped_with_fields(
            scan, half_extent, fields, X_FS, source=drive.name
        )

    return clouds.read_only(
        np.concatenate([*map(cropped_scan, range(first, end))])
    )


def cropped(
    scan: np.ndarray, half_extent: float, X_FS: np.ndarray | None = None
) -> np.ndarray:
    """Returns the points of a scan that are finite and within range.

    Args:
        scan: structured array (N,) in the frame S of a sensor.
        half_extent: greatest absolute x, y and z of a point in F [m].
        X_FS: (4, 4) pose of the sensor in the frame F of the result; by default
            F is S.

    Returns:
        (K, 3) float64 in F [m].
    """
    p_F = _coordinates(scan, X_FS)
    return p_F.compress(within_cube(p_F, half_extent), axis=0)


def cropped_with_fields(
    scan: np.ndarray,
    half_extent: float,
    fields: tuple[str, ...],
    X_FS: np.ndarray | None = None,
    *,
    source: str,
) -> np.ndarray:
    """Returns the same points as `cropped`, with further fields.

    Args:
        scan: structured array (N,) in the frame S of a sensor.
        half_extent: greatest absolute x, y and z of a point in F [m].
        fields: names of further fields of the points, besides x, y and z.
        X_FS: (4, 4) pose of the sensor in the frame F of the result; by default
            F is S.
        source: name of the drive or file, for error messages.

    Returns:
        Structured array (K,) of float64 x, y, z in F [m] and the fields.

    Raises:
        InputError: if the scan lacks a field.
    """
    known = scan.dtype.names or ()
    for name in fields:
        if name not in known:
            raise InputError(
                f"{source}: its points have no field {name!r} (they have"
                f" {', '.join(known)})"
            )
    p_F = _coordinates(scan, X_FS)
    kept = within_cube(p_F, half_extent)
    p_F = p_F.compress(kept, axis=0)
    cloud = np.empty(
        len(p_F),
        [(axis, np.float64) for axis in "xyz"]
        + [(name, scan.dtype[name]) for name in fields],
    )
    for axis, coordinates in zip("xyz", p_F.T, strict=True):
        cloud[axis] = coordinates
    for name in fields:
        cloud[name] = scan[name].compress(kept, axis=0)
    return cloud


def _coordinates(scan: np.ndarray, X_FS: np.ndarray | None) -> np.ndarray:
    """Returns the points (N, 3) of a scan in the frame F [m].

    Args:
        scan: structured array (N,) in the frame S of a sensor.
        X_FS: (4, 4) pose of the sensor in F; None if F is S.
    """
    p_S = clouds.xyz(scan)
    if X_FS is None:
        return p_S
    x, y, z = p_S.T
    # Unlike a matrix product, products and sums that are computed one by one
    # are rounded in the same way on every processor.
    with np.errstate(invalid="ignore"):
        rows = [r[0] * x + r[1] * y + r[2] * z + r[3] for r in X_FS[:3]]
    return np.stack(rows, axis=1)
