"""A chart: its description, the rows that it shows, and its panels."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.recognition import METRICS
from evaluation.results.figure_text import escape_dollars
from evaluation.results.styles import MethodStyle
from evaluation.results.table import QueryRows, Results, Row

# Width of a chart on a screen [px].
WIDE = 860
# Width of a chart on a phone [px].
NARROW = 358
# A pixel of a page [inches].
PX = 1.0 / 96.0
# Size of letters [pt]; more than 12 px, on a phone of 360 px as well.
FONT = 10.0
# Height of a row of values or names [px].
ROW = 22.0


@dataclass(frozen=True)
class Chart:
    """What a chart shows.

    Attributes:
        keys: the fields of the chart's description, except the kind and the
            fields that select rows.
        results: the whole table of results.
        rows: the selected rows of the chart's metric.
        styles: method as in the legend -> its style.
        width: width of the drawing [px].
        queries: the answers from which the table was made; None if unknown.
    """

    keys: Mapping[str, str]
    results: Results
    rows: Sequence[Row]
    styles: Mapping[str, MethodStyle]
    width: int
    queries: QueryRows | None

    @property
    def metric(self) -> str:
        return self.keys.get("metric", self.keys.get("y", "auc"))

    @property
    def panel_rows(self) -> dict[str, list[Row]]:
        """The rows of each panel, by the panel's title.

        There is one panel per map. If the chart itself compares maps (`over` is
        `map`), it has a single panel without a title.
        """
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            name = "" if self.keys.get("over") == "map" else row.map
            found.setdefault(name, []).append(row)
        return found

    def panels(
        self, height: float, titles: Collection[str]
    ) -> tuple[Figure, list[Axes]]:
        """Returns a figure and its panels, which have a given height [px]."""
        columns = 1 if self.width < WIDE else min(2, len(titles))
        lines = math.ceil(len(titles) / columns)
        figure = self.figure(lines * height)
        grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
        for axes in grid.flat[len(titles) :]:
            axes.axis("off")
        for axes, name in zip(grid.flat, titles, strict=False):
            axes.set_title(escape_dollars(name), loc="left")
        return figure, list(grid.flat[: len(titles)])

    def figure(self, height: float) -> Figure:
        """Returns an empty figure of a given height [px]."""
        size = self.width * PX, height * PX
        return Figure(figsize=size, layout="constrained")


def start_at_zero(axes: Axes, x: str = "", y: str = "") -> None:
    """Makes an axis start at 0 if its metric cannot be negative.

    Args:
        axes: a panel in which everything is drawn.
        x, y: name of what the axis shows; empty to leave the axis unchanged.
    """
    is_least = [
        name in METRICS and METRICS[name].least == 0.0 for name in (x, y)
    ]
    # Markers at 0 are whole.
    axes.update_datalim([(0.0, 0.0)], *is_least)
    axes.autoscale_view()
