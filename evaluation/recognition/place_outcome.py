"""The outcome of a method on two drives, query by query."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from evaluation.recognition.fault_kinds import NEARLY, visible_change_added
from evaluation.recognition.metrics import (
    UNKNOWN,
    Interval,
    own_samples,
    paired_samples,
    percentile_interval,
    pr_curve,
)
from evaluation.recognition.pose_errors import PoseErrors, pose_success
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.retrieval import Retrieval

# Reasons for wrong best places, in order of precedence.
FAULTS = ("no_place", "no_candidate", "other_city", "too_far", "elsewhere")
_HALF = 0.5


@dataclass(frozen=True)
class PlaceOutcome:
    """The outcome of a method on two drives.

    Attributes:
        method: name of the method.
        is_gated: whether the gate was used.
        outcomes: outcomes of Q queries.
        query_frames: (Q,) frames of the queries in their drive.
        stamps_ns: (Q,) int64 time stamps of the queries.
        p_WQs: (Q, 3) positions of the sensor at the queries [m].
        match_drives: Q names of the drive of the best place; "" without a
            candidate.
        match_frames: (Q,) frame of the best place in that drive; -1 without a
            candidate.
        distances: (Q,) distances between query and best place [m]; NaN without
            a candidate, and where the best place is in another city.
        pose_errors: errors of the poses at the best places.
        overlaps: (Q,) how much of the query's scan the best of its matches
            shows, see `overlap_truth`; NaN without a match.
        radius: radius of a match [m].
    """

    method: str
    is_gated: bool
    outcomes: QueryOutcomes
    query_frames: np.ndarray
    stamps_ns: np.ndarray
    p_WQs: np.ndarray
    match_drives: list[str]
    match_frames: np.ndarray
    distances: np.ndarray
    pose_errors: PoseErrors
    overlaps: np.ndarray
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
        """Returns the outcome of each query from the scores of all pairs.

        Args:
            method: method that made the scores.
            is_gated: whether they were gated.
            retrieval: retrieval of Q queries and D places.
            query: (Q,) stamps [ns] and (Q, 3) places [m] of the queries.
            drives: D names of the drives of the places; that of the query's
                own city comes first.
            overlaps: (Q,) of the best match of each query.
            radius: radius of a match [m].
        """
        best = retrieval.best_places.tolist()
        names = [drives[k] if k >= 0 else "" for k in best]
        at_home = np.array([name == drives[0] for name in names])
        return cls(
            method=method,
            is_gated=is_gated,
            outcomes=judge(
                retrieval.scores, retrieval.matches, retrieval.query_blocks
            ),
            query_frames=retrieval.query_frames,
            stamps_ns=query[0],
            p_WQs=query[1],
            match_drives=names,
            match_frames=retrieval.best_frames,
            distances=np.where(at_home, retrieval.best_distances, np.nan),
            pose_errors=retrieval.pose_errors,
            overlaps=overlaps,
            radius=radius,
        )

    def number(
        self,
        metric: str,
        value: float,
        interval: Interval = UNKNOWN,
        n: int | None = None,
    ) -> Number:
        """Returns a metric of the outcome, by default over all queries."""
        count = len(self.outcomes) if n is None else n
        return Number(
            self.method, self.is_gated, metric, value, interval, count
        )

    @property
    def num_hidden(self) -> int:
        """Number of wrong answers to queries with little overlap.

        Their best match shows less than half of their scan.
        """
        is_hidden = self.overlaps < _HALF
        return int((is_hidden & ~self.outcomes.is_right).sum())

    def faults(self) -> list[str]:
        """Returns the reason for each query's wrong best place.

        Returns:
            Q of: "" if it is right; `no_place` if the query has no match;
            `no_candidate` if the method has no place, or rejects all;
            `other_city`; `too_far` if it is within two radii; `elsewhere`.
        """
        wrong = [
            ~self.outcomes.has_match,
            self.match_frames < 0,
            np.isnan(self.distances),
            self.distances <= NEARLY * self.radius,
        ]
        return np.where(
            self.outcomes.is_right,
            "",
            np.select(wrong, FAULTS[:-1], FAULTS[-1]),
        ).tolist()

    def columns(self) -> dict[str, np.ndarray | list]:
        """Returns the columns of `queries.csv` for each of the Q queries."""
        outcomes = self.outcomes
        blocks = outcomes.blocks
        return {
            "query_frame": self.query_frames,
            "query_stamp_ns": self.stamps_ns,
            "query_x": self.p_WQs[:, 0],
            "query_y": self.p_WQs[:, 1],
            "query_z": self.p_WQs[:, 2],
            "block": np.arange(len(outcomes)) if blocks is None else blocks,
            "correct": outcomes.is_right,
            "has_match": outcomes.has_match,
            "score": outcomes.best_scores,
            "first_right_rank": outcomes.known_ranks,
            "why": self.faults(),
            "match_drive": self.match_drives,
            "match_frame": self.match_frames,
            "distance": self.distances,
            "translation_error": self.pose_errors.translation,
            "rotation_error_deg": self.pose_errors.rotation_deg,
            "overlap": self.overlaps,
            "visible_change": 1.0 - self.overlaps,
        }


class Number(NamedTuple):
    """A result of a task.

    Attributes:
        method: method, estimator or baseline; "" if there is none. For a place
            recognition method, it is the method's name with its settings.
        gate: whether the gate was used.
        metric: name of the metric.
        value: its value.
        interval: its 95 % interval.
        n: number of queries, or other things, that count.
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
    """Yields a method's place recognition results in a condition.

    Intervals are by bootstrap over blocks of the route. Each bootstrap sample
    draws the same blocks in the condition and in the baseline.

    Args:
        now: outcome of the method in the condition.
        before: outcome of the method in the baseline, with which `kept`, `lost`
            and `found` are computed; None to leave these out.
    """
    outcomes = now.outcomes
    values = _areas(outcomes)
    samples = own_samples(outcomes)
    for (name, value), drawn in zip(values.items(), samples, strict=True):
        yield now.number(name, value, percentile_interval(drawn))
    if before is not None:
        drawn_then: Sequence[np.ndarray | float] = [math.nan] * len(samples)
        if is_paired := len(before.outcomes) == len(outcomes):
            drawn_then = paired_samples(before.outcomes, outcomes)
        for name, then, today, drawn, other in zip(
            ("kept", "kept_r1", "kept_strict"),
            _areas(before.outcomes).values(),
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
            added = visible_change_added(now.overlaps, before.overlaps)
            if not math.isnan(added):
                yield now.number("visible_change_added", added)
    yield now.number("with_match", float(outcomes.has_match.sum()))
    yield now.number("places", float(outcomes.num_places))
    yield now.number(
        "recall_at_full_precision", pr_curve(outcomes).recall_at_full_precision
    )
    why = now.faults()
    for name in FAULTS:
        yield now.number(name, float(why.count(name)))
    yield now.number("hidden", float(now.num_hidden))
    known = now.overlaps[~np.isnan(now.overlaps)]
    if len(known):
        yield now.number("visible_change", 1.0 - float(known.mean()))


def pose_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[Number]:
    """Yields a method's pose results; nothing if it estimates no poses.

    Args:
        now: outcome of the method in a condition.
        before: outcome of the method in the baseline, with which the kept share
            is computed.
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
    known = ~np.isnan(errors.translation)
    for name, some in (
        ("translation_median", errors.translation[known]),
        ("rotation_median_deg", errors.rotation_deg[known]),
    ):
        if len(some):
            yield now.number(name, float(np.median(some)), n=number)


def kept_share(
    changed: np.ndarray | float, unchanged: np.ndarray | float
) -> np.ndarray:
    """Returns changed / unchanged; NaN where `unchanged` is 0 or NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.divide(changed, unchanged)
    return np.where(np.asarray(unchanged) > 0.0, share, math.nan)


def _areas(outcomes: QueryOutcomes) -> dict[str, float]:
    """Returns the metrics of which `own_samples` returns samples."""
    curve = pr_curve(outcomes)
    return {
        "auc": curve.auc,
        "r1": outcomes.recall_at(1),
        "auc_strict": curve.strict_auc(int(outcomes.has_match.sum())),
    }
