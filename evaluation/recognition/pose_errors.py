"""Errors of the relative poses that methods estimate."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base import poses
from evaluation.recognition.precision_recall import pr_curve
from evaluation.recognition.query_outcomes import QueryOutcomes

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


@dataclass(frozen=True)
class PoseMetrics:
    """Quality of the poses of one method on one pair of drives.

    Medians and quantiles are over the accepted matches, see `is_accepted`.

    Attributes:
        num_accepted: number of accepted matches.
        translation_median, translation_90: median and 90 % quantile of the
            translation error [m]; NaN without an accepted match that has a
            pose.
        rotation_median_deg, rotation_90_deg: median and 90 % quantile of the
            rotation error [deg]; NaN without an accepted match that has a pose.
        success: share of the queries with a match whose estimated pose is
            within 2 m and 5 deg of the ground truth. Queries of every score
            count. NaN if the method estimates no poses or no query has a match.
    """

    num_accepted: int
    translation_median: float
    translation_90: float
    rotation_median_deg: float
    rotation_90_deg: float
    success: float


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


def is_accepted(outcomes: QueryOutcomes) -> np.ndarray:
    """Returns which queries are accepted matches, (Q,) bool.

    These are the queries whose top-ranked place is a match, and whose score
    reaches the threshold with the greatest F1. This F1 counts all queries,
    including queries without a match.
    """
    curve = pr_curve(outcomes)
    if not len(curve.thresholds):
        return np.zeros(len(outcomes), dtype=bool)
    # A comparison with NaN is false.
    least = curve.thresholds[curve.f1.argmax()]
    return outcomes.is_right & (outcomes.best_scores >= least)


def pose_metrics(errors: PoseErrors, outcomes: QueryOutcomes) -> PoseMetrics:
    """Returns a summary of the pose errors of a method on a pair of drives.

    Args:
        errors: errors of the poses of Q queries.
        outcomes: outcomes of the same queries.
    """
    accepted = is_accepted(outcomes)
    known = ~np.isnan(errors.translation)
    translation = errors.translation[accepted & known]
    rotation_deg = errors.rotation_deg[accepted & known]
    return PoseMetrics(
        num_accepted=int(accepted.sum()),
        translation_median=_quantile(translation, 0.5),
        translation_90=_quantile(translation, 0.9),
        rotation_median_deg=_quantile(rotation_deg, 0.5),
        rotation_90_deg=_quantile(rotation_deg, 0.9),
        success=pose_success(errors, outcomes),
    )


def pose_success(errors: PoseErrors, outcomes: QueryOutcomes) -> float:
    """Returns the pose success: a share of the queries with a match.

    A pose is a success within 2 m and 5 deg of the ground truth; see
    `PoseMetrics.success`.
    """
    # A method that finds no place localises no query.
    known = ~np.isnan(errors.translation)
    estimates = known.any() or np.isnan(outcomes.best_scores).all()
    if not (estimates and outcomes.has_match.any()):
        return math.nan
    is_near = (errors.translation <= SUCCESS_TRANSLATION) & (
        errors.rotation_deg <= SUCCESS_ROTATION_DEG
    )
    return float(is_near[outcomes.has_match].mean())


def _quantile(values: np.ndarray, part: float) -> float:
    return float(np.quantile(values, part)) if len(values) else math.nan
