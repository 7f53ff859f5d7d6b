"""Confidence intervals by bootstrap over queries, in blocks of the route.

Right and wrong correlate along a drive: whole blocks of queries are drawn with
replacement (Kuensch, Annals of Statistics 17, 1989; here they do not overlap).
"""

from dataclasses import dataclass
import math

import numpy as np

from evaluation.drives.sampling import travelled
from evaluation.recognition.pr_curve import (
    areas_under,
    recall_of,
    weighted_counts,
)
from evaluation.recognition.query_outcomes import QueryOutcomes

# Length of a block of the route [m].
BLOCK_LENGTH = 100.0
_SAMPLES = 1000
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A confidence interval."""

    low: float
    high: float


def route_blocks(positions: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Returns the block (Q,) of the route in which each query lies.

    Args:
        positions: (N, 3) of the sensor along the drive [m].
        frames: (Q,) of the queries.
    """
    passed = travelled(positions)[frames] / BLOCK_LENGTH
    return np.floor(passed).astype(np.int64)


def resampled_weights(
    num_queries: int, seed: int = 0, blocks: np.ndarray | None = None
) -> np.ndarray:
    """Returns how often each query counts in each sample of a bootstrap.

    Args:
        num_queries: Q, one or more.
        seed: of the drawing; equal ones draw the same queries.
        blocks: (Q,) the block of each query; whole blocks are drawn, as many
            as there are. Each query is a block by default, and on a route
            that is shorter than two blocks.

    Returns:
        (B, Q) float64 counts; without blocks, each row of sum Q.
    """
    number, of_query = num_queries, np.arange(num_queries)
    if blocks is not None:
        known, of_query = np.unique(blocks, return_inverse=True)
        number = len(known)
        if number == 1:
            return resampled_weights(num_queries, seed)
    rng = np.random.default_rng([seed, number])
    draws = rng.integers(number, size=(_SAMPLES, number))
    return np.stack(
        [np.bincount(draw, minlength=number)[of_query] for draw in draws]
    ).astype(np.float64)


def resampled_metrics(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns AUC (B,) and R@1 (B,) of samples of the queries.

    Args:
        outcomes: outcomes of Q queries, all of which count.
        weights: (B, Q) how often each does in each sample.
    """
    _, tp, fp, fn = weighted_counts(outcomes, weights)
    # Nothing is accepted before a sample's first query; there the curve keeps
    # the precision of its first point.
    with np.errstate(invalid="ignore"):
        precision = tp / (tp + fp)
    areas = areas_under(_filled_from_right(precision), recall_of(tp, fn))
    with np.errstate(invalid="ignore"):
        recalls = (weights * outcomes.is_right).sum(axis=1) / (
            weights * outcomes.has_match
        ).sum(axis=1)
    return areas, recalls


def percentile_interval(samples: np.ndarray) -> Interval:
    """Returns the interval of 95 % of the samples; NaN do not count."""
    known = samples[~np.isnan(samples)]
    if len(known) == 0:
        return Interval(math.nan, math.nan)
    tail = 0.5 * (1.0 - _CONFIDENCE)
    low, high = np.quantile(known, [tail, 1.0 - tail])
    return Interval(float(low), float(high))


def bootstrap_intervals(
    outcomes: QueryOutcomes, seed: int
) -> tuple[Interval, Interval]:
    """Returns percentile intervals of AUC and R@1 over resampled blocks."""
    if len(outcomes) == 0:
        nothing = Interval(math.nan, math.nan)
        return nothing, nothing
    weights = resampled_weights(len(outcomes), seed, outcomes.blocks)
    areas, recalls = resampled_metrics(outcomes, weights)
    return percentile_interval(areas), percentile_interval(recalls)


def _filled_from_right(values: np.ndarray) -> np.ndarray:
    """Returns rows whose leading NaNs are replaced by the first number.

    A row without any number becomes zeros.
    """
    if values.shape[1] == 0:
        return values
    known = ~np.isnan(values)
    first = known.argmax(axis=1)
    rows = np.arange(len(values))
    start = np.where(known.any(axis=1), values[rows, first], 0.0)
    return np.where(known, values, start[:, None])
