"""Writes the page of an experiment: findings, charts, numbers, YAML file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
import math
from pathlib import Path
import re
import tempfile
from typing import Any

from markupsafe import Markup
from matplotlib.markers import MarkerStyle
import numpy as np

from cns_drake.base import (
    InputError,
    __version__,
    make_folder,
    write_csv,
    write_text,
)
from evaluation.recognition import METRICS, Metric, metric_named
from evaluation.results.answer import page_answer
from evaluation.results.charts.chart import NARROW, WIDE
from evaluation.results.charts.kinds import DrawnChart, draw_chart
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.figure_files import save_figure
from evaluation.results.keys import (
    CAUSE,
    KEYS,
    LEVEL,
    PROTOCOL_BASE,
    SETTINGS,
)
from evaluation.results.method_names import in_table_order
from evaluation.results.method_names import title as title_of
from evaluation.results.page_frame import (
    PageSection,
    framed_page,
    page_section,
    value_text,
)
from evaluation.results.summaries import Summary, means, summarised
from evaluation.results.table import QueryRows, Results

_TASKS = {
    "place": "Place recognition",
    "pose": "Poses of places that were found",
    "localise": "Localisation in the map",
    "map": "What of the map changed",
    "change": "Structural change",
    "cost": "Costs",
}
_SUMMARIES = "summaries.csv"
# Greatest number of columns of the table of conditions.
_MOST_COLUMNS = 12
# Line style of Matplotlib -> dashes of an SVG line.
_DASHES = {"-": "none", "--": "6 3", "-.": "8 3 2 3", ":": "2 3", "": "0 99"}


def write_page(
    results: Results,
    queries: QueryRows | None,
    folder: Path,
    *,
    title: str,
    about: str = "",
    charts: Sequence[Mapping[str, Any]] = (),
    metrics: Sequence[Metric] = (),
    experiment_text: str = "",
    notes: Iterable[str] = (),
    sections: Iterable[PageSection] = (),
    on_note: Callable[[str], None] = lambda text: None,
) -> Path:
    """Writes an experiment's page, `index.html`, which needs no other file.

    Next to the page, the function writes the charts for print and, if there are
    numbers behind the charts (see `evaluation.results.summaries.summarised`),
    `summaries.csv`. Such files of an earlier page that this page does not have
    are removed.

    Args:
        results: the table of results, written next to the page as
            `results.csv`.
        queries: the table of queries, written as `queries.csv`; None if there
            is none.
        folder: folder in which the page is written.
        title: title of the page.
        about: the question, in words.
        charts: descriptions of the charts, see `evaluation.results.charts`. The
            headline says what the change of the first chart costs the methods,
            or of the experiment's only factor, see `page_answer`; of other
            questions, it is the message of the first chart. A chart without
            data in the table is left out, with a note. If the experiment has
            several
            protocols, a chart shows the first, unless it names the factor
            `protocol.base`.
        metrics: the metrics that the summary of each task shows, if the task
            has them; by default, its main metrics.
        experiment_text: the experiment as YAML.
        notes: further sentences for the page, such as on settings.
        sections: further sections, such as those of recordings.
        on_note: is called with a note on each chart that is left out, and last
            with the headline.

    Returns:
        The path of the page.

    Raises:
        InputError: a file cannot be written.
    """
    make_folder(folder)
    known, undefined = results.defined()
    numbers = summarised(*_charted(results, queries, {}), charts)
    if numbers:
        write_csv(folder / _SUMMARIES, Summary._fields, numbers)
    shown, missing = _drawn_charts(known, queries, folder, charts)
    if undefined:
        missing.append(f"{undefined[:1].upper()}{undefined[1:]}.")
    for note in missing:
        on_note(note)
    protocols = ", ".join(filter(None, results.distinct("protocol")))
    first = charts[0] if charts else {}
    answer = page_answer(*_charted(known, queries, first), first)
    headline = title
    if answer is not None:
        headline = answer.headline
    elif shown:
        headline = str(shown[0]["message"])
    about = f". {about}" if about else ""
    intro = Markup("<p><strong>{}</strong>{}</p>").format(title, about)
    if answer is not None and answer.evidence:
        intro = Markup("<p>{}</p>{}").format(answer.evidence, intro)
    text = framed_page(
        title,
        headline,
        intro,
        [
            *_first_sections(known, shown, metrics, headline),
            *sections,
            *_last_sections(results, queries, numbers, experiment_text),
        ],
        made_by=[f"cns-drake {__version__}", f"protocol: {protocols}"],
        notes=[*notes, *missing],
    )
    path = folder / "index.html"
    write_text(path, text)
    if shown or answer is not None:
        on_note(headline)
    return path


def _drawn_charts(
    results: Results,
    queries: QueryRows | None,
    folder: Path,
    charts: Iterable[Mapping[str, Any]],
) -> tuple[list[dict[str, Any]], list[str]]:
    """Draws all charts, and writes those for print into a folder.

    The arguments are the same as for `write_page`.

    Returns:
        For each chart, its message, its legend, and the drawings for the page,
        by the names in the template; and a note on each chart that is left out,
        because it has no data.
    """
    drawn, missing = [], []
    for number, chart in enumerate(charts, start=1):
        rows, answers = _charted(results, queries, chart)
        try:
            alone = draw_chart(chart, rows, alone=True, queries=answers)
            save_figure(
                alone.figure, folder / f"chart_{number}", ("pdf", "png")
            )
            # The message is known; only curves are drawn from answers.
            needed = answers if chart["kind"] == "curves" else None
            svgs = {
                name: _svg(
                    draw_chart(chart, rows, width, queries=needed),
                    f"{name}{number}",
                )
                for name, width in (("wide", WIDE), ("narrow", NARROW))
            }
        except InputError as error:
            # What was measured does not depend on it.
            missing.append(f"Chart {number} is left out: {error}.")
            continue
        drawn.append(
            {
                "message": alone.message,
                "legend": alone.legend,
                "source": alone.source,
                **svgs,
            }
        )
    return drawn, missing


def _charted(
    results: Results, queries: QueryRows | None, chart: Mapping[str, Any]
) -> tuple[Results, QueryRows | None]:
    """Returns the rows and answers from which a chart is drawn.

    Numbers by two protocols have no common mean.
    """
    protocols = results.distinct(PROTOCOL_BASE)
    if len(protocols) < 2 or PROTOCOL_BASE in {*chart, *_names(chart)}:
        return results, queries
    first = protocols[0]
    if queries is not None:
        answers = queries.answers
        queries = QueryRows.of(a for a in answers if a[PROTOCOL_BASE] == first)
    return results.where({PROTOCOL_BASE: first}), queries


def _names(chart: Mapping[str, Any]) -> set[str]:
    return {value for value in chart.values() if isinstance(value, str)}


def _first_sections(
    results: Results,
    charts: Sequence[Mapping[str, Any]],
    metrics: Sequence[Metric],
    headline: str,
) -> list[PageSection]:
    """Returns the charts, and the main results of each task."""
    sections = []
    if charts:
        sections.append(
            page_section(
                "charts",
                "Charts",
                "results.csv: the rows that are named below each chart",
                is_open=True,
                charts=charts,
                headline=headline,
                wide=WIDE,
                dashes=_DASHES,
                corners=marker_corners,
            )
        )
    summary = [
        _summary(results, task, metrics) for task in results.distinct("task")
    ]
    return [
        *sections,
        page_section(
            "means",
            "Results",
            f"results.csv: {len(results.rows)} rows with a defined value",
            is_open=True,
            summary=summary,
        ),
    ]


def _last_sections(
    results: Results,
    queries: QueryRows | None,
    numbers: Sequence[Summary],
    experiment_text: str,
) -> list[PageSection]:
    """Returns the numbers behind the charts, all results, and the files."""
    sections = []
    if numbers:
        source = "results.csv and queries.csv: the rows of the charts"
        sections.append(
            page_section("summaries", "Summaries", source, numbers=numbers)
        )
    answers = queries.answers if queries else ()
    return [
        *sections,
        page_section(
            "conditions",
            "Conditions",
            f"results.csv: all {len(results.rows)} rows",
            table=_wide_table(results),
        ),
        page_section(
            "made_by",
            "Files",
            "the experiment's file",
            experiment_text=experiment_text,
            queries=sum(len(answer.columns["correct"]) for answer in answers),
        ),
    ]


def _svg(drawn: DrawnChart, prefix: str) -> Markup:
    """Returns a drawing as an element whose ids no other drawing has."""
    with tempfile.TemporaryDirectory() as folder:
        stem = Path(folder) / "chart"
        save_figure(drawn.figure, stem, ("svg",))
        text = stem.with_suffix(".svg").read_text()
    text = text[text.index("<svg") :]
    return Markup(re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", text))


def _summary(
    results: Results, task: str, chosen: Sequence[Metric]
) -> dict[str, Any]:
    """Returns a table of a task's main results: a row for each method.

    Results without and with geometric verification are different parts. If
    there are few conditions, each column is a condition with the task's main
    metric; otherwise each column is a metric, averaged over all conditions.
    """
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


def _wide_table(results: Results) -> dict[str, Any]:
    """Returns a table: a line per condition and method, a column per metric.

    Columns that have the same value in all lines are left out.
    """
    lines: dict[tuple, dict[str, Any]] = {}
    for row in results.rows:
        line = lines.setdefault(row.identity, {})
        if not line:
            line.update((n, row[n]) for n in (*KEYS, *results.factors))
        line[row.metric] = row.value
    metrics = results.distinct("metric")
    varied = [
        name
        for name in (*KEYS, *results.factors)
        if len({line[name] for line in lines.values()}) > 1
    ]
    names = [*varied, *metrics]
    cells = [[line.get(name) for name in names] for line in lines.values()]
    is_text = [
        any(isinstance(v, str) for v in column)
        for column in zip(*cells, strict=True)
    ]
    forms = [
        *("g" for _ in varied),
        *(".0f" if metric_named(name).is_whole else "" for name in metrics),
    ]
    columns = [
        [
            f"{v:{form}}" if form and _is_finite(v) else value_text(v)
            for v in column
        ]
        for form, column in zip(forms, zip(*cells, strict=True), strict=True)
    ]
    return {
        "header": list(zip(names, is_text, strict=True)),
        "rows": list(zip(*columns, strict=True)),
    }


def _is_finite(value: object) -> bool:
    return isinstance(value, float) and math.isfinite(value)


def marker_corners(marker: str) -> str:
    """Returns the points of an SVG polygon that shows a marker of a chart.

    The polygon is 8 px wide around (18, 6), the middle of a line in a legend.

    Args:
        marker: the marker, in the terms of Matplotlib.
    """
    style = MarkerStyle(marker)
    path = style.get_path().transformed(style.get_transform())
    # SVG's y points down.
    corners = np.array(path.to_polygons()[0]) * (8, -8) + (18, 6)
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
