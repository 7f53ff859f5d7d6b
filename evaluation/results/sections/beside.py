"""The section with the user's methods beside the shipped results."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import itertools
import math
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from evaluation.base import figure_style
from evaluation.recognition import Metric, metric_named
from evaluation.results.charts.chart import (
    NARROW,
    ROW,
    WIDE,
    PrintStyle,
    rows_of_methods,
    start_at_zero,
)
from evaluation.results.figure_files import PRINTED, figure_svg, save_figure
from evaluation.results.figure_text import escape_dollars
from evaluation.results.keys import LAST, STAGE
from evaluation.results.method_names import in_table_order, title
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.ranking import Ranked, rank_methods
from evaluation.results.styles import FIGURE_STYLE, PALE, method_styles
from evaluation.results.table import QueryRows, Results, Row
from evaluation.results.table_comparison import rows_beside_shipped

_METRIC = "auc_strict"
# Width of a column of a paper [inches].
_COLUMN = 3.5
# Part of a row's height over which its single results are spread.
_SPREAD = 0.56


def beside_section(
    results: Results,
    queries: QueryRows | None,
    own_methods: Sequence[str],
    metrics: Sequence[Metric],
    folder: Path,
    printed: PrintStyle,
) -> tuple[list[PageSection], str]:
    """Returns the user's methods beside the shipped ones, and writes a figure.

    The figure, `beside.pdf` and others, is as wide as a column of paper,
    unless its style has another width.

    Args:
        results: the table of the study, with defined values only.
        queries: the table of queries; None if there is none.
        own_methods: names of the user's methods.
        metrics: the metrics that the page shows; the first is compared, or the
            AUC strict.
        folder: folder of the page.
        printed: style of the figure.

    Returns:
        The section, if the shipped tables have results of the same conditions;
        and why there is none, empty without methods of the user.
    """
    if not own_methods:
        return [], ""
    metric = metrics[0].name if metrics else _METRIC
    rows, why_not = rows_beside_shipped(results, metric)
    if why_not:
        return [], why_not
    labels = {row.label for row in results.rows if row.method in own_methods}
    ranked = rank_methods(rows)
    of_method: dict[str, list[Row]] = {one.method: [] for one in ranked}
    for row in rows:
        of_method[row.method].append(row)
    # As in all charts of the page; the shipped ones are grey.
    styles = method_styles(in_table_order(row.label for row in results.rows))
    colours = {
        name: styles[title(name)].colour for name in of_method if name in labels
    }
    if not colours:
        return [], "no method of yours has all of their conditions"
    shown = ranked, of_method, colours, metric
    figures = {
        name: _draw(*shown, width, PrintStyle())
        for name, width in (("wide", WIDE), ("narrow", NARROW))
    }
    column = replace(printed, width=printed.width or _COLUMN)
    save_figure(
        _draw(*shown, column.layout_width, column),
        folder / "beside",
        PRINTED,
        column.settings,
    )
    number = len(of_method[ranked[0].method])
    against = {
        own: {
            one.method: _against(of_method[own], of_method[one.method])
            for one in ranked
            if one.method != own
        }
        for own in colours
    }
    return [
        page_section(
            "beside",
            "Your method",
            f"results.csv and the shipped tables: {len(rows)} rows of {metric}"
            f" in {number} conditions, verified 0",
            is_open=True,
            title_of=title,
            metric=metric_named(metric).label,
            number=number,
            wide=WIDE,
            svgs={
                name: figure_svg(figure, f"beside-{name}")
                for name, figure in figures.items()
            },
            verdicts=[
                _verdict(own, ranked, of_others, number)
                for own, of_others in against.items()
            ],
            own=list(colours),
            ranked=[
                (one, [others.get(one.method) for others in against.values()])
                for one in ranked
            ],
            alone=_alone(queries, own_methods),
        )
    ], ""


class _Against(NamedTuple):
    """A method against another one, over the same conditions.

    Attributes:
        difference: mean difference of the metric.
        better, worse: in how many of them it is better and worse, and the 95 %
            intervals of the two results do not overlap.
    """

    difference: float
    ahead: int
    better: int
    worse: int


def _against(own: Sequence[Row], other: Sequence[Row]) -> _Against:
    theirs = {row.without("method"): row for row in other}
    pairs = [(row, theirs[row.without("method")]) for row in own]
    above = [row.value > than.value for row, than in pairs]
    below = [row.value < than.value for row, than in pairs]
    apart = [(row.low > than.high, row.high < than.low) for row, than in pairs]
    surely_above, surely_below = map(sum, zip(*apart, strict=True))
    difference = sum(row.value - than.value for row, than in pairs) / len(pairs)
    if metric_named(own[0].metric).better == "less":
        return _Against(difference, sum(below), surely_below, surely_above)
    return _Against(difference, sum(above), surely_above, surely_below)


def _verdict(
    own: str,
    ranked: Sequence[Ranked],
    against: Mapping[str, _Against],
    number: int,
) -> dict[str, Any]:
    """Returns a method's rank, and which methods are surely worse or better."""
    place = next(k for k, one in enumerate(ranked, 1) if one.method == own)
    return {
        "name": title(own),
        "place": place,
        "value": ranked[place - 1].value,
        "worse": [
            title(name) for name, one in against.items() if one.better == number
        ],
        "better": [
            title(name) for name, one in against.items() if one.worse == number
        ],
    }


def _alone(
    queries: QueryRows | None, own_methods: Sequence[str]
) -> list[tuple[str, str, int, int, int]]:
    """Returns how many queries only one of two methods of the study answers.

    Returns:
        For each pair of a user's method and another one: their names, the
        number of queries that only the first and only the second answers, and
        of all.
    """
    answers: dict[tuple, dict[str, Any]] = {}
    for one in queries.answers if queries else ():
        if one.task == "place" and not one.verified and one[STAGE] != LAST:
            found = answers.setdefault(one.without("method"), {})
            found[one.label] = one
    counts: dict[tuple[str, str], list[int]] = {}
    for by_method in answers.values():
        for first, second in itertools.permutations(by_method.values(), 2):
            if first.method not in own_methods or second.method in own_methods:
                continue
            is_right, is_other = (
                one.columns["correct"] for one in (first, second)
            )
            count = counts.setdefault((first.label, second.label), [0, 0, 0])
            count[0] += int((is_right & ~is_other).sum())
            count[1] += int((is_other & ~is_right).sum())
            count[2] += len(is_right)
    return [
        (title(first), title(second), only_first, only_second, total)
        for (first, second), (only_first, only_second, total) in counts.items()
    ]


def _draw(
    ranked: Sequence[Ranked],
    of_method: Mapping[str, Sequence[Row]],
    colours: Mapping[str, str],
    metric: str,
    width: int,
    look: PrintStyle,
) -> Figure:
    """Returns the chart: a row for each method, the best first.

    A mark is the mean, a thin line with a point a single result with its
    interval.
    """
    number = len(of_method[ranked[0].method])
    height = ROW * (len(ranked) * max(1.0, 0.3 * number) + 2.5)
    with figure_style({**FIGURE_STYLE, **look.settings}):
        size = width * look.px, height * look.px
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        side = axes.get_yaxis_transform()
        for y, one in enumerate(ranked):
            colour = colours.get(one.method, PALE)
            for k, row in enumerate(of_method[one.method]):
                at = y + _SPREAD * ((k + 0.5) / number - 0.5)
                if not math.isnan(row.low):
                    axes.plot(
                        [row.low, row.high], [at, at], "-", c=colour, lw=1
                    )
                if number > 1:
                    axes.plot(row.value, at, ".", c=colour, ms=4)
            axes.plot(one.value, y, "o", c=colour, ms=7, zorder=3)
            axes.text(
                1.02,
                y,
                f"{one.value:.2f}",
                transform=side,
                va="center",
                # Black is white on a dark page.
                color=colours.get(one.method, "black"),
            )
        rows_of_methods(axes, [title(one.method) for one in ranked])
        for one, label in zip(ranked, axes.get_yticklabels(), strict=True):
            if one.method in colours:
                label.set(color=colours[one.method], fontweight="bold")
        axes.set_xlabel(escape_dollars(metric_named(metric).label))
        start_at_zero(axes, x=metric)
    return figure
