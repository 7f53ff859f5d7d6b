"""Recall, precision-recall curve, AUC and F1 of place recognition.

The definitions were derived from the paper's numbers. Each query counts with
its best place only:

- TP: accepted, and the best place is a true match,
- FP: accepted, and it is not, whether or not the query has a match at all,
- FN: rejected, although the query has a match.

A rejected query without a match counts nowhere. A query without a candidate
is never accepted. In mode `all` every query counts; in mode `filtered` only
those that have a match (then F1max carries no more than recall at 1).

In both modes R@N is the part of the queries with a match that have a match
among their N best places.
"""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Literal

import numpy as np

Mode = Literal["all", "filtered"]
MODES: tuple[Mode, ...] = ("all", "filtered")

MAX_RANK = 25
_BOOTSTRAP_SAMPLES = 1000
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class QueryOutcomes:
    """The outcomes of Q queries.

    Attributes:
        best_scores: (Q,) score of the best place; NaN without a candidate.
        is_right: (Q,) bool, whether the best place is a true match.
        has_match: (Q,) bool, whether the database holds a true match.
        first_right_ranks: (Q,) rank of the best true match, from 1 on;
            infinite if no candidate is one.
        num_places: size of the database.

    Example:
        from evaluation import judge

        print(judge(scores, matches).recall_at(5))
    """

    best_scores: np.ndarray
    is_right: np.ndarray
    has_match: np.ndarray
    first_right_ranks: np.ndarray
    num_places: int

    def __len__(self) -> int:
        return len(self.best_scores)

    def subset(self, kept: np.ndarray) -> QueryOutcomes:
        """Returns the outcomes of some of the queries, (Q,) bool."""
        return QueryOutcomes(
            self.best_scores[kept],
            self.is_right[kept],
            self.has_match[kept],
            self.first_right_ranks[kept],
            self.num_places,
        )

    def recall_at(self, rank: int) -> float:
        """Returns R@N; NaN if no query has a match."""
        return _mean(self.first_right_ranks[self.has_match] <= rank)

    @property
    def mean_reciprocal_rank(self) -> float:
        """Mean of 1 / rank of the best true match, over queries with one.

        A query without a match among its candidates counts 0. NaN if no query
        has a match.
        """
        return _mean(1.0 / self.first_right_ranks[self.has_match])

    @property
    def match_auroc(self) -> float:
        """The best score's power to separate queries with a match from others.

        The area under the receiver operating characteristic: the chance that
        a query with a match has a higher best score than one without; equal
        scores count half, and no candidate is the lowest score. NaN if all or
        none of the queries have a match.
        """
        num_with = int(self.has_match.sum())
        num_without = len(self) - num_with
        if num_with == 0 or num_without == 0:
            return math.nan
        scores = np.where(np.isnan(self.best_scores), -np.inf, self.best_scores)
        # This is the sum of ranks of Mann and Whitney's U test; equal scores
        # share the mean of their ranks.
        _, of_score, counts = np.unique(
            scores, return_inverse=True, return_counts=True
        )
        mean_ranks = np.cumsum(counts) - 0.5 * (counts - 1)
        ranks = mean_ranks[of_score][self.has_match].sum()
        wins = ranks - 0.5 * num_with * (num_with + 1)
        return float(wins / (num_with * num_without))

    @property
    def one_percent_rank(self) -> int:
        """The N of R@1%: a hundredth of the database, at least 1."""
        return max(1, round(0.01 * self.num_places))


@dataclass(frozen=True)
class PrCurve:
    """Precision over recall at every distinct score, best scores first.

    Attributes:
        thresholds: (K,) scores from which on a place is accepted,
            decreasing.
        true_positives: (K,) TP at each.
        false_positives: (K,) FP.
        false_negatives: (K,) FN.
    """

    thresholds: np.ndarray
    true_positives: np.ndarray
    false_positives: np.ndarray
    false_negatives: np.ndarray

    @property
    def precision(self) -> np.ndarray:
        """(K,); every threshold accepts at least one query."""
        return self.true_positives / (
            self.true_positives + self.false_positives
        )

    @property
    def recall(self) -> np.ndarray:
        """(K,); 0 if there is nothing to recall."""
        return _recall(self.true_positives, self.false_negatives)

    @property
    def f1(self) -> np.ndarray:
        """(K,) 2 TP / (2 TP + FP + FN)."""
        return 2.0 * self.true_positives / (self.true_positives + self.counted)

    @property
    def counted(self) -> np.ndarray:
        """(K,) T = TP + FP + FN."""
        return self.true_positives + self.false_positives + self.false_negatives

    @property
    def auc(self) -> float:
        """Area under the curve, by trapezoids over the recalls it reaches.

        From recall 0 to its first point the curve keeps that point's
        precision. 0 if nothing is ever accepted.
        """
        return float(_area(self.precision[None], self.recall[None])[0])

    @property
    def recall_at_full_precision(self) -> float:
        """Greatest recall without a false positive; 0 if none."""
        return float(self.recall[self.false_positives == 0].max(initial=0.0))


@dataclass(frozen=True)
class Interval:
    """A confidence interval."""

    low: float
    high: float


@dataclass(frozen=True)
class PlaceRecognitionMetrics:
    """The numbers of one pair of drives and one method.

    Attributes:
        mode: the queries that the curve counts.
        curve: the exact precision-recall curve.
        auc: area under it.
        f1_max: greatest F1 on it; 0 if nothing is accepted.
        f1_max_index: its point on the curve; None if that is empty.
        recall_at_n: (25,) R@1 to R@25.
        recall_at_1_percent: R@N for a hundredth of the database.
        num_queries: queries asked.
        num_with_match: N, the number of queries with a match.
        num_right: TP with every candidate accepted: the queries whose best
            place is right. R@1 = num_right / N.
        auc_interval: 95 % bootstrap interval over the queries.
        recall_at_1_interval: likewise.

    Example:
        from evaluation import evaluate, judge

        print(evaluate(judge(scores, matches), "filtered").f1_max)
    """

    mode: Mode
    curve: PrCurve
    auc: float
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
    def recall_at_1(self) -> float:
        return float(self.recall_at_n[0])


def judge(scores: np.ndarray, matches: np.ndarray) -> QueryOutcomes:
    """Reduces the scores of all pairs to the outcome of each query.

    If two places have equal scores, the first one in the database is better.

    Args:
        scores: (Q, D), higher is more similar; NaN is no candidate.
        matches: (Q, D) bool, the truth.

    Raises:
        ValueError: scores are complex, masked or not numbers, or the two shapes
            differ.

    Example:
        from evaluation import judge, retrieve

        found = retrieve(database, query, method)
        outcomes = judge(found.scores, found.matches)
    """
    values = np.asarray(scores)
    if isinstance(scores, np.ma.MaskedArray) or values.dtype.kind not in "biuf":
        raise ValueError(
            f"scores are {type(scores).__name__} of {values.dtype}, not plain"
            " numbers with NaN where a place is no candidate"
        )
    if values.ndim != 2 or values.shape != np.shape(matches):
        raise ValueError(
            f"scores of shape {values.shape}, matches of {np.shape(matches)}"
        )
    scores = np.asarray(values, dtype=np.float64)
    num_queries, num_places = scores.shape
    first_right = np.full(num_queries, np.inf)
    best_scores = np.full(num_queries, np.nan)
    # One row at a time: a second array of all pairs of long drives could fill
    # the memory.
    for query, (row, is_match) in enumerate(zip(scores, matches, strict=True)):
        candidates = np.flatnonzero(~np.isnan(row))
        if len(candidates) == 0:
            continue
        found = row[candidates]
        best_scores[query] = found.max()
        right = np.flatnonzero(is_match[candidates])
        if len(right):
            first = right[found[right].argmax()]
            better = found > found[first]
            better[:first] |= found[:first] == found[first]
            first_right[query] = 1.0 + np.count_nonzero(better)
    return QueryOutcomes(
        best_scores=best_scores,
        is_right=first_right == 1.0,
        has_match=np.any(matches, axis=1),
        first_right_ranks=first_right,
        num_places=num_places,
    )


def evaluate(
    outcomes: QueryOutcomes, mode: Mode = "all", seed: int = 0
) -> PlaceRecognitionMetrics:
    """Computes all numbers of one pair and method.

    Args:
        outcomes: of the queries.
        mode: selects the queries of the precision-recall curve.
        seed: of the bootstrap.

    Example:
        from evaluation import evaluate, judge

        print(evaluate(judge(scores, matches)).recall_at_1)
    """
    counted = outcomes
    if mode == "filtered":
        counted = outcomes.subset(outcomes.has_match)
    thresholds, tp, fp, fn = _curves(counted, np.ones((1, len(counted))))
    curve = PrCurve(
        thresholds,
        tp[0].astype(np.int64),
        fp[0].astype(np.int64),
        fn[0].astype(np.int64),
    )
    best = int(curve.f1.argmax()) if len(thresholds) else None
    auc_interval, recall_interval = _bootstrap(counted, seed)
    return PlaceRecognitionMetrics(
        mode=mode,
        curve=curve,
        auc=curve.auc,
        f1_max=0.0 if best is None else float(curve.f1[best]),
        f1_max_index=best,
        recall_at_n=np.array(
            [outcomes.recall_at(rank) for rank in range(1, MAX_RANK + 1)]
        ),
        recall_at_1_percent=outcomes.recall_at(outcomes.one_percent_rank),
        num_queries=len(outcomes),
        num_with_match=int(outcomes.has_match.sum()),
        num_right=int(outcomes.is_right.sum()),
        auc_interval=auc_interval,
        recall_at_1_interval=recall_interval,
    )


def area(outcomes: QueryOutcomes) -> float:
    """Returns the AUC of queries, all of which count."""
    _, tp, fp, fn = _curves(outcomes, np.ones((1, len(outcomes))))
    return float(_area(tp / (tp + fp), _recall(tp, fn))[0])


def _curves(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Counts TP, FP and FN at every distinct score, queries weighted.

    Args:
        outcomes: of Q queries.
        weights: (B, Q) how often each query counts, in each of B samples.

    Returns:
        (K,) thresholds, decreasing; (B, K) TP; (B, K) FP; (B, K) FN.
    """
    answered = np.flatnonzero(~np.isnan(outcomes.best_scores))
    order = answered[np.argsort(-outcomes.best_scores[answered], kind="stable")]
    scores = outcomes.best_scores[order]
    # The last query of each group of equal scores: all of them are accepted
    # together.
    is_last = np.ones(len(scores), dtype=bool)
    is_last[:-1] = scores[1:] != scores[:-1]
    ends = np.flatnonzero(is_last)

    def accepted(counts: np.ndarray) -> np.ndarray:
        return np.cumsum(weights[:, order] * counts[order], axis=1)[:, ends]

    tp = accepted(outcomes.is_right)
    fp = accepted(~outcomes.is_right)
    with_match = (weights * outcomes.has_match).sum(axis=1, keepdims=True)
    fn = with_match - accepted(outcomes.has_match)
    return scores[ends], tp, fp, fn


def resampled_weights(num_queries: int, seed: int = 0) -> np.ndarray:
    """Returns how often each query counts in each sample of a bootstrap.

    Args:
        num_queries: Q, one or more.
        seed: of the drawing; equal ones draw the same queries.

    Returns:
        (B, Q) float64 counts, each row of sum Q.
    """
    rng = np.random.default_rng([seed, num_queries])
    draws = rng.integers(num_queries, size=(_BOOTSTRAP_SAMPLES, num_queries))
    return np.stack(
        [np.bincount(draw, minlength=num_queries) for draw in draws]
    ).astype(np.float64)


def resampled_metrics(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns AUC (B,) and R@1 (B,) of samples of the queries.

    Args:
        outcomes: of Q queries, all of which count.
        weights: (B, Q) how often each does in each sample.
    """
    _, tp, fp, fn = _curves(outcomes, weights)
    # Nothing is accepted before a sample's first query; there the curve keeps
    # the precision of its first point.
    with np.errstate(invalid="ignore"):
        precision = tp / (tp + fp)
    areas = _area(_filled_from_right(precision), _recall(tp, fn))
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


def _bootstrap(outcomes: QueryOutcomes, seed: int) -> tuple[Interval, Interval]:
    """Returns percentile intervals of AUC and R@1 over resampled queries."""
    if len(outcomes) == 0:
        nothing = Interval(math.nan, math.nan)
        return nothing, nothing
    weights = resampled_weights(len(outcomes), seed)
    areas, recalls = resampled_metrics(outcomes, weights)
    return percentile_interval(areas), percentile_interval(recalls)


def _area(precision: np.ndarray, recall: np.ndarray) -> np.ndarray:
    """Returns the areas (B,) under curves (B, K), K possibly 0."""
    if precision.shape[1] == 0:
        return np.zeros(len(precision))
    start = precision[:, :1] * recall[:, :1]
    heights = 0.5 * (precision[:, 1:] + precision[:, :-1])
    widths = np.diff(recall, axis=1)
    return start[:, 0] + (heights * widths).sum(axis=1)


def _recall(tp: np.ndarray, fn: np.ndarray) -> np.ndarray:
    """Returns TP / (TP + FN), 0 if there is nothing to recall."""
    return tp / np.maximum(tp + fn, 1)


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


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else math.nan
