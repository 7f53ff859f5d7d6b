"""Lines: a metric over a numeric factor, with a band.

The band reaches from the lowest to the highest result among the seeds.
"""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.base import InputError
from evaluation.recognition import metric_named
from evaluation.results.charts.chart import Chart, start_at_zero
from evaluation.results.charts.words import in_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.method_names import title
from evaluation.results.summaries import means
from evaluation.results.table import Row

# Beyond this ratio of its values, an axis is logarithmic.
_WIDE_RANGE = 50.0


def draw_lines(chart: Chart) -> Figure:
    """Returns the chart."""
    over = chart.keys["over"]
    figure, panels = chart.panels(280.0, chart.panel_rows)
    at = sorted({_checked_number(row, over) for row in chart.rows})
    for axes, rows in zip(panels, chart.panel_rows.values(), strict=True):
        for label, (colour, style, marker) in chart.styles.items():
            of_label = [row for row in rows if title(row.label) == label]
            points = sorted(means(of_label, over), key=lambda mean: mean.key)
            x = [mean.key[0] for mean in points]
            y, low, high = (
                [getattr(mean, end) for mean in points]
                for end in ("value", "least", "greatest")
            )
            axes.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
            axes.plot(x, y, linestyle=style, marker=marker, color=colour)
        _spread_axis(axes, at)
        if metric_named(chart.metric).grows:
            axes.set_yscale("log")
        else:
            start_at_zero(axes, y=chart.metric)
        axes.grid()
        # A label of the whole figure would lie below its legend.
        axes.set_xlabel(escape_dollars(in_words(over)))
    figure.supylabel(escape_dollars(in_words(chart.metric)))
    return figure


def _checked_number(row: Row, column: str) -> float:
    value = row[column]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"charts: {column}: {value!r} is no number")
    return float(value)


def _spread_axis(axes: Axes, at: Sequence[float]) -> None:
    """Makes the x axis logarithmic if its values span a wide range.

    On a linear axis of whole numbers, such as levels, ticks are whole, too.
    """
    above = [value for value in at if value > 0.0]
    if min(at) >= 0.0 and above and max(above) / min(above) > _WIDE_RANGE:
        axes.set_xscale("symlog", linthresh=min(above))
        axes.set_xticks(list(at), [f"{value:g}" for value in at])
        axes.minorticks_off()
    elif all(value == round(value) for value in at):
        axes.locator_params(axis="x", integer=True)
