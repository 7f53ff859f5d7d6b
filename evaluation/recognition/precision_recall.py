"""The precision-recall curve of place recognition, and the area under it.

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
every method that has a top-ranked place for all queries. The strict AUC is the
area under another curve, see `PrCurve.strict_auc`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from evaluation.recognition.query_outcomes import QueryOutcomes


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
