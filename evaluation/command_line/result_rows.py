"""Results as the lines that `cns-eval` prints."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from typing import TYPE_CHECKING

from cns_drake.base import terminal

if TYPE_CHECKING:
    from evaluation.change.drive_change import ChangeReport
    from evaluation.recognition.place_recognition import PlaceRecognition
    from evaluation.recognition.resampling import Interval


def change_rows(report: ChangeReport) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `tcr`."""
    change = report.change
    pair = f"{report.source} <-> {report.target}"
    yield "pair", pair
    yield "TCR_sym", terminal.number(change.symmetric)
    if change.undefined_because:
        yield "  because", change.undefined_because
    for label, names, side in (
        ("TCR", (report.source, report.target), change.source_to_target),
        ("TCR", (report.target, report.source), change.target_to_source),
    ):
        counts = f"({side.num_unchanged} of {side.num_in_hull} unchanged)"
        yield (
            f"{label} {names[0]} -> {names[1]}",
            f"{terminal.number(side.ratio)}  {counts}",
        )
    if report.masked is not None:
        yield (
            "TCR_sym where both drove",
            terminal.number(report.masked.symmetric),
        )
    if report.control is not None and report.control_names is not None:
        value = terminal.number(report.control.symmetric)
        yield (
            "TCR_sym of the routes alone",
            f"{value}  ({' <-> '.join(report.control_names)})",
        )


def recognition_rows(result: PlaceRecognition) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `pr`."""
    from evaluation.recognition.pose_errors import (
        SUCCESS_ROTATION_DEG,
        SUCCESS_TRANSLATION,
    )

    metrics = result.metrics
    yield "method", result.method
    yield "database -> query", f"{result.database} -> {result.query}"
    yield "mode", metrics.mode
    yield (
        "queries, with a match (N)",
        f"{metrics.num_queries}, {metrics.num_with_match}",
    )
    yield (
        "R@1",
        f"{terminal.number(metrics.recall_at_1)}"
        f"  {_interval_text(metrics.recall_at_1_interval)}"
        f"  (TP {metrics.num_right} of N {metrics.num_with_match})",
    )
    for rank in (5, 10, 25):
        yield f"R@{rank}", terminal.number(metrics.recall_at_n[rank - 1])
    yield "R@1%", terminal.number(metrics.recall_at_1_percent)
    yield (
        "AUC",
        f"{terminal.number(metrics.auc)}"
        f"  {_interval_text(metrics.auc_interval)}",
    )
    f1 = terminal.number(metrics.f1_max)
    if metrics.f1_max_index is not None:
        index = metrics.f1_max_index
        f1 += (
            f"  (TP {metrics.curve.true_positives[index]},"
            f" T {metrics.curve.counted[index]})"
        )
    yield "F1max", f1
    number = terminal.number(metrics.curve.recall_at_full_precision)
    yield "recall at 100 % precision", number
    outcomes = result.outcomes
    yield (
        "mean reciprocal rank",
        terminal.number(outcomes.mean_reciprocal_rank),
    )
    if not isnan(outcomes.match_auroc):
        yield (
            "AUROC of queries with a match",
            terminal.number(outcomes.match_auroc),
        )
    yield (
        "AUC by radius",
        ", ".join(
            f"{radius:g} m {terminal.number(auc)}"
            for radius, auc in result.auc_over_radius().items()
        ),
    )
    pose = result.pose
    if not isnan(pose.success):
        yield (
            "translation error, median, 90 %",
            f"{terminal.number(pose.translation_median)} m,"
            f" {terminal.number(pose.translation_90)} m"
            f"  ({pose.num_accepted} accepted matches)",
        )
        yield (
            "rotation error, median, 90 %",
            f"{terminal.number(pose.rotation_median_deg)} deg,"
            f" {terminal.number(pose.rotation_90_deg)} deg",
        )
        yield (
            f"within {SUCCESS_TRANSLATION:g} m"
            f" and {SUCCESS_ROTATION_DEG:g} deg",
            f"{terminal.number(pose.success)}  (of N)",
        )
    yield "protocol", result.protocol.to_text()


def _interval_text(interval: Interval) -> str:
    low, high = terminal.number(interval.low), terminal.number(interval.high)
    return f"[{low}, {high}]"
