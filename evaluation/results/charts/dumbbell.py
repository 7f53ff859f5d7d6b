"""Dumbbell: a metric at the first and the last value of a factor.

Results without and with geometric verification are in two panels.
"""

from collections.abc import Mapping, Sequence
import math
import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from evaluation.base import InputError
from evaluation.recognition import kept_share
from evaluation.results.charts.chart import (
    ROW,
    Chart,
    rows_of_methods,
    start_at_zero,
)
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.keys import STAGE
from evaluation.results.method_names import title
from evaluation.results.summaries import means
from evaluation.results.table import Row

_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# Titles of the panels.
_PANELS = ("Without geometric verification", "With geometric verification")
# Columns that say which drives are compared.
_PAIR = ("map", "database", "query")


def draw_dumbbell(chart: Chart) -> Figure:
    """Returns the chart.

    Raises:
        InputError: the factor has one value, or no pair of drives was measured
            at its first and its last value.
    """
    over = chart.keys["over"]
    values = chart.results.distinct(over)
    if len(values) < 2:
        raise InputError(f"charts: dumbbell: {over}: the table has one value")
    both = values[0], values[-1]
    ends = _ends(chart.rows, over, *both)
    if not ends:
        raise InputError(f"charts: dumbbell: {over}: no pair has both ends")
    verifications = sorted({verified for _, verified in ends})
    figure, panels = _panels(chart, len(verifications))
    for axes, verified in zip(panels, verifications, strict=True):
        _draw_methods(axes, chart, ends, both, verified)
        if len(panels) > 1:
            axes.set_title(_PANELS[verified], loc="left")
        start_at_zero(axes, x=chart.metric)
    number = max(map(len, ends.values()))
    text = textwrap.fill(_axis_text(chart, *both, number), chart.width // 9)
    figure.supxlabel(escape_dollars(text))
    return figure


def _ends(
    rows: Sequence[Row], over: str, before: object, after: object
) -> dict[tuple[str, bool], np.ndarray]:
    """Returns (method, verified) -> the metric (P, 2) of P pairs of drives.

    A pair has both ends; of several seeds, the mean counts. Values are NaN
    where a method was not measured.
    """
    value_at = {
        (title(mean.key[0]), bool(mean.key[1]), mean.key[2:5], mean.key[5]): (
            mean.value
        )
        for mean in means(rows, "label", "verified", *_PAIR, over)
    }
    at_start, at_end = (
        dict.fromkeys(pair for _, _, pair, v in value_at if v == value)
        for value in (before, after)
    )
    pairs = [pair for pair in at_start if pair in at_end]
    return {
        name: np.array(
            [
                [value_at.get((*name, p, v), math.nan) for v in (before, after)]
                for p in pairs
            ]
        )
        for name in dict.fromkeys(key[:2] for key in value_at)
        if pairs
    }


def _panels(chart: Chart, number: int) -> tuple[Figure, list[Axes]]:
    """Returns a figure with a panel without, and one with verification.

    On a phone, one is below the other.
    """
    height = (1.6 * len(chart.styles) + 2) * ROW
    wide = chart.is_wide
    figure = chart.figure((1 if wide else number) * height + 2 * ROW)
    shape = (1, number) if wide else (number, 1)
    grid = figure.subplots(*shape, squeeze=False, sharex=True, sharey=wide)
    return figure, list(grid.flat)


def _draw_methods(
    axes: Axes,
    chart: Chart,
    ends: Mapping[tuple[str, bool], np.ndarray],
    both: tuple[object, object],
    verified: bool,
) -> None:
    """Draws a row for each method, and in it a line for each pair of drives.

    The share at the right is the mean of what the pairs keep, as everywhere.
    """
    side = axes.get_yaxis_transform()
    for y, (name, (colour, _, marker)) in enumerate(chart.styles.items()):
        if (name, verified) not in ends:
            continue
        of_pairs = ends[name, verified]
        is_whole = ~np.isnan(of_pairs).any(axis=1)
        if is_whole.any():
            of_pairs = of_pairs[is_whole]
        number = len(of_pairs)
        shifts = np.linspace(-0.3, 0.3, number) if number > 1 else [0.0]
        size = 8 if number == 1 else max(3, 7 - number // 3)
        if number == 1:  # Above the line: before; below: after.
            for value, shift in zip(both, (-0.3, 0.3), strict=True):
                limits = _interval(chart, name, verified, value)
                rows = np.full(len(limits), y + shift)
                axes.plot(limits, rows, color=colour, alpha=0.8, lw=1.2)
        for at, shift in zip(of_pairs, shifts, strict=True):
            axes.plot(at, [y + shift] * 2, color=colour, lw=size / 2, alpha=0.5)
            for end, fill in zip(at, ("white", colour), strict=True):
                axes.plot(
                    end, y + shift, marker, color=colour, mfc=fill, ms=size
                )
        shares = kept_share(of_pairs[:, 1], of_pairs[:, 0])
        if not np.isnan(shares).all():
            text = _PERCENT.format(100.0 * np.nanmean(shares))
            axes.text(
                1.02, y, text, transform=side, va="center", fontweight="bold"
            )
    rows_of_methods(axes, list(chart.styles))


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


def _axis_text(chart: Chart, before: object, after: object, number: int) -> str:
    """Returns the text of the axis: the metric, and what the marks are."""
    over = chart.keys["over"]
    at = "" if over == STAGE else f"at {in_words(over)} "
    first, last = (f"{at}{value_words(one, over)}" for one in (before, after))
    text = f"{in_words(chart.metric)} {first} (hollow) and {last} (filled)"
    if number > 1:
        text += (
            f", a line for each of {number} pairs of drives; right: the mean of"
            " the shares that are left"
        )
        return text
    elif any(
        _interval(chart, name, verified, after)
        for name in chart.styles
        for verified in (False, True)
    ):
        text += "; thin lines are 95\N{NO-BREAK SPACE}% intervals"
    return f"{text}; right: the share that is left"
