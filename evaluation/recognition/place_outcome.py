"""The answers of a method to the queries of a drive, and their metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
import math
from typing import NamedTuple

import numpy as np

from cns_drake.base import InputError, json_values
from evaluation.methods import Method
from evaluation.recognition.faults import faults
from evaluation.recognition.pair_scores import (
    MODES,
    Mode,
    PlaceRecognitionMetrics,
    evaluate,
)
from evaluation.recognition.pose_errors import (
    PoseErrors,
    PoseMetrics,
    pose_metrics,
)
from evaluation.recognition.precision_recall import pr_curve
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.ranking import ranked_places
from evaluation.recognition.result_number import Number
from evaluation.recognition.retrieval import Retrieval
from evaluation.recognition.sign_flips import (
    UNKNOWN,
    Interval,
)

# Further radii of a match for which AUC is computed [m].
RADII = (2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0)
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
        protocol_name: name of the protocol in tables, see
            `RetrievalProtocol.name_with`.
        outcomes: outcomes of Q queries.
        columns: name of a column of `queries.csv` -> (Q,) values. An unknown
            value is -1 for a frame, infinite for a rank, and NaN for other
            numbers.
        place_frames: (D,) frame of each place in its drive.
        best_places: (Q, K) int32, the top-ranked places of each query, best
            first; -1 where a query has fewer than K candidates.
        best_scores: (Q, K) scores of these places; NaN where there is no
            candidate.
        matches: (M, 2) int32, each pair of a query and a place that is a true
            match.
        nearest: (Q,) distance of each query to the nearest place that is
            allowed as an answer [m]; infinite if there is none.
    """

    method: str
    database: str
    query: str
    protocol: RetrievalProtocol
    protocol_name: str
    outcomes: QueryOutcomes
    columns: Mapping[str, np.ndarray]
    place_frames: np.ndarray
    best_places: np.ndarray
    best_scores: np.ndarray
    matches: np.ndarray
    nearest: np.ndarray

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
        columns = {
            "query_frame": retrieval.query_frames,
            "query_stamp_ns": query.stamps_ns,
            "query_x": query.positions[:, 0],
            "query_y": query.positions[:, 1],
            "query_z": query.positions[:, 2],
            "block": outcomes.own_blocks,
            **_columns_of_answers(
                retrieval, outcomes, drives, num_here, protocol.radius
            ),
            "overlap": overlaps,
            "visible_change": 1.0 - overlaps,
        }
        allowed = np.where(retrieval.is_known, retrieval.distances, math.inf)
        return cls(
            method=name,
            database=drives[0],
            query=query.name,
            protocol=protocol.of(method),
            protocol_name=protocol.name_with(method),
            outcomes=outcomes,
            columns=columns,
            place_frames=retrieval.database_frames,
            best_places=best_places,
            best_scores=best_scores,
            matches=np.argwhere(retrieval.matches).astype(np.int32),
            nearest=allowed.min(axis=1, initial=math.inf),
        )

    @classmethod
    def joined(cls, batches: Sequence[PlaceOutcome]) -> PlaceOutcome:
        """Returns the outcomes of successive batches of queries as one."""
        if len(batches) == 1:
            return batches[0]
        outcomes = QueryOutcomes.joined([one.outcomes for one in batches])
        columns = {
            name: np.concatenate([one.columns[name] for one in batches])
            for name in batches[0].columns
        }
        firsts = np.cumsum([0, *(len(one.outcomes) for one in batches)])
        return replace(
            batches[0],
            outcomes=outcomes,
            columns=columns | {"block": outcomes.own_blocks},
            best_places=np.concatenate([one.best_places for one in batches]),
            best_scores=np.concatenate([one.best_scores for one in batches]),
            matches=np.concatenate(
                [
                    one.matches + np.array([first, 0], np.int32)
                    for first, one in zip(firsts, batches, strict=False)
                ]
            ),
            nearest=np.concatenate([one.nearest for one in batches]),
        )

    @property
    def is_verified(self) -> bool:
        """Whether geometric verification was used.

        Geometric verification rejects places that lie too far away according to
        the method's own pose estimate.
        """
        return self.protocol.verified

    @property
    def radius(self) -> float:
        """Greatest distance between a query and its match [m]."""
        return self.protocol.radius

    @property
    def pose_errors(self) -> PoseErrors:
        """Errors of the poses at the top-ranked places."""
        return PoseErrors(
            self.columns["translation_error"],
            self.columns["rotation_error_deg"],
        )

    @cached_property
    def by_mode(self) -> Mapping[Mode, PlaceRecognitionMetrics]:
        """Metrics by mode: of all queries, or of the queries with a match."""
        return {mode: evaluate(self.outcomes, mode) for mode in MODES}

    @cached_property
    def pose(self) -> PoseMetrics:
        """Errors of the estimated poses."""
        return pose_metrics(self.pose_errors, self.outcomes)

    def auc_over_radius(self) -> dict[float, float]:
        """Returns a mapping from the radius of a match [m] to the AUC.

        The mapping contains several radii. All queries count. The AUC is NaN if
        no query has a match within the radius.
        """
        found = {}
        for radius in RADII:
            has_match = self.nearest <= radius
            outcomes = replace(
                self.outcomes,
                is_right=self.columns["distance"] <= radius,
                has_match=has_match,
            )
            found[radius] = math.nan
            if has_match.any():
                found[radius] = pr_curve(outcomes).auc
        return found

    def to_json(self, mode: Mode = "all") -> dict:
        """Returns all numbers as a dictionary for JSON; NaN becomes None.

        Args:
            mode: which queries count: `all`, or only queries with a match
                (`filtered`).
        """
        metrics = self.by_mode[mode]
        true_positives = counted = 0
        if metrics.f1_max_index is not None:
            true_positives = metrics.curve.true_positives[metrics.f1_max_index]
            counted = metrics.curve.counted[metrics.f1_max_index]
        values = {
            "method": self.method,
            "mode": metrics.mode,
            "database": self.database,
            "query": self.query,
            "auc": metrics.auc,
            "auc_strict": metrics.auc_strict,
            "auc_interval_95": metrics.auc_interval.to_json(),
            "recall_at_1": metrics.recall_at_1,
            "r1": metrics.recall_at_1,  # Its name in tables of results.
            "recall_at_1_interval_95": metrics.recall_at_1_interval.to_json(),
            "recall_at_n": metrics.recall_at_n.tolist(),
            "recall_at_1_percent": metrics.recall_at_1_percent,
            "f1_max": metrics.f1_max,
            "f1_max_true_positives": int(true_positives),
            "f1_max_counted": int(counted),
            "queries": metrics.num_queries,
            "queries_with_match": metrics.num_with_match,
            "true_positives": metrics.num_right,
            "places": self.outcomes.num_places,
            "recall_at_full_precision": metrics.curve.recall_at_full_precision,
            "mean_reciprocal_rank": self.outcomes.mean_reciprocal_rank,
            "match_auroc": self.outcomes.match_auroc,
            "auc_over_radius": {
                f"{radius:g}": auc
                for radius, auc in self.auc_over_radius().items()
            },
            "pose": asdict(self.pose),
            "protocol": self.protocol.to_json(),
        }
        return json_values(values)

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
            self.method, self.is_verified, metric, value, interval, count
        )


def _columns_of_answers(
    retrieval: Retrieval,
    outcomes: QueryOutcomes,
    drives: Sequence[str],
    num_here: int,
    radius: float,
) -> dict[str, np.ndarray]:
    """Returns the columns of `queries.csv` on the top-ranked places.

    Args:
        retrieval: see `PlaceOutcome.of`.
        outcomes: outcomes of the queries.
        drives: see `PlaceOutcome.of`.
        num_here: see `PlaceOutcome.of`.
        radius: radius of a match [m].
    """
    best = retrieval.best_places
    distances = retrieval.best_distances
    distances[best >= num_here] = math.nan
    names = [drives[k] if k >= 0 else "" for k in best.tolist()]
    return {
        "correct": outcomes.is_right,
        "has_match": outcomes.has_match,
        "score": outcomes.best_scores,
        "first_right_rank": outcomes.first_right_ranks,
        "why": faults(outcomes, retrieval.best_frames, distances, radius),
        "match_drive": np.array(names),
        "match_frame": retrieval.best_frames,
        "distance": distances,
        "translation_error": retrieval.pose_errors.translation,
        "rotation_error_deg": retrieval.pose_errors.rotation_deg,
    }


def check_has_match(outcome: PlaceOutcome) -> None:
    """Checks that at least one query has a match.

    Raises:
        InputError: no query has a match.
    """
    if outcome.outcomes.has_match.any():
        return
    protocol, database = outcome.protocol, outcome.database
    if protocol.exclude_recent is not None and database == outcome.query:
        raise InputError(
            f"{outcome.query}: never within {protocol.radius:g} m of where it"
            f" was {protocol.exclude_recent:g} s or more before"
        )
    if protocol.overlap is not None:
        raise InputError(
            f"{outcome.query}: no place of {database} shows"
            f" {protocol.overlap:.0%} of a query's scan"
        )
    raise InputError(
        f"{outcome.query}: no query lies within {protocol.radius:g} m of a"
        f" place of {database} (the nearest at {outcome.nearest.min():.1f} m)"
    )
