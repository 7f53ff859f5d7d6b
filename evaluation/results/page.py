"""Writes the page of an experiment: question, charts, numbers, YAML file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
import math
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.markers import MarkerStyle
import numpy as np

from evaluation.base import (
    InputError,
    __version__,
    make_folder,
    write_csv,
    write_text,
)
from evaluation.recognition import Metric, metric_named
from evaluation.results.charts.chart import (
    NARROW,
    WIDE,
    FewPointsError,
    PrintStyle,
)
from evaluation.results.charts.kinds import draw_chart
from evaluation.results.keys import KEYS, PROTOCOL_BASE, STAGE
from evaluation.results.page_frame import (
    PageSection,
    framed_page,
    page_section,
    value_text,
)
from evaluation.results.sections.beside import beside_section
from evaluation.results.sections.found import found_section, lacks_baseline
from evaluation.results.summaries import Summary, summarised
from evaluation.results.summary_tables import summary_tables
from evaluation.results.table import QueryRows, Results

_SUMMARIES = "summaries.csv"
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
    own_methods: Sequence[str] = (),
    printed: PrintStyle | None = None,
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
        about: the question, in words, which is the page's heading.
        charts: descriptions of the charts, see `evaluation.results.charts`. A
            chart without data in the table is left out, with a note. If the
            experiment has several protocols, a chart shows the first, unless it
            names the factor `protocol.base`. If no drives were compared without
            the change, the page says who found how many places instead of a
            chart over the stage.
        metrics: the metrics that the summary of each task shows, if the task
            has them; by default, its main metrics.
        experiment_text: the experiment as YAML.
        notes: further sentences for the page, such as on settings.
        sections: further sections, such as those of recordings.
        own_methods: methods that the page shows beside the shipped results of
            the same conditions, if there are such results.
        printed: style of the charts for print; None for the default.
        on_note: is called with a note on each chart that is left out, but
            for one with too few points.

    Returns:
        The path of the page.

    Raises:
        InputError: a file cannot be written.
    """
    printed = printed or PrintStyle()
    make_folder(folder)
    first = []
    if queries is not None and lacks_baseline(results):
        first.append(found_section(queries))
        charts = [one for one in charts if one.get("over") != STAGE]
    known, undefined = results.defined()
    numbers = summarised(*_charted(results, queries, {}), charts)
    if numbers:
        write_csv(folder / _SUMMARIES, Summary._fields, numbers)
    shown, missing, few = _drawn_charts(known, queries, folder, charts, printed)
    if undefined:
        few.append(f"{undefined[:1].upper()}{undefined[1:]}.")
    beside, why_not = beside_section(
        known, queries, own_methods, metrics, folder, printed
    )
    if why_not:
        missing.append(f"Shipped results are not shown: {why_not}.")
    for note in missing:
        on_note(note)
    protocols = ", ".join(filter(None, results.distinct("protocol")))
    text = framed_page(
        title,
        about or title,
        Markup("<p>{}</p>").format(title) if about else Markup(),
        [
            *beside,
            *first,
            *_first_sections(known, shown, metrics),
            *sections,
            *_last_sections(results, queries, numbers, experiment_text),
        ],
        made_by=[f"cns-drake {__version__}", f"protocol: {protocols}"],
        notes=[*notes, *missing, *few],
    )
    path = folder / "index.html"
    write_text(path, text)
    return path


def _drawn_charts(
    results: Results,
    queries: QueryRows | None,
    folder: Path,
    charts: Iterable[Mapping[str, Any]],
    printed: PrintStyle,
) -> tuple[list[dict[str, Any]], list[str], list[str]]:
    """Draws all charts, and writes those for print into a folder.

    The arguments are the same as for `write_page`.

    Returns:
        For each chart, its title, its legend, and the drawings for the page,
        by the names in the template; a note on each chart that is left out,
        because it has no data; and one on each that would have too few points.
    """
    drawn, missing, few = [], [], []
    for number, chart in enumerate(charts, start=1):
        rows, answers = _charted(results, queries, chart)
        try:
            alone = draw_chart(chart, rows, printed=printed, queries=answers)
            alone.save(folder / f"chart_{number}")
            svgs = {
                name: draw_chart(chart, rows, width, queries=answers).svg(
                    f"{name}{number}"
                )
                for name, width in (("wide", WIDE), ("narrow", NARROW))
            }
        except FewPointsError as error:
            few.append(f"No chart {number}: {error}.")
            continue
        except InputError as error:
            # What was measured does not depend on it.
            missing.append(f"Chart {number} is left out: {error}.")
            continue
        drawn.append(
            {
                "title": alone.title,
                "legend": alone.legend,
                "source": alone.source,
                **svgs,
            }
        )
    return drawn, missing, few


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
                wide=WIDE,
                dashes=_DASHES,
                corners=marker_corners,
            )
        )
    return [
        *sections,
        page_section(
            "means",
            "Results",
            f"results.csv: {len(results.rows)} rows with a defined value",
            is_open=True,
            summary=summary_tables(results, metrics),
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
            f"{v:{form}}"
            if form and isinstance(v, float) and math.isfinite(v)
            else value_text(v)
            for v in column
        ]
        for form, column in zip(forms, zip(*cells, strict=True), strict=True)
    ]
    return {
        "header": list(zip(names, is_text, strict=True)),
        "rows": list(zip(*columns, strict=True)),
    }


def marker_corners(marker: str) -> str:
    """Returns the points of an SVG polygon that shows a marker of a chart.

    The polygon is 8 px wide around (18, 6), the middle of a line in a legend.
    """
    style = MarkerStyle(marker)
    path = style.get_path().transformed(style.get_transform())
    # SVG's y points down.
    corners = np.array(path.to_polygons()[0]) * (8, -8) + (18, 6)
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
