"""Dumbbell: a metric at the first and the last value of a factor."""

from collections import Counter
from collections.abc import Sequence
import math
import textwrap

from matplotlib.figure import Figure

from cns_drake.base.errors import InputError
from evaluation.recognition.place_numbers import kept_share
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
from evaluation.results.summaries import means, median_kept
from evaluation.results.table_forms import title

# The sign of per cent never begins a line.
_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# Columns that say which drives are compared.
_PAIR = ("map", "database", "query")


def draw_dumbbell(chart: Chart) -> tuple[str, Figure]:
    """Returns the chart's message, and the chart."""
    over = chart.keys["over"]
    values = chart.results.distinct(over)
    if len(values) < 2:
        raise InputError(f"charts: dumbbell: {over}: the table has one value")
    before, after = values[0], values[-1]
    found = {
        (title(one.key[0]), *one.key[1:]): one.value
        for one in means(chart.rows, "label", *_PAIR, over)
    }
    ends_of = [
        {key[1:4]: None for key in found if key[4] == v}
        for v in (before, after)
    ]
    pairs = [pair for pair in ends_of[0] if pair in ends_of[1]]
    labels = _pair_labels(pairs)
    heights: list[tuple[str, float]] = []
    kept: dict[str, list[float]] = {}
    figure = chart.figure((len(chart.styles) * (len(pairs) + 1) + 3) * ROW)
    axes = figure.subplots()
    for name, (colour, _, marker) in chart.styles.items():
        heights.append((name, len(heights)))
        for pair, label in zip(pairs, labels, strict=True):
            y = float(len(heights))
            heights.append((label, y))
            ends = [
                found.get((name, *pair, v), math.nan) for v in (before, after)
            ]
            axes.plot(ends, [y, y], color=colour, lw=2.5, alpha=0.5)
            axes.plot(ends[0], y, marker, color=colour, mfc="white", ms=7)
            axes.plot(ends[1], y, marker, color=colour, ms=7)
            share = float(kept_share(ends[1], ends[0]))
            kept.setdefault(name, []).append(share)
            if not math.isnan(share):
                side = axes.get_yaxis_transform()
                text = f"{100.0 * share:.0f} %"
                axes.text(1.02, y, text, transform=side, va="center")
    axes.set_yticks(
        [y for _, y in heights], [escape_dollars(one) for one, _ in heights]
    )
    for tick_label in axes.get_yticklabels():
        if tick_label.get_text() in map(escape_dollars, chart.styles):
            tick_label.set_fontweight("bold")
    axes.set_ylim(len(heights) - 0.4, -0.7)
    first, last = (
        value_words(v, over)
        if over == STAGE
        else f"at {in_words(over)} {value_words(v)}"
        for v in (before, after)
    )
    text = f"{in_words(chart.metric)} {first} (hollow) and {last} (filled)"
    text = textwrap.fill(text, chart.width // 9)
    figure.supxlabel(escape_dollars(text), fontsize=FONT)
    axes.grid(axis="x", alpha=0.3)
    axes.tick_params(length=0)
    start_at_zero(axes, x=chart.metric)
    shares = {name: 100.0 * median_kept(kept[name]) for name in kept}
    number = f"median of {len(pairs)} pairs" if len(pairs) > 1 else "one pair"
    message = (
        f"Share of the {in_words(chart.metric)} that is retained, {number}:"
        f" {from_least_to_greatest(shares, _PERCENT)}"
    )
    return with_significance(message, chart, after), figure


def _pair_labels(pairs: Sequence[tuple[str, str, str]]) -> list[str]:
    """Returns each pair's map, with the drives if the map has several pairs."""
    of_map = Counter(name for name, *_ in pairs)
    labels = []
    for name, *drives in pairs:
        drive_names = (one.removeprefix(f"{name}_") for one in drives)
        is_alone = of_map[name] == 1
        labels.append(name if is_alone else f"{name} {' → '.join(drive_names)}")
    return labels
