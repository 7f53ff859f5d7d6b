"""Matrix: a metric for each method and each value of a factor."""

from collections.abc import Collection, Sequence
import textwrap
from typing import Any, NamedTuple

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
import numpy as np

from evaluation.recognition import metric_named
from evaluation.results.charts.chart import ROW, Chart
from evaluation.results.charts.words import in_words, value_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.method_names import title
from evaluation.results.summaries import means
from evaluation.results.table import Row

# Told apart by all kinds of colour vision, and light enough for letters.
_COLOURS = LinearSegmentedColormap.from_list(
    "shares", colormaps["RdYlBu"](np.linspace(0.15, 0.8, 64))
)
# Height of the titles, the key and the caption of a matrix [px].
_CAPTIONS = 150.0
# Width of a letter, and height of one of a slanted name [px].
_LETTER = 8.0
_SLANTED = 6.0
# Characters in a line of a slanted name.
_NAME_WIDTH = 32
# Height of the strips above a number, of a row's.
_STRIPS = 0.3


class _Cell(NamedTuple):
    """A cell of a matrix: its strips and their shares, in order.

    `is_loss` says whether the last share is significantly below 1.
    """

    strips: tuple[Any, ...]
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
    rows_text = [value_words(value, over) for value in values]
    above, is_slanted = _column_names(chart, names, rows_text)
    lines = [line for name in above for line in name.split("\n")]
    height = _SLANTED * max(map(len, lines)) if is_slanted else 2.0 * ROW
    figure, panels = chart.panels(
        _CAPTIONS + height + len(values) * ROW, chart.panel_rows
    )
    strips_shown: dict[Any, None] = {}
    has_loss = False
    for axes, rows in zip(panels, chart.panel_rows.values(), strict=True):
        cells = _cells(rows, columns, losses)
        for (name, value), cell in cells.items():
            _draw_cell(axes, names.index(name), values.index(value), cell)
            has_loss |= cell.is_loss
            if len(cell.shares) > 1:
                strips_shown |= dict.fromkeys(cell.strips)
        _draw_frame(axes, above, rows_text, is_slanted)
    key = figure.colorbar(
        ScalarMappable(Normalize(0.0, 100.0), _COLOURS),
        ax=panels,
        location="bottom",
        aspect=30.0,
        shrink=0.6,
        label=escape_dollars(f"{in_words(chart.metric)} [%]"),
    )
    key.outline.set_visible(False)
    texts = []
    if strips is not None and strips_shown:
        among = ", ".join(value_words(value, strips) for value in strips_shown)
        texts.append(
            f"strips from the left: {in_words(strips)} {among}; number: the"
            " last"
        )
    if has_loss:
        texts.append("bold: 95 % interval below 100")
    if texts:
        text = textwrap.fill("; ".join(texts), chart.width // 8)
        figure.supxlabel(escape_dollars(text))
    return figure


def _column_names(
    chart: Chart, names: Sequence[str], rows_text: Sequence[str]
) -> tuple[list[str], bool]:
    """Returns the names of the columns, and whether they must be slanted.

    Names are slanted where their words are wider than a column.
    """
    panels = min(2, len(chart.panel_rows)) if chart.is_wide else 1
    letters = chart.width / _LETTER / panels - max(map(len, rows_text)) - 2
    letters = int(letters / len(names))
    longest = max(len(word) for name in names for word in name.split())
    slanted = letters < longest or max(map(len, names)) > 2 * letters
    width = _NAME_WIDTH if slanted else letters
    return [textwrap.fill(name, width) for name in names], slanted


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
        names, shares, are_losses = zip(
            *sorted(cell_strips, key=_strip_order), strict=True
        )
        found[key] = _Cell(names, shares, are_losses[-1])
    return found


def _strip_order(strip: tuple[Any, float, bool]) -> tuple[bool, Any]:
    return isinstance(strip[0], str), strip[0]


def _draw_cell(axes: Axes, x: int, y: int, cell: _Cell) -> None:
    """Fills a cell with its last share, below strips if it has several."""
    number = len(cell.shares)
    top = _STRIPS if number > 1 else 0.0
    boxes = [(cell.shares[-1], float(x), top, 1.0 - top, 1.0)]
    if number > 1:
        boxes += [
            (share, x + k / number, 0.0, top, 1.0 / number)
            for k, share in enumerate(cell.shares)
        ]
    for share, left, down, height, width in boxes:
        axes.add_patch(
            Rectangle(
                (left, y + down), width, height,
                color=_COLOURS(min(share, 1.0)), lw=0,
            )
        )  # fmt: skip
    axes.text(
        x + 0.5,
        y + 0.5 + top / 2.0,
        f"{100.0 * cell.shares[-1]:.0f}",
        weight="bold" if cell.is_loss else "normal",
        ha="center",
        va="center_baseline",
    )


def _draw_frame(
    axes: Axes, names: Sequence[str], values: Sequence[str], is_slanted: bool
) -> None:
    """Names the columns and rows of a matrix, and separates its cells."""
    axes.set(xlim=(0, len(names)), ylim=(len(values), 0))
    axes.set_xticks(
        np.arange(len(names)) + 0.5, [escape_dollars(name) for name in names]
    )
    axes.xaxis.tick_top()
    if is_slanted:
        for label in axes.get_xticklabels():
            label.set(rotation=45, rotation_mode="anchor", ha="left")
    axes.set_yticks(
        np.arange(len(values)) + 0.5,
        [escape_dollars(value) for value in values],
    )
    axes.tick_params(length=0)
    axes.vlines(range(1, len(names)), 0, len(values), "white", lw=2)
    axes.hlines(range(1, len(values)), 0, len(names), "white", lw=2)
    axes.spines[:].set_visible(False)
