"""Tables of one metric by method and condition, shipped or by the user."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import functools
import itertools
import math
from pathlib import Path
from typing import Any

from evaluation.base import InputError
from evaluation.methods import SETTINGS
from evaluation.recognition import METRICS, PROTOCOLS, metric_named
from evaluation.results.keys import PROTOCOL_BASE
from evaluation.results.table import (
    QUERIES,
    RESULTS,
    Answers,
    QueryRows,
    Results,
    Row,
)

_BASELINES = Path(__file__).with_name("baselines")
SHIPPED = "shipped"
# The same for a value and its answers, for tables that were rounded by hand.
_ROUNDED_BY_HAND = 1e-3
# What identifies a condition, without the method.
Condition = tuple[object, ...]
# A method with its settings, and a condition.
_Measured = tuple[str, Condition]


@dataclass(frozen=True)
class MetricTable:
    """A table's rows of one metric, and its answers to queries.

    Attributes:
        name: name of the table.
        rows: (method with its settings, condition) -> row of the metric.
        answers: (method with its settings, condition) -> answers to queries;
            empty if they are unknown.
    """

    name: str
    rows: Mapping[_Measured, Row]
    answers: Mapping[_Measured, Answers]

    @property
    def methods(self) -> list[str]:
        return list(dict.fromkeys(method for method, _ in self.rows))

    @property
    def conditions(self) -> list[Condition]:
        return list(dict.fromkeys(condition for _, condition in self.rows))


def table_name(path: Path, paths: Iterable[Path]) -> str:
    """Returns the name of a table: the name of its file or folder.

    If several of the tables have this name, the result is the path.
    """
    names = [
        table_path.stem
        if table_path.is_file() and table_path.name != RESULTS
        # A folder, or the file that it holds.
        else (table_path if table_path.is_dir() else table_path.parent)
        .absolute()
        .name
        for table_path in (path, *paths)
    ]
    name = names.pop(0)
    return name if names.count(name) < 2 else str(path)


def _by_one_protocol(rows: Sequence[Row], path: Path) -> tuple[Row, ...]:
    names = list(dict.fromkeys(row.protocol for row in rows))
    if "random-yaw" not in names and len(names) > 1:
        raise InputError(
            f"{path}: protocol: {' and '.join(names)} in one table; choose one"
            " with --protocol"
        )
    chosen = "random-yaw" if "random-yaw" in names else names[0]
    return tuple(row for row in rows if row.protocol == chosen)


def _by_method_and_condition(keys: Iterable[Any]) -> dict[_Measured, Any]:
    """Returns rows or answers by (method with settings, condition).

    An unknown digest of a protocol is taken for the shipped protocol's digest.
    Name and digest of the protocol say more than the factor of a study that
    measures by several protocols, which does not count.
    """
    found = {}
    for key in keys:
        factors = {
            name: value
            for name, value in key.factors.items()
            if not name.startswith(SETTINGS) and name != PROTOCOL_BASE
        }
        digest = key.protocol_digest
        if not digest and key.protocol in PROTOCOLS:
            digest = PROTOCOLS[key.protocol].digest()
        plain = replace(
            key, method=key.label, factors=factors, protocol_digest=digest
        )
        found[plain.method, plain.without("method")] = plain
    return found


def _check_answers(
    queries: Path, answers: Iterable[Answers], path: Path, results: Results
) -> None:
    """Checks that a table's results follow from the answers to queries."""
    known = {
        (*row.identity, row.metric): row
        for row in results.where(task="place").rows
    }
    computed = [
        one
        for one in METRICS.values()
        if "place" in one.tasks and not one.is_compared
    ]
    for answer, metric in itertools.product(answers, computed):
        name, number = metric.name, len(answer.outcomes)
        row = known.get((*answer.identity, name))
        # Only what the table has is computed: areas take time.
        if row is None:
            continue
        value = metric.of(answer.outcomes)
        if not (
            abs(row.value - value) > _ROUNDED_BY_HAND
            or row.n not in (None, number)
        ):
            continue
        count = "" if row.n is None else f" of {row.n} queries"
        raise InputError(
            f"{queries}: contradicts {path}: {name} of {answer.label},"
            f" {answer.database} -> {answer.query}: {value:.4f} of {number}"
            f" queries, but {row.value:.4f}{count} in the results"
        )


def read_metric_table(
    path: Path,
    results: Results,
    selection: Mapping[str, object],
    *,
    name: str,
    is_alone: bool,
) -> tuple[MetricTable, list[str]]:
    """Returns the selected rows of a table, and notes for the user.

    The answers to queries in a `queries.csv` next to the table are read as
    well.

    Args:
        path: the table, or the folder that contains it.
        results: all rows of the table.
        selection: name of a column -> its value in the rows to select:
            `metric`, `task`, `verified` and, if only rows of one protocol
            count, `protocol`.
        name: name of the table for the user.
        is_alone: whether the rows must be of one protocol, because they are
            ranked without rows of other tables.

    Raises:
        InputError: no row is selected, or the answers contradict the table.
    """
    rows = results.where(selection).rows
    if not rows:
        raise InputError(f"{path}: {_no_row_text(results, selection)}")
    if is_alone and "protocol" not in selection:
        rows = _by_one_protocol(rows, path)
    notes = []
    known, note = Results(results.factors, rows).defined()
    if note:
        left = next(row for row in rows if math.isnan(row.value))
        notes.append(
            f"{path}: {note}; the first is of {left.label}, {left.database} ->"
            f" {left.query}"
        )
        rows = known.rows
    if not rows:
        raise InputError(f"{path}: no {selection['metric']} is defined")
    if any(not row.protocol_digest for row in rows):
        notes.append(
            f"{path}: rows do not say how they were made (column"
            " protocol_digest); taken for the shipped protocol of this name"
        )
    queries = (path if path.is_dir() else path.parent) / QUERIES
    answers = QueryRows.read(queries).answers if queries.is_file() else ()
    _check_answers(queries, answers, path, results)
    asked = [
        answer
        for answer in answers
        if (answer.task, answer.verified)
        == (selection["task"], selection["verified"])
    ]
    metric = metric_named(str(selection["metric"]))
    if metric.is_resampled and any(
        answer.outcomes.blocks is None for answer in asked
    ):
        notes.append(
            f"{queries}: without blocks of the route (column block),"
            " intervals are too narrow"
        )
    rows_of = _by_method_and_condition(rows)
    return MetricTable(name, rows_of, _by_method_and_condition(asked)), notes


def _no_row_text(results: Results, selection: Mapping[str, object]) -> str:
    with_or = "with" if selection["verified"] else "without"
    chosen = f"{selection['metric']} {with_or} geometric verification"
    protocol = selection.get("protocol")
    by = f" by protocol {protocol}" if protocol else ""
    known = ", ".join(sorted(results.distinct("metric")))
    return f"no row of {chosen}{by} (metrics: {known})"


def table_of(
    name: str, results: Results, selection: Mapping[str, object]
) -> MetricTable:
    """Returns the selected rows of a study, see `Results.where`."""
    rows = results.where(selection).defined()[0].rows
    return MetricTable(name, _by_method_and_condition(rows), {})


def shipped_table(selection: Mapping[str, object]) -> MetricTable:
    """Returns the selected rows of all shipped tables, see `Results.where`."""
    rows = [
        row
        for table in shipped_tables()
        for row in table.where(selection).defined()[0].rows
    ]
    return MetricTable(SHIPPED, _by_method_and_condition(rows), {})


def shipped_pairs(
    results: Results, selection: Mapping[str, object]
) -> list[tuple[Row, Row]]:
    """Returns selected rows of a table, each with the shipped row like it."""
    own = _by_method_and_condition(results.where(selection).defined()[0].rows)
    shipped = shipped_table(selection).rows
    return [(row, shipped[key]) for key, row in own.items() if key in shipped]


@functools.cache
def shipped_tables() -> list[Results]:
    """Returns the shipped tables."""
    return [Results.read(path) for path in sorted(_BASELINES.glob("*.csv"))]
