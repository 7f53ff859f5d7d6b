"""Places along a drive, and the clouds seen there.

- Places are d metres apart along the path: a frame is a place if it is the
  first frame at or beyond a multiple of d. The first frame of a drive is a
  place.
- Points are limited to a range, 100 m in the paper. The range of a point is the
  greatest absolute value of its x, y and z in the frame of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import points as clouds
from cns_drake.base import poses
from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError

# Frames closer than this are at the same place [m].
_LEAST_SPACING = 1e-6
# A standing receiver jitters by less than this [m].
_LEAST_MOVE = 0.5
# Within such a distance, no road makes a path longer than its chord by this
# factor.
_MOST_BENT = 1.1


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


def corners(positions: np.ndarray, apart: float) -> list[int]:
    """Returns indices of positions that are at least a given distance apart.

    The first index is 0. Each further index belongs to the next position that
    lies at least `apart` [m] from the previous position in the result.
    """
    points = positions.tolist()
    kept = [0]
    for index, point in enumerate(points):
        if math.dist(point, points[kept[-1]]) >= apart:
            kept.append(index)
    return kept


def travelled(positions: np.ndarray) -> np.ndarray:
    """Returns the path length (N,) up to each position (N, 3) [m].

    The jitter of a receiver that stands or creeps does not lengthen the path:
    the path is divided into parts whose ends lie 0.5 m apart, and a part that
    is much longer than the straight line between its ends counts as that line.
    """
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    ends = corners(positions, _LEAST_MOVE)
    if ends[-1] < len(steps):
        ends.append(len(steps))
    parts = np.add.reduceat(steps, ends[:-1]) if len(steps) else steps
    chords = np.linalg.norm(np.diff(positions[ends], axis=0), axis=1)
    is_jitter = parts > _MOST_BENT * chords
    scale = np.where(is_jitter, chords / np.where(is_jitter, parts, 1.0), 1.0)
    steps *= np.repeat(scale, np.diff(ends))
    return np.concatenate([[0.0], np.cumsum(steps)])


def sample_frames(positions: np.ndarray, spacing: float) -> np.ndarray:
    """Returns frames at a given spacing along a trajectory.

    Args:
        positions: (N, 3) positions of the sensor [m], at least one.
        spacing: distance between two frames, along the path [m].

    Returns:
        (K,) increasing frame numbers; the first is 0.
    """
    steps = travelled(positions) / max(spacing, _LEAST_SPACING)
    passed = np.floor(steps).astype(np.int64)
    return np.flatnonzero(np.diff(passed, prepend=-1) > 0)


def within_range(points: np.ndarray, max_range: float) -> np.ndarray:
    """Returns which points (N, 3) are finite and within a range, (N,) bool.

    Args:
        points: (N, 3) points in the frame of the sensor [m].
        max_range: greatest absolute value of each coordinate [m].
    """
    # One column at a time, because NumPy reduces slowly along a short axis. A
    # comparison with NaN is false, so NaN is out of range.
    x, y, z = np.abs(points.T)
    return (x <= max_range) & (y <= max_range) & (z <= max_range)


def gather(
    drive: Drive,
    frame: int,
    num_scans: int,
    max_range: float,
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
        max_range: greatest absolute x, y and z of a point in the sensor's frame
            [m].
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

    def seen(index: int) -> np.ndarray:
        scan = drive.scan(index)
        if sensor is not None:
            scan = sensor.without_hidden(scan)
        X_FS = X_FS0
        if index != frame:
            X_FS = X_S0W @ X_WS[index]
            if X_FS0 is not None:
                X_FS = X_FS0 @ X_FS
        return cropped(scan, max_range, X_FS, fields, drive.name)

    return clouds.read_only(np.concatenate([*map(seen, range(first, end))]))


def cropped(
    scan: np.ndarray,
    max_range: float,
    X_FS: np.ndarray | None = None,
    fields: tuple[str, ...] = (),
    source: str = "",
) -> np.ndarray:
    """Returns the points of a scan that are finite and within range.

    Args:
        scan: structured array (N,) in the frame S of a sensor.
        max_range: greatest absolute x, y and z of a point in F [m].
        X_FS: (4, 4) pose of the sensor in the frame F of the result; by default
            F is S.
        fields: names of further fields of the points, besides x, y and z.
        source: name of the drive, for error messages.

    Returns:
        (K, 3) float64 in F; with fields, a structured array (K,) of float64 x,
        y, z and the fields.

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
    p_F = clouds.xyz(scan)
    if X_FS is not None:
        x, y, z = p_F.T
        # Unlike a matrix product, products and sums that are computed one by
        # one are rounded in the same way on every processor.
        with np.errstate(invalid="ignore"):
            rows = [r[0] * x + r[1] * y + r[2] * z + r[3] for r in X_FS[:3]]
        p_F = np.stack(rows, axis=1)
    kept = within_range(p_F, max_range)
    p_F = p_F.compress(kept, axis=0)
    if not fields:
        return p_F
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
