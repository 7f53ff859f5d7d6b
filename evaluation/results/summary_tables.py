"""Tables of a study's main results, for its page and for a terminal."""

from collections.abc import Iterator, Sequence
import math
from typing import Any

from evaluation.methods import SETTINGS
from evaluation.recognition import METRICS, Metric, metric_named
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.keys import CAUSE, LEVEL
from evaluation.results.method_names import in_table_order
from evaluation.results.method_names import title as title_of
from evaluation.results.page_frame import value_text
from evaluation.results.summaries import means
from evaluation.results.table import Results

_TASKS = {
    "place": "Place recognition",
    "pose": "Poses of places that were found",
    "localise": "Localisation in the map",
    "map": "What of the map changed",
    "change": "Structural change",
    "cost": "Costs",
}
# Greatest number of columns of a table of conditions.
_MOST_COLUMNS = 12


def summary_tables(
    results: Results, metrics: Sequence[Metric] = ()
) -> list[dict[str, Any]]:
    """Returns a table of each task's main results: a row for each method.

    Results without and with geometric verification are different parts. If
    there are few conditions, each column is a condition with the task's main
    metric; otherwise each column is a metric, averaged over all conditions.

    Args:
        results: the table of results, with defined values only.
        metrics: the metrics that the table of a task shows, if the task has
            them; by default, its main metrics.
    """
    return [
        _summary(results, task, metrics) for task in results.distinct("task")
    ]


def summary_lines(results: Results) -> Iterator[str]:
    """Yields the lines of the tables, for a terminal.

    A single result has its 95 % interval in brackets, if that is known.
    """
    for table in summary_tables(results.defined()[0]):
        lines = [["method", *table["metrics"]]]
        for part in table["parts"]:
            if part["verified"]:
                lines.append(["with geometric verification"])
            for row in part["rows"]:
                cells = [_cell_text(*cell) for cell in row["cells"]]
                lines.append([row["name"], *cells])
        widths = [
            max(len(line[k]) for line in lines if len(line) > max(k, 1))
            for k in range(len(lines[0]))
        ]
        yield table["name"]
        for line in lines:
            # Only one of the cells of a whole row is filled.
            cells = [
                f"{one:<{w}}" for one, w in zip(line, widths, strict=False)
            ]
            yield "  ".join(cells).rstrip()
        yield ""


def _cell_text(mean: Any, interval: tuple[float, float] | None) -> str:
    if mean is None:
        return ""
    limits = ", ".join(map(value_text, interval or ()))
    return value_text(mean.value) + f" [{limits}]" * bool(interval)


def _summary(
    results: Results, task: str, chosen: Sequence[Metric]
) -> dict[str, Any]:
    rows = results.where(task=task).rows
    known = dict.fromkeys(row.metric for row in rows)
    main = [one for one in METRICS.values() if task in one.main_in]
    metrics = next(
        names
        for some in (chosen, main, map(metric_named, known))
        if (names := [one.name for one in some if one.name in known])
    )
    factors = _told_factors(results.where(task=task))
    cells = dict.fromkeys(tuple(row[f] for f in factors) for row in rows)
    by_condition = 1 < len(cells) <= _MOST_COLUMNS
    if by_condition:
        metrics = metrics[:1]
    shown = ("label", "verified", "metric", *(factors if by_condition else ()))
    found = {mean.key: mean for mean in means(rows, *shown) if mean.number}
    # A single result has an interval of its own.
    intervals = {
        key: (row.low, row.high)
        for row in rows
        if (key := tuple(row[name] for name in shown)) in found
        and found[key].number == 1
        and not math.isnan(row.low + row.high)
    }
    columns = [
        (metric, *(cell if by_condition else ()))
        for metric in metrics
        for cell in (cells if by_condition else [()])
    ]
    parts = [
        {
            "verified": bool(verified),
            "rows": [
                {
                    "name": title_of(name) or "–",
                    "cells": [
                        (found.get(key), intervals.get(key))
                        for key in (
                            (name, verified, *column) for column in columns
                        )
                    ],
                }
                for name in in_table_order(row.label for row in rows)
                if any((name, verified, *column) in found for column in columns)
            ],
        }
        for verified in sorted({row.verified for row in rows})
    ]
    heads = [metric_named(str(metric)).label for metric, *_ in columns]
    title = _TASKS.get(task, task)
    if by_condition:
        title += f": {heads[0]}"
        if factors:
            title += f" by {', '.join(map(in_words, factors))}"
        heads = [
            ", ".join(map(value_words, values, factors))
            for _, *values in columns
        ]
    return {"name": title, "metrics": heads, "parts": parts}


def _told_factors(results: Results) -> list[str]:
    """Returns the factors in which the conditions of a task differ.

    Settings of methods do not count, because they are shown with the names of
    the methods.
    """
    if CAUSE in results.factors:
        # All other factors follow from the cause and its level.
        names = [CAUSE, LEVEL]
    else:
        names = [f for f in results.factors if not f.startswith(SETTINGS)]
    return [
        name for name in names if len({row[name] for row in results.rows}) > 1
    ]
