"""The part of a method's performance that survives structural change.

A control drive takes the place of one drive of a pair: it follows the same
route, but in the stage of the other drive. What a method loses from the control
to the pair is due to the change alone, and not to the routes.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from evaluation.recognition.metrics import (
    UNKNOWN,
    Interval,
    percentile_interval,
    resampled_metrics,
    resampled_weights,
)
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.query_outcomes import QueryOutcomes


@dataclass(frozen=True)
class Kept:
    """A number without the change, with it, and the share that is kept.

    Attributes:
        unchanged: the number without the change; NaN without a control.
        changed: the number with the change.
        interval: 95 % interval of the share by bootstrap over blocks of the
            route; a sample has the same ones with and without the change. NaN
            if control and pair have different numbers of queries.
    """

    unchanged: float
    changed: float
    interval: Interval = UNKNOWN

    @property
    def share(self) -> float:
        """Changed over unchanged; NaN if `unchanged` is 0 or NaN."""
        return float(kept_share(self.changed, self.unchanged))


@dataclass(frozen=True)
class Survival:
    """A method on a pair of stages, with and without the change (mode all).

    Attributes:
        changed: on the pair.
        unchanged: on its control; None without one.
        auc: area under the precision-recall curve.
        recall_at_1: R@1.
    """

    changed: RecognitionResult
    unchanged: RecognitionResult | None
    auc: Kept
    recall_at_1: Kept

    @classmethod
    def of(
        cls, changed: RecognitionResult, unchanged: RecognitionResult | None
    ) -> Survival:
        """Compares a result with the control's result, if there is one."""
        after = changed.metrics["all"]
        if unchanged is None:
            return cls(
                changed,
                None,
                Kept(math.nan, after.auc),
                Kept(math.nan, after.recall_at_1),
            )
        before = unchanged.metrics["all"]
        auc, recall = paired_intervals(
            unchanged.outcome.outcomes, changed.outcome.outcomes
        )
        return cls(
            changed,
            unchanged,
            Kept(before.auc, after.auc, auc),
            Kept(before.recall_at_1, after.recall_at_1, recall),
        )

    @property
    def method(self) -> str:
        return self.changed.method

    @property
    def pair(self) -> tuple[str, str, str]:
        """Map, database, query."""
        return self.changed.pair

    @property
    def recall_at_full_precision(self) -> float:
        """With the change."""
        curve = self.changed.metrics["all"].curve
        return curve.recall_at_full_precision

    @property
    def auc_strict(self) -> tuple[float, float]:
        """AUC with recall = TP / N, without the change and with it.

        The former is NaN without a control.
        """
        before = math.nan
        if self.unchanged is not None:
            before = self.unchanged.metrics["all"].auc_strict
        return before, self.changed.metrics["all"].auc_strict

    @property
    def protocol(self) -> RetrievalProtocol:
        """The protocol of both results."""
        return self.changed.outcome.protocol

    @property
    def control(self) -> str | None:
        """The drive that replaces one of the pair."""
        if self.unchanged is None:
            return None
        before, after = self.unchanged.outcome, self.changed.outcome
        if before.query != after.query:
            return before.query
        return before.database


def paired_intervals(
    unchanged: QueryOutcomes, changed: QueryOutcomes, seed: int = 0
) -> tuple[Interval, Interval]:
    """Returns 95 % intervals of the kept shares of AUC and of R@1.

    Args:
        unchanged: of Q queries without the change.
        changed: of the same queries with it, in the same order; its blocks
            of the route are drawn.
        seed: of the bootstrap.

    Returns:
        Intervals of AUC and of R@1; NaN if the numbers of queries differ or are
        zero.
    """
    if len(unchanged) != len(changed) or len(changed) == 0:
        return UNKNOWN, UNKNOWN
    weights = resampled_weights(len(changed), seed, changed.blocks)
    before = resampled_metrics(unchanged, weights)[:2]
    after = resampled_metrics(changed, weights)[:2]
    auc, recall = (
        percentile_interval(kept_share(one, other))
        for one, other in zip(after, before, strict=True)
    )
    return auc, recall


def kept_share(
    changed: np.ndarray | float, unchanged: np.ndarray | float
) -> np.ndarray:
    """Returns changed over unchanged; NaN where the latter is 0 or NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.divide(changed, unchanged)
    return np.where(np.asarray(unchanged) > 0.0, share, math.nan)
