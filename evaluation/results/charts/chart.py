"""A chart: its description, the rows that it shows, and its panels."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
import math
import re
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.base import InputError, font_settings
from evaluation.recognition import METRICS
from evaluation.results.figure_text import escape_dollars
from evaluation.results.styles import MethodStyle
from evaluation.results.table import QueryRows, Results, Row

# Width of a chart on a screen [px].
WIDE = 860
# Width of a chart on a phone [px].
NARROW = 358
# From this width on, two panels are side by side [px].
_TWO_PANELS = 600
# A pixel of a page [inches].
PX = 1.0 / 96.0
# Size of letters [pt]; more than 12 px, on a phone of 360 px as well.
FONT = 10.0
# Size of letters in a chart whose width was chosen for a paper [pt].
_PAPER_FONT = 8.0
# Unit of length -> number of them in an inch.
_IN_AN_INCH = {"in": 1.0, "cm": 2.54, "mm": 25.4, "pt": 72.27}
# Height of a row of values or names [px].
ROW = 22.0


class FewPointsError(InputError):
    """A chart would show too few points for what it is about."""


@dataclass(frozen=True)
class PrintStyle:
    """How charts for print look.

    Attributes:
        width: width [inches], at which letters have 8 pt; None for the width
            of a chart on a screen, with letters of 10 pt.
        font: `serif`, `sans-serif`, `monospace` or the name of an installed
            font.
        title: whether the chart's title stands above it.

    Example:
        from evaluation import PrintStyle

        column = PrintStyle(width=3.5, font="serif", title=False)
    """

    width: float | None = None
    font: str = "sans-serif"
    title: bool = True

    @classmethod
    def checked(
        cls, width: str | None, font: str | None, title: bool
    ) -> PrintStyle:
        """Returns the style that options of a command name.

        Args:
            width: a length with its unit, such as `3.5in`.
            font: see the attribute.
            title: see the attribute.

        Raises:
            InputError: the width is no length from 2 to 20 inches, or the font
                is not installed.
        """
        style = cls(
            None if width is None else _parse_width(width),
            font or cls.font,
            title,
        )
        if style.width is not None and not 2.0 <= style.width <= 20.0:
            raise InputError(f"--width: {width}: not from 2in to 20in")
        font_settings(style.font)
        return style

    @property
    def settings(self) -> dict[str, Any]:
        """Matplotlib's parameters of the style."""
        size = FONT if self.width is None else _PAPER_FONT
        return {**font_settings(self.font), "font.size": size}

    @property
    def px(self) -> float:
        """A pixel of the chart's layout [inches], relative to its letters."""
        return PX if self.width is None else self.width / self.layout_width

    @property
    def layout_width(self) -> int:
        """Width of the layout [px]."""
        if self.width is None:
            return WIDE
        return round(self.width / PX * FONT / _PAPER_FONT)


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
        px: a pixel of the drawing [inches].
        queries: the answers from which the table was made; None if unknown.
    """

    keys: Mapping[str, str]
    results: Results
    rows: Sequence[Row]
    styles: Mapping[str, MethodStyle]
    width: int
    px: float
    queries: QueryRows | None

    @property
    def is_wide(self) -> bool:
        """Whether two panels are side by side."""
        return self.width >= _TWO_PANELS

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
        columns = min(2, len(titles)) if self.is_wide else 1
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
        size = self.width * self.px, height * self.px
        return Figure(figsize=size, layout="constrained")


def rows_of_methods(axes: Axes, names: Sequence[str]) -> None:
    """Gives each method a row of a panel, the first on top."""
    axes.set_yticks(range(len(names)), list(map(escape_dollars, names)))
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(axis="x")
    axes.tick_params(length=0)
    axes.spines["left"].set_visible(False)


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


def _parse_width(text: str) -> float:
    """Returns a width [inches] from text with its unit, such as `3.5in`.

    Args:
        text: a number and `in`, `cm`, `mm` or `pt`, the point of TeX.
    """
    found = re.fullmatch(r"(\d+\.?\d*|\.\d+) ?(in|cm|mm|pt)", text.strip())
    if found is None:
        raise InputError(
            f"--width: {text!r}: a number and in, cm, mm or pt is needed, such"
            " as 3.5in"
        )
    return float(found[1]) / _IN_AN_INCH[found[2]]
