"""Differences of AUC between methods on the same queries, and their doubt."""

from dataclasses import dataclass
import math

import numpy as np
from scipy.special import stdtr, stdtrit

from evaluation.recognition.pr_curve import pr_curve
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.resampling import (
    Interval,
    resampled_metrics,
    resampled_weights,
)


@dataclass(frozen=True)
class Difference:
    """The difference of two areas under precision-recall curves.

    Attributes:
        value: the first less the second.
        interval: 95 % interval.
        p_value: two-sided, of no difference; NaN with a single block.
    """

    value: float
    interval: Interval
    p_value: float


def auc_difference(first: QueryOutcomes, second: QueryOutcomes) -> Difference:
    """Compares two methods on the same queries (mode all).

    The bootstrap draws the same blocks for both. Its deviation, corrected for
    the number n of blocks, gives a t test of n - 1 degrees of freedom, whose
    small p-values do not end at the number of samples.

    Args:
        first: outcomes of Q queries.
        second: outcomes of the same queries, in the same blocks.
    """
    value = pr_curve(first).auc - pr_curve(second).auc
    blocks = first.blocks
    number = len(first) if blocks is None else len(np.unique(blocks))
    if number < 2:
        return Difference(value, Interval(math.nan, math.nan), math.nan)
    weights = resampled_weights(len(first), blocks=blocks)
    samples = (
        resampled_metrics(first, weights)[0]
        - resampled_metrics(second, weights)[0]
    )
    spread = float(samples.std()) * math.sqrt(number / (number - 1))
    margin = float(stdtrit(number - 1, 0.975)) * spread
    p_value = 1.0
    if spread > 0.0:
        p_value = 2.0 * float(stdtr(number - 1, -abs(value) / spread))
    return Difference(value, Interval(value - margin, value + margin), p_value)


def holm(p_values: np.ndarray) -> np.ndarray:
    """Returns p-values (N,) corrected for their number, by Holm's method.

    NaN stay, and do not count.
    """
    known = np.flatnonzero(~np.isnan(p_values))
    order = known[np.argsort(p_values[known], kind="stable")]
    steps = p_values[order] * np.arange(len(order), 0, -1)
    result = np.full(len(p_values), math.nan)
    result[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return result
