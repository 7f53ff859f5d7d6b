"""Trajectories and poses from tables of text."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import NS_PER_S, InputError, poses, value_errors
from evaluation.drives.stamped_poses import StampedPoses
from evaluation.drives.text_tables import (
    check_finite,
    form_of,
    parse_microseconds,
    parse_seconds,
    read_numbers,
    read_stamped_rows,
)

# Greatest error of a rotation matrix, as in numbers that are written with four
# digits.
_ROTATION_TOLERANCE = 1e-3
# Greatest error of a quaternion's length, as in numbers with two digits.
_LENGTH_TOLERANCE = 0.02
# Columns of a table of poses.
_COLUMNS = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")


def read_matrices(path: Path) -> StampedPoses:
    """Returns the trajectory in a table of times and poses.

    Each row of the table is a time and 12 numbers: the upper three rows of the
    4 x 4 pose, one after the other, separated by commas.

    Raises:
        InputError: if the table does not have this form, the left 3 x 3 part of
            a pose is no rotation, or the poses are not in order of time.
    """
    stamps_ns, values = read_stamped_rows(path, 12, ",")
    return StampedPoses.of(path, stamps_ns, pose_matrices(path, values))


def read_quaternions(path: Path, separator: str | None) -> StampedPoses:
    """Reads a trajectory: rows with a time, x y z [m] and quaternion x y z w.

    Args:
        path: the file.
        separator: text between columns; None for white space.

    Raises:
        InputError: if the table does not have that form, a quaternion is not of
            unit length, or the poses are out of order.
    """
    stamps_ns, values = read_stamped_rows(path, 7, separator, _COLUMNS)
    return _turned_poses(path, stamps_ns, values)


def _turned_poses(
    path: Path, stamps_ns: np.ndarray, values: np.ndarray
) -> StampedPoses:
    """Returns poses from times (N,) and positions with quaternions (N, 7)."""
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(values[:, 3:], axis=1)
    # A quaternion of another length has the same axis and angle.
    bad = np.flatnonzero(np.abs(lengths - 1.0) > _LENGTH_TOLERANCE)
    if len(bad):
        raise InputError(
            f"{path}: row {bad[0] + 1}: quaternion: of length"
            f" {lengths[bad[0]]:.4g} instead of 1"
        )
    R = poses.rotation_from_quaternion(values[:, 3:])
    _check_positions(path, values[:, :3])
    return StampedPoses.of(path, stamps_ns, poses.make_pose(R, values[:, :3]))


def read_trajectory(
    path: Path, stamps_ns: np.ndarray, scans: Sequence[int] | None = None
) -> StampedPoses:
    """Returns the poses of a file in the form of TUM or of KITTI.

    Args:
        path: rows of a time [s, or whole ns], x y z [m] and quaternion x y z w
            (TUM), or of columns that a header names, such as EuRoC's; or of 3 x
            4 matrices, one for each scan (KITTI), or behind a time (MulRan) or
            the number of the scan (KITTI-360). Commas may separate columns.
            Rows with NaN are left out, and noted. TUM's times are the numbers
            of the scans if they are 0, 1, ... N - 1 s, as KISS-ICP writes.
        stamps_ns: (N,) stamps of the scans [ns].
        scans: (N,) numbers of the scans, ascending; by default 0 to N - 1.
            Rows with other numbers are left out.

    Raises:
        InputError: the file has neither form, another number of matrices, or no
            row has the number of a scan.
    """
    separator, columns, is_named = form_of(path)
    if is_named or columns == len(_COLUMNS):
        rows = read_numbers(
            path, [("stamp", "U40"), ("values", "f8", 7)], separator, _COLUMNS
        )
        has_pose = ~np.isnan(rows["values"]).any(axis=1)
        known = rows[has_pose]
        if not len(known):
            raise InputError(f"{path}: no row without NaN")
        with value_errors(f"{path}: time"):
            own_ns = parse_seconds(known["stamp"])
        # KISS-ICP counts scans whose stamps it does not know.
        order = np.flatnonzero(has_pose)
        is_count = np.array_equal(own_ns, order * NS_PER_S)
        if is_count and len(rows) == len(stamps_ns):
            own_ns = stamps_ns[order]
        check_finite(path, known["values"])
        found = _turned_poses(path, own_ns, known["values"])
        return replace(found, num_unknown=len(rows) - len(known))
    if columns == 13:
        own_ns, values = read_stamped_rows(path, 12, separator)
        of_scans = np.arange(len(stamps_ns)) if scans is None else scans
        if ((own_ns >= 0) & (own_ns <= of_scans[-1])).all():
            has_scan = np.isin(own_ns, of_scans)
            if not has_scan.any():
                raise InputError(f"{path}: no row has the number of a scan")
            own_ns, values = own_ns[has_scan], values[has_scan]
            own_ns = stamps_ns[np.searchsorted(of_scans, own_ns)]
        return StampedPoses.of(path, own_ns, pose_matrices(path, values))
    if columns != 12:
        raise InputError(
            f"{path}: rows of {columns} numbers; TUM has 8 (seconds x y z qx qy"
            " qz qw), KITTI 12, or 13 with a time; name the columns in a first"
            " line"
        )
    numbers = read_numbers(path, float, separator)
    X_WS = pose_matrices(path, numbers)
    if len(X_WS) != len(stamps_ns):
        raise InputError(
            f"{path}: {len(X_WS)} poses without times, for {len(stamps_ns)}"
            " scans"
        )
    return StampedPoses(path, stamps_ns, X_WS)


def read_angles(path: Path, num_velocities: int = 0) -> StampedPoses:
    """Reads a trajectory: rows with a time, a position and three angles.

    Times are in microseconds; roll, pitch and yaw are in radians.

    Args:
        path: a table with commas.
        num_velocities: number of velocities that follow the position, and of
            velocities that follow the angles, in a table without a header.

    Returns:
        Poses with the rotation Rz(yaw) Ry(pitch) Rx(roll). Rows with NaN are
        left out, and counted.

    Raises:
        InputError: if the table does not have that form, or the poses are out
            of order.
    """
    velocities = [""] * num_velocities
    names = ["time", "x", "y", "z", *velocities]
    names += ["roll", "pitch", "yaw", *velocities]
    columns = [("stamp", "U40"), ("values", "f8", 6)]
    rows = read_numbers(path, columns, ",", names)
    known = rows[~np.isnan(rows["values"]).any(axis=1)]
    with value_errors(f"{path}: time"):
        stamps_ns = parse_microseconds(known["stamp"])
    values = known["values"]
    if not len(values):
        raise InputError(f"{path}: no row without NaN")
    check_finite(path, values)
    _check_positions(path, values[:, :3])
    R = Rotation.from_euler("xyz", values[:, 3:]).as_matrix()
    X_WB = poses.make_pose(R, values[:, :3])
    found = StampedPoses.of(path, stamps_ns, X_WB)
    return replace(found, num_unknown=len(rows) - len(known))


def read_poses(path: Path) -> np.ndarray:
    """Returns poses (N, 4, 4) from rows with a 3 x 4 matrix, row by row.

    Raises:
        InputError: if there is no such table, it is empty, a row has another
            length, or a matrix is no rotation.
    """
    values = read_numbers(path, float)
    if values.shape[1] != 12:
        raise InputError(
            f"{path}: rows of {values.shape[1]} numbers instead of 12"
        )
    return pose_matrices(path, values)


def pose_matrices(path: Path, values: np.ndarray) -> np.ndarray:
    """Returns poses from rows of twelve numbers, a 3 x 4 matrix each.

    Args:
        path: file of the numbers, for messages.
        values: (N, 12) numbers.

    Returns:
        (N, 4, 4) poses. The rotation matrices contain the given numbers, and
        are orthogonal only as far as the rounding of these numbers permits.

    Raises:
        InputError: if a number is not finite or a matrix is no rotation.
    """
    check_finite(path, values)
    upper = values.reshape(-1, 3, 4)
    R = upper[:, :, :3]
    # Numbers that overflow, and the NaN that follow from them, are no rotation.
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(axis=(1, 2))
        bad = ~((error <= _ROTATION_TOLERANCE) & (np.linalg.det(R) > 0.0))
    if bad.any():
        raise InputError(
            f"{path}: row {np.flatnonzero(bad)[0] + 1}: no rotation matrix"
        )
    _check_positions(path, upper[:, :, 3])
    return poses.make_pose(R, upper[:, :, 3])


def _check_positions(path: Path, positions: np.ndarray) -> None:
    far = (np.abs(positions) >= poses.FARTHEST).any(axis=1)
    if far.any():
        row = int(far.argmax())
        raise InputError(
            f"{path}: row {row + 1}: {np.abs(positions[row]).max():g} m from"
            " the origin"
        )
