"""Frames at equal distances along a drive.

Places are d metres apart along the path: a frame is a place if it is the first
frame at or beyond a multiple of d. The first frame of a drive is a place.
"""

import math

import numpy as np

from evaluation.base import step_lengths

# Frames closer than this are at the same place [m].
_LEAST_SPACING = 1e-6
# A standing receiver jitters by less than this [m].
_LEAST_MOVE = 0.5
# Within such a distance, no road makes a path longer than its chord by this
# factor.
_MOST_BENT = 1.1


def _corners(positions: np.ndarray) -> list[int]:
    """Returns indices of positions that are at least 0.5 m apart.

    The first index is 0. Each further index belongs to the next position that
    lies at least so far from the previous position in the result.
    """
    points = positions.tolist()
    kept = [0]
    for index, point in enumerate(points):
        if math.dist(point, points[kept[-1]]) >= _LEAST_MOVE:
            kept.append(index)
    return kept


def travelled(positions: np.ndarray) -> np.ndarray:
    """Returns the path length (N,) up to each position (N, 3) [m].

    The jitter of a receiver that stands or creeps does not lengthen the path:
    the path is divided into parts whose ends lie 0.5 m apart, and a part that
    is much longer than the straight line between its ends counts as that line.
    """
    if not len(positions):
        return np.zeros(0)
    steps = step_lengths(positions)
    ends = _corners(positions)
    if ends[-1] < len(steps):
        ends.append(len(steps))
    parts = np.add.reduceat(steps, ends[:-1]) if len(steps) else steps
    chords = step_lengths(positions[ends])
    is_jitter = parts > _MOST_BENT * chords
    scale = np.where(is_jitter, chords / np.where(is_jitter, parts, 1.0), 1.0)
    steps *= np.repeat(scale, np.diff(ends))
    return np.concatenate([[0.0], np.cumsum(steps)])


def sample_frames(positions: np.ndarray, spacing: float) -> np.ndarray:
    """Returns frames at a given spacing along a trajectory.

    Args:
        positions: (N, 3) positions of the sensor [m].
        spacing: distance between two frames, along the path [m].

    Returns:
        (K,) increasing frame numbers; the first is 0.
    """
    steps = travelled(positions) / max(spacing, _LEAST_SPACING)
    # Where poses are a whole number of metres apart, no last bit decides.
    passed = np.floor(steps.round(9)).astype(np.int64)
    return np.flatnonzero(np.diff(passed, prepend=-1) > 0)
