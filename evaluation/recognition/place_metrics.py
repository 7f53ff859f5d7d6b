"""A method's results of place recognition and poses, number by number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import math

import numpy as np

from evaluation.recognition.faults import FAULTS
from evaluation.recognition.metrics import METRICS, Metric
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.pose_errors import is_accepted
from evaluation.recognition.precision_recall import WeightedMetrics
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.result_number import Number
from evaluation.recognition.sign_flips import (
    UNKNOWN,
    Interval,
    jackknife_interval,
)


def place_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[Number]:
    """Yields a method's place recognition results in a condition, one by one.

    Intervals come from sign flips over blocks of street, see
    `jackknife_interval`. Without a block, a retained share has the block
    neither in the condition nor in the baseline, in which nothing differs
    between the drives.

    Args:
        now: outcome of the method in the condition.
        before: outcome of the method in the baseline; `now` itself if the
            condition is the baseline, whose retained shares have no interval;
            None to leave out the results that compare with a baseline.

    Yields:
        The metrics of the condition. If there is a baseline, the following
        results come in addition. `relative_auc`, `relative_r1` and
        `relative_auc_strict` are AUC, R@1 and AUC strict in the condition,
        divided by the same metric in the baseline. `lost` is the number of
        queries that are right only in the baseline; `found` is the number of
        queries that are right only in the
        condition. The last result comes from the function
        `_visible_change_added`.
    """
    outcomes = now.outcomes
    for name in WeightedMetrics._fields:
        yield _computed(now, METRICS[name])
    if before is not None:
        yield from _compared_numbers(now, before)
    for metric in METRICS.values():
        if metric.compute and metric.name not in WeightedMetrics._fields:
            yield _computed(now, metric)
    overlaps = now.columns["overlap"]
    for name in FAULTS:
        yield now.number(name, float(np.sum(now.columns["why"] == name)))
    is_little_shown = (overlaps < _ENOUGH_OVERLAP) & ~outcomes.is_right
    yield now.number("hidden", float(is_little_shown.sum()))
    if not math.isnan(shown := _mean_visible_change(overlaps)[0]):
        yield now.number("visible_change", shown)


def _computed(now: PlaceOutcome, metric: Metric) -> Number:
    """Returns a metric that follows from the outcomes, with its interval."""
    outcomes = now.outcomes
    interval = metric.interval(outcomes)
    return now.number(metric.name, metric.of(outcomes), interval)


def _compared_numbers(
    now: PlaceOutcome, before: PlaceOutcome
) -> Iterator[Number]:
    """Yields the results that compare a condition with the baseline.

    The docstring of `place_numbers` lists these results. If the queries differ,
    only `relative_auc`, `relative_r1` and `relative_auc_strict` are known,
    without intervals.
    """
    outcomes = now.outcomes
    is_paired = len(before.outcomes) == len(outcomes)
    for of in WeightedMetrics._fields:
        metric = METRICS[of]
        retained = next(
            one.name for one in METRICS.values() if one.share_of == of
        )
        share = kept_share(metric.of(outcomes), metric.of(before.outcomes))
        interval = UNKNOWN
        if is_paired and before is not now:
            then = replace(before.outcomes, blocks=outcomes.own_blocks)
            interval = _kept_interval(metric, outcomes, then)
        yield now.number(retained, float(share), interval)
    if is_paired:
        right = outcomes.is_right
        was = before.outcomes.is_right
        yield now.number("lost", float((was & ~right).sum()))
        yield now.number("found", float((right & ~was).sum()))
        added = _visible_change_added(
            now.columns["overlap"], before.columns["overlap"]
        )
        if not math.isnan(added):
            yield now.number("visible_change_added", added)


def _kept_interval(
    metric: Metric, now: QueryOutcomes, before: QueryOutcomes
) -> Interval:
    """Returns the 95 % interval of a retained share.

    The two imaginary blocks of `jackknife_interval` are one in which nothing is
    retained, and one in which the metric rises from 0 to 1.
    """
    unchanged = metric.of(before)
    if not unchanged > 0.0:
        return UNKNOWN
    share = metric.of(now) / unchanged
    values, weights = metric.without_blocks(now)
    then, _ = metric.without_blocks(before)
    ends = 0.0, share + 1.0 / unchanged
    return jackknife_interval(share, kept_share(values, then), weights, ends)


def pose_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[Number]:
    """Yields a method's pose results; nothing if it estimates no poses.

    Args:
        now: outcome of the method in a condition.
        before: outcome of the method in the baseline. If it is given, the
            results include `relative_success`: the success rate in the
            condition divided by the success rate in the baseline.
    """
    value = now.pose.success
    if math.isnan(value):
        return
    number = int(now.outcomes.has_match.sum())
    yield now.number("pose_success", value, n=number)
    if before is not None:
        kept = float(kept_share(value, before.pose.success))
        yield now.number("relative_success", kept, n=number)
    known = is_accepted(now.outcomes) & ~np.isnan(now.pose_errors.translation)
    for name, median in (
        ("translation_median", now.pose.translation_median),
        ("rotation_median_deg", now.pose.rotation_median_deg),
    ):
        if not math.isnan(median):
            yield now.number(name, median, n=int(known.sum()))


def kept_share(
    changed: np.ndarray | float, unchanged: np.ndarray | float
) -> np.ndarray:
    """Returns `changed` / `unchanged`, NaN where `unchanged` is 0 or NaN.

    If `changed` is a result under a change, and `unchanged` the same result
    without the change, the quotient is the retained share.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.divide(changed, unchanged)
    return np.where(np.asarray(unchanged) > 0.0, share, math.nan)


# Overlap below which two scans show different surroundings.
_ENOUGH_OVERLAP = 0.5


def _visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change minus the mean in a baseline.

    The visible change also contains parts of a scan that are occluded only
    because the viewpoints differ (parallax). Subtracting the baseline removes
    this share.

    Args:
        now: (Q,) overlaps, see `PlaceOutcome.of`.
        before: (Q,) overlaps of the same queries in the baseline.

    Returns:
        The difference; NaN if no query has both values, or the queries differ.
    """
    if before is None or len(before) != len(now):
        return math.nan
    added = before - now
    known = added[~np.isnan(added)]
    return float(known.mean()) if len(known) else math.nan


def _mean_visible_change(overlaps: np.ndarray) -> tuple[float, int]:
    """Returns the mean visible change, and the number of queries.

    The visible change of a query is the share of its scan that the best of its
    matches does not show.

    Args:
        overlaps: (Q,) see `PlaceOutcome.of`; NaN for queries that have no
            match, which do not count.

    Returns:
        The mean and the number of queries with a match; NaN and 0 if there are
        none.
    """
    known = overlaps[~np.isnan(overlaps)]
    if len(known) == 0:
        return math.nan, 0
    return float(1.0 - known.mean()), len(known)
