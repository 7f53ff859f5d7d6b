"""Confidence intervals of place recognition, by bootstrap over the route.

Neighbouring queries along a drive tend to be right or wrong together. Therefore
whole blocks of the route are sampled, with all queries in them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np

from cns_drake.base import json_values
from evaluation.drives import travelled
from evaluation.recognition.precision_recall import (
    areas_under,
    recall_of,
    weighted_counts,
)
from evaluation.recognition.query_outcomes import QueryOutcomes

# Length of a block of the route [m].
BLOCK_LENGTH = 100.0
# Number of bootstrap samples.
_SAMPLES = 1000
# Probability with which an interval contains the value.
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A 95 % confidence interval; its limits are NaN if it is unknown."""

    low: float = math.nan
    high: float = math.nan

    def to_json(self) -> list[float | None]:
        """Returns the lower and upper limit; NaN becomes None."""
        return [json_values(self.low), json_values(self.high)]


UNKNOWN = Interval()


class SampledMetrics(NamedTuple):
    """The metrics of B bootstrap samples, in the order of tables.

    Attributes:
        auc: (B,) AUC.
        r1: (B,) R@1.
        auc_strict: (B,) strict AUC, see `PrCurve.strict_auc`.
    """

    auc: np.ndarray
    r1: np.ndarray
    auc_strict: np.ndarray


def route_blocks(positions: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Returns the block (Q,) of the route in which each query lies.

    A block is a stretch of the route. Bootstrap samples consist of whole
    blocks, because neighbouring queries tend to be right or wrong together.

    Args:
        positions: (N, 3) positions of the sensor along the drive [m].
        frames: (Q,) frame numbers of the queries.

    Example:
        from evaluation import evaluate, judge, route_blocks

        blocks = route_blocks(query.X_WS[:, :3, 3], queries)
        print(evaluate(judge(scores, matches, blocks)).auc_interval)
    """
    passed = travelled(positions)[frames] / BLOCK_LENGTH
    return np.floor(passed).astype(np.int64)


def resampled_weights(
    num_queries: int, seed: int = 0, blocks: np.ndarray | None = None
) -> np.ndarray:
    """Returns the number of times each query is in each bootstrap sample.

    Neighbouring queries along a drive tend to be right or wrong together.
    Therefore whole blocks of queries are sampled with replacement (Kuensch,
    Annals of Statistics 17, 1989; here blocks do not overlap).

    Args:
        num_queries: Q, one or more.
        seed: seed of the random sampling; equal seeds give the same samples.
        blocks: (Q,) the block of each query. Each sample contains as many
            blocks as exist. By default, and on routes shorter than two blocks,
            each query is a block of its own.

    Returns:
        (B, Q) float64 counts. Without blocks, each row sums to Q.
    """
    number = num_queries
    of_query = np.arange(num_queries)
    if blocks is not None:
        known, of_query = np.unique(blocks, return_inverse=True)
        number = len(known)
        if number == 1:
            return resampled_weights(num_queries, seed)
    return _block_counts(number, seed)[:, of_query]


def _block_counts(number: int, seed: int) -> np.ndarray:
    """Returns how often each of `number` blocks is in each sample, float64."""
    rng = np.random.default_rng([seed, number])
    draws = rng.integers(number, size=(_SAMPLES, number))
    return np.stack(
        [np.bincount(draw, minlength=number) for draw in draws]
    ).astype(np.float64)


def weights_by_drive(
    blocks: Sequence[np.ndarray], drives: Sequence[int]
) -> Iterator[tuple[int, np.ndarray]]:
    """Yields how often queries are in bootstrap samples, for sets of queries.

    Sets of queries of one drive are not independent: where the streets suit a
    method, the method tends to be right under all conditions. Therefore samples
    of the sets of one drive contain the same blocks. Different drives are
    sampled independently.

    Args:
        blocks: for each set, the block (Q,) of the route of each query.
        drives: for each set, a number that identifies the drive, and is the
            seed of its samples.

    Yields:
        For each set, the number of different blocks in all sets of its drive,
        and the counts (B, Q), as `resampled_weights` returns them.
    """
    known: dict[int, np.ndarray] = {}
    for drive, of_set in zip(drives, blocks, strict=True):
        known[drive] = np.union1d(known.get(drive, of_set), of_set)
    for drive, of_set in zip(drives, blocks, strict=True):
        number = len(known[drive])
        if number == 1:
            yield 1, resampled_weights(len(of_set), drive)
        else:
            of_query = np.searchsorted(known[drive], of_set)
            yield number, _block_counts(number, drive)[:, of_query]


def resampled_metrics(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> SampledMetrics:
    """Returns AUC, R@1 and strict AUC of B samples of queries.

    Args:
        outcomes: outcomes of Q queries, all of which count.
        weights: (B, Q) how often each query counts in each sample.
    """
    _, tp, fp, fn = weighted_counts(outcomes, weights)
    # Before a sample's first query nothing is accepted; the curve there has the
    # precision of its first point.
    with np.errstate(invalid="ignore"):
        precision = tp / (tp + fp)
    precision = _filled_from_right(precision)
    areas = areas_under(precision, recall_of(tp, fn))
    with_match = (weights * outcomes.has_match).sum(axis=1)
    stricts = areas_under(precision, recall_of(tp, with_match[:, None] - tp))
    with np.errstate(invalid="ignore"):
        recalls = (weights * outcomes.is_right).sum(axis=1) / with_match
    return SampledMetrics(areas, recalls, stricts)


@lru_cache(maxsize=1024)
def own_samples(outcomes: QueryOutcomes, seed: int = 0) -> SampledMetrics:
    """Returns AUC, R@1 and strict AUC of B bootstrap samples.

    The samples consist of whole
    blocks of the queries' route, see `resampled_weights`. The samples are
    cached, so several comparisons use the same samples.

    Args:
        outcomes: outcomes of the queries.
        seed: seed of the random sampling.
    """
    weights = resampled_weights(len(outcomes), seed, outcomes.blocks)
    return resampled_metrics(outcomes, weights)


def paired_samples(
    outcomes: QueryOutcomes, other: QueryOutcomes
) -> SampledMetrics:
    """Returns metrics of bootstrap samples, paired with samples of `other`.

    Sample k contains the same blocks of queries as sample k of
    `own_samples(other)`. The metrics of both methods or conditions can thus be
    subtracted, sample by sample.

    Args:
        outcomes: outcomes of Q queries.
        other: outcomes of as many queries with another method or condition.
    """
    if np.array_equal(outcomes.own_blocks, other.own_blocks):
        return own_samples(outcomes)
    weights = resampled_weights(len(other), blocks=other.blocks)
    return resampled_metrics(outcomes, weights)


def percentile_interval(samples: np.ndarray) -> Interval:
    """Returns the interval that contains the middle 95 % of samples.

    NaN does not count as a sample.
    """
    known = samples[~np.isnan(samples)]
    if len(known) == 0:
        return UNKNOWN
    tail = 0.5 * (1.0 - _CONFIDENCE)
    low, high = np.quantile(known, [tail, 1.0 - tail])
    return Interval(float(low), float(high))


def bootstrap_intervals(
    outcomes: QueryOutcomes, seed: int
) -> tuple[Interval, Interval]:
    """Returns 95 % intervals of AUC and of R@1, by bootstrap.

    Each bootstrap sample consists of whole blocks of the queries' route.

    Args:
        outcomes: outcomes of the queries.
        seed: seed of the random sampling.
    """
    if len(outcomes) == 0:
        return UNKNOWN, UNKNOWN
    samples = own_samples(outcomes, seed)
    return percentile_interval(samples.auc), percentile_interval(samples.r1)


def _filled_from_right(values: np.ndarray) -> np.ndarray:
    """Returns rows whose leading NaNs are replaced by the first number.

    A row without any number becomes zeros.
    """
    if values.shape[1] == 0:
        return values
    known = ~np.isnan(values)
    first = known.argmax(axis=1)[:, None]
    start = np.nan_to_num(np.take_along_axis(values, first, axis=1))
    return np.where(known, values, start)
