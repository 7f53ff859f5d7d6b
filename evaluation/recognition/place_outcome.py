"""The outcome of a method on two drives, query by query."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.recognition.fault_kinds import NEARLY
from evaluation.recognition.metrics import (
    UNKNOWN,
    Interval,
    percentile_interval,
    pr_curve,
    resampled_metrics,
    resampled_weights,
)
from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.retrieval import Retrieval
from evaluation.recognition.survival import kept_share

# Kinds of wrong best places, in order of precedence.
FAULTS = ("no_place", "no_candidate", "other_city", "too_far", "elsewhere")
_HALF = 0.5


@dataclass(frozen=True)
class PlaceOutcome:
    """The outcome of a method on two drives.

    Attributes:
        method: its name.
        is_gated: whether the gate was used.
        outcomes: outcomes of Q queries.
        query_frames: (Q,) of the query drive.
        stamps_ns: (Q,) int64.
        p_WQs: (Q, 3) where the sensor was [m].
        match_drives: Q names of the drive of the best place; "" without a
            candidate.
        match_frames: (Q,) frame of the best place there; -1 without.
        distances: (Q,) between query and best place [m]; NaN without, and
            where the best place is of another city.
        pose_errors: errors of the best place.
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
        """Reduces the scores of all pairs to the outcome of each query.

        Args:
            method: that made the scores.
            is_gated: whether they were gated.
            retrieval: retrieval of Q queries and D places.
            query: (Q,) stamps [ns] and (Q, 3) places [m] of the queries.
            drives: D names of the drives of the places; that of the query's
                own city comes first.
            overlaps: (Q,) of the best match of each query.
            radius: of a match [m].
        """
        best = retrieval.best_places
        rows = np.arange(len(best))
        names = [drives[k] if k >= 0 else "" for k in best.tolist()]
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
            match_frames=np.where(
                best >= 0, retrieval.database_frames[best], -1
            ),
            distances=np.where(
                at_home, retrieval.distances[rows, best], np.nan
            ),
            pose_errors=retrieval.pose_errors,
            overlaps=overlaps,
            radius=radius,
        )

    @property
    def num_hidden(self) -> int:
        """Number of wrong answers to queries with little overlap.

        Their best match shows less than half of them.
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


def place_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[tuple[str, float, Interval]]:
    """Yields name, value and 95 % interval of the numbers of a method.

    Intervals are by bootstrap over blocks of the route; a sample has the same
    ones in the baseline.

    Args:
        now: its outcome in a condition.
        before: its outcome in the baseline, for what is kept, lost and found.
    """
    outcomes = now.outcomes
    curve = pr_curve(outcomes)
    with_match = int(outcomes.has_match.sum())
    strict = curve.strict_auc(with_match)
    weights = resampled_weights(len(outcomes), blocks=outcomes.blocks)
    areas, recalls, stricts = resampled_metrics(outcomes, weights)
    interval = percentile_interval
    yield "auc", curve.auc, interval(areas)
    yield "auc_strict", strict, interval(stricts)
    yield "r1", outcomes.recall_at(1), interval(recalls)
    if before is not None:
        then = pr_curve(before.outcomes)
        strict_then = then.strict_auc(int(before.outcomes.has_match.sum()))
        shares = [UNKNOWN] * 2
        if is_paired := len(before.outcomes) == len(outcomes):
            drawn = resampled_metrics(before.outcomes, weights)
            drawn_auc, _, drawn_strict = drawn
            shares = [
                interval(kept_share(one, other))
                for one, other in (
                    (areas, drawn_auc),
                    (stricts, drawn_strict),
                )
            ]
        yield "kept", float(kept_share(curve.auc, then.auc)), shares[0]
        yield "kept_strict", float(kept_share(strict, strict_then)), shares[1]
        if is_paired:
            right, was = outcomes.is_right, before.outcomes.is_right
            yield "lost", float((was & ~right).sum()), UNKNOWN
            yield "found", float((right & ~was).sum()), UNKNOWN
            # What two viewpoints hide from each other is in both.
            added = before.overlaps - now.overlaps
            added = added[~np.isnan(added)]
            if len(added):
                yield "visible_change_added", float(added.mean()), UNKNOWN
    yield "with_match", float(with_match), UNKNOWN
    yield "places", float(outcomes.num_places), UNKNOWN
    why = now.faults()
    for name in FAULTS:
        yield name, float(why.count(name)), UNKNOWN
    yield "hidden", float(now.num_hidden), UNKNOWN
    known = now.overlaps[~np.isnan(now.overlaps)]
    if len(known):
        yield "visible_change", 1.0 - float(known.mean()), UNKNOWN
