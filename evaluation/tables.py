"""Tables of results, with the paper's values beside ours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import csv
from dataclasses import dataclass, replace
import io
import math

from evaluation import paper
from evaluation.change import ChangeReport
from evaluation.metrics import Mode
from evaluation.place_recognition import PlaceRecognition

_MISSING = "–"


@dataclass(frozen=True)
class Table:
    """Rows under a header; numbers stay numbers until they are written.

    Attributes:
        header: name of each column.
        rows: one value a column: text, a number, or None where there is
            none.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]

    def to_csv(self) -> str:
        """Returns the table with all digits; a missing value is empty."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.header)
        for row in self.rows:
            writer.writerow(["" if _is_missing(v) else v for v in row])
        return stream.getvalue()

    def to_markdown(self) -> str:
        """Returns the table with four decimals, as the paper prints them."""
        lines = [self.header, ["---"] * len(self.header)]
        lines += [[_to_text(value) for value in row] for row in self.rows]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)


@dataclass(frozen=True)
class ChangeResult:
    """The change between two stages of a map."""

    map_name: str
    stages: tuple[str, str]
    report: ChangeReport


@dataclass(frozen=True)
class RecognitionResult:
    """A method on a pair of stages of a map: database, query."""

    map_name: str
    stages: tuple[str, str]
    outcome: PlaceRecognition

    def counting(self, mode: Mode) -> RecognitionResult:
        """Returns the same outcome with its numbers in a mode."""
        return replace(self, outcome=self.outcome.counting(mode))


def change_table(results: Iterable[ChangeResult]) -> Table:
    """Returns Table I: the change of each pair, and what it is made of."""
    header = (
        "map",
        "stages",
        "TCR_sym",
        "paper",
        "earlier -> later",
        "later -> earlier",
        "same stage, both routes",
        "where both drove",
        "voxels in hulls",
        "unchanged",
    )
    rows = []
    for result in results:
        report = result.report
        change = report.change
        rows.append(
            (
                result.map_name,
                " <-> ".join(result.stages),
                change.symmetric,
                paper.tcr_values().get((result.map_name, *result.stages)),
                change.source_to_target.ratio,
                change.target_to_source.ratio,
                report.control.symmetric if report.control else None,
                report.masked.symmetric if report.masked else None,
                change.num_in_hull,
                change.num_unchanged,
            )
        )
    return Table(header, tuple(rows))


def recognition_table(results: Sequence[RecognitionResult]) -> Table:
    """Returns Table II: a row for each pair, method and mode."""
    header = (
        "map",
        "database -> query",
        "method",
        "mode",
        "AUC",
        "paper's AUC",
        "R@1",
        "paper's R@1",
        "F1max",
        "paper's F1",
        "queries",
        "N (with a match)",
        "TP of R@1",
        "TP of F1max",
        "T of F1max",
    )
    rows = []
    for result in results:
        outcome = result.outcome
        metrics = outcome.metrics
        printed = paper.recognition_values().get(
            (result.map_name, *result.stages, outcome.method, metrics.mode)
        )
        index = metrics.f1_max_index
        curve = metrics.curve
        rows.append(
            (
                result.map_name,
                " -> ".join(result.stages),
                outcome.method,
                metrics.mode,
                metrics.auc,
                printed.auc if printed else None,
                metrics.recall_at_1,
                printed.recall_at_1 if printed else None,
                metrics.f1_max,
                printed.f1_max if printed else None,
                metrics.num_queries,
                metrics.num_with_match,
                metrics.num_right,
                None if index is None else int(curve.true_positives[index]),
                None if index is None else int(curve.counted[index]),
            )
        )
    return Table(header, tuple(rows))


def _is_missing(value: object) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))


def _to_text(value: object) -> str:
    if _is_missing(value):
        return _MISSING
    return f"{value:.4f}" if isinstance(value, float) else str(value)
