"""Places along a drive, and the clouds seen there.

- Places d metres apart: frame i is one when the length of the path so far
  first reaches a multiple of d. The first frame is one.
- Points are limited to [-100, 100] m, as the paper has it: each of x, y, z in
  the frame of the sensor.
"""

from __future__ import annotations

import numpy as np

from evaluation.geometry import points as point_arrays
from evaluation.geometry import poses
from evaluation.sequences.sequence import Sequence

# [m]
CROP = 100.0


def sample_frames(positions: np.ndarray, spacing: float) -> np.ndarray:
    """Returns frames at equal distances along a trajectory.

    Args:
        positions: (N, 3) [m], N >= 1.
        spacing: between two frames, along the path [m].

    Returns:
        (K,) increasing frame numbers; the first is 0.
    """
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    passed = np.floor(travelled / spacing).astype(np.int64)
    return np.flatnonzero(np.diff(passed, prepend=-1) > 0)


def crop(points: np.ndarray) -> np.ndarray:
    """Returns the finite points (N, 3) within the limits of the protocol."""
    kept = np.ones(len(points), dtype=bool)
    # By column: NumPy is slow in reducing along the shorter axis.
    for coordinates in points.T:
        # A comparison with NaN is false.
        kept &= np.abs(coordinates) <= CROP
    return points.compress(kept, axis=0)


def gather(sequence: Sequence, frame: int, num_scans: int) -> np.ndarray:
    """Returns the cloud that a method describes at a frame.

    Args:
        sequence: the drive.
        frame: the first scan.
        num_scans: how many consecutive scans are merged; fewer at the end
            of the drive.

    Returns:
        (N, 3) float64, cropped, in the sensor frame of the first scan.
    """
    last = min(frame + num_scans, len(sequence))
    X_WS = sequence.X_WS
    X_S0W = poses.inverse(X_WS[frame])
    clouds = []
    for index in range(frame, last):
        cloud = point_arrays.xyz(sequence.scan(index))
        if index > frame:
            cloud = poses.transform(X_S0W @ X_WS[index], cloud)
        clouds.append(cloud)
    return crop(np.concatenate(clouds))
