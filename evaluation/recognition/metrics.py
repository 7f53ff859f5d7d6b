"""Recall, precision-recall curve, AUC and F1 of place recognition.

The definitions were derived from the paper's numbers. Only the top-ranked place
of each query counts:

- TP: accepted, and the top-ranked place is a true match,
- FP: accepted, and the top-ranked place is not a true match, whether or not the
  query has a match,
- FN: rejected, although the query has a match.

A rejected query without a match is neither TP, FP nor FN. A query without a
candidate is never accepted. In mode `all` every query counts; in mode
`filtered` only queries that have a match (in this mode, the greatest F1 follows
from R@1).

A query with a match and a wrong top-ranked place is FN while it is rejected,
and FP once it is accepted. Recall = TP / (TP + FN) therefore reaches 1 for
every method that has a top-ranked place for all queries. The strict AUC,
`auc_strict`, is the area under the curve with recall = TP / N instead, where N
is the number of queries with a match.

In both modes, R@N is the share of the queries with a match that have a match
among their N top-ranked places.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
import itertools
import math
from typing import Any, Literal

import numpy as np
from scipy.special import stdtr, stdtrit

from cns_drake.base.json_text import json_values
from evaluation.drives.sampling import travelled
from evaluation.recognition.precision_recall import (
    PrCurve,
    areas_under,
    pr_curve,
    recall_of,
    weighted_counts,
)
from evaluation.recognition.query_outcomes import QueryOutcomes

# Length of a block of the route [m].
BLOCK_LENGTH = 100.0
_SAMPLES = 1000
_CONFIDENCE = 0.95
Mode = Literal["all", "filtered"]
MODES: tuple[Mode, ...] = ("all", "filtered")

MAX_RANK = 25


@dataclass(frozen=True)
class Interval:
    """A 95 % confidence interval; its limits are NaN if it is unknown."""

    low: float = math.nan
    high: float = math.nan

    def to_json(self) -> list[float | None]:
        """Returns the lower and upper limit; NaN becomes None."""
        return [json_values(self.low), json_values(self.high)]


UNKNOWN = Interval()


def route_blocks(positions: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Returns the block (Q,) of the route in which each query lies.

    A block is a stretch of the route. The bootstrap samples whole blocks,
    because neighbouring queries tend to be right or wrong together.

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
        and the counts (B, Q), like those of `resampled_weights`.
    """
    known: dict[int, np.ndarray] = {}
    for drive, some in zip(drives, blocks, strict=True):
        known[drive] = np.union1d(known.get(drive, some), some)
    for drive, some in zip(drives, blocks, strict=True):
        number = len(known[drive])
        if number == 1:
            yield 1, resampled_weights(len(some), drive)
        else:
            of_query = np.searchsorted(known[drive], some)
            yield number, _block_counts(number, drive)[:, of_query]


def resampled_metrics(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns AUC, R@1 and strict AUC of B samples of queries, each (B,).

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
    return areas, recalls, stricts


@lru_cache(maxsize=1024)
def own_samples(
    outcomes: QueryOutcomes, seed: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns AUC, R@1 and strict AUC of B bootstrap samples, each (B,).

    Strict AUC is defined at `PrCurve.strict_auc`. The samples consist of whole
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
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns metrics of bootstrap samples, paired with samples of `other`.

    Sample k contains the same blocks of queries as sample k of
    `own_samples(other)`. The metrics of both methods or conditions can thus be
    subtracted, sample by sample.

    Args:
        outcomes: outcomes of Q queries.
        other: outcomes of as many queries with another method or condition.

    Returns:
        AUC, R@1 and strict AUC of the B samples of `outcomes`, each (B,).
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
    areas, recalls, _ = own_samples(outcomes, seed)
    return percentile_interval(areas), percentile_interval(recalls)


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


@dataclass(frozen=True)
class Difference:
    """The difference of two areas under precision-recall curves.

    Attributes:
        value: the first area minus the second.
        interval: 95 % interval.
        p_value: two-sided p-value under the hypothesis that there is no
            difference; NaN if a route has a single bootstrap block.
    """

    value: float
    interval: Interval
    p_value: float


def holm(p_values: np.ndarray) -> np.ndarray:
    """Returns p-values (N,) corrected for multiple tests, by Holm's method.

    NaN stays NaN and does not count as a test.
    """
    known = np.flatnonzero(~np.isnan(p_values))
    order = known[np.argsort(p_values[known], kind="stable")]
    steps = p_values[order] * np.arange(len(order), 0, -1)
    result = np.full(len(p_values), math.nan)
    result[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return result


def compared_by_auc(
    answers: Mapping[Hashable, Sequence[QueryOutcomes]],
    drives: Sequence[int] | None = None,
) -> dict[tuple[Any, Any], tuple[Difference, float]]:
    """Returns the difference of the mean AUC between any two methods.

    The mean is over one or more sets of queries. All queries count, with or
    without a match.

    The p-value comes from a t test. Several sets can have the same query drive.
    The variance of the sum over the sets of one drive comes from a bootstrap,
    whose samples contain the same blocks of the route for both methods and for
    all sets of the drive. With n blocks, this variance is multiplied by
    n/(n-1). Different drives are independent: their variances add up, and their
    degrees of freedom (n - 1 for each drive) add up.

    Args:
        answers: method -> its outcomes on each set of queries. The queries must
            be the same for all methods, and so must their blocks of the route,
            see `QueryOutcomes.blocks`.
        drives: for each set of queries, a number that identifies the drive. By
            default, each set belongs to a different drive.

    Returns:
        (first method, second method) -> AUC of the first minus AUC of the
        second; and the p-value, corrected by Holm's method for the number of
        differences.
    """
    sets = list(zip(*answers.values(), strict=True))
    drives = range(len(sets)) if drives is None else drives
    blocks = [one[0].own_blocks for one in sets]
    of_drive: dict[int, int] = {}
    sums: dict[int, Any] = {}
    drawn = weights_by_drive(blocks, drives)
    for drive, some, (number, weights) in zip(drives, sets, drawn, strict=True):
        samples = [resampled_metrics(one, weights)[0] for one in some]
        sums[drive] = sums.get(drive, 0.0) + np.array(samples)
        of_drive[drive] = number
    numbers = np.array(list(of_drive.values()))
    areas = [[pr_curve(one).auc for one in some] for some in sets]

    def difference(first: int, second: int) -> Difference:
        value = float(np.mean([some[first] - some[second] for some in areas]))
        if (numbers < 2).any():
            return Difference(value, UNKNOWN, math.nan)
        samples = [some[first] - some[second] for some in sums.values()]
        variances = np.var(samples, axis=1) * numbers / (numbers - 1)
        spread = math.sqrt(variances.sum()) / len(sets)
        freedom = (numbers - 1).sum()
        margin = float(stdtrit(freedom, 0.975)) * spread
        p_value = 1.0
        if spread > 0.0:
            p_value = 2.0 * float(stdtr(freedom, -abs(value) / spread))
        interval = Interval(value - margin, value + margin)
        return Difference(value, interval, p_value)

    pairs = list(itertools.combinations(range(len(answers)), 2))
    found = [difference(*pair) for pair in pairs]
    corrected = holm(np.array([one.p_value for one in found])).tolist()
    names = itertools.combinations(answers, 2)
    return dict(zip(names, zip(found, corrected, strict=True), strict=True))


@dataclass(frozen=True)
class PlaceRecognitionMetrics:
    """The scores of one method on one pair of drives.

    Attributes:
        mode: which queries the precision-recall curve counts: `all`, or only
            queries with a match (`filtered`).
        curve: exact precision-recall curve.
        auc: area under the curve.
        auc_strict: area under the curve with recall = TP / N at each of its
            points.
        f1_max: greatest F1 on the curve; 0 if nothing is accepted.
        f1_max_index: index of the point of the curve with this F1; None if the
            curve is empty.
        recall_at_n: (25,) R@1 to R@25.
        recall_at_1_percent: R@N, where N is a hundredth of the number of
            places.
        num_queries: number of queries.
        num_with_match: N, the number of queries with a match.
        num_right: number of queries whose top-ranked place is right. R@1 =
            num_right / N.
        auc_interval: 95 % interval of `auc`, by bootstrap over blocks of the
            route.
        recall_at_1_interval: 95 % interval of R@1, by the same bootstrap.

    Example:
        from evaluation import evaluate, judge

        print(evaluate(judge(scores, matches), "filtered").f1_max)
    """

    mode: Mode
    curve: PrCurve
    auc: float
    auc_strict: float
    f1_max: float
    f1_max_index: int | None
    recall_at_n: np.ndarray
    recall_at_1_percent: float
    num_queries: int
    num_with_match: int
    num_right: int
    auc_interval: Interval
    recall_at_1_interval: Interval

    @property
    def areas(self) -> dict[str, float]:
        """AUC, R@1 and strict AUC, by their names in tables."""
        return {
            "auc": self.auc,
            "r1": self.recall_at_1,
            "auc_strict": self.auc_strict,
        }

    @property
    def recall_at_1(self) -> float:
        """R@1: share of right answers among the queries with a match."""
        return float(self.recall_at_n[0])


def areas(outcomes: QueryOutcomes) -> dict[str, float]:
    """Returns AUC, R@1 and strict AUC, by their names in tables."""
    curve = pr_curve(outcomes)
    return {
        "auc": curve.auc,
        "r1": outcomes.recall_at(1),
        "auc_strict": curve.strict_auc(int(outcomes.has_match.sum())),
    }


def evaluate(
    outcomes: QueryOutcomes, mode: Mode = "all", seed: int = 0
) -> PlaceRecognitionMetrics:
    """Returns the scores of one method on one pair of drives.

    Args:
        outcomes: outcome of each query.
        mode: which queries the precision-recall curve counts: `all`, or only
            queries with a match (`filtered`).
        seed: seed of the bootstrap.

    Example:
        from evaluation import evaluate, judge

        print(evaluate(judge(scores, matches)).recall_at_1)
    """
    counted = outcomes
    if mode == "filtered":
        counted = outcomes.subset(outcomes.has_match)
    curve = pr_curve(counted)
    num_with_match = int(outcomes.has_match.sum())
    best = int(curve.f1.argmax()) if len(curve.thresholds) else None
    auc_interval, recall_interval = bootstrap_intervals(counted, seed)
    values = areas(counted)
    return PlaceRecognitionMetrics(
        mode=mode,
        curve=curve,
        auc=values["auc"],
        auc_strict=values["auc_strict"],
        f1_max=0.0 if best is None else float(curve.f1[best]),
        f1_max_index=best,
        recall_at_n=np.array(
            [outcomes.recall_at(rank) for rank in range(1, MAX_RANK + 1)]
        ),
        recall_at_1_percent=outcomes.recall_at(outcomes.one_percent_rank),
        num_queries=len(outcomes),
        num_with_match=num_with_match,
        num_right=int(outcomes.is_right.sum()),
        auc_interval=auc_interval,
        recall_at_1_interval=recall_interval,
    )
