"""Measures one method on one pair of drives, from scans to numbers."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import math

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError
from cns_drake.base.json_text import json_values
from evaluation.methods.method import Method
from evaluation.recognition.metrics import (
    MODES,
    Mode,
    PlaceRecognitionMetrics,
    evaluate,
    pr_curve,
)
from evaluation.recognition.pose_errors import PoseMetrics, pose_metrics
from evaluation.recognition.protocol import RECORDED_PROTOCOL, RetrievalProtocol
from evaluation.recognition.query_outcomes import QueryOutcomes, judge
from evaluation.recognition.retrieval import Retrieval, retrieve

# Further radii of a match for which AUC is computed [m].
RADII = (2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0)


@dataclass(frozen=True)
class PlaceRecognition:
    """The result of one method on one pair of drives.

    Attributes:
        method: name of the method.
        parameters: all parameters of the method.
        database: name of the drive of the places.
        query: name of the drive of the queries.
        retrieval: scores and truth of all pairs of a query and a place.
        outcomes: outcomes of the queries.
        by_mode: mode -> metrics.
        pose: errors of the estimated poses.
        asked: protocol of the run.
        protocol: `asked`, with the choices that are the method's own.
        protocol_name: name of the protocol in tables.
        mode: mode of `metrics`: whether all queries count (`all`), or only
            queries with a match (`filtered`).
        pair: names of the map and of the stages of database and query, if the
            result is for a report.
    """

    method: str
    parameters: dict
    database: str
    query: str
    retrieval: Retrieval
    outcomes: QueryOutcomes
    by_mode: Mapping[Mode, PlaceRecognitionMetrics]
    pose: PoseMetrics
    asked: RetrievalProtocol
    protocol: RetrievalProtocol
    protocol_name: str
    mode: Mode = "all"
    pair: tuple[str, str, str] = ("", "", "")

    @property
    def metrics(self) -> PlaceRecognitionMetrics:
        """The metrics in the result's own mode, `mode`."""
        return self.by_mode[self.mode]

    def auc_over_radius(self) -> dict[float, float]:
        """Returns the AUC for several radii of a match: radius [m] -> AUC.

        All queries count.

        The AUC is NaN if no query has a match within the radius.
        """
        found = {}
        for radius in RADII:
            matches = self.retrieval.distances <= radius
            outcomes = judge(
                self.retrieval.scores, matches & self.retrieval.is_known
            )
            known = outcomes.has_match.any()
            found[radius] = pr_curve(outcomes).auc if known else math.nan
        return found

    def to_json(self) -> dict:
        """Returns all numbers as a dictionary for JSON; NaN becomes None."""
        metrics = self.metrics
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
            "places": len(self.retrieval.database_frames),
            "recall_at_full_precision": metrics.curve.recall_at_full_precision,
            "mean_reciprocal_rank": self.outcomes.mean_reciprocal_rank,
            "match_auroc": self.outcomes.match_auroc,
            "auc_over_radius": {
                f"{radius:g}": auc
                for radius, auc in self.auc_over_radius().items()
            },
            "pose": asdict(self.pose),
            "parameters": self.parameters,
            "protocol": self.protocol.to_json(),
        }
        return json_values(values)


def run(
    database: Drive,
    query: Drive,
    method: Method,
    mode: Mode = "all",
    protocol: RetrievalProtocol = RECORDED_PROTOCOL,
    *,
    across_maps: bool = False,
    overlaps: np.ndarray | None = None,
) -> PlaceRecognition:
    """Returns the result of a method on a pair of drives.

    Args:
        database, query: the drives.
        method: the method.
        mode: which queries count: `all`, or only those with a match
            (`filtered`).
        protocol: protocol of the comparison.
        across_maps: whether the drives may be from maps with different names.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows; by default computed from the scans. Used only for matches by
            overlap.

    Raises:
        InputError: if a drive cannot be read, the drives are not in the same
            world, the method returns an invalid result, or no query has a
            match.
    """
    retrieval = retrieve(
        database,
        query,
        method,
        protocol,
        across_maps=across_maps,
        overlaps=overlaps,
    )
    return judge_retrieval(
        method, database.name, query.name, retrieval, protocol, mode
    )


def judge_retrieval(
    method: Method,
    database: str,
    query: str,
    retrieval: Retrieval,
    protocol: RetrievalProtocol,
    mode: Mode = "all",
    pair: tuple[str, str, str] = ("", "", ""),
) -> PlaceRecognition:
    """Returns the metrics of a method on a pair of drives, from its scores.

    Args:
        method: the method.
        database, query: names of the drives.
        retrieval: scores and truth of all pairs of a query and a place.
        protocol: protocol of the retrieval.
        mode: which queries count: `all`, or only those with a match
            (`filtered`).
        pair: names of the map and of the stages of database and query, if the
            result is for a report.

    Raises:
        InputError: if no query has a match.
    """
    if not retrieval.matches.any():
        if protocol.exclude_recent is not None and database == query:
            raise InputError(
                f"{query}: never within {protocol.radius:g} m of where it was"
                f" {protocol.exclude_recent:g} s or more before"
            )
        if protocol.overlap is not None:
            raise InputError(
                f"{query}: no place of {database} shows"
                f" {protocol.overlap:.0%} of what a query shows"
            )
        nearest = retrieval.distances.min()
        raise InputError(
            f"{query}: no query lies within {protocol.radius:g} m of a place"
            f" of {database} (the nearest at {nearest:.1f} m)"
        )
    outcomes = judge(
        retrieval.scores, retrieval.matches, retrieval.query_blocks
    )
    by_mode = {one: evaluate(outcomes, one) for one in MODES}
    return PlaceRecognition(
        method=method.name,
        parameters=method.config.model_dump(mode="json"),
        database=database,
        query=query,
        retrieval=retrieval,
        outcomes=outcomes,
        by_mode=by_mode,
        pose=pose_metrics(retrieval.pose_errors, outcomes),
        asked=protocol,
        protocol=protocol.of(method),
        protocol_name=protocol.name_with(method),
        mode=mode,
        pair=pair,
    )
