"""Trajectories and poses from tables of text."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import InputError, poses, value_errors
from evaluation.drives.text_tables import (
    check_finite,
    check_increasing,
    parse_microseconds,
    read_numbers,
    read_stamped_rows,
)

# Greatest error of a rotation matrix or quaternion, as in numbers that are
# written with four digits.
_ROTATION_TOLERANCE = 1e-3
# Greatest time between two poses that are interpolated [ns].
_LONGEST_GAP_NS = 1_000_000_000
# Columns of a table of poses.
_COLUMNS = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")


@dataclass(frozen=True)
class StampedPoses:
    """Poses at increasing times.

    Attributes:
        path: the file it comes from, for messages.
        stamps_ns: (N,) int64 [ns], strictly increasing.
        X_WB: (N, 4, 4) float64 poses.
    """

    path: Path
    stamps_ns: np.ndarray
    X_WB: np.ndarray

    def interpolate(
        self,
        stamps_ns: np.ndarray,
        wanted_for: str = "the scan",
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns interpolated poses at given times (SLERP and linear).

        Args:
            stamps_ns: (M,) int64 times of the wanted poses [ns].
            wanted_for: what the poses are for, such as `the scan`; named in
                error messages.

        Returns:
            (K, 4, 4) poses at those K of the given times that lie between the
            first and the last pose of the table; (M,) bool, which of the given
            times these are.

        Raises:
            InputError: the table spans none of the times, or a time lies in a
                gap of more than a second.
        """
        own = self.stamps_ns
        spanned = (stamps_ns >= own[0]) & (stamps_ns <= own[-1])
        if not spanned.any():
            raise InputError(
                f"{self.path}: time: no pose for any scan: the poses span"
                f" {own[0]} to {own[-1]} ns, the scans {stamps_ns[0]} to"
                f" {stamps_ns[-1]} ns"
            )
        wanted = stamps_ns[spanned]
        after = np.searchsorted(own, wanted)
        exact = own[after] == wanted
        before = np.where(exact, after, after - 1)
        gaps = own[after] - own[before]
        if (gaps > _LONGEST_GAP_NS).any():
            worst = int(gaps.argmax())
            raise InputError(
                f"{self.path}: time: no pose for {wanted_for} at"
                f" {wanted[worst]} ns: the poses there are"
                f" {gaps[worst] * 1e-9:.2f} s apart, more than"
                f" {_LONGEST_GAP_NS * 1e-9:g} s"
            )
        # Differences of int64 are exact, and small enough for a double.
        fraction = (wanted - own[before]) / np.where(exact, 1, gaps)
        return (
            poses.interpolate(self.X_WB[before], self.X_WB[after], fraction),
            spanned,
        )

    def at(self, stamps_ns: np.ndarray, tolerance_ns: int) -> np.ndarray:
        """Returns the stored poses at given times, without interpolation.

        Args:
            stamps_ns: (M,) int64 [ns].
            tolerance_ns: greatest difference between a given time and the time
                of a stored pose [ns].

        Returns:
            (M, 4, 4) poses.

        Raises:
            InputError: there is no pose at one of the times.
        """
        own = self.stamps_ns
        after = np.clip(np.searchsorted(own, stamps_ns), 0, len(own) - 1)
        before = np.maximum(after - 1, 0)
        off_after = np.abs(own[after] - stamps_ns)
        off_before = np.abs(own[before] - stamps_ns)
        nearest = np.where(off_before < off_after, before, after)
        missing = np.minimum(off_before, off_after) > tolerance_ns
        if missing.any():
            first = int(np.flatnonzero(missing)[0])
            raise InputError(
                f"{self.path}: time: no pose for the scan at"
                f" {stamps_ns[first]} ns ({missing.sum()} of {len(missing)}"
                " scans have none)"
            )
        return self.X_WB[nearest]


def read_matrices(path: Path) -> StampedPoses:
    """Returns the trajectory in a table of times and poses.

    Each row of the table is a time and 12 numbers: the upper three rows of the
    4 x 4 pose, one after the other, separated by commas.

    Raises:
        InputError: if the table does not have this form, the left 3 x 3 part of
            a pose is no rotation, or the poses are not in order of time.
    """
    stamps_ns, values = read_stamped_rows(path, 12, ",")
    return _increasing_poses(path, stamps_ns, pose_matrices(path, values))


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
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(values[:, 3:], axis=1)
    bad = np.flatnonzero(np.abs(lengths - 1.0) > _ROTATION_TOLERANCE)
    if len(bad):
        raise InputError(
            f"{path}: row {bad[0] + 1}: quaternion: of length"
            f" {lengths[bad[0]]:.4g} instead of 1"
        )
    R = poses.rotation_from_quaternion(values[:, 3:])
    _check_positions(path, values[:, :3])
    return _increasing_poses(path, stamps_ns, poses.make_pose(R, values[:, :3]))


def read_angles(
    path: Path, num_velocities: int = 0
) -> tuple[StampedPoses, tuple[str, ...]]:
    """Reads a trajectory: rows with a time, a position and three angles.

    Times are in microseconds; roll, pitch and yaw are in radians.

    Args:
        path: a table with commas.
        num_velocities: number of velocities that follow the position, and of
            velocities that follow the angles, in a table without a header.

    Returns:
        Poses with the rotation Rz(yaw) Ry(pitch) Rx(roll); a note if rows were
        left out because a number in them is NaN.

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
    num_unknown = len(rows) - len(known)
    note = f"{path}: {num_unknown} rows with NaN are left out"
    return (
        _increasing_poses(path, stamps_ns, poses.make_pose(R, values[:, :3])),
        (note,) if num_unknown else (),
    )


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


def _increasing_poses(
    path: Path, stamps_ns: np.ndarray, X_WB: np.ndarray
) -> StampedPoses:
    # Loggers may repeat lines; equal rows are harmless.
    news = np.append(True, np.diff(stamps_ns) != 0)
    news[1:] |= (np.diff(X_WB, axis=0) != 0.0).any(axis=(1, 2))
    check_increasing(path, stamps_ns[news], "pose")
    return StampedPoses(path, stamps_ns[news], X_WB[news])
