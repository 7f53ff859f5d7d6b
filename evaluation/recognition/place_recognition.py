"""One method on one pair of drives, from scans to numbers."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
import math

from cns_drake.base.errors import InputError
from cns_drake.base.progress import Track, silent
from cns_drake.base.recordings.sequence import Sequence
from evaluation.methods.method import Method
from evaluation.recognition.metrics import (
    Interval,
    Mode,
    PlaceRecognitionMetrics,
    QueryOutcomes,
    evaluate,
    judge,
)
from evaluation.recognition.pose_errors import PoseMetrics, pose_metrics
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.recognition.retrieval import Retrieval, retrieve


@dataclass(frozen=True)
class PlaceRecognition:
    """The outcome of one method on one pair.

    Attributes:
        method: its name.
        parameters: all that it ran with.
        database: name of the drive whose places are known.
        query: name of the drive that asks.
        retrieval: scores and truth of all pairs.
        outcomes: what became of each query.
        metrics: the numbers.
        pose: how good the poses are that come with the places.
        protocol: that it ran by; nothing in it is left to the method.
    """

    method: str
    parameters: dict
    database: str
    query: str
    retrieval: Retrieval
    outcomes: QueryOutcomes
    metrics: PlaceRecognitionMetrics
    pose: PoseMetrics
    protocol: RetrievalProtocol

    def counting(self, mode: Mode) -> PlaceRecognition:
        """Returns the same outcome with its numbers in a mode."""
        return replace(self, metrics=evaluate(self.outcomes, mode))

    def to_json(self) -> dict:
        """Returns all numbers; NaN becomes None."""
        metrics = self.metrics
        index = metrics.f1_max_index
        pose = asdict(self.pose)
        return {
            "method": self.method,
            "mode": metrics.mode,
            "database": self.database,
            "query": self.query,
            "auc": metrics.auc,
            "auc_interval_95": _interval(metrics.auc_interval),
            "recall_at_1": _number(metrics.recall_at_1),
            "recall_at_1_interval_95": _interval(metrics.recall_at_1_interval),
            "recall_at_n": [
                _number(float(value)) for value in metrics.recall_at_n
            ],
            "recall_at_1_percent": _number(float(metrics.recall_at_1_percent)),
            "f1_max": metrics.f1_max,
            "f1_max_true_positives": (
                0 if index is None else int(metrics.curve.true_positives[index])
            ),
            "f1_max_counted": (
                0 if index is None else int(metrics.curve.counted[index])
            ),
            "queries": metrics.num_queries,
            "queries_with_match": metrics.num_with_match,
            "true_positives": metrics.num_right,
            "places": len(self.retrieval.database_frames),
            "recall_at_100_precision": metrics.curve.recall_at_full_precision,
            "pose": {key: _number(value) for key, value in pose.items()},
            "parameters": self.parameters,
            "protocol": self.protocol.to_json(),
        }


def run(
    database: Sequence,
    query: Sequence,
    method: Method,
    mode: Mode = "all",
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    track: Track = silent,
    *,
    across_maps: bool = False,
) -> PlaceRecognition:
    """Runs a method on a pair of drives.

    Args:
        database: the drive whose places are known.
        query: the drive that asks.
        method: that runs.
        mode: which queries count.
        protocol: what is asked.
        track: reports progress.
        across_maps: the two may be of maps of different names.

    Raises:
        InputError: if a sequence cannot be read, the two are not of the same
            world, the method fails, or no query has a match.
    """
    retrieval = retrieve(
        database, query, method, protocol, track, across_maps=across_maps
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
) -> PlaceRecognition:
    """Returns the numbers of what a method retrieved.

    Args:
        method: that made the scores.
        database: name of the drive whose places are known.
        query: name of the drive that asks.
        retrieval: scores and truth.
        protocol: by which it was asked.
        mode: which queries count.

    Raises:
        InputError: if no query has a match.
    """
    if not retrieval.matches.any():
        if protocol.exclude_recent is not None and database == query:
            raise InputError(
                f"{query}: never within {protocol.radius:g} m of where it was"
                f" {protocol.exclude_recent:g} s or more before"
            )
        nearest = retrieval.distances.min()
        raise InputError(
            f"{query}: no query lies within {protocol.radius:g} m of a place"
            f" of {database} (the nearest at {nearest:.1f} m)"
        )
    outcomes = judge(retrieval.scores, retrieval.matches)
    metrics = evaluate(outcomes)
    return PlaceRecognition(
        method=method.name,
        parameters=method.config.model_dump(mode="json"),
        database=database,
        query=query,
        retrieval=retrieval,
        outcomes=outcomes,
        metrics=metrics if mode == "all" else evaluate(outcomes, mode),
        pose=pose_metrics(retrieval.pose_errors, outcomes, metrics),
        protocol=protocol.of(method),
    )


def _interval(interval: Interval) -> list[float | None]:
    return [_number(interval.low), _number(interval.high)]


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
