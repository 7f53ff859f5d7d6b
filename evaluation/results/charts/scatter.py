"""Scatter: a metric over another metric or a numeric factor."""

from collections.abc import Iterable
import math

from matplotlib.figure import Figure
import numpy as np

from cns_drake.base import InputError
from evaluation.results.charts.chart import Chart, start_at_zero
from evaluation.results.charts.words import in_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.headlines import from_least_to_greatest, listed
from evaluation.results.method_names import title
from evaluation.results.smoothing import curves
from evaluation.results.summaries import (
    LEAST_POINTS,
    correlations,
    paired_values,
)
from evaluation.results.table import Results, Row


def draw_scatter(chart: Chart) -> tuple[str, Figure]:
    """Returns the chart's message, and the chart."""
    x_name, y_name = chart.keys["x"], chart.keys["y"]
    shown = {row.identity for row in chart.rows}
    points = [
        (row, at)
        for row, at in paired_values(chart.results, x_name, y_name)
        if row.identity in shown
    ]
    if not points:
        raise InputError(f"charts: scatter: no {y_name} has a {x_name}")
    figure = chart.figure(380.0)
    axes = figure.subplots()
    has_points_beyond = False
    for label, (colour, style, marker) in chart.styles.items():
        known = sorted(
            (at, row.value) for row, at in points if title(row.label) == label
        )
        if not known:
            continue
        x, y = np.array(known).T
        few = len(x) < LEAST_POINTS
        size, alpha = (8.0, 0.9) if few else (5.0, 0.55)
        axes.plot(x, y, marker, color=colour, mew=0, ms=size, alpha=alpha)
        drawn = list(curves(x, y))
        has_points_beyond |= bool(drawn) and not all(
            any(curve.x[0] <= at <= curve.x[-1] for curve in drawn) for at in x
        )
        for curve in drawn:
            axes.fill_between(
                curve.x, curve.low, curve.high, color=colour, alpha=0.18, lw=0
            )
            axes.plot(curve.x, curve.y, style, color=colour)
    axes.set(
        xlabel=escape_dollars(in_words(x_name)),
        ylabel=escape_dollars(in_words(y_name)),
    )
    start_at_zero(axes, x=x_name, y=y_name)
    # On a phone there is room for a few numbers.
    axes.locator_params(axis="x", nbins=6)
    axes.grid(alpha=0.3)
    message = _trend_message(chart, points)
    if has_points_beyond:
        message += "; curves end where gaps between points are wide"
    return message, figure


def _trend_message(chart: Chart, points: Iterable[tuple[Row, float]]) -> str:
    """Returns the rank correlation of each method with what is on the x axis.

    Args:
        chart: the chart.
        points: rows of the metric on the y axis, each with its x.
    """
    x_name, y_name = chart.keys["x"], chart.keys["y"]
    selected = Results.of(
        [row for row in chart.results.rows if row.metric != y_name]
        + list(chart.rows)
    )
    # `correlations` are of 1 - metric: the signs change.
    found = [
        correlation._replace(
            value=-correlation.value,
            low=-correlation.high,
            high=-correlation.low,
        )
        for correlation in correlations(selected, x_name, y_name)
        if not math.isnan(correlation.value)
    ]
    if not found:
        message = f"{in_words(y_name)} over {in_words(x_name)}"
        number = len({row.without("method") for row, _ in points})
        if number < LEAST_POINTS:
            message += ", too few points for a trend"
        return message
    coefficients = {
        title(correlation.method): correlation.value for correlation in found
    }
    text = from_least_to_greatest(coefficients, "{:+.2f}")
    names = f"{in_words(y_name)} with {in_words(x_name)}"
    message = f"Rank correlation of {names}: {text}"
    doubtful = [
        title(correlation.method)
        for correlation in found
        if correlation.low <= 0 <= correlation.high
    ]
    if doubtful:
        message += (
            f"; not significantly different from 0 with {listed(doubtful)}"
        )
    return message
