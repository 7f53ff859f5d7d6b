"""Dumbbell: a metric at the first and the last value of a factor.

Results without and with geometric verification are in two panels.
"""

from collections.abc import Sequence
import math
import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from cns_drake.base import InputError
from evaluation.recognition import metric_named
from evaluation.results.answer import Change, change_of, cost_sentence
from evaluation.results.charts.chart import (
    FONT,
    ROW,
    WIDE,
    Chart,
    start_at_zero,
)
from evaluation.results.charts.words import end_words, in_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.headlines import from_least_to_greatest
from evaluation.results.keys import SETTINGS
from evaluation.results.method_names import title

_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# Titles of the panels.
_PANELS = ("Without geometric verification", "With geometric verification")


def draw_dumbbell(chart: Chart) -> tuple[str, Figure]:
    """Returns the chart's message, and the chart."""
    over = chart.keys["over"]
    values = chart.results.distinct(over)
    if len(values) < 2:
        raise InputError(f"charts: dumbbell: {over}: the table has one value")
    try:
        change = change_of(chart.rows, over, values[0], values[-1])
    except InputError as error:
        raise InputError(f"charts: dumbbell: {error}") from None
    figure, panels = _panels(chart, change)
    for axes, verified in zip(panels, change.verifications, strict=True):
        _draw_methods(axes, chart, change, verified)
        if len(panels) > 1:
            axes.set_title(_PANELS[verified], loc="left")
        axes.grid(axis="x", alpha=0.3)
        axes.tick_params(length=0)
        start_at_zero(axes, x=chart.metric)
    text = textwrap.fill(_axis_text(chart, change), chart.width // 9)
    figure.supxlabel(escape_dollars(text), fontsize=FONT)
    return _message(change), figure


def _message(change: Change) -> str:
    """Returns what the chart shows: the cost, if more of the metric is better.

    Of other metrics, and of shares, it is what is left.
    """
    metric = metric_named(change.metric)
    verified, *_ = change.verifications
    if change.over.startswith(SETTINGS):
        # Each value of a setting makes a method with a row of its own.
        ends = {
            name: np.array(
                [change.ends[name, verified, p] for p in change.pairs]
            )
            for name in change.methods
        }
        found = {
            name: float(np.nanmedian(one))
            for name, one in ends.items()
            if not np.isnan(one).all()
        }
        return f"{in_words(change.metric)}: {from_least_to_greatest(found)}"
    if metric.better == "more" and not metric.share_of:
        return cost_sentence(change)
    shares = {n: 100.0 * one for n, one in change.shares(verified).items()}
    number = len(change.pairs)
    pairs = f"median of {number} pairs" if number > 1 else "one pair"
    return (
        f"Share of the {in_words(change.metric)} that is retained, {pairs}:"
        f" {from_least_to_greatest(shares, _PERCENT)}"
    )


def _panels(chart: Chart, change: Change) -> tuple[Figure, list[Axes]]:
    """Returns a figure with a panel without, and one with verification.

    On a phone, one is below the other.
    """
    number = len(change.verifications)
    height = (1.6 * len(change.methods) + 2) * ROW
    is_wide = chart.width >= WIDE
    figure = chart.figure((1 if is_wide else number) * height + 2 * ROW)
    shape = (1, number) if is_wide else (number, 1)
    grid = figure.subplots(*shape, squeeze=False, sharex=True, sharey=is_wide)
    return figure, list(grid.flat)


def _draw_methods(
    axes: Axes, chart: Chart, change: Change, verified: bool
) -> None:
    """Draws a row for each method: the median, and a tick for each pair."""
    side = axes.get_yaxis_transform()
    for y, name in enumerate(change.methods):
        colour, _, marker = chart.styles[name]
        ends = np.array([change.ends[name, verified, p] for p in change.pairs])
        is_whole = ~np.isnan(ends).any(axis=1)
        if is_whole.any():
            ends = ends[is_whole]
        # Above the row: before; below: after.
        for value, at, shift in (
            (change.before, ends[:, 0], -0.3),
            (change.after, ends[:, 1], 0.3),
        ):
            mark, shown = "|", at.tolist()
            if len(change.pairs) == 1:
                mark, shown = "-", _interval(chart, name, verified, value)
            rows = np.full(len(shown), y + shift)
            axes.plot(shown, rows, mark, color=colour, ms=7, alpha=0.8, lw=1.2)
        before, after = np.median(ends, axis=0)
        axes.plot([before, after], [y, y], color=colour, lw=3.5, alpha=0.5)
        axes.plot(before, y, marker, color=colour, mfc="white", ms=8)
        axes.plot(after, y, marker, color=colour, ms=8)
        share = change.share(name, verified)
        if not math.isnan(share):
            text = _PERCENT.format(100.0 * share)
            axes.text(
                1.02, y, text, transform=side, va="center", fontweight="bold"
            )
    axes.set_yticks(
        range(len(change.methods)), list(map(escape_dollars, change.methods))
    )
    axes.set_ylim(len(change.methods) - 0.4, -0.6)


def _interval(
    chart: Chart, method: str, verified: bool, value: object
) -> Sequence[float]:
    """Returns the 95 % interval of a single result; empty if unknown."""
    found = [
        (row.low, row.high)
        for row in chart.rows
        if (title(row.label), row.verified) == (method, verified)
        and row[chart.keys["over"]] == value
    ]
    return found[0] if len(found) == 1 and not np.isnan(found).any() else ()


def _axis_text(chart: Chart, change: Change) -> str:
    """Returns the text of the axis: the metric, and what the marks are."""
    first, last = end_words(change.over, change.before, change.after)
    text = f"{in_words(chart.metric)} {first} (hollow) and {last} (filled)"
    if (number := len(change.pairs)) > 1:
        text += (
            f": medians of {number} pairs; ticks are pairs, before above and"
            " after below the line"
        )
    elif any(
        _interval(chart, name, verified, change.after)
        for name in change.methods
        for verified in change.verifications
    ):
        text += "; thin lines are 95\N{NO-BREAK SPACE}% intervals"
    return f"{text}; right: the share that is left"
