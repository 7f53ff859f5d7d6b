"""The answers of a method on two drives, query by query, as numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from evaluation.recognition.metrics import (
    UNKNOWN,
    Interval,
    own_samples,
    paired_samples,
    percentile_interval,
    pr_curve,
)
from evaluation.recognition.pose_errors import (
    PoseErrors,
    is_accepted,
    pose_success,
)
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.retrieval import Retrieval

# The reason for a wrong best place to which no other one applies.
ELSEWHERE = "elsewhere"
# Reasons for wrong best places, in order of precedence.
FAULTS = ("no_place", "no_candidate", "other_city", "too_far", ELSEWHERE)
# Up to this multiple of the radius, a wrong place is `too_far`; beyond it,
# `elsewhere`.
NEARLY = 2.0
_HALF = 0.5


@dataclass(frozen=True)
class PlaceOutcome:
    """The answers of a method to the queries of a drive, and their truth.

    Attributes:
        method: name of the method.
        is_gated: whether the gate was used, which rejects places that lie too
            far away by the method's own pose estimate.
        outcomes: outcomes of Q queries.
        columns: name of a column of `queries.csv` -> (Q,) values. An unknown
            value is -1 for a frame, infinite for a rank, and NaN for other
            numbers.
        pose_errors: errors of the poses at the best places.
        radius: radius of a match [m].
    """

    method: str
    is_gated: bool
    outcomes: QueryOutcomes
    columns: Mapping[str, np.ndarray]
    pose_errors: PoseErrors
    radius: float

    @classmethod
    def of(
        cls,
        method: str,
        is_gated: bool,
        retrieval: Retrieval,
        query: tuple[np.ndarray, np.ndarray],
        drives: Sequence[str],
        overlaps: np.ndarray,
        radius: float,
    ) -> PlaceOutcome:
        """Returns the outcomes of a method's queries in a retrieval.

        Args:
            method: name of the method.
            is_gated: whether the gate has changed the scores.
            retrieval: scores and truth of Q queries and D places.
            query: time stamps (Q,) [ns] and positions (Q, 3) [m] of the
                queries.
            drives: name of each place's drive (D names). The first name is
                that of the drive through the query's own city; distances to
                places of all other drives are unknown.
            overlaps: (Q,) how much of the query's scan the best of its matches
                shows, see `evaluation.recognition.overlap_truth`; NaN without a
                match.
            radius: radius of a match [m].
        """
        best = retrieval.best_places.tolist()
        names = np.array([drives[k] if k >= 0 else "" for k in best])
        outcomes = judge(
            retrieval.scores, retrieval.matches, retrieval.query_blocks
        )
        distances = retrieval.best_distances
        distances[names != drives[0]] = math.nan
        columns = {
            "query_frame": retrieval.query_frames,
            "query_stamp_ns": query[0],
            "query_x": query[1][:, 0],
            "query_y": query[1][:, 1],
            "query_z": query[1][:, 2],
            "block": outcomes.own_blocks,
            "correct": outcomes.is_right,
            "has_match": outcomes.has_match,
            "score": outcomes.best_scores,
            "first_right_rank": outcomes.first_right_ranks,
            "why": faults(outcomes, retrieval.best_frames, distances, radius),
            "match_drive": names,
            "match_frame": retrieval.best_frames,
            "distance": distances,
            "translation_error": retrieval.pose_errors.translation,
            "rotation_error_deg": retrieval.pose_errors.rotation_deg,
            "overlap": overlaps,
            "visible_change": 1.0 - overlaps,
        }
        errors = retrieval.pose_errors
        return cls(method, is_gated, outcomes, columns, errors, radius)

    def number(
        self,
        metric: str,
        value: float,
        interval: Interval = UNKNOWN,
        n: int | None = None,
    ) -> Number:
        """Returns a `Number` of this outcome: a metric with its value.

        Args:
            metric: name of the metric.
            value: value of the metric.
            interval: its 95 % interval.
            n: number of queries from which the value is computed; by default
                all.
        """
        count = len(self.outcomes) if n is None else n
        return Number(
            self.method, self.is_gated, metric, value, interval, count
        )


def faults(
    outcomes: QueryOutcomes,
    match_frames: np.ndarray,
    distances: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Returns, for each query, why its best place is wrong.

    The best place is the one that the method ranks first.

    Args:
        outcomes: outcomes of Q queries.
        match_frames: (Q,) frame of the best place; -1 without a candidate.
        distances: (Q,) distance to the best place [m]; NaN in another city.
        radius: radius of a match [m].

    Returns:
        (Q,) "" if the best place is a match, and otherwise the first reason
        that applies: `no_place` if the query has no match; `no_candidate` if
        the method finds no place, or rejects all places; `other_city` if the
        best place is in another city; `too_far` if the best place is at most
        twice the radius away; `elsewhere` if no other reason applies.
    """
    wrong = [
        ~outcomes.has_match,
        match_frames < 0,
        np.isnan(distances),
        distances <= NEARLY * radius,
    ]
    kinds = np.select(wrong, FAULTS[:-1], FAULTS[-1])
    return np.where(outcomes.is_right, "", kinds)


def visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change minus that of a baseline.

    The visible change also contains parts of a scan that are hidden only
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


def mean_visible_change(overlaps: np.ndarray) -> tuple[float, int]:
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


class Number(NamedTuple):
    """A result of a task.

    Attributes:
        method: method, estimator or baseline; "" if there is none. For a place
            recognition method, it is the method's name with its settings.
        gate: whether the gate was used.
        metric: name of the metric.
        value: its value.
        interval: its 95 % interval.
        n: number of queries, points or other items from which the value is
            computed.
    """

    method: str
    gate: bool
    metric: str
    value: float
    interval: Interval = UNKNOWN
    n: int = 0


def place_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[Number]:
    """Yields a method's place recognition results in a condition, one by one.

    Intervals are by bootstrap over blocks of the route. Each bootstrap sample
    draws the same blocks in the condition and in the baseline, in which nothing
    differs between the drives.

    Args:
        now: outcome of the method in the condition.
        before: outcome of the method in the baseline; None to leave out the
            results that compare the condition with the baseline. `kept`,
            `kept_r1` and `kept_strict` are AUC, R@1 and strict AUC in the
            condition, divided by those in the baseline. `lost` is the number of
            queries that are right in the baseline only, and `found` the number
            of those that are right in the condition only. For
            `visible_change_added`, see the function.
    """
    outcomes = now.outcomes
    values = areas(outcomes)
    samples = own_samples(outcomes)
    for (name, value), drawn in zip(values.items(), samples, strict=True):
        yield now.number(name, value, percentile_interval(drawn))
    if before is not None:
        drawn_then: Sequence[np.ndarray | float] = [math.nan] * len(samples)
        if is_paired := len(before.outcomes) == len(outcomes):
            drawn_then = paired_samples(before.outcomes, outcomes)
        for name, then, today, drawn, other in zip(
            ("kept", "kept_r1", "kept_strict"),
            areas(before.outcomes).values(),
            values.values(),
            samples,
            drawn_then,
            strict=True,
        ):
            interval = percentile_interval(kept_share(drawn, other))
            yield now.number(name, float(kept_share(today, then)), interval)
        if is_paired:
            right, was = outcomes.is_right, before.outcomes.is_right
            yield now.number("lost", float((was & ~right).sum()))
            yield now.number("found", float((right & ~was).sum()))
            added = visible_change_added(
                now.columns["overlap"], before.columns["overlap"]
            )
            if not math.isnan(added):
                yield now.number("visible_change_added", added)
    yield now.number("with_match", float(outcomes.has_match.sum()))
    yield now.number("places", float(outcomes.num_places))
    yield now.number(
        "recall_at_full_precision", pr_curve(outcomes).recall_at_full_precision
    )
    overlaps = now.columns["overlap"]
    for name in FAULTS:
        yield now.number(name, float(np.sum(now.columns["why"] == name)))
    # Their best match shows less than half of their scan.
    is_little_shown = (overlaps < _HALF) & ~outcomes.is_right
    yield now.number("hidden", float(is_little_shown.sum()))
    if not math.isnan(shown := mean_visible_change(overlaps)[0]):
        yield now.number("visible_change", shown)


def pose_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[Number]:
    """Yields a method's pose results; nothing if it estimates no poses.

    Args:
        now: outcome of the method in a condition.
        before: outcome of the method in the baseline. If it is given, the
            results include the metric `kept`: the success rate in the condition
            divided by the success rate in the baseline.
    """
    errors = now.pose_errors
    value = pose_success(errors, now.outcomes)
    if math.isnan(value):
        return
    number = int(now.outcomes.has_match.sum())
    yield now.number("pose_success", value, n=number)
    if before is not None:
        then = pose_success(before.pose_errors, before.outcomes)
        yield now.number("kept", float(kept_share(value, then)), n=number)
    # The same queries as in the report's table of poses.
    known = is_accepted(now.outcomes) & ~np.isnan(errors.translation)
    for name, some in (
        ("translation_median", errors.translation[known]),
        ("rotation_median_deg", errors.rotation_deg[known]),
    ):
        if len(some):
            yield now.number(name, float(np.median(some)), n=len(some))


def kept_share(
    changed: np.ndarray | float, unchanged: np.ndarray | float
) -> np.ndarray:
    """Returns `changed` / `unchanged`, NaN where `unchanged` is 0 or NaN.

    For a result with a change and the same result without it, the quotient is
    the share of the result that the change leaves.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.divide(changed, unchanged)
    return np.where(np.asarray(unchanged) > 0.0, share, math.nan)


def areas(outcomes: QueryOutcomes) -> dict[str, float]:
    """Returns AUC, R@1 and strict AUC, by their names in tables."""
    curve = pr_curve(outcomes)
    return {
        "auc": curve.auc,
        "r1": outcomes.recall_at(1),
        "auc_strict": curve.strict_auc(int(outcomes.has_match.sum())),
    }
