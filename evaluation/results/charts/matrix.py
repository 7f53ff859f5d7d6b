"""Matrix: a metric for each method and each value of a factor."""

from collections.abc import Collection, Sequence
import textwrap
from typing import Any, NamedTuple

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
import numpy as np

from evaluation.recognition import metric_named
from evaluation.results.charts.chart import FONT, ROW, Chart
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.method_names import title
from evaluation.results.summaries import means
from evaluation.results.table import Row

# Least height of all that stands around the cells of a panel [px].
_LEAST_AROUND = 220.0
# Told apart by all kinds of colour vision, and light enough for letters.
_COLOURS = LinearSegmentedColormap.from_list(
    "shares", colormaps["RdYlBu"](np.linspace(0.15, 0.8, 64))
)
# Height of the titles and the caption of a matrix [px].
_CAPTIONS = 130.0
# Height of a letter of a slanted name [px].
_LETTER = 6.0
# Characters in a line of a method's name below a chart.
_NAME_WIDTH = 32


class _Cell(NamedTuple):
    """A cell of a matrix: the shares of its strips, in order.

    `is_loss` says whether the last share is significantly below 1.
    """

    shares: tuple[float, ...]
    is_loss: bool


def draw_matrix(chart: Chart) -> Figure:
    """Returns the chart."""
    over = chart.keys["over"]
    strips = chart.keys.get("strips")
    values = list(dict.fromkeys(row[over] for row in chart.rows))
    names = list(chart.styles)
    columns = "label", over, strips or over
    # Retained shares that are significantly below 1.
    losses = {
        (row.map, *(row[name] for name in columns))
        for row in chart.rows
        if metric_named(chart.metric).share_of and row.high < 1.0
    }
    below = [textwrap.fill(name, _NAME_WIDTH) for name in names]
    longest = max(len(line) for name in below for line in name.split("\n"))
    # Names of methods and the caption stand below.
    around = max(_LEAST_AROUND, _CAPTIONS + _LETTER * longest)
    figure, panels = chart.panels(around + len(values) * ROW, chart.panel_rows)
    most_strips = 1
    for axes, rows in zip(panels, chart.panel_rows.values(), strict=True):
        cells = _cells(rows, columns, losses)
        for (name, value), cell in cells.items():
            _draw_cell(axes, names.index(name), values.index(value), cell)
            most_strips = max(most_strips, len(cell.shares))
        _draw_frame(axes, below, [value_words(v, over) for v in values])
    text = f"{in_words(chart.metric)} in per cent"
    if strips is not None and most_strips > 1:
        text += (
            f"; a strip for each value of {in_words(strips)}, the number is of"
            " the last"
        )
    if losses:
        text += "; bold where its 95 % interval lies below 100"
    text = textwrap.fill(text, chart.width // 8)
    figure.supxlabel(escape_dollars(text), fontsize=FONT)
    return figure


def _cells(
    rows: Sequence[Row],
    columns: tuple[str, str, str],
    losses: Collection[tuple[object, ...]],
) -> dict[tuple[str, Any], _Cell]:
    """Returns the cells of a panel, by method and value of the factor."""
    strips: dict[tuple[str, Any], list[tuple[Any, float, bool]]] = {}
    for mean in means(rows, *columns):
        label, value, strip = mean.key
        is_loss = mean.number == 1 and (rows[0].map, *mean.key) in losses
        strips.setdefault((title(label), value), []).append(
            (strip, mean.value, is_loss)
        )
    found = {}
    for key, cell_strips in strips.items():
        _, shares, are_losses = zip(
            *sorted(cell_strips, key=_strip_order), strict=True
        )
        found[key] = _Cell(shares, are_losses[-1])
    return found


def _strip_order(strip: tuple[Any, float, bool]) -> tuple[bool, Any]:
    return isinstance(strip[0], str), strip[0]


def _draw_cell(axes: Axes, x: int, y: int, cell: _Cell) -> None:
    number = len(cell.shares)
    for k, share in enumerate(cell.shares):
        axes.add_patch(
            Rectangle(
                (x + k / number, y),
                1.0 / number,
                1.0,
                color=_COLOURS(min(share, 1.0)),
                lw=0,
            )
        )
    axes.text(
        x + 0.5,
        y + 0.5,
        f"{100.0 * cell.shares[-1]:.0f}",
        weight="bold" if cell.is_loss else "normal",
        ha="center",
        va="center",
    )


def _draw_frame(
    axes: Axes, names: Sequence[str], values: Sequence[str]
) -> None:
    """Names the columns and rows of a matrix, and separates its cells."""
    axes.set(xlim=(0, len(names)), ylim=(len(values), 0))
    axes.set_xticks(
        np.arange(len(names)) + 0.5,
        [escape_dollars(name) for name in names],
        rotation=45,
        ha="right",
    )
    for label in axes.get_xticklabels():
        label.set_rotation_mode("anchor")
    axes.set_yticks(
        np.arange(len(values)) + 0.5,
        [escape_dollars(value) for value in values],
    )
    axes.tick_params(length=0)
    axes.vlines(range(1, len(names)), 0, len(values), "white", lw=2)
    axes.hlines(range(1, len(values)), 0, len(names), "white", lw=2)
    axes.spines[:].set_visible(False)
