"""The table of metrics of other publications, beside those of the paper."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.recognition.place_recognition import RADII, RecognitionResult
from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.report.result_tables import by_pair_and_method
from evaluation.report.tables import Table


def metric_numbers(results: Sequence[RecognitionResult]) -> Table:
    """Returns all numbers, as `metrics.csv` has them.

    Args:
        results: of all pairs and methods.
    """
    rows = []
    for result in by_pair_and_method(results):
        outcome = result.outcome
        metrics = result.metrics["all"]
        rows.append(
            (
                *result.pair,
                result.method,
                metrics.recall_at_1,
                float(metrics.recall_at_1_percent),
                outcome.outcomes.mean_reciprocal_rank,
                metrics.curve.recall_at_full_precision,
                outcome.outcomes.match_auroc,
                outcome.pose.success,
                *outcome.auc_over_radius().values(),
                *protocol_values(outcome.protocol),
            )
        )
    header = (
        "map",
        "db",
        "query",
        "method",
        "recall_at_1",
        "recall_at_1_percent",
        "mean_reciprocal_rank",
        "recall_at_full_precision",
        "match_auroc",
        "pose_success",
        *(f"auc_within_{radius:g}_m" for radius in RADII),
        *PROTOCOL_COLUMNS,
    )
    return Table(header, tuple(rows))
