"""One method on one pair of drives, from scans to numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from evaluation.methods.method import Method
from evaluation.recognition.metrics import (
    Interval,
    Mode,
    PlaceRecognitionMetrics,
    QueryOutcomes,
    evaluate,
    judge,
)
from evaluation.recognition.retrieval import (
    MATCH_RADIUS,
    Retrieval,
    retrieve,
)
from evaluation.sequences.sequence import Sequence
from evaluation.support.errors import InputError
from evaluation.support.progress import Track, silent


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
    """

    method: str
    parameters: dict
    database: str
    query: str
    retrieval: Retrieval
    outcomes: QueryOutcomes
    metrics: PlaceRecognitionMetrics

    def counting(self, mode: Mode) -> PlaceRecognition:
        """Returns the same outcome with its numbers in a mode."""
        return replace(self, metrics=evaluate(self.outcomes, mode))

    def to_json(self) -> dict:
        """Returns all numbers; NaN becomes None."""
        metrics = self.metrics
        index = metrics.f1_max_index
        return {
            "method": self.method,
            "mode": metrics.mode,
            "database": self.database,
            "query": self.query,
            "auc": metrics.auc,
            "auc_interval_95": _interval(metrics.auc_interval),
            "recall_at_1": _number(metrics.recall_at_1),
            "recall_at_1_interval_95": _interval(metrics.recall_at_1_interval),
            "recall_at_n": [_number(value) for value in metrics.recall_at_n],
            "recall_at_1_percent": _number(metrics.recall_at_1_percent),
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
            "parameters": self.parameters,
        }


def run(
    database: Sequence,
    query: Sequence,
    method: Method,
    mode: Mode = "all",
    track: Track = silent,
) -> PlaceRecognition:
    """Runs a method on a pair of drives.

    Raises:
        InputError: if a sequence cannot be read, the two are not of the same
            world, or no query has a match.
    """
    retrieval = retrieve(database, query, method, track)
    return judge_retrieval(method, database.name, query.name, retrieval, mode)


def judge_retrieval(
    method: Method,
    database: str,
    query: str,
    retrieval: Retrieval,
    mode: Mode = "all",
) -> PlaceRecognition:
    """Returns the numbers of what a method retrieved.

    Args:
        method: that made the scores.
        database: name of the drive whose places are known.
        query: name of the drive that asks.
        retrieval: scores and truth.
        mode: which queries count.

    Raises:
        InputError: if no query has a match.
    """
    if not retrieval.matches.any():
        nearest = retrieval.distances.min()
        raise InputError(
            f"{query}: no query lies within {MATCH_RADIUS} m of a place"
            f" of {database} (the nearest at {nearest:.1f} m)"
        )
    outcomes = judge(retrieval.scores, retrieval.matches)
    return PlaceRecognition(
        method=method.name,
        parameters=method.config.model_dump(mode="json"),
        database=database,
        query=query,
        retrieval=retrieval,
        outcomes=outcomes,
        metrics=evaluate(outcomes, mode),
    )


def _interval(interval: Interval) -> list[float | None]:
    return [_number(interval.low), _number(interval.high)]


def _number(value: float) -> float | None:
    value = float(value)
    return None if math.isnan(value) else value
