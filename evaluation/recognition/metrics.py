"""Recall, precision-recall curve, AUC and F1 of place recognition.

The definitions were derived from the paper's numbers. Each query counts with
its best place only:

- TP: accepted, and the best place is a true match,
- FP: accepted, and it is not, whether or not the query has a match at all,
- FN: rejected, although the query has a match.

A rejected query without a match counts nowhere. A query without a candidate
is never accepted. In mode `all` every query counts; in mode `filtered` only
those that have a match (then F1max carries no more than recall at 1).

A wrong accepted answer to a query with a match thus leaves FN, so that recall =
TP / (TP + FN) reaches 1 for every method that answers all queries. `auc_strict`
is the area with recall = TP / N, of N queries with a match.

In both modes R@N is the part of the queries with a match that have a match
among their N best places.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.recognition.pr_curve import PrCurve, pr_curve
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.resampling import Interval, bootstrap_intervals

Mode = Literal["all", "filtered"]
MODES: tuple[Mode, ...] = ("all", "filtered")

MAX_RANK = 25


@dataclass(frozen=True)
class PlaceRecognitionMetrics:
    """The numbers of one pair of drives and one method.

    Attributes:
        mode: the queries that the curve counts.
        curve: the exact precision-recall curve.
        auc: area under it.
        auc_strict: area with recall = TP / N at each of its points.
        f1_max: greatest F1 on it; 0 if nothing is accepted.
        f1_max_index: its point on the curve; None if that is empty.
        recall_at_n: (25,) R@1 to R@25.
        recall_at_1_percent: R@N for a hundredth of the database.
        num_queries: queries asked.
        num_with_match: N, the number of queries with a match.
        num_right: TP with every candidate accepted: the queries whose best
            place is right. R@1 = num_right / N.
        auc_interval: 95 % interval by bootstrap over blocks of the route.
        recall_at_1_interval: likewise.

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
        """The part of the queries with a match whose best place is one."""
        return float(self.recall_at_n[0])


def evaluate(
    outcomes: QueryOutcomes, mode: Mode = "all", seed: int = 0
) -> PlaceRecognitionMetrics:
    """Computes all numbers of one pair and method.

    Args:
        outcomes: outcomes of the queries.
        mode: selects the queries of the precision-recall curve.
        seed: of the bootstrap.

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
    return PlaceRecognitionMetrics(
        mode=mode,
        curve=curve,
        auc=curve.auc,
        auc_strict=curve.strict_auc(num_with_match),
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
