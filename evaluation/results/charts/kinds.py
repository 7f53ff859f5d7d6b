"""Checks the description of a chart, and draws a chart of any kind."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
import re
import textwrap
from typing import Any, NamedTuple, TypeVar

from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evaluation.base import InputError, figure_style, no_such
from evaluation.methods import SETTINGS
from evaluation.recognition import METRICS, metric_named
from evaluation.results.charts.chart import ROW, WIDE, Chart, PrintStyle
from evaluation.results.charts.curves import draw_curves
from evaluation.results.charts.dumbbell import draw_dumbbell
from evaluation.results.charts.lines import draw_lines
from evaluation.results.charts.matrix import draw_matrix
from evaluation.results.charts.scatter import draw_scatter
from evaluation.results.charts.words import in_words
from evaluation.results.figure_files import PRINTED, figure_svg, save_figure
from evaluation.results.figure_text import escape_dollars
from evaluation.results.keys import RESERVED
from evaluation.results.method_names import in_table_order, title
from evaluation.results.styles import FIGURE_STYLE, MethodStyle, method_styles
from evaluation.results.table import Answers, QueryRows, Results, Row

_Measured = TypeVar("_Measured", Row, Answers)
# Width of a line in a legend, and of a letter of a name [px].
_LEGEND_LINE = 60
_LEGEND_LETTER = 8


@dataclass(frozen=True)
class DrawnChart:
    """A chart that is drawn.

    Attributes:
        title: what the chart shows.
        source: the rows of the table that the chart shows, in words.
        figure: the drawing.
        legend: name of a method -> its style; the mapping is empty if the
            drawing itself contains the names.
        settings: Matplotlib's parameters with which it was drawn.
    """

    title: str
    source: str
    figure: Figure
    legend: Mapping[str, MethodStyle]
    settings: Mapping[str, Any]

    def save(self, stem: Path, kinds: Sequence[str] = PRINTED) -> None:
        """Writes the drawing, see `save_figure`."""
        save_figure(self.figure, stem, kinds, self.settings)

    def svg(self, prefix: str) -> Markup:
        """Returns the drawing for a page, see `figure_svg`."""
        return figure_svg(self.figure, prefix, self.settings)


def draw_chart(
    chart: Mapping[str, Any],
    results: Results,
    width: int = WIDE,
    *,
    printed: PrintStyle | None = None,
    queries: QueryRows | None = None,
) -> DrawnChart:
    """Returns a chart, drawn from a table of results.

    Args:
        chart: description of the chart, as in an experiment's file.
        results: the table.
        width: width of the drawing on a page [px].
        printed: style of a drawing for print, which includes its legend; None
            for a drawing on a page.
        queries: the answers from which the table was made, for `curves`; None
            if they are unknown.

    Raises:
        InputError: the chart has an unknown kind or column, or selects no rows.

    Example:
        from evaluation import Results, draw_chart

        chart = {"kind": "matrix", "over": "map", "metric": "auc"}
        table = Results.read(Path("results.csv"))
        draw_chart(chart, table).save(Path("matrix"), ["pdf"])
    """
    keys = check_chart(chart)
    if names_of := _file_names(results.rows):
        results = Results.of(_renamed(results.rows, names_of))
        if queries is not None:
            queries = QueryRows.of(_renamed(queries.answers, names_of))
    rows, source = _selected_rows(chart, keys, results)
    # All charts of a table show a method in the same style.
    of_table = method_styles(in_table_order(row.label for row in results.rows))
    shown = {title(row.label) for row in rows}
    styles = {name: one for name, one in of_table.items() if name in shown}
    kind = chart["kind"]
    look = printed or PrintStyle()
    width = printed.layout_width if printed else width
    settings = {**FIGURE_STYLE, **look.settings}
    with figure_style(settings):
        drawn = Chart(keys, results, rows, styles, width, look.px, queries)
        figure = _KINDS[kind].draw(drawn)
        name = _title(keys)
        legend = {}
        if kind in ("curves", "lines", "scatter"):
            legend = _legend(figure, styles)
        if look.title and printed:
            figure.suptitle(escape_dollars(textwrap.fill(name, width // 9)))
        if printed:
            _add_legend(drawn, figure, legend)
    return DrawnChart(name, source, figure, legend, settings)


def _title(keys: Mapping[str, str]) -> str:
    """Returns what a chart shows, by the fields of its description."""
    if "over" in keys:
        return f"{in_words(keys['metric'])} by {in_words(keys['over'])}"
    if "x" in keys:
        return f"{in_words(keys['y'])} over {in_words(keys['x'])}"
    return "Precision over recall"


def _selected_rows(
    chart: Mapping[str, Any], keys: Mapping[str, str], results: Results
) -> tuple[tuple[Row, ...], str]:
    """Returns the rows of a chart's metric that its description selects.

    Returns:
        The rows with a defined value; and in words, which rows these are.
    """
    kind = chart["kind"]
    metric = keys.get("metric", keys.get("y", "auc"))
    chosen = {n: v for n, v in chart.items() if n != "kind" and n not in keys}
    for name in (*chosen, *(keys[n] for n in keys if n in ("over", "strips"))):
        if not any(row[name] is not None for row in results.rows):
            raise InputError(f"charts: {kind}: {name}: the table has none")
    tasks = results.where(metric=metric).distinct("task")
    task = "place" if "place" in tasks else tasks[:1]
    # A dumbbell shows results without and with geometric verification.
    verified: object = 0
    if kind == "dumbbell":
        shown = results.where({"task": task, **chosen}, metric=metric)
        verified = sorted({int(row.verified) for row in shown.rows}) or 0
    chosen = {"task": task, "verified": verified, **chosen}
    known, undefined = results.where(chosen, metric=metric).defined()
    rows = known.rows
    if not rows:
        raise InputError(f"charts: {kind}: the table has no {metric} like that")
    for row in rows:
        metric_named(metric).checked(row.value)
    named = ", ".join(f"{name} {_listed(one)}" for name, one in chosen.items())
    source = f"{len(rows)} rows of results.csv: metric {metric}, {named}"
    return rows, f"{source}; {undefined}" if undefined else source


def _listed(value: object) -> str:
    """Returns the value of a column, or possible values, as text."""
    some = value if isinstance(value, tuple | list | set) else [value]
    return " or ".join(map(str, some))


def _file_names(rows: Sequence[Row]) -> dict[tuple[str, object], str]:
    """Returns settings of methods that name files, without their folders.

    Paths are too long for a chart. If two paths of a table end in the same
    name, all paths stay whole.

    Returns:
        (Column, value) -> the value without folders; empty if nothing changes.
    """
    found = {
        (name, value): re.sub(r"[^\s\"',\[\]]*/", "", value)
        for row in rows
        for name, value in row.factors.items()
        if name.startswith(SETTINGS) and isinstance(value, str)
    }
    different = {(name, short) for (name, _), short in found.items()}
    if len(different) < len(found):
        return {}
    return {key: short for key, short in found.items() if key[1] != short}


def _renamed(
    items: Iterable[_Measured], names_of: Mapping[tuple[str, object], str]
) -> list[_Measured]:
    return [
        replace(
            item,
            factors={
                name: names_of.get((name, value), value)
                for name, value in item.factors.items()
            },
        )
        for item in items
    ]


def _legend(
    figure: Figure, styles: Mapping[str, MethodStyle]
) -> dict[str, MethodStyle]:
    """Returns methods' styles; the line style is empty if no line is drawn."""
    with_line = {
        line.get_color()
        for axes in figure.axes
        for line in axes.get_lines()
        if line.get_linestyle() != "None"
    }
    return {
        name: style if style.colour in with_line else style._replace(line="")
        for name, style in styles.items()
    }


def _add_legend(
    chart: Chart, figure: Figure, legend: Mapping[str, MethodStyle]
) -> None:
    """Adds a legend below a figure, and makes room for the legend's rows."""
    if not legend:
        return
    handles = []
    for name, style in legend.items():
        options: dict = {"linestyle": style.line, "marker": style.marker}
        options["label"] = escape_dollars(name)
        handles.append(Line2D([], [], color=style.colour, **options))
    column = _LEGEND_LINE + _LEGEND_LETTER * max(map(len, legend))
    columns = max(1, chart.width // column)
    lines = math.ceil(len(handles) / columns)
    figure.set_figheight(figure.get_figheight() + lines * ROW * chart.px)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)


def chart_factors(chart: Mapping[str, Any]) -> list[str]:
    """Returns the names in a chart's description that must be factors.

    Columns that every table has are left out, and so are metrics.
    """
    keys = check_chart(chart)
    names = [n for n in chart if n != "kind" and n not in keys]
    names += [keys[n] for n in ("over", "strips") if n in keys]
    names += [
        keys[n] for n in ("x", "y") if n in keys and keys[n] not in METRICS
    ]
    return [name for name in names if name not in RESERVED]


def check_factors(
    chart: Mapping[str, Any], names: Iterable[str], factors: Collection[str]
) -> None:
    """Checks that names in a chart's description are factors.

    Args:
        chart: the description.
        names: the names, see `chart_factors`.
        factors: names of the experiment's factors.

    Raises:
        InputError: the experiment has no such factor.
    """
    for name in names:
        if name not in factors:
            raise InputError(
                f"charts: {chart['kind']}: no factor {name!r} (the experiment"
                f" varies: {', '.join(factors) or 'nothing'})"
            )


def check_chart(chart: Mapping[str, Any]) -> dict[str, str]:
    """Checks the description of a chart before there are results.

    Returns:
        The fields of the description that this kind of chart uses.

    Raises:
        InputError: the kind is unknown, or the description lacks a key.
    """
    kind = chart.get("kind")
    if not isinstance(kind, str) or kind not in _KINDS:
        fault = no_such("kind", kind, _KINDS)
        raise InputError(f"charts: kind: {fault}")
    _, needed, optional = _KINDS[kind]
    keys = {n: chart[n] for n in (*needed, *optional) if n in chart}
    for name in (*needed, *keys):
        if not isinstance(keys.get(name), str):
            raise InputError(f"charts: {kind}: {name}: a name is needed")
    return keys


class _Kind(NamedTuple):
    """How charts of a kind are drawn, and the keys of their descriptions."""

    draw: Callable[[Chart], Figure]
    needed: tuple[str, ...]
    optional: tuple[str, ...] = ()


_KINDS = {
    "curves": _Kind(draw_curves, ()),
    "dumbbell": _Kind(draw_dumbbell, ("over", "metric")),
    "lines": _Kind(draw_lines, ("over", "metric")),
    "matrix": _Kind(draw_matrix, ("over", "metric"), ("strips",)),
    "scatter": _Kind(draw_scatter, ("x", "y")),
}
