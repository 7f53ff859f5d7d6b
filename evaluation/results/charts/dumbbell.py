"""Dumbbell: a metric at the first and the last value of a factor."""

from collections import Counter
from collections.abc import Mapping, Sequence
import math
import textwrap
from typing import TypeAlias

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cns_drake.base import InputError
from evaluation.recognition import kept_share
from evaluation.results.charts.chart import (
    FONT,
    ROW,
    Chart,
    start_at_zero,
    with_significance,
)
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.headlines import from_least_to_greatest
from evaluation.results.keys import STAGE
from evaluation.results.method_names import title
from evaluation.results.summaries import means, median_kept

# The sign of per cent never begins a line.
_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# Columns that say which drives are compared.
_PAIR = ("map", "database", "query")
_DrivePair: TypeAlias = tuple[str, str, str]
# A metric at the first and at the last value of the factor.
_Ends: TypeAlias = tuple[float, float]


def draw_dumbbell(chart: Chart) -> tuple[str, Figure]:
    """Returns the chart's message, and the chart."""
    over = chart.keys["over"]
    values = chart.results.distinct(over)
    if len(values) < 2:
        raise InputError(f"charts: dumbbell: {over}: the table has one value")
    before, after = values[0], values[-1]
    pairs, ends = _ends_of_pairs(chart, before, after)
    figure = chart.figure((len(chart.styles) * (len(pairs) + 1) + 3) * ROW)
    axes = figure.subplots()
    _draw_methods(axes, chart, pairs, ends)
    text = textwrap.fill(_axis_text(chart, before, after), chart.width // 9)
    figure.supxlabel(escape_dollars(text), fontsize=FONT)
    axes.grid(axis="x", alpha=0.3)
    axes.tick_params(length=0)
    start_at_zero(axes, x=chart.metric)
    shares = {
        name: 100.0
        * median_kept(_kept_share(*ends[name, pair]) for pair in pairs)
        for name in chart.styles
    }
    number = f"median of {len(pairs)} pairs" if len(pairs) > 1 else "one pair"
    message = (
        f"Share of the {in_words(chart.metric)} that is retained, {number}:"
        f" {from_least_to_greatest(shares, _PERCENT)}"
    )
    return with_significance(message, chart, after), figure


def _ends_of_pairs(
    chart: Chart, before: object, after: object
) -> tuple[list[_DrivePair], dict[tuple[str, _DrivePair], _Ends]]:
    """Returns the pairs of drives that have both ends, and the ends.

    Args:
        chart: a chart over a factor.
        before: the factor's first value.
        after: the factor's last value.

    Returns:
        The pairs, in the order of the table; and, by method and pair, the
        metric at the first and the last value, NaN where it is unknown.
    """
    metric_at = {
        (title(mean.key[0]), mean.key[1:4], mean.key[4]): mean.value
        for mean in means(chart.rows, "label", *_PAIR, chart.keys["over"])
    }
    pairs_before, pairs_after = (
        dict.fromkeys(pair for _, pair, v in metric_at if v == value)
        for value in (before, after)
    )
    pairs = [pair for pair in pairs_before if pair in pairs_after]
    ends = {
        (name, pair): (
            metric_at.get((name, pair, before), math.nan),
            metric_at.get((name, pair, after), math.nan),
        )
        for name in chart.styles
        for pair in pairs
    }
    return pairs, ends


def _draw_methods(
    axes: Axes,
    chart: Chart,
    pairs: Sequence[_DrivePair],
    ends: Mapping[tuple[str, _DrivePair], _Ends],
) -> None:
    """Draws a heading for each method, and below it a row for each pair."""
    pair_labels = _pair_labels(pairs)
    labels: list[str] = []
    headings = []
    for name, (colour, _, marker) in chart.styles.items():
        headings.append(len(labels))
        labels.append(name)
        for pair, label in zip(pairs, pair_labels, strict=True):
            y = float(len(labels))
            labels.append(label)
            before, after = ends[name, pair]
            axes.plot([before, after], [y, y], color=colour, lw=2.5, alpha=0.5)
            axes.plot(before, y, marker, color=colour, mfc="white", ms=7)
            axes.plot(after, y, marker, color=colour, ms=7)
            share = _kept_share(before, after)
            if not math.isnan(share):
                side = axes.get_yaxis_transform()
                text = f"{100.0 * share:.0f} %"
                axes.text(1.02, y, text, transform=side, va="center")
    axes.set_yticks(range(len(labels)), list(map(escape_dollars, labels)))
    tick_labels = axes.get_yticklabels()
    for row in headings:
        tick_labels[row].set_fontweight("bold")
    axes.set_ylim(len(labels) - 0.4, -0.7)


def _kept_share(before: float, after: float) -> float:
    return float(kept_share(after, before))


def _axis_text(chart: Chart, before: object, after: object) -> str:
    """Returns the text of the axis: the metric, and what the ends are."""
    over = chart.keys["over"]
    first, last = (
        value_words(value, over)
        if over == STAGE
        else f"at {in_words(over)} {value_words(value)}"
        for value in (before, after)
    )
    return f"{in_words(chart.metric)} {first} (hollow) and {last} (filled)"


def _pair_labels(pairs: Sequence[_DrivePair]) -> list[str]:
    """Returns each pair's map, with the drives if the map has several pairs."""
    of_map = Counter(name for name, *_ in pairs)
    labels = []
    for name, *drives in pairs:
        drive_names = (drive.removeprefix(f"{name}_") for drive in drives)
        is_alone = of_map[name] == 1
        labels.append(name if is_alone else f"{name} {' → '.join(drive_names)}")
    return labels
