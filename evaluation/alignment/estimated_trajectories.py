"""Errors of an estimated trajectory, such as the result of a LiDAR odometry.

Two measures are in common use. Let X_i be ground-truth poses, Y_i the estimated
poses at the same times, and p_i and q_i the positions of these poses:

- ATE, the absolute trajectory error: the root mean square of |p_i - R q_i - t|
  over all i. R and t are the rigid motion that minimises this error; the scale
  is not changed. J. Sturm et al., A benchmark for the evaluation of RGB-D SLAM
  systems, IROS 2012; S. Umeyama, Least-squares estimation of transformation
  parameters between two point patterns, PAMI 13(4), 1991. `evo_ape --align`
  prints the ATE as `rmse`.
- Drift over 100 m: the length and the angle of (Y_i^-1 Y_j)^-1 (X_i^-1 X_j),
  for every tenth pose i. Pose j is the first pose that lies more than 100 m of
  ground-truth path after pose i. A. Geiger et al., Are we ready for autonomous
  driving?, CVPR 2012, and the development kit of KITTI odometry. The kit
  divides each length by 100 m, and calls the mean of these ratios the
  translation error [%].
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
import math
from pathlib import Path
from typing import Literal
import warnings

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import InputError, poses, step_lengths
from cns_drake.drives import Drive, checked_poses
from evaluation.drives import StampedPoses, travelled

Frame = Literal["lidar", "base_link"]
# Length of the parts over which an odometry drifts [m].
SPAN = 100.0
# Number of poses from the beginning of one part to that of the next.
_STEP = 10
# With fewer poses, an alignment would leave hardly any error.
_LEAST_POSES = 3


@dataclass(frozen=True)
class TrajectoryErrors:
    """Errors of N estimated poses.

    Attributes:
        offsets: (N,) distances to the ground-truth positions after the
            alignment [m].
        drift: (K,) errors of position over 100 m [m]; empty if the path is
            shorter than 100 m.
        drift_deg: (K,) errors of orientation over 100 m [deg].
        length: length of the ground-truth path along the poses [m].
        drive_length: length of the path of the whole drive [m].
        num_outside: number of estimated poses that are left out because their
            times lie before or after the drive.
    """

    offsets: np.ndarray
    drift: np.ndarray
    drift_deg: np.ndarray
    length: float
    drive_length: float
    num_outside: int

    @property
    def ate(self) -> float:
        """The absolute trajectory error [m]."""
        return float(np.sqrt(np.mean(self.offsets**2)))

    def to_json(self) -> dict:
        """Returns the errors as a JSON object; drift is null if unknown."""
        drift: dict[str, float | None] = dict.fromkeys(
            (
                "drift_100m",
                "drift_100m_median",
                "drift_100m_90",
                "drift_100m_rotation_deg",
            )
        )
        if len(self.drift):
            values = (
                self.drift.mean(),
                *np.quantile(self.drift, (0.5, 0.9)),
                self.drift_deg.mean(),
            )
            drift = dict(zip(drift, map(float, values), strict=True))
        return {
            "poses": len(self.offsets),
            "poses_outside": self.num_outside,
            "length": self.length,
            "drive_length": self.drive_length,
            "ate": self.ate,
            "ate_median": float(np.median(self.offsets)),
            "ate_max": float(self.offsets.max()),
            "drift_segments": len(self.drift),
            **drift,
        }

    def to_rows(self) -> Iterator[tuple[str, str]]:
        """Yields the lines of a printed summary, as pairs (name, text)."""
        values = self.to_json()
        yield (
            "compared",
            f"{values['poses']} poses, {self.length:.0f} m of the drive's"
            f" {self.drive_length:.0f} m",
        )
        yield (
            "ATE",
            f"{self.ate:.3f} m  (median {values['ate_median']:.3f} m,"
            f" greatest {values['ate_max']:.3f} m)",
        )
        drift = "undefined  (the path is shorter)"
        if len(self.drift):
            drift = (
                f"{values['drift_100m']:.3f} m"
                f" and {values['drift_100m_rotation_deg']:.3f} deg"
                f"  (median {values['drift_100m_median']:.3f} m,"
                f" 90 % {values['drift_100m_90']:.3f} m,"
                f" {values['drift_segments']} parts)"
            )
        yield "drift over 100 m", drift


def trajectory_errors(
    drive: Drive,
    estimate: StampedPoses,
    frame: Frame = "lidar",
    time_offset: float = 0.0,
) -> TrajectoryErrors:
    """Returns the errors of an estimated trajectory of a drive.

    The drive's poses are interpolated at the estimate's times. The world frame
    of the estimate does not matter.

    Args:
        drive: drive with the ground-truth poses.
        estimate: estimated poses of `frame`, in any world.
        frame: the frame whose poses are estimated: the LiDAR's or the
            vehicle's.
        time_offset: time to add to the times of the estimate [s].

    Raises:
        InputError: if the estimate is of the vehicle but the drive has no poses
            of the vehicle, or if fewer than three of the estimate's times lie
            within the drive.
    """
    truth = _true_poses(drive, frame)
    stamps_ns = _shifted(estimate.stamps_ns, time_offset)
    own = truth.stamps_ns
    inside = (stamps_ns >= own[0]) & (stamps_ns <= own[-1])
    if inside.sum() < _LEAST_POSES:
        raise InputError(
            f"{estimate.path}: time: {inside.sum()} poses within that of the"
            f" drive, of {_LEAST_POSES} at least: the estimate spans"
            f" {_seconds_text(stamps_ns)}, {drive.name} {_seconds_text(own)}"
            f" ({_fitting_offset(estimate.stamps_ns, own)})"
        )
    X_WB, _ = truth.interpolate(stamps_ns[inside], "the estimated pose")
    Y_WB = estimate.X_WB[inside]
    _, _, E = segment_errors(X_WB, Y_WB)
    return TrajectoryErrors(
        aligned_offsets(X_WB[:, :3, 3], Y_WB[:, :3, 3]),
        np.linalg.norm(E[:, :3, 3], axis=1),
        np.degrees(Rotation.from_matrix(E[:, :3, :3]).magnitude()),
        float(travelled(X_WB[:, :3, 3])[-1]),
        float(travelled(truth.X_WB[:, :3, 3])[-1]),
        int((~inside).sum()),
    )


def _shifted(stamps_ns: np.ndarray, offset: float) -> np.ndarray:
    """Returns times [ns], moved by an offset [s].

    Raises:
        InputError: the offset is not finite, or int64 cannot hold the times.
    """
    if not math.isfinite(offset):
        raise InputError(f"--time-offset: {offset} is not a finite number")
    # Exact, unlike offset * 1e9: a double of ns since 1970 has steps of 256 ns.
    offset_ns = round(Fraction(offset) * 10**9)
    limits = np.iinfo(np.int64)
    ends = [one + offset_ns for one in stamps_ns[[0, -1]].tolist()]
    if not limits.min <= ends[0] <= ends[1] <= limits.max:
        raise InputError(
            f"--time-offset: {offset:g} s moves the times of the estimate"
            f" beyond {limits.max * 1e-9:.0f} s"
        )
    # The sum fits, even where the offset alone would not.
    return np.array([one + offset_ns for one in stamps_ns.tolist()], np.int64)


def _fitting_offset(estimate_ns: np.ndarray, drive_ns: np.ndarray) -> str:
    offset_ns = int(drive_ns[0]) - int(estimate_ns[0])
    return f"both begin together with --time-offset={offset_ns / 1e9:.3f}"


def aligned_offsets(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Returns the distances (N,) of estimates from the ground truth [m].

    The estimated positions are first moved and rotated so that they fit best.

    Args:
        p: (N, 3) ground-truth positions [m].
        q: (N, 3) estimated positions, in any frame [m].
    """
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    with warnings.catch_warnings():
        # For points on a straight line, several rotations are best; all have
        # the same error.
        warnings.filterwarnings("ignore", "Optimal rotation is not uniquely")
        R, *_ = Rotation.align_vectors(p, q)
    return np.asarray(np.linalg.norm(p - R.apply(q), axis=1))


def segment_errors(
    X: np.ndarray, Y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the errors of the motion over segments of 100 m of path.

    A segment begins at every tenth pose.

    Args:
        X: (N, 4, 4) ground-truth poses.
        Y: (N, 4, 4) estimated poses, in any world.

    Returns:
        For each segment of 100 m: (K,) index of its first pose; (K,) index of
        its last pose; and (K, 4, 4) error: the ground-truth last pose, in the
        frame of the estimated last pose, after both first poses were made
        equal.
    """
    # As KITTI's development kit: jitter of a receiver counts.
    along = np.concatenate([[0.0], np.cumsum(step_lengths(X[:, :3, 3]))])
    starts = np.arange(0, len(X), _STEP)
    ends = np.searchsorted(along, along[starts] + SPAN, "right")
    starts, ends = starts[ends < len(X)], ends[ends < len(X)]

    def motion(Z: np.ndarray) -> np.ndarray:
        return poses.inverse(Z[starts]) @ Z[ends]

    return starts, ends, poses.inverse(motion(Y)) @ motion(X)


def _true_poses(drive: Drive, frame: Frame) -> StampedPoses:
    """Returns the ground-truth poses of a drive, of the LiDAR or the car.

    Args:
        drive: the drive.
        frame: `lidar`, or `base_link` for the car.

    Raises:
        InputError: the drive has no poses of the car.
    """
    source = Path(drive.name)
    if frame == "lidar":
        return StampedPoses(source, drive.stamps_ns, drive.X_WS)
    rows = drive.odometry
    if rows is None:
        raise InputError(
            f"--frame: {drive.name} has poses of the LiDAR alone, none of"
            " base_link"
        )
    stamps_ns, order = np.unique(rows["stamp_ns"], return_index=True)
    rows = rows[order]
    X_WB = checked_poses(rows["position"], rows["quat_xyzw"], drive.name)
    return StampedPoses(source, stamps_ns, X_WB)


def _seconds_text(stamps_ns: np.ndarray) -> str:
    first, last = stamps_ns[[0, -1]].tolist()
    return f"{first * 1e-9:.3f} to {last * 1e-9:.3f} s"
