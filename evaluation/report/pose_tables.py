"""The table of the errors of estimated poses."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.report.method_titles import title
from evaluation.report.result_tables import by_pair_and_method
from evaluation.report.tables import Table

POSE_CAPTION = (
    "Poses that come with the places. Errors of the accepted matches: best"
    " places that are right, with a score from that of the greatest F1 on."
    " Success: queries with a match whose pose is wrong by at most 2 m and"
    " 5 deg, whatever the score. Recall at full precision: the greatest at"
    " which no accepted place is wrong. Scan Context++ and SOLiD estimate"
    " little more than the turn."
)


def pose_table(results: Sequence[RecognitionResult]) -> Table:
    """Returns the table for print: a row for each pair and method.

    Args:
        results: of all pairs and methods.
    """
    rows = []
    for result in by_pair_and_method(results):
        rows.append(
            (
                result.map_name,
                " → ".join(result.stages),
                title(result.method),
                *_values(result),
            )
        )
    return Table(
        (
            "map",
            "DB → query",
            "method",
            "median",
            "90 %",
            "median",
            "90 %",
            "success",
            "recall at full precision",
        ),
        tuple(rows),
        groups=(
            ("", 3),
            ("translation [m]", 2),
            ("rotation [deg]", 2),
            ("", 2),
        ),
        caption=POSE_CAPTION,
    )


def pose_numbers(results: Sequence[RecognitionResult]) -> Table:
    """Returns all numbers, as `poses.csv` has them."""
    header = (
        "map",
        "db",
        "query",
        "method",
        "accepted_matches",
        "translation_median",
        "translation_90",
        "rotation_median_deg",
        "rotation_90_deg",
        "success",
        "recall_at_100_precision",
        *PROTOCOL_COLUMNS,
    )
    rows = []
    for result in results:
        rows.append(
            (
                *result.pair,
                result.method,
                result.outcome.pose.num_accepted,
                *_values(result),
                *protocol_values(result.outcome.protocol),
            )
        )
    return Table(header, tuple(rows))


def _values(result: RecognitionResult) -> tuple[float, ...]:
    pose = result.outcome.pose
    return (
        pose.translation_median,
        pose.translation_90,
        pose.rotation_median_deg,
        pose.rotation_90_deg,
        pose.success,
        result.metrics["all"].curve.recall_at_full_precision,
    )
