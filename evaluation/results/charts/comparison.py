"""The figure of a comparison: a row for each method, the best on top."""

from collections.abc import Collection
import math
import textwrap

from matplotlib.figure import Figure

from evaluation.base import figure_style
from evaluation.recognition import metric_named
from evaluation.results.charts.chart import (
    ROW,
    WIDE,
    PrintStyle,
    rows_of_methods,
    start_at_zero,
)
from evaluation.results.charts.words import in_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.method_names import title
from evaluation.results.styles import FIGURE_STYLE, PALE, method_styles
from evaluation.results.survival import MARGIN
from evaluation.results.table_comparison import Comparison


def draw_comparison(
    found: Comparison,
    printed: PrintStyle | None = None,
    marked: Collection[str] = (),
    width: int = WIDE,
) -> Figure:
    """Returns the figure of a comparison.

    A mark is a method's mean, a bar its 95 % interval. Of a comparison with
    survival, these are what a method retains, with a tick for each city; the
    whole bar of a method that survives lies in the grey part.

    Args:
        found: the comparison.
        printed: style of a figure for print; None for one on a page.
        marked: names of cities whose ticks have the method's colour.
        width: width of a figure on a page [px].
    """
    look = printed or PrintStyle()
    width = look.layout_width if printed else width
    if found.survival:
        rows = [
            (
                one.method,
                100.0 * (1.0 - one.loss),
                100.0 * (1.0 - one.interval.high),
                100.0 * (1.0 - one.interval.low),
                {c: 100.0 * (1.0 - x) for c, x in one.of_cities.items()},
            )
            for one in found.survival
        ]
        number = len(found.survival[0].of_cities)
        kept = in_words(metric_named(found.metric).share_of)
        text = f"retained {kept} in {number} cities [%]"
        says = (
            "bar: 95\N{NO-BREAK SPACE}% interval; tick: a city; grey: where"
            " methods survive"
        )
    else:
        rows = [
            (one.method, one.value, one.interval.low, one.interval.high, {})
            for one in found.ranked
        ]
        number = found.conditions
        text = f"{in_words(found.metric)}, mean of {number} conditions"
        says = "bar: 95\N{NO-BREAK SPACE}% interval"
    names = [title(name) for name, *_ in rows]
    styles = method_styles([name for name, *_ in rows])
    settings = {**FIGURE_STYLE, **look.settings}
    with figure_style(settings):
        size = width * look.px, (1.6 * len(rows) + 4) * ROW * look.px
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        if found.survival:
            axes.axvspan(
                100.0 * (1.0 - MARGIN), 100.0, color=PALE, alpha=0.2, lw=0
            )
        for y, (name, (_, value, low, high, of_cities)) in enumerate(
            zip(names, rows, strict=True)
        ):
            colour, _, marker = styles[name]
            if not math.isnan(low):
                axes.plot(
                    [low, high], [y, y], color=colour, lw=5, alpha=0.4,
                    solid_capstyle="butt",
                )  # fmt: skip
            axes.plot(value, y, marker, color=colour, ms=8)
            for city, share in of_cities.items():
                mine = city in marked
                axes.plot(
                    share, y + 0.35, "|", color=colour if mine else PALE,
                    ms=9 if mine else 6, mew=2.5 if mine else 1.0,
                )  # fmt: skip
        rows_of_methods(axes, names)
        start_at_zero(axes, x=found.metric)
        if any(not math.isnan(row[2]) for row in rows):
            text = f"{text}; {says}"
        if marked:
            text += f"; tick in colour: {', '.join(sorted(marked))}"
        figure.supxlabel(escape_dollars(textwrap.fill(text, width // 9)))
        if printed and look.title:
            figure.suptitle(
                escape_dollars(f"{in_words(found.metric)} of each method")
            )
    return figure
