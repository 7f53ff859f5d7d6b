"""Errors of the relative poses that methods estimate."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base import poses

# Greatest errors of a localised query's pose.
SUCCESS_TRANSLATION = 2.0
SUCCESS_ROTATION_DEG = 5.0


@dataclass(frozen=True)
class PoseErrors:
    """Errors of the pose of each of Q queries relative to its top-ranked place.

    Attributes:
        translation: (Q,) distance to the ground-truth position [m]; NaN without
            a candidate or a pose.
        rotation_deg: (Q,) angle to the ground-truth orientation [deg]; NaN
            without a candidate or a pose.
    """

    translation: np.ndarray
    rotation_deg: np.ndarray

    @classmethod
    def unknown(cls, num_queries: int) -> PoseErrors:
        """Returns the errors of a method that estimates no poses: NaN."""
        return cls(np.full(num_queries, np.nan), np.full(num_queries, np.nan))


def pose_error(
    X_PQ: np.ndarray, X_WP: np.ndarray, X_WQ: np.ndarray
) -> tuple[float, float]:
    """Returns the error of an estimated pose, in metres and in degrees.

    Args:
        X_PQ: (4, 4) estimated pose of the query's sensor in the frame of the
            place's sensor.
        X_WP: (4, 4) ground-truth pose of the place's sensor in the world.
        X_WQ: (4, 4) ground-truth pose of the query's sensor in the world.
    """
    X_error = poses.inverse(X_WQ) @ X_WP @ X_PQ
    # Sine and cosine together give exact small and large angles.
    R = X_error[:3, :3]
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    angle = math.atan2(float(np.linalg.norm(axis)), float(np.trace(R)) - 1.0)
    return float(np.linalg.norm(X_error[:3, 3])), math.degrees(angle)
