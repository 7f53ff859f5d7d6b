"""Registered pairs of keyframes, within a drive or between two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import poses
from evaluation.alignment.registration import register
from evaluation.alignment.submaps import Submaps

# Least share of two submaps with a counterpart, of all points and of upright
# things. In a simulated city that lost three quarters of its buildings, trees
# and poles, right pairs reach at least 0.71 and 0.69; 95 % of pairs that slid
# along a street, or are of other places, stay below 0.64 and 0.45.
_LEAST_FITNESS = 0.55
_LEAST_STRUCTURE = 0.55
# Greatest error of a guess that registration can correct [m].
_BASIN = 12.0
# Errors that ICP does not estimate: 0.2 degrees, 0.1 m.
_FLOOR = np.diag([np.radians(0.2) ** 2] * 3 + [0.1**2] * 3)


@dataclass(frozen=True)
class Loop:
    """A keyframe of a source registered to one of a target.

    Attributes:
        source: keyframe K of the source.
        target: keyframe L of the target.
        X_LK: (4, 4).
        covariance: (6, 6) of a small motion of K in L: turn [rad], move [m].
    """

    source: int
    target: int
    X_LK: np.ndarray
    covariance: np.ndarray


def close(
    source: Submaps, target: Submaps, k: int, place: int, X_LK: np.ndarray
) -> Loop | None:
    """Registers a keyframe of the source to one of the target.

    Args:
        source: a drive.
        target: another one, or the same.
        k: keyframe of the source.
        place: keyframe of the target.
        X_LK: (4, 4) guess of k's pose in the frame of the place.

    Returns:
        The loop; None if the two do not fit together.
    """
    moving, held = source.surface(k), target.surface(place)
    if moving is None or held is None:
        return None
    result = register(moving, held, X_LK)
    strayed = np.linalg.norm(result.X_TS[:3, 3] - X_LK[:3, 3])
    if (
        result.fitness < _LEAST_FITNESS
        or result.structure < _LEAST_STRUCTURE
        or strayed > _BASIN
    ):
        return None
    return Loop(k, place, result.X_TS, result.covariance + _FLOOR)


def loop_errors(
    loops: list[Loop], X_WL: np.ndarray, X_WK: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the disagreement of poses with loops.

    Args:
        loops: M of them.
        X_WL: poses (L, 4, 4) of the target's keyframes.
        X_WK: poses (K, 4, 4) of the source's keyframes.

    Returns:
        (M,) distances [m]; (M,) angles [rad].
    """
    expected = implied_poses(loops, X_WL)
    E = poses.inverse(expected) @ X_WK[[loop.source for loop in loops]]
    angles = Rotation.from_matrix(E[:, :3, :3]).magnitude()
    return np.linalg.norm(E[:, :3, 3], axis=1), angles


def implied_poses(loops: list[Loop], X_WL: np.ndarray) -> np.ndarray:
    """Returns the poses (M, 4, 4) that loops give to their keyframes."""
    X_LK = np.array([loop.X_LK for loop in loops]).reshape(-1, 4, 4)
    return X_WL[[loop.target for loop in loops]] @ X_LK
