"""Tables of place recognition: metrics of methods on pairs of drives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from evaluation.change.drive_change import ChangeResult, symmetric_changes
from evaluation.recognition.metrics import MODES, Mode, PlaceRecognitionMetrics
from evaluation.recognition.place_outcome import RADII, PlaceOutcome
from evaluation.recognition.protocol import check_one_protocol
from evaluation.report.reference import NO_REFERENCE, Published, Reference
from evaluation.report.tables.change import visible_change
from evaluation.report.tables.columns import (
    KEYS,
    PRINTED_KEYS,
    PROTOCOL,
    Evidence,
)
from evaluation.results.table_forms import (
    CAPTIONS,
    Cell,
    Table,
    by_pair,
    by_pair_and_method,
    in_table_order,
    keyed,
    protocol_columns,
    ranked,
    title,
)

# Name of a column -> attribute of a result's metrics, and of published numbers.
_MEASURES = {"AUC": "auc", "strict": "auc_strict", "R@1": "recall_at_1"}
# The same for tables with published numbers.
_PUBLISHED_MEASURES = {**_MEASURES, "F1": "f1_max"}


class _ModeResult(NamedTuple):
    """A result in one mode, with the published numbers if there are any."""

    result: PlaceOutcome
    metrics: PlaceRecognitionMetrics
    printed: Published | None

    @classmethod
    def of(
        cls, result: PlaceOutcome, mode: Mode, reference: Reference
    ) -> _ModeResult:
        printed = reference.values(result, mode)
        return cls(result, result.by_mode[mode], printed)

    def at_f1_max(self, counts: np.ndarray) -> int | None:
        """Returns the entry of `counts` for the threshold with the greatest F1.

        `counts` (K,) contains a number of queries, such as TP, for each
        threshold of the precision-recall curve. The result is None if the curve
        is empty.
        """
        index = self.metrics.f1_max_index
        return None if index is None else int(counts[index])


def recognition_table(
    results: Sequence[PlaceOutcome],
    changes: Sequence[ChangeResult],
    mode: Mode | None = None,
    reference: Reference = NO_REFERENCE,
    evidence: Evidence = MappingProxyType({}),
) -> Table:
    """Returns the table of place recognition, like Table II of the paper.

    The table has a row for each pair of drives, and the columns AUC, strict AUC
    and R@1 for each method. If `mode` is None, each method also has a column
    F1.

    Args:
        results: results of one protocol.
        changes: change between the drives of each pair.
        mode: which queries count: `all`, or only queries with a match
            (`filtered`). None for the mode that the reference has for each
            method.
        reference: published results to compare with.
        evidence: names of a database and a query -> why queries went wrong.

    Raises:
        InputError: results of two protocols.
    """
    check_one_protocol(result.protocol for result in results)
    methods = in_table_order(result.method for result in results)
    measures = _PUBLISHED_MEASURES if mode is None else _MEASURES
    tcr = symmetric_changes(changes)
    rows = []
    for pair, of_pair in by_pair(results).items():
        by_method = {
            outcome.method: _ModeResult.of(
                outcome, mode or reference.mode(outcome.method), reference
            )
            for outcome in of_pair
        }
        drives = of_pair[0].database, of_pair[0].query
        change = visible_change(evidence, *drives)
        rows.append(
            (
                pair[0],
                " → ".join(pair[1:]),
                tcr.get(pair),
                Cell(change.share, change.added),
                *_cells([by_method.get(m) for m in methods], measures.values()),
            )
        )
    captions = {
        None: f", {reference.counting}",
        "all": ", all queries counted (mode all)",
        "filtered": ", only queries counted that have a match (mode filtered)",
    }
    protocol = beside = ""
    if results:
        # Each method sets its scans per place.
        shared = replace(results[0].protocol, scans_per_place=None, place=None)
        protocol = shared.to_text() + _place_pose_text(results)
    if any(map(reference.covers, results)):
        beside = f" In brackets or small: the value of {reference.title}."
    return Table(
        (
            "map",
            "DB → query",
            "TCR_sym",
            "visible change",
            *tuple(measures) * len(methods),
        ),
        tuple(rows),
        groups=(
            ("", 4),
            *((title(method), len(measures)) for method in methods),
        ),
        caption=f"Place recognition{captions[mode]}. {protocol}{beside}"
        " Strict: the AUC with recall = TP / N, which wrong accepted answers"
        " lower, too. Bold: best of a row; underlined: second. Beside"
        " visible change: the same minus that of the control.",
    )


def _cells(
    results: Sequence[_ModeResult | None], metric_names: Iterable[str]
) -> list[Cell]:
    """Returns the cells of a pair of drives: all metrics of each method.

    Args:
        results: result of each method; None if there is none.
        metric_names: names of the metrics.
    """
    columns = [
        ranked(
            [result and getattr(result.metrics, name) for result in results],
            [
                result and getattr(result.printed, name, None)
                for result in results
            ],
        )
        for name in metric_names
    ]
    return [column[i] for i in range(len(results)) for column in columns]


def _place_pose_text(results: Sequence[PlaceOutcome]) -> str:
    """Returns a sentence on which scan of a submap gives a place its pose.

    The sentence is empty if no method merges scans.
    """
    methods: dict[str, list[str]] = {}
    for method in in_table_order(result.method for result in results):
        (place,) = {
            result.protocol.place
            for result in results
            if result.method == method
        }
        if place is not None:
            methods.setdefault(place, []).append(title(method))
    if not methods:
        return ""
    chosen = " and ".join(
        f"the {place} scan ({', '.join(names)})"
        for place, names in methods.items()
    )
    return f" Where scans are merged, {chosen} gives the place its pose."


def audit_table(
    results: Sequence[PlaceOutcome], reference: Reference = NO_REFERENCE
) -> Table:
    """Returns a table of all metrics with the counts from which they follow.

    The table has a row for each result and mode (all queries, or only queries
    with a match).

    Args:
        results: results of methods on pairs of drives.
        reference: published results to put next to them.
    """
    return Table.of(
        [_ModeResult.of(r, mode, reference) for r in results for mode in MODES],
        {
            "map": lambda c: c.result.pair[0],
            "DB → query": lambda c: " → ".join(c.result.pair[1:]),
            "method": lambda c: c.result.method,
            "mode": lambda c: c.metrics.mode,
            "AUC": lambda c: c.metrics.auc,
            "AUC low": lambda c: c.metrics.auc_interval.low,
            "AUC high": lambda c: c.metrics.auc_interval.high,
            "paper's AUC": lambda c: c.printed and c.printed.auc,
            "AUC strict": lambda c: c.metrics.auc_strict,
            "R@1": lambda c: c.metrics.recall_at_1,
            "R@1 low": lambda c: c.metrics.recall_at_1_interval.low,
            "R@1 high": lambda c: c.metrics.recall_at_1_interval.high,
            "paper's R@1": lambda c: c.printed and c.printed.recall_at_1,
            "R@5": lambda c: float(c.metrics.recall_at_n[4]),
            "R@25": lambda c: float(c.metrics.recall_at_n[24]),
            "R@1%": lambda c: float(c.metrics.recall_at_1_percent),
            "F1max": lambda c: c.metrics.f1_max,
            "paper's F1": lambda c: c.printed and c.printed.f1_max,
            "queries": lambda c: c.metrics.num_queries,
            "N (with a match)": lambda c: c.metrics.num_with_match,
            "TP of R@1": lambda c: c.metrics.num_right,
            "TP of F1max": lambda c: c.at_f1_max(
                c.metrics.curve.true_positives
            ),
            "FP + FN of F1max": lambda c: c.at_f1_max(
                c.metrics.curve.counted - c.metrics.curve.true_positives
            ),
            **protocol_columns("result."),
        },
        CAPTIONS["audit"],
    )


def metric_numbers(results: Sequence[PlaceOutcome]) -> Table:
    """Returns the metrics that other publications use, for `metrics.csv`."""
    return Table.of(
        by_pair_and_method(results),
        {
            **KEYS,
            "auc_strict": lambda r: r.by_mode["all"].auc_strict,
            "recall_at_1": lambda r: r.outcomes.recall_at(1),
            "recall_at_1_percent": lambda r: r.outcomes.recall_at(
                r.outcomes.one_percent_rank
            ),
            "mean_reciprocal_rank": lambda r: r.outcomes.mean_reciprocal_rank,
            "recall_at_full_precision": lambda r: (
                r.by_mode["all"].curve.recall_at_full_precision
            ),
            "match_auroc": lambda r: r.outcomes.match_auroc,
            "pose_success": lambda r: r.pose.success,
            **keyed(
                {f"auc_within_{radius:g}_m": radius for radius in RADII},
                lambda r, radius: r.auc_over_radius()[radius],
            ),
            **PROTOCOL,
        },
    )


def sessions_table(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of databases of several drives, for print."""
    return Table.of(
        by_pair_and_method(results),
        {
            **PRINTED_KEYS,
            "places": lambda r: len(r.place_frames),
            "AUC": lambda r: r.by_mode["all"].auc,
            "strict": lambda r: r.by_mode["all"].auc_strict,
            "R@1": lambda r: r.by_mode["all"].recall_at_1,
        },
        CAPTIONS["sessions"],
    )
