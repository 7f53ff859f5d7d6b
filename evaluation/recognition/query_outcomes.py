"""The outcome of each query of place recognition, and the curve of all.

The definitions of the precision-recall curve were derived from the paper's
numbers. Only the top-ranked place of each query counts:

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
every method that has a top-ranked place for all queries. The strict AUC is the
area under another curve, see `PrCurve.strict_auc`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
import math
from typing import NamedTuple

import numpy as np

from evaluation.base import poses, read_only

# With fewer places, sorting all of them is as quick.
_MANY = 2000
# Overlap below which two scans show different surroundings.
_ENOUGH_OVERLAP = 0.5
# Greatest errors of a localised query's pose [m], [deg].
_SUCCESS = 2.0, 5.0
# Reasons for wrong top-ranked places, in order of precedence.
FAULTS = ("no_place", "no_candidate", "other_city", "near_miss", "elsewhere")
# Up to this multiple of the radius, a wrong place is `near_miss`; beyond it,
# `elsewhere`.
_NEARLY = 2.0


@dataclass(frozen=True, eq=False)
class QueryOutcomes:
    """Whether the top-ranked places of Q queries are right, and their scores.

    Attributes:
        best_scores: (Q,) score of the top-ranked place; NaN without a
            candidate.
        is_right: (Q,) bool, whether the top-ranked place is a true match.
        has_match: (Q,) bool, whether the database holds a true match.
        first_right_ranks: (Q,) rank of the best true match, 1 or greater;
            infinite if no candidate is a true match.
        num_places: size of the database.
        blocks: (Q,) block of the route in which each query lies, see
            `evaluation.recognition.sign_flips.route_blocks`; None if each query
            is a block of its own.
        columns: name -> (Q,) values: what else is known of the queries, as far
            as it is. The names are those of `queries.csv`, and `nearest`, the
            distance to the nearest place that is allowed as an answer [m];
            infinite if there is none.

    Example:
        from evaluation import judge

        print(judge(scores, matches).recall_at(5))
    """

    best_scores: np.ndarray
    is_right: np.ndarray
    has_match: np.ndarray
    first_right_ranks: np.ndarray
    num_places: int
    blocks: np.ndarray | None = None
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.best_scores)

    @classmethod
    def joined(cls, parts: Sequence[QueryOutcomes]) -> QueryOutcomes:
        """Returns the outcomes of successive queries in one database as one."""
        blocks = [one.blocks for one in parts if one.blocks is not None]
        return cls(
            np.concatenate([one.best_scores for one in parts]),
            np.concatenate([one.is_right for one in parts]),
            np.concatenate([one.has_match for one in parts]),
            np.concatenate([one.first_right_ranks for one in parts]),
            parts[0].num_places,
            np.concatenate(blocks) if blocks else None,
            {
                name: np.concatenate([one.columns[name] for one in parts])
                for name in parts[0].columns
            },
        )

    def subset(self, kept: np.ndarray) -> QueryOutcomes:
        """Returns the outcomes of the queries that a mask (Q,) bool selects."""
        return QueryOutcomes(
            self.best_scores[kept],
            self.is_right[kept],
            self.has_match[kept],
            self.first_right_ranks[kept],
            self.num_places,
            None if self.blocks is None else self.blocks[kept],
            {name: values[kept] for name, values in self.columns.items()},
        )

    def read_only(self) -> QueryOutcomes:
        """Returns the same outcomes, whose arrays cannot be changed."""
        views = {one.name: getattr(self, one.name) for one in fields(self)}
        for name, value in views.items():
            if isinstance(value, np.ndarray):
                views[name] = read_only(value)
        columns = {n: read_only(column) for n, column in self.columns.items()}
        return QueryOutcomes(**views | {"columns": columns})

    @property
    def own_blocks(self) -> np.ndarray:
        """(Q,) block of each query: `blocks`, or a block of its own."""
        return np.arange(len(self)) if self.blocks is None else self.blocks

    @property
    def known_ranks(self) -> list[int | None]:
        """`first_right_ranks` as integers; None where they are infinite."""
        return [
            int(r) if np.isfinite(r) else None for r in self.first_right_ranks
        ]

    @cached_property
    def curve(self) -> PrCurve:
        """The exact precision-recall curve of all queries."""
        return pr_curve(self)

    def recall_at(self, rank: int) -> float:
        """Returns the recall R@N for N = `rank`.

        R@N is the share of the queries with a match that have a match among
        their N top-ranked places. It is NaN if no query has a match, or the
        ranks are unknown (NaN).
        """
        ranks = self.first_right_ranks[self.has_match]
        if rank > 1 and np.isnan(ranks).any():
            return math.nan
        return _mean_or_nan(ranks <= rank)

    @property
    def mean_reciprocal_rank(self) -> float:
        """Mean of 1 / rank of the best true match, over queries with a match.

        A query without a match among its candidates counts 0. NaN if no query
        has a match.
        """
        return _mean_or_nan(1.0 / self.first_right_ranks[self.has_match])

    @property
    def match_auroc(self) -> float:
        """How well the best score shows whether a query has a match (AUROC).

        The AUROC is the area under the receiver operating characteristic: the
        probability that a query with a match has a higher best score than a
        query without a match. Equal scores count half, and a query without a
        candidate has the lowest score. NaN if all or none of the queries have a
        match.
        """
        return auroc(self.best_scores, self.has_match)

    @property
    def recall_at_1_percent(self) -> float | None:
        """R@N, where N is a hundredth of the number of places, at least 1.

        It is None if the number of places is unknown, 0.
        """
        if not self.num_places:
            return None
        return self.recall_at(max(1, round(0.01 * self.num_places)))

    @property
    def auc_strict(self) -> float:
        """Area under the curve with recall = TP / N at each of its points.

        NaN if no query has a match.
        """
        if not self.num_matched:
            return math.nan
        return self.curve.strict_auc(self.num_matched)

    @property
    def num_matched(self) -> int:
        """N, the number of queries with a match."""
        return int(self.has_match.sum())

    @property
    def true_positives(self) -> int:
        """TP, the number of right answers."""
        return int(self.is_right.sum())

    @property
    def f1_max_true_positives(self) -> int:
        """TP at the greatest F1."""
        return int(self.is_accepted.sum())

    @property
    def f1_max_counted(self) -> int:
        """TP + FP + FN at the greatest F1; 0 if nothing is accepted."""
        best = self.curve.f1_max_index
        return 0 if best is None else int(self.curve.counted[best])

    def auc_within(self, radius: float) -> float | None:
        """Returns the AUC if a match lies within another radius [m].

        It is NaN if no query has such a match, and None if the columns
        `distance` and `nearest` are unknown.
        """
        if not {"distance", "nearest"} <= self.columns.keys():
            return None
        has_match = self.columns["nearest"].round(9) <= radius
        if not has_match.any():
            return math.nan
        is_right = self.columns["distance"].round(9) <= radius
        return replace(self, is_right=is_right, has_match=has_match).curve.auc

    def num_wrong_by(self, fault: str) -> int | None:
        """Returns how many queries are wrong for a reason, if it is known."""
        why = self.columns.get("why")
        return None if why is None else int(np.sum(why == fault))

    @property
    def hidden(self) -> int | None:
        """Number of wrong answers where no match shows half of the scan."""
        shown = self.columns.get("overlap")
        if shown is None:
            return None
        return int(((shown < _ENOUGH_OVERLAP) & ~self.is_right).sum())

    @property
    def is_accepted(self) -> np.ndarray:
        """(Q,) bool, which queries are accepted matches.

        These are the queries whose top-ranked place is a match, and whose score
        reaches the threshold with the greatest F1. This F1 counts all queries,
        including queries without a match.
        """
        best = self.curve.f1_max_index
        if best is None:
            return np.zeros(len(self), dtype=bool)
        # A comparison with NaN is false.
        return self.is_right & (self.best_scores >= self.curve.thresholds[best])

    @property
    def _estimates_poses(self) -> bool:
        """Whether the method estimates poses.

        A method that finds no place localises no query.
        """
        errors = self.columns.get("translation_error")
        return errors is not None and bool(
            (~np.isnan(errors)).any() or np.isnan(self.best_scores).all()
        )

    @property
    def num_poses(self) -> int:
        """Number of accepted matches with a pose."""
        return len(self._errors("translation_error"))

    def pose_error(self, name: str, part: float) -> float | None:
        """Returns a quantile of the errors of the poses of accepted matches.

        It is NaN without such a pose, and None if the method estimates none.

        Args:
            name: `translation_error` [m] or `rotation_error_deg`.
            part: share of smaller errors.
        """
        if not self._estimates_poses:
            return None
        errors = self._errors(name)
        return float(np.quantile(errors, part)) if len(errors) else math.nan

    def _errors(self, name: str) -> np.ndarray:
        is_known = ~np.isnan(self.columns["translation_error"])
        return self.columns[name][self.is_accepted & is_known]

    @property
    def success(self) -> float | None:
        """Share of the queries with a match whose pose is a success.

        A pose is a success within 2 m and 5 deg of the ground truth. Queries of
        every score count. NaN if no query has a match, and None if the method
        estimates no poses.
        """
        if not self._estimates_poses:
            return None
        far, turned = _SUCCESS
        is_near = (self.columns["translation_error"] <= far) & (
            self.columns["rotation_error_deg"] <= turned
        )
        return _mean_or_nan(is_near[self.has_match])


def faults(
    outcomes: QueryOutcomes,
    match_frames: np.ndarray,
    distances: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Returns, for each query, why its top-ranked place is wrong.

    The top-ranked place is the place that the method ranks first.

    Args:
        outcomes: outcomes of Q queries.
        match_frames: (Q,) frame of the top-ranked place; -1 without a
            candidate.
        distances: (Q,) distance to the top-ranked place [m]; NaN if this place
            is in another city.
        radius: radius of a match [m].

    Returns:
        (Q,) "" if the top-ranked place is a match, and otherwise the first
        reason that applies: `no_place` if the query has no match;
        `no_candidate` if the method finds no place, or rejects all places;
        `other_city` if the top-ranked place is in another city; `near_miss` if
        the top-ranked place is at most twice the radius away; `elsewhere` if no
        other reason applies.
    """
    wrong = [
        ~outcomes.has_match,
        match_frames < 0,
        np.isnan(distances),
        distances <= _NEARLY * radius,
    ]
    kinds = np.select(wrong, FAULTS[:-1], FAULTS[-1])
    return np.where(outcomes.is_right, "", kinds)


def common_blocks(outcomes: Sequence[QueryOutcomes]) -> np.ndarray:
    """Returns the block (Q,) of each of Q queries that several methods answer.

    The order of the methods does not matter.

    Args:
        outcomes: the outcomes of one or more methods. Those without blocks take
            the blocks of the others. If none has blocks, each query is a block
            of its own.

    Raises:
        ValueError: two methods have other blocks.
    """
    known = [one for one in outcomes if one.blocks is not None]
    for one in known:
        if not np.array_equal(one.own_blocks, known[0].own_blocks):
            raise ValueError("other blocks of the route")
    return (known or outcomes)[0].own_blocks


def ranked_places(scores: np.ndarray, most: int) -> np.ndarray:
    """Returns the best places, from the best on.

    Of places with equal scores, the first in the database is ranked higher.
    Places that are no candidates (NaN) come last.

    Args:
        scores: (..., D), higher is more similar; NaN is no candidate.
        most: greatest number K of places.

    Returns:
        (..., min(K, D)) indices of places.
    """
    # NumPy sorts NaN last.
    worst_last = -scores
    number = scores.shape[-1]
    if number < _MANY or most >= number:
        order = np.argsort(worst_last, axis=-1, kind="stable")
        return order[..., :most]
    rows = worst_last.reshape(-1, number)
    found = np.empty((len(rows), most), np.int64)
    for k, row in enumerate(rows):
        limit = np.partition(row, most - 1)[most - 1]
        # NaN is a limit if there are fewer candidates.
        near = np.flatnonzero((row <= limit) | np.isnan(limit))
        found[k] = near[np.argsort(row[near], kind="stable")[:most]]
    return found.reshape(*scores.shape[:-1], most)


def judge(
    scores: np.ndarray,
    matches: np.ndarray,
    blocks: np.ndarray | None = None,
) -> QueryOutcomes:
    """Returns the outcome of each query from the scores of all pairs.

    Among places with equal scores, the first in the database ranks higher.

    Args:
        scores: (Q, D) scores, higher is more similar; NaN for places that are
            no candidates.
        matches: (Q, D) bool, true matches.
        blocks: (Q,) block of the route in which each query lies; None if each
            query is a block of its own.

    Raises:
        ValueError: scores are complex, masked or not numbers, or scores and
            matches differ in shape.

    Example:
        from evaluation import judge, retrieve

        found = retrieve(database, query, method)
        outcomes = judge(found.scores, found.matches)
    """
    values = _as_numbers(scores)
    if values.ndim != 2 or values.shape != np.shape(matches):
        raise ValueError(
            f"scores of shape {values.shape}, matches of {np.shape(matches)}"
        )
    num_queries, num_places = values.shape
    first_right = np.full(num_queries, np.inf)
    best_scores = np.full(num_queries, np.nan)
    # One row at a time: a second array of all pairs of long drives could fill
    # the memory.
    for query, (row, is_match) in enumerate(zip(values, matches, strict=True)):
        candidates = np.flatnonzero(~np.isnan(row))
        if len(candidates):
            found = row[candidates]
            best_scores[query] = found.max()
            first_right[query] = _first_right_rank(found, is_match[candidates])
    return QueryOutcomes(
        best_scores=best_scores,
        is_right=first_right == 1.0,
        has_match=np.any(matches, axis=1),
        first_right_ranks=first_right,
        num_places=num_places,
        blocks=blocks,
    )


def _as_numbers(scores: np.ndarray) -> np.ndarray:
    """Returns scores as float64.

    Raises:
        ValueError: they are complex, masked or not numbers.
    """
    values = np.asarray(scores)
    if isinstance(scores, np.ma.MaskedArray) or values.dtype.kind not in "biuf":
        raise ValueError(
            f"scores are {type(scores).__name__} of {values.dtype}, not plain"
            " numbers with NaN where a place is no candidate"
        )
    return np.asarray(values, dtype=np.float64)


def _first_right_rank(scores: np.ndarray, is_match: np.ndarray) -> float:
    """Returns the rank of a query's best true match; infinite without a match.

    Args:
        scores: (C,) scores of the candidates, in the order of the database.
        is_match: (C,) bool, which candidates are true matches.
    """
    right = np.flatnonzero(is_match)
    if len(right) == 0:
        return math.inf
    first = right[scores[right].argmax()]
    better = scores > scores[first]
    # Among places with equal scores, the first ranks higher.
    better[:first] |= scores[:first] == scores[first]
    return 1.0 + np.count_nonzero(better)


def _mean_or_nan(values: np.ndarray) -> float:
    """Returns the mean of values (N,); NaN without a value."""
    return float(values.mean()) if len(values) else math.nan


def auroc(scores: np.ndarray, is_positive: np.ndarray) -> float:
    """Returns the area under the receiver operating characteristic.

    The area is the probability that a positive has a higher score than a
    negative; equal scores count half. The result is NaN if all items or no
    items are positive.

    Args:
        scores: (N,) scores; NaN is the lowest.
        is_positive: (N,) bool.
    """
    # Imported here: it is slow to load.
    from scipy.stats import mannwhitneyu

    values = np.where(np.isnan(scores), -np.inf, scores)
    positive, negative = values[is_positive], values[~is_positive]
    if not (len(positive) and len(negative)):
        return math.nan
    test = mannwhitneyu(positive, negative, method="asymptotic")
    return float(test.statistic / (len(positive) * len(negative)))


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


@dataclass(frozen=True)
class PrCurve:
    """The precision-recall curve: a point for every distinct score.

    The threshold of the first point is the best score.

    Attributes:
        thresholds: (K,) least accepted scores, decreasing.
        true_positives: (K,) TP at each threshold.
        false_positives: (K,) FP at each threshold.
        false_negatives: (K,) FN at each threshold.
    """

    thresholds: np.ndarray
    true_positives: np.ndarray
    false_positives: np.ndarray
    false_negatives: np.ndarray

    @property
    def precision(self) -> np.ndarray:
        """(K,) precision TP / (TP + FP) at each threshold."""
        return self.true_positives / (
            self.true_positives + self.false_positives
        )

    @property
    def recall(self) -> np.ndarray:
        """(K,) recall TP / (TP + FN) at each threshold; 0 if TP + FN is 0."""
        return recall_of(self.true_positives, self.false_negatives)

    @property
    def f1(self) -> np.ndarray:
        """(K,) F1 = 2 TP / (2 TP + FP + FN)."""
        return 2.0 * self.true_positives / (self.true_positives + self.counted)

    @property
    def counted(self) -> np.ndarray:
        """(K,) TP + FP + FN at each threshold: all but the true negatives."""
        return self.true_positives + self.false_positives + self.false_negatives

    @property
    def auc(self) -> float:
        """Area under the precision-recall curve, by the trapezoidal rule.

        The area is from recall 0 to the greatest recall of the curve. Left of
        the first point of the curve, the precision is as at the first point.
        The area is 0 if no answer is ever accepted.
        """
        return float(areas_under(self.precision[None], self.recall[None])[0])

    def strict_auc(self, num_with_match: int) -> float:
        """Returns the area under the curve with recall = TP / N.

        N is the number of queries with a match. N includes queries whose
        accepted answer is wrong; TP + FN does not.
        """
        recall = recall_of(
            self.true_positives, num_with_match - self.true_positives
        )
        return float(areas_under(self.precision[None], recall[None])[0])

    @property
    def f1_max_index(self) -> int | None:
        """Index of the point with the greatest F1; None without a point."""
        return int(self.f1.argmax()) if len(self.thresholds) else None

    @property
    def f1_max(self) -> float:
        """Greatest F1; 0 if nothing is accepted."""
        return float(self.f1.max(initial=0.0))

    @property
    def recall_at_full_precision(self) -> float:
        """Greatest recall at a precision of 1; 0 if no threshold has it."""
        return float(self.recall[self.false_positives == 0].max(initial=0.0))


def pr_curve(outcomes: QueryOutcomes) -> PrCurve:
    """Returns the exact precision-recall curve of all given queries."""
    thresholds, tp, fp, fn = weighted_counts(
        outcomes, np.ones((1, len(outcomes)))
    )
    return PrCurve(
        thresholds, *(row[0].astype(np.int64) for row in (tp, fp, fn))
    )


def weighted_counts(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns TP, FP and FN at every distinct score, for weighted queries.

    Args:
        outcomes: outcomes of Q queries.
        weights: (B, Q) number of times that each query counts in each of B
            samples.

    Returns:
        (K,) thresholds, decreasing; (B, K) TP; (B, K) FP; (B, K) FN.
    """
    answered = np.flatnonzero(~np.isnan(outcomes.best_scores))
    order = answered[np.argsort(-outcomes.best_scores[answered], kind="stable")]
    scores = outcomes.best_scores[order]
    # The last query of each group of equal scores, which are accepted together.
    is_last = np.append(scores[1:] != scores[:-1], len(scores) > 0)
    ends = np.flatnonzero(is_last)

    def accepted(counts: np.ndarray) -> np.ndarray:
        return np.cumsum(weights[:, order] * counts[order], axis=1)[:, ends]

    tp = accepted(outcomes.is_right)
    fp = accepted(~outcomes.is_right)
    with_match = (weights * outcomes.has_match).sum(axis=1, keepdims=True)
    fn = with_match - accepted(outcomes.has_match)
    return scores[ends], tp, fp, fn


def areas_under(precision: np.ndarray, recall: np.ndarray) -> np.ndarray:
    """Returns the areas (B,) under B precision-recall curves.

    Args:
        precision: (B, K) precision at K thresholds; K can be 0.
        recall: (B, K) recall at these thresholds, increasing.
    """
    start = (precision[:, :1] * recall[:, :1]).sum(axis=1)
    return start + np.trapezoid(precision, recall, axis=1)


def recall_of(tp: np.ndarray, fn: np.ndarray) -> np.ndarray:
    """Returns the recall TP / (TP + FN); 0 where TP + FN is 0.

    The counts `tp` and `fn` and the result are arrays of the same shape.
    """
    return tp / np.maximum(tp + fn, 1)


class WeightedMetrics(NamedTuple):
    """The metrics of B weighted sets of queries, in the order of tables.

    Attributes:
        auc: (B,) AUC.
        r1: (B,) R@1.
        auc_strict: (B,) strict AUC, see `PrCurve.strict_auc`.
    """

    auc: np.ndarray
    r1: np.ndarray
    auc_strict: np.ndarray


def weighted_metrics(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> WeightedMetrics:
    """Returns AUC, R@1 and strict AUC of B weighted sets of queries.

    Args:
        outcomes: outcomes of Q queries, all of which count.
        weights: (B, Q) how often each query counts in each set.
    """
    _, tp, fp, fn = weighted_counts(outcomes, weights)
    # Before a set's first query nothing is accepted; the curve there has the
    # precision of its first point.
    with np.errstate(invalid="ignore"):
        precision = tp / (tp + fp)
    precision = _filled_from_right(precision)
    areas = areas_under(precision, recall_of(tp, fn))
    with_match = (weights * outcomes.has_match).sum(axis=1)
    stricts = areas_under(precision, recall_of(tp, with_match[:, None] - tp))
    with np.errstate(invalid="ignore"):
        recalls = (weights * outcomes.is_right).sum(axis=1) / with_match
    return WeightedMetrics(areas, recalls, stricts)


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
