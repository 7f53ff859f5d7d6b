"""The precision-recall curve, and the areas of many weighted ones."""

from dataclasses import dataclass

import numpy as np

from evaluation.recognition.query_outcomes import QueryOutcomes


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
        return recall_of(self.true_positives, self.false_negatives)

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
        return float(areas_under(self.precision[None], self.recall[None])[0])

    def strict_auc(self, num_with_match: int) -> float:
        """Returns the area over recall = TP / N.

        N, the number of queries with a match, includes those whose accepted
        place is wrong; TP / (TP + FN) reaches 1 whatever they are.
        """
        recall = recall_of(
            self.true_positives, num_with_match - self.true_positives
        )
        return float(areas_under(self.precision[None], recall[None])[0])

    @property
    def recall_at_full_precision(self) -> float:
        """Greatest recall without a false positive; 0 if none."""
        return float(self.recall[self.false_positives == 0].max(initial=0.0))


def pr_curve(outcomes: QueryOutcomes) -> PrCurve:
    """Returns the exact curve of queries, all of which count."""
    thresholds, tp, fp, fn = weighted_counts(
        outcomes, np.ones((1, len(outcomes)))
    )
    return PrCurve(
        thresholds, *(row[0].astype(np.int64) for row in (tp, fp, fn))
    )


def weighted_counts(
    outcomes: QueryOutcomes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Counts TP, FP and FN at every distinct score, queries weighted.

    Args:
        outcomes: outcomes of Q queries.
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


def areas_under(precision: np.ndarray, recall: np.ndarray) -> np.ndarray:
    """Returns the areas (B,) under curves (B, K), K possibly 0."""
    if precision.shape[1] == 0:
        return np.zeros(len(precision))
    start = precision[:, 0] * recall[:, 0]
    heights = 0.5 * (precision[:, 1:] + precision[:, :-1])
    widths = np.diff(recall, axis=1)
    return start + (heights * widths).sum(axis=1)


def recall_of(tp: np.ndarray, fn: np.ndarray) -> np.ndarray:
    """Returns TP / (TP + FN), 0 if there is nothing to recall."""
    return tp / np.maximum(tp + fn, 1)
