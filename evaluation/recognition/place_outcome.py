"""The answers of a method to the queries of a drive, and their metrics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math
from typing import NamedTuple

import numpy as np

from evaluation.base import InputError
from evaluation.methods import Method
from evaluation.recognition.metrics import Mode, Number, numbers_of
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.query_outcomes import (
    QueryOutcomes,
    faults,
    judge,
    ranked_places,
)
from evaluation.recognition.retrieval import Retrieval

# Number of top-ranked places that are kept for each query.
NUM_BEST = 5


class QueryDrive(NamedTuple):
    """The drive of Q queries.

    Attributes:
        name: name of the drive.
        stamps_ns: (Q,) time stamps of the queries [ns].
        positions: (Q, 3) positions of the queries [m].
    """

    name: str
    stamps_ns: np.ndarray
    positions: np.ndarray


@dataclass(frozen=True, eq=False)
class PlaceOutcome:
    """A method's answers to the queries of a drive, and whether they are right.

    All numbers, tables and pages of place recognition are made from objects of
    this class. An object holds the top-ranked places of each query instead of
    the scores of all places.

    Attributes:
        method: name of the method, with its settings if it has any.
        database: name of the drive of the places.
        query: name of the drive of the queries.
        protocol: protocol with the method's own choices. The radius and the
            geometric verification of this protocol apply to the outcome.
        outcomes: outcomes of Q queries, with all columns of `queries.csv`. An
            unknown value is -1 for a frame, infinite for a rank, and NaN for
            other numbers.
        place_frames: (D,) frame of each place in its drive.
        best_places: (Q, K) int32, the top-ranked places of each query, best
            first; -1 where a query has fewer than K candidates.
        best_scores: (Q, K) scores of these places; NaN where there is no
            candidate.
        matches: (M, 2) int32, each pair of a query and a place that is a true
            match.
    """

    method: str
    database: str
    query: str
    protocol: RetrievalProtocol
    outcomes: QueryOutcomes
    place_frames: np.ndarray
    best_places: np.ndarray
    best_scores: np.ndarray
    matches: np.ndarray

    @classmethod
    def of(
        cls,
        name: str,
        method: Method,
        protocol: RetrievalProtocol,
        retrieval: Retrieval,
        query: QueryDrive,
        drives: Sequence[str],
        overlaps: np.ndarray | None = None,
        num_here: int | None = None,
    ) -> PlaceOutcome:
        """Returns the outcomes of a method's queries in a retrieval.

        Args:
            name: name of the method, with its settings.
            method: the method.
            protocol: protocol of the retrieval: the radius of a match, and
                whether geometric verification has changed the scores.
            retrieval: scores and ground truth of Q queries and D places.
            query: the drive of the queries.
            drives: name of each place's drive (D names). The first name is the
                name of the database drive.
            overlaps: (Q,) how much of the query's scan the best of its matches
                shows, see `evaluation.recognition.overlap_truth`; NaN without a
                match. None if it is unknown.
            num_here: number of places in the query's own city; these places
                come first. By default, all places of the database drive.
                Distances to all other places are unknown.
        """
        scores = retrieval.scores
        order = ranked_places(scores, NUM_BEST).astype(np.int32)
        best_scores = np.take_along_axis(scores, order, axis=1)
        best_places = np.where(np.isnan(best_scores), -1, order)
        outcomes = judge(scores, retrieval.matches, retrieval.query_blocks)
        if num_here is None:
            num_here = sum(name == drives[0] for name in drives)
        if overlaps is None:
            overlaps = np.full(len(outcomes), math.nan)
        best = retrieval.best_places
        distances = retrieval.best_distances
        distances[best >= num_here] = math.nan
        frames = retrieval.best_frames
        columns = {
            "query_frame": retrieval.query_frames,
            "query_stamp_ns": query.stamps_ns,
            "query_x": query.positions[:, 0],
            "query_y": query.positions[:, 1],
            "query_z": query.positions[:, 2],
            "block": outcomes.own_blocks,
            "correct": outcomes.is_right,
            "has_match": outcomes.has_match,
            "score": outcomes.best_scores,
            "first_right_rank": outcomes.first_right_ranks,
            "why": faults(outcomes, frames, distances, protocol.radius),
            "match_drive": np.array(
                [drives[k] if k >= 0 else "" for k in best.tolist()]
            ),
            "match_frame": frames,
            "distance": distances,
            "translation_error": retrieval.pose_errors.translation,
            "rotation_error_deg": retrieval.pose_errors.rotation_deg,
            "overlap": overlaps,
            "visible_change": 1.0 - overlaps,
            "nearest": np.where(
                retrieval.is_known, retrieval.distances, math.inf
            ).min(axis=1, initial=math.inf),
        }
        return cls(
            method=name,
            database=drives[0],
            query=query.name,
            protocol=protocol.of(method),
            outcomes=replace(outcomes, columns=columns),
            place_frames=retrieval.database_frames,
            best_places=best_places,
            best_scores=best_scores,
            matches=np.argwhere(retrieval.matches).astype(np.int32),
        )

    @classmethod
    def joined(cls, batches: Sequence[PlaceOutcome]) -> PlaceOutcome:
        """Returns the outcomes of successive batches of queries as one."""
        if len(batches) == 1:
            return batches[0]
        outcomes = QueryOutcomes.joined([one.outcomes for one in batches])
        columns = {**outcomes.columns, "block": outcomes.own_blocks}
        firsts = np.cumsum([0, *(len(one.outcomes) for one in batches)])
        return replace(
            batches[0],
            outcomes=replace(outcomes, columns=columns),
            best_places=np.concatenate([one.best_places for one in batches]),
            best_scores=np.concatenate([one.best_scores for one in batches]),
            matches=np.concatenate(
                [
                    one.matches + np.array([first, 0], np.int32)
                    for first, one in zip(firsts, batches, strict=False)
                ]
            ),
        )

    def numbers(
        self,
        task: str = "place",
        before: PlaceOutcome | None = None,
        mode: Mode = "all",
    ) -> Iterator[Number]:
        """Yields the numbers of a task, see `numbers_of`.

        Args:
            task: `place` or `pose`.
            before: outcome of the method in the baseline; None to leave out the
                results that compare the condition with the baseline.
            mode: which queries the precision-recall curve counts.
        """
        return numbers_of(
            task,
            self.outcomes,
            None if before is None else before.outcomes,
            method=self.method,
            verified=self.protocol.verified,
            mode=mode,
        )


def never_returns(name: str, protocol: RetrievalProtocol) -> str:
    """Returns what is wrong with a drive that never returns to a place."""
    return (
        f"{name}: never within {protocol.radius:g} m of where it was"
        f" {protocol.exclude_recent:g} s or more before"
    )


def check_has_match(outcome: PlaceOutcome) -> None:
    """Checks that at least one query has a match.

    Raises:
        InputError: no query has a match.
    """
    if outcome.outcomes.has_match.any():
        return
    protocol, database = outcome.protocol, outcome.database
    if protocol.exclude_recent is not None and database == outcome.query:
        raise InputError(never_returns(outcome.query, protocol))
    if protocol.overlap is not None:
        raise InputError(
            f"{outcome.query}: no place of {database} shows"
            f" {protocol.overlap:.0%} of a query's scan"
        )
    nearest = outcome.outcomes.columns["nearest"].min()
    raise InputError(
        f"{outcome.query}: no query lies within {protocol.radius:g} m of a"
        f" place of {database} (the nearest at {nearest:.1f} m)"
    )
