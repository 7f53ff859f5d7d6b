"""The cloud at a frame: one scan or several merged scans, limited to a range.

The range of a point is the greatest absolute value of its x, y and z in the
frame of the sensor. The paper limits points to a range of 100 m.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, compiled, poses, read_only
from evaluation.drives.drive import Drive


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

    return read_only(np.concatenate([*map(cropped_scan, range(first, end))]))


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
    return _within_range(scan, half_extent, X_FS)[0]


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
        scan, half_extent, X_FS: see `cropped`.
        fields: names of further fields of the points, besides x, y and z.
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
    p_F, rows = _within_range(scan, half_extent, X_FS)
    cloud = np.empty(
        len(p_F),
        [(axis, np.float64) for axis in "xyz"]
        + [(name, scan.dtype[name]) for name in fields],
    )
    for axis, coordinates in zip("xyz", p_F.T, strict=True):
        cloud[axis] = coordinates
    for name in fields:
        cloud[name] = scan[name].take(rows, axis=0)
    return cloud


def _within_range(
    scan: np.ndarray, half_extent: float, X_FS: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the points (K, 3) of `cropped`, and their rows (K,) in the scan.

    For the arguments, see `cropped`.
    """
    p_S = np.empty((3, len(scan)))
    # NumPy warns when it converts some NaN.
    with np.errstate(invalid="ignore"):
        for coordinates, axis in zip(p_S, "xyz", strict=True):
            coordinates[:] = scan[axis]
    X = np.eye(4) if X_FS is None else np.array(X_FS, np.float64, order="C")
    p_F, rows = np.empty((len(scan), 3)), np.empty(len(scan), np.int64)
    extent = float(half_extent)
    number = _move_and_crop(p_S, X, X_FS is not None, extent, p_F, rows)
    return p_F[:number].copy(), rows[:number].copy()


@compiled
def _move_and_crop(
    p_S: np.ndarray,
    X_FS: np.ndarray,
    is_moved: bool,
    half_extent: float,
    p_F: np.ndarray,
    rows: np.ndarray,
) -> int:
    """Moves points (3, N) to F; returns how many are within range.

    The first of `p_F` (N, 3) and `rows` (N,) are set to these points and their
    rows.
    """
    number = 0
    for row in range(p_S.shape[1]):
        x, y, z = p_S[0, row], p_S[1, row], p_S[2, row]
        if is_moved:
            # Unlike a matrix product, products and sums that are computed one
            # by one are rounded in the same way on every processor.
            a, b, c = x, y, z
            x = X_FS[0, 0] * a + X_FS[0, 1] * b + X_FS[0, 2] * c + X_FS[0, 3]
            y = X_FS[1, 0] * a + X_FS[1, 1] * b + X_FS[1, 2] * c + X_FS[1, 3]
            z = X_FS[2, 0] * a + X_FS[2, 1] * b + X_FS[2, 2] * c + X_FS[2, 3]
        # A comparison with NaN is false, so NaN is out of range.
        if (
            abs(x) <= half_extent
            and abs(y) <= half_extent
            and abs(z) <= half_extent
        ):
            p_F[number, 0] = x
            p_F[number, 1] = y
            p_F[number, 2] = z
            rows[number] = row
            number += 1
    return number


@dataclass(frozen=True, eq=False)
class QuerySensor:
    """A rotated sensor Q that replaces the recorded sensor S in a query.

    Q and S are at the same position. A sector of azimuths can be occluded in Q:
    the points in this sector are removed from the scan.

    Attributes:
        X_SQ: (4, 4) a rotation; None if Q is not rotated.
        hidden_from: azimuth in S at which the occluded sector begins [rad].
        hidden_angle: angle of the occluded sector [rad]; 0 for none.
    """

    X_SQ: np.ndarray | None = None
    hidden_from: float = 0.0
    hidden_angle: float = 0.0

    @classmethod
    def draw(
        cls,
        seed: int,
        frame: int,
        turns: bool,
        tilt_deg: float,
        hidden_deg: float,
    ) -> QuerySensor:
        """Returns a query's sensor with random yaw, tilt and occluded sector.

        The result depends on the frame's number but not on the drive, so that
        queries at the same frames of two drives have the same random yaw and
        tilt.

        Args:
            seed: seed of the random numbers.
            frame: frame of the query.
            turns: whether the query gets a random yaw.
            tilt_deg: greatest roll, and greatest pitch [deg].
            hidden_deg: angle of the occluded sector [deg].
        """
        rng = np.random.default_rng([seed, frame])
        yaw, hidden_from = rng.uniform(0.0, 2.0 * math.pi, 2)
        pitch, roll = rng.uniform(-1.0, 1.0, 2) * math.radians(tilt_deg)
        X_SQ = None
        if turns or tilt_deg > 0.0:
            angles = [yaw if turns else 0.0, pitch, roll]
            R_SQ = Rotation.from_euler("ZYX", angles).as_matrix()
            X_SQ = poses.make_pose(R_SQ, np.zeros(3))
        return cls(X_SQ, float(hidden_from), math.radians(hidden_deg))

    def without_hidden(self, scan: np.ndarray) -> np.ndarray:
        """Returns the points of a scan in S outside the occluded sector."""
        if self.hidden_angle == 0.0:
            return scan
        azimuth = np.arctan2(scan["y"], scan["x"]).astype(np.float64)
        turned = np.mod(azimuth - self.hidden_from, 2.0 * math.pi)
        # Points that are not finite are in no sector.
        return scan[~(turned < self.hidden_angle)]
