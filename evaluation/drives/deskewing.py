"""Removal of the motion distortion from scans of a moving LiDAR."""

import re

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from evaluation.base import InputError, poses
from evaluation.drives.drive import Drive

# Number of poses before and after a scan from which its motion is interpolated.
# The splines have free ends; the error that this causes falls to about a
# quarter with each pose.
_REACH = 4
# Times of points from here on do not count from a scan's stamp, in any unit.
_SINCE_1970 = 1e9
# Points lie no further outside of the time from a scan's stamp to the next
# one's than this multiple of it.
_MOST_OUTSIDE = 0.75
# Names of fields with times of points, whatever their unit or zero.
_TIMES = re.compile(r"t|.*time.*|.*stamp.*", re.IGNORECASE)
# Largest ratio between the duration of a scan and the time between scans, or
# its inverse. The two times are about equal; in a wrong unit of time they
# differ by a factor of 1,000.
_MOST_RATIO = 300.0


def deskewed_notes(drive: Drive) -> list[str]:
    """Returns the notes on a drive whose scans `deskewed_scan` reads."""
    known = drive.distortion_note
    taken_out = (
        f"{drive.name}: taken while the LiDAR moved; the motion is taken out,"
        " and all points are as at the scan's stamp"
    )
    return [taken_out if note == known else note for note in drive.notes]


def deskewed_scan(drive: Drive, index: int) -> np.ndarray:
    """Returns a scan, deskewed if it is known to have motion distortion.

    Raises:
        InputError: see `deskew`.
    """
    if drive.distortion_note is None:
        return drive.scan(index)
    return deskew(drive, index)


def deskew(drive: Drive, index: int) -> np.ndarray:
    """Returns a scan as if all points had been measured at its time stamp.

    In a recorded scan, each point was measured `t` ns after the stamp (before
    it, if `t` is negative) and is
    expressed in the LiDAR's frame at that time. The pose at that time comes
    from cubic splines through the recorded poses around the scan: one for
    positions, and scipy's RotationSpline, with smooth angular rates, for
    rotations. This pose transforms the point to the world; the pose at the
    stamp then transforms the point to the LiDAR's frame S at the stamp.

    If no pose is recorded after the last scan, the motion during this scan is
    extrapolated.

    Args:
        drive: drive whose scans have a field `t` [ns].
        index: number of the scan.

    Returns:
        A copy of the scan with corrected `x`, `y` and `z` [m]; all other fields
        are unchanged.

    Raises:
        InputError: if the scan cannot be read, has no field `t` in nanoseconds,
            or the drive has only one scan.
    """
    points = drive.scan(index).copy()
    if "t" not in (points.dtype.names or ()):
        raise InputError(
            f"{drive.name}: scan {index}: no field t, the time of each point"
            f" since the stamp [ns]{_unused(points)}"
        )
    # Most points share their firing time with a whole column.
    t_ns, column = np.unique(points["t"], return_inverse=True)
    scan_s = np.ptp(t_ns) * 1e-9 if len(t_ns) else 0.0
    if len(drive) < 2:
        raise InputError(f"{drive.name}: one scan is not enough for a motion")
    near = drive.stamps_ns[max(0, index - _REACH) : index + _REACH + 2]
    step_s = np.diff(near).mean() * 1e-9
    if (kind := points["t"].dtype).kind not in "iu":
        raise InputError(
            f"{drive.name}: scan {index}: t: {kind.name}, not whole nanoseconds"
        )
    if scan_s > 0.0 and not (1.0 / _MOST_RATIO < scan_s / step_s < _MOST_RATIO):
        raise InputError(
            f"{drive.name}: scan {index}: t: from {t_ns[0]:g} to {t_ns[-1]:g};"
            f" no nanoseconds of a scan, where scans are {step_s:.3g} s apart"
        )
    span_s = max(scan_s, step_s)
    ends_s = t_ns[[0, -1]] * 1e-9 if len(t_ns) else np.zeros(2)
    if (np.abs(ends_s) > (1.0 + _MOST_OUTSIDE) * span_s).any():
        raise InputError(
            f"{drive.name}: scan {index}: t: the points lie from"
            f" {ends_s[0]:.3g} to {ends_s[1]:.3g} s after the stamp, outside of"
            f" the scan's time (scans are {step_s:.3g} s apart)"
        )
    # Differences of int64 are exact; stamps as doubles would not be.
    stamps_ns, X_WS = drive.motion
    times_ns = stamps_ns - drive.stamps_ns[index]
    first, at, end = np.searchsorted(
        times_ns, [t_ns.min(initial=0), 0, t_ns.max(initial=0)]
    )
    around = slice(max(0, first - _REACH), end + _REACH + 1)
    # The last one is the pose at the stamp.
    *X_WT, X_WS0 = _interpolate_poses(
        times_ns[around] * 1e-9, X_WS[around], np.append(t_ns, 0) * 1e-9
    )
    if at < len(times_ns) and times_ns[at] == 0:
        X_WS0 = X_WS[at]
    X_ST = poses.inverse(X_WS0) @ np.reshape(X_WT, (-1, 4, 4))
    p_T = np.stack([points[axis] for axis in "xyz"], axis=1).astype(float)
    R_ST, p_ST = X_ST[column, :3, :3], X_ST[column, :3, 3]
    p_S = np.einsum("nij,nj->ni", R_ST, p_T) + p_ST
    for axis, values in zip("xyz", p_S.T, strict=True):
        points[axis] = values
    return points


def _unused(points: np.ndarray) -> str:
    """Returns which field of times is there, and why it is not used; or ""."""
    for name in points.dtype.names or ():
        if not _TIMES.fullmatch(name) or points.dtype[name].shape:
            continue
        values = points[name].astype(float)
        if not len(values):
            continue
        low, high = values.min(), values.max()
        if not np.isfinite([low, high]).all():
            why = "not finite"
        elif low < 0.0:
            why = "times before the stamp"
        elif high >= _SINCE_1970:
            why = "times since 1970 or since the LiDAR began, not the stamp"
        elif low == high:
            why = "the same for all points"
        else:
            why = "of an unknown unit"
        kind = points.dtype[name].name
        return (
            f"; the field {name} ({kind}) is not used: {why}, {low:g} to"
            f" {high:g}"
        )
    return ""


def _interpolate_poses(
    times: np.ndarray, X_WS: np.ndarray, wanted: np.ndarray
) -> np.ndarray:
    """Returns poses (M, 4, 4) at M times [s], by splines through N poses."""
    p = CubicSpline(times, X_WS[:, :3, 3])(wanted)
    R = RotationSpline(times, Rotation.from_matrix(X_WS[:, :3, :3]))(wanted)
    return poses.make_pose(R.as_matrix(), p)
