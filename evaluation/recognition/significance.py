"""Differences of AUC between methods, and whether they are significant."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import Any

import numpy as np
from scipy.special import stdtr, stdtrit

from evaluation.recognition.bootstrap import (
    UNKNOWN,
    Interval,
    resampled_metrics,
    weights_by_drive,
)
from evaluation.recognition.precision_recall import pr_curve
from evaluation.recognition.query_outcomes import (
    QueryOutcomes,
    common_blocks,
)

# Probability of a value below the upper limit of a 95 % interval.
_UPPER_LIMIT = 0.975
# Differences and spreads of areas below this are rounding errors.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Difference:
    """The difference of two areas under precision-recall curves.

    Attributes:
        value: the first area minus the second.
        interval: 95 % interval.
        p_value: two-sided p-value under the hypothesis that there is no
            difference: 1 for equal areas in all samples; NaN if a route has a
            single bootstrap block.
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

    A p-value is never below 2^(1 - n), where n is the number of blocks of all
    drives. This is the least p-value of an exact test over n blocks, in which
    the sign of each block's difference is random (Fisher, The Design of
    Experiments, 1935). A lead without any spread has this p-value, because the
    t test, which divides by the spread, does not apply.

    Args:
        answers: method -> its outcomes on each set of queries. The queries must
            be the same for all methods, and so must their blocks of the route,
            see `QueryOutcomes.blocks`. Outcomes without blocks take the blocks
            of the other methods.
        drives: for each set of queries, a number that identifies the drive. By
            default, each set belongs to a different drive.

    Returns:
        (first method, second method) -> AUC of the first minus AUC of the
        second; and the p-value, corrected by Holm's method for the number of
        differences.

    Raises:
        ValueError: two methods have other blocks for the same queries.
    """
    sets = list(zip(*answers.values(), strict=True))
    drives = range(len(sets)) if drives is None else drives
    numbers, sums = _samples_by_drive(sets, drives)
    areas = [
        [pr_curve(outcome).auc for outcome in outcomes] for outcomes in sets
    ]

    def difference(first: int, second: int) -> Difference:
        """Returns the difference of two methods, by their numbers."""
        value = float(
            np.mean(
                [by_method[first] - by_method[second] for by_method in areas]
            )
        )
        if (numbers < 2).any():
            return Difference(value, UNKNOWN, math.nan)
        samples = [by_method[first] - by_method[second] for by_method in sums]
        variances = np.var(samples, axis=1) * numbers / (numbers - 1)
        spread = math.sqrt(variances.sum()) / len(sets)
        freedom = (numbers - 1).sum()
        margin = float(stdtrit(freedom, _UPPER_LIMIT)) * spread
        if spread <= _ROUNDING and abs(value) <= _ROUNDING:
            return Difference(value, Interval(value, value), 1.0)
        p_value = 0.0
        if spread > _ROUNDING:
            p_value = 2.0 * float(stdtr(freedom, -abs(value) / spread))
        p_value = max(p_value, 2.0 ** (1.0 - float(numbers.sum())))
        interval = Interval(value - margin, value + margin)
        return Difference(value, interval, p_value)

    pairs = list(itertools.combinations(range(len(answers)), 2))
    found = [difference(*pair) for pair in pairs]
    corrected = holm(
        np.array([difference_found.p_value for difference_found in found])
    ).tolist()
    names = itertools.combinations(answers, 2)
    return dict(zip(names, zip(found, corrected, strict=True), strict=True))


def _samples_by_drive(
    sets: Sequence[Sequence[QueryOutcomes]], drives: Sequence[int]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Returns AUCs of bootstrap samples, summed over the sets of each drive.

    Args:
        sets: for each set of queries, the outcomes of the methods.
        drives: for each set, a number that identifies the drive.

    Returns:
        For each of the different drives, the number of its blocks, (N,); and
        the sums (methods, B) of the AUCs in B samples.
    """
    numbers: dict[int, int] = {}
    sums: dict[int, Any] = {}
    blocks = [common_blocks(outcomes) for outcomes in sets]
    drawn = weights_by_drive(blocks, drives)
    for drive, outcomes, (number, weights) in zip(
        drives, sets, drawn, strict=True
    ):
        samples = [
            resampled_metrics(outcome, weights).auc for outcome in outcomes
        ]
        sums[drive] = sums.get(drive, 0.0) + np.array(samples)
        numbers[drive] = number
    return np.array(list(numbers.values())), list(sums.values())
