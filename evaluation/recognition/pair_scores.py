"""The scores of a method on a pair of drives: a public noun.

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
`auc_strict`, is the area under another curve, with recall = TP / N, where N is
the number of queries with a match.

In both modes, R@N is the share of the queries with a match that have a match
among their N top-ranked places.
"""

from dataclasses import dataclass

import numpy as np

from evaluation.recognition.metrics import METRICS, Mode
from evaluation.recognition.precision_recall import PrCurve
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.sign_flips import Interval

# Greatest N of R@N.
MAX_RANK = 25


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
        auc_interval: 95 % interval of `auc`, by sign flips over blocks of
            street.
        recall_at_1_interval: 95 % interval of R@1, by the same sign flips.

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
    def recall_at_1(self) -> float:
        """R@1: share of right answers among the queries with a match."""
        return float(self.recall_at_n[0])


def evaluate(
    outcomes: QueryOutcomes, mode: Mode = "all"
) -> PlaceRecognitionMetrics:
    """Returns the scores of one method on one pair of drives.

    Args:
        outcomes: outcome of each query.
        mode: which queries the precision-recall curve counts: `all`, or only
            queries with a match (`filtered`).

    Example:
        from evaluation import evaluate, judge

        print(evaluate(judge(scores, matches)).recall_at_1)
    """
    counted = outcomes
    if mode == "filtered":
        counted = outcomes.subset(outcomes.has_match)
    curve = counted.curve
    num_with_match = int(outcomes.has_match.sum())
    return PlaceRecognitionMetrics(
        mode=mode,
        curve=curve,
        auc=curve.auc,
        auc_strict=curve.strict_auc(int(counted.has_match.sum())),
        f1_max=curve.f1_max,
        f1_max_index=curve.f1_max_index,
        recall_at_n=np.array(
            [outcomes.recall_at(rank) for rank in range(1, MAX_RANK + 1)]
        ),
        recall_at_1_percent=METRICS["r1_percent"].of(outcomes),
        num_queries=len(outcomes),
        num_with_match=num_with_match,
        num_right=int(outcomes.is_right.sum()),
        auc_interval=METRICS["auc"].interval(counted),
        recall_at_1_interval=METRICS["r1"].interval(counted),
    )
