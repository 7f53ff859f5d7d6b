"""The results of a report, and the tables made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from evaluation.change.drive_change import ChangeResult, symmetric_changes
from evaluation.recognition.metrics import MODES, Mode
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.report.method_titles import in_table_order, title
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.tables import Table, ranked


def protocol_text(results: Sequence[RecognitionResult]) -> str:
    """Returns the protocol in words; each method sets its scans per place."""
    if not results:
        return ""
    return replace(results[0].outcome.protocol, scans_per_place=None).to_text()


def by_pair_and_method(
    results: Sequence[RecognitionResult],
) -> list[RecognitionResult]:
    """Returns results pair by pair, methods in the order of tables."""
    pairs = list(dict.fromkeys(result.pair for result in results))
    methods = in_table_order(result.method for result in results)
    return sorted(
        results,
        key=lambda r: (pairs.index(r.pair), methods.index(r.method)),
    )


def change_table(
    results: Sequence[ChangeResult], reference: Reference = NO_REFERENCE
) -> Table:
    """Returns Table I: the change of each pair, and its parts.

    Args:
        results: of all pairs.
        reference: its published values stand beside ours, and below.
    """
    header = (
        "map",
        "stages",
        "TCR_sym",
        "paper",
        "earlier → later",
        "later → earlier",
        "same stage, both routes",
        "where both drove",
        "voxels in hulls",
        "unchanged",
    )
    rows: list[tuple] = []
    for result in results:
        report = result.report
        change = report.change
        rows.append(
            (
                result.map_name,
                " ↔ ".join(result.stages),
                change.symmetric,
                reference.change(result.map_name, result.stages),
                change.source_to_target.ratio,
                change.target_to_source.ratio,
                report.control.symmetric if report.control else None,
                report.masked.symmetric if report.masked else None,
                change.num_in_hull,
                change.num_unchanged,
            )
        )
    names = {result.map_name for result in results}
    for label, stages, value in reference.further_changes(names):
        rows.append((label, stages, None, value, *(None,) * 6))
    return Table(
        header,
        tuple(rows),
        caption="Temporal change ratio: TCR_sym is 0 where nothing changed and"
        " 1 where everything did. Same stage: TCR_sym of the two routes in one"
        " stage of the city, where nothing changed. Where both drove: only"
        " voxels within 40 m of both routes.",
    )


def recognition_tables(
    results: Sequence[RecognitionResult],
    changes: Sequence[ChangeResult],
    reference: Reference = NO_REFERENCE,
) -> list[Table]:
    """Returns Table II in its forms.

    The first form counts as the reference does, if it has such numbers; one
    form for each mode follows.
    """
    modes: list[Mode | None] = list(MODES)
    if any(map(reference.covers, results)):
        modes.insert(0, None)
    return [
        recognition_table(results, changes, mode, reference) for mode in modes
    ]


def recognition_table(
    results: Sequence[RecognitionResult],
    changes: Sequence[ChangeResult],
    mode: Mode | None = None,
    reference: Reference = NO_REFERENCE,
) -> Table:
    """Returns Table II: a row for each pair, three columns for each method.

    Args:
        results: of all pairs and methods.
        changes: for the TCR_sym of the pairs.
        mode: mode in which methods are counted; None for the mode that the
            reference used for each.
        reference: its values stand beside ours.
    """
    methods = in_table_order(result.method for result in results)
    names = ("AUC", "R@1", "F1")
    tcr = symmetric_changes(changes)
    by_pair: dict[tuple, dict[str, RecognitionResult]] = {}
    for result in results:
        by_pair.setdefault(result.pair, {})[result.method] = result
    rows = []
    for pair, of_method in by_pair.items():
        map_name, *stages = pair
        columns = []
        for name in names:
            values, printed = [], []
            for method in methods:
                ours, theirs = _numbers(
                    of_method.get(method), mode, name, reference
                )
                values.append(ours)
                printed.append(theirs)
            columns.append(ranked(values, printed))
        cells = [column[i] for i in range(len(methods)) for column in columns]
        rows.append((map_name, " → ".join(stages), tcr.get(pair), *cells))
    captions = {
        None: f", {reference.counting[0]}",
        "all": ", all queries counted (mode all)",
        "filtered": ", only queries counted that have a match (mode filtered;"
        " F1 then says no more than R@1)",
    }
    beside = ""
    if any(map(reference.covers, results)):
        beside = f" In brackets or small: the value of {reference.title}."
    return Table(
        ("map", "DB → query", "TCR_sym", *names * len(methods)),
        tuple(rows),
        groups=(("", 3), *((title(method), 3) for method in methods)),
        caption=f"Place recognition{captions[mode]}."
        f" {protocol_text(results)}{beside}"
        " Bold: best of a row; underlined: second.",
    )


def audit_table(
    results: Sequence[RecognitionResult], reference: Reference = NO_REFERENCE
) -> Table:
    """Returns all numbers with the counts behind them, a row each."""
    header = (
        "map",
        "DB → query",
        "method",
        "mode",
        "AUC",
        "AUC low",
        "AUC high",
        "paper's AUC",
        "R@1",
        "R@1 low",
        "R@1 high",
        "paper's R@1",
        "R@5",
        "R@25",
        "R@1%",
        "F1max",
        "paper's F1",
        "queries",
        "N (with a match)",
        "TP of R@1",
        "TP of F1max",
        "T of F1max",
        *PROTOCOL_COLUMNS,
    )
    rows = []
    for result in results:
        for mode in MODES:
            metrics = result.metrics[mode]
            printed = reference.values(result, mode)
            index = metrics.f1_max_index
            curve = metrics.curve
            rows.append(
                (
                    result.map_name,
                    " → ".join(result.stages),
                    result.method,
                    mode,
                    metrics.auc,
                    metrics.auc_interval.low,
                    metrics.auc_interval.high,
                    printed.auc if printed else None,
                    metrics.recall_at_1,
                    metrics.recall_at_1_interval.low,
                    metrics.recall_at_1_interval.high,
                    printed.recall_at_1 if printed else None,
                    float(metrics.recall_at_n[4]),
                    float(metrics.recall_at_n[24]),
                    float(metrics.recall_at_1_percent),
                    metrics.f1_max,
                    printed.f1_max if printed else None,
                    metrics.num_queries,
                    metrics.num_with_match,
                    metrics.num_right,
                    None if index is None else int(curve.true_positives[index]),
                    None if index is None else int(curve.counted[index]),
                    *protocol_values(result.outcome.protocol),
                )
            )
    return Table(
        header,
        tuple(rows),
        caption="All numbers with 95 % intervals (bootstrap over queries) and"
        " the counts they are made of: R@1 = TP / N, F1max = 2 TP / (TP + T).",
    )


def _numbers(
    result: RecognitionResult | None,
    mode: Mode | None,
    name: str,
    reference: Reference,
) -> tuple[float | None, float | None]:
    """Returns our value and the reference's."""
    if result is None:
        return None, None
    mode = reference.mode(result.method) if mode is None else mode
    metrics, printed = result.metrics[mode], reference.values(result, mode)
    ours = {
        "AUC": metrics.auc,
        "R@1": metrics.recall_at_1,
        "F1": metrics.f1_max,
    }[name]
    if printed is None:
        return ours, None
    return ours, {
        "AUC": printed.auc,
        "R@1": printed.recall_at_1,
        "F1": printed.f1_max,
    }[name]
