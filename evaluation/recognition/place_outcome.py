"""The outcome of a method on two drives, query by query."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.recognition.description import DescribedDrive
from evaluation.recognition.fault_kinds import NEARLY
from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.retrieval import Retrieval

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
        query: DescribedDrive,
        drives: Sequence[str],
        overlaps: np.ndarray,
        radius: float,
    ) -> PlaceOutcome:
        """Reduces the scores of all pairs to the outcome of each query.

        Args:
            method: that made the scores.
            is_gated: whether they were gated.
            retrieval: retrieval of Q queries and D places.
            query: the drive of the queries.
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
            stamps_ns=query.queries.stamps_ns,
            p_WQs=query.queries.p_WSs,
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
