"""The figure of a ladder: methods over causes, the share kept as colour."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evaluation.report.drawing import plain, save
from evaluation.report.ladder_rows import LadderRow
from evaluation.report.method_titles import in_table_order, title

# Told apart by all kinds of colour vision.
_COLOURS = colormaps["RdYlBu"]
# Letters on these shares are black.
_LIGHT = (0.15, 0.85)
_SHARES = Normalize(0.0, 1.0)
_CELL_WIDTH, _CELL_HEIGHT = 0.95, 0.3
_EDGES = (2.4, 1.6)
_FONT_SIZE = 8.5
_TITLES = {False: "without the gate", True: "with the gate"}


def draw_ladder(rows: Sequence[LadderRow], stem: Path) -> None:
    """Draws the share of the AUC without a change that each cause leaves.

    A cell has a strip for each level, the weakest at its left; the number is
    that of the strongest level [%]. Without a change it is AUC itself.

    Args:
        rows: of all maps.
        stem: path to write, without ending.
    """
    maps = list(dict.fromkeys(row.rung.map_name for row in rows))
    methods = in_table_order(row.method for row in rows)
    causes = list(dict.fromkeys(row.rung.cause for row in rows))
    size = (
        _EDGES[0] + 2 * _CELL_WIDTH * len(methods),
        len(maps) * (_EDGES[1] + _CELL_HEIGHT * len(causes)),
    )
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(maps), 2, squeeze=False, sharey=True)
    for name, line in zip(maps, panels, strict=True):
        for axes, (is_gated, words) in zip(line, _TITLES.items(), strict=True):
            shown = [
                row
                for row in rows
                if row.rung.map_name == name and row.is_gated == is_gated
            ]
            _draw_panel(axes, shown, methods, causes)
            axes.set_title(plain(f"{name}, {words}"), fontsize=_FONT_SIZE + 1)
    bar = figure.colorbar(
        ScalarMappable(_SHARES, _COLOURS),
        ax=panels[:, 1],
        shrink=0.8,
        aspect=30,
    )
    bar.set_label("part of AUC that is kept", fontsize=_FONT_SIZE)
    bar.ax.tick_params(labelsize=_FONT_SIZE)
    save(figure, stem)


def _draw_panel(
    axes: Axes,
    rows: Sequence[LadderRow],
    methods: Sequence[str],
    causes: Sequence[str],
) -> None:
    cells: dict[tuple[str, str], list[LadderRow]] = {}
    for row in rows:
        cells.setdefault((row.method, row.rung.cause), []).append(row)
    for (method, cause), levels in cells.items():
        x, y = methods.index(method), causes.index(cause)
        levels.sort(key=lambda row: row.rung.level)
        width = 1.0 / len(levels)
        for k, row in enumerate(levels):
            share = row.kept.share
            colour = "lightgray" if math.isnan(share) else _COLOURS(share)
            axes.add_patch(
                Rectangle((x + k * width, y), width, 1.0, color=colour, lw=0)
            )
        strongest = levels[-1]
        share = strongest.kept.share
        is_light = math.isnan(share) or _LIGHT[0] < share < _LIGHT[1]
        axes.text(
            x + 0.5,
            y + 0.5,
            _label(strongest),
            ha="center",
            va="center",
            color="black" if is_light else "white",
            fontsize=_FONT_SIZE,
        )
    axes.set(xlim=(0, len(methods)), ylim=(len(causes), 0))
    axes.set_xticks(
        [k + 0.5 for k in range(len(methods))],
        [plain(title(method)) for method in methods],
        fontsize=_FONT_SIZE,
    )
    axes.set_yticks(
        [k + 0.5 for k in range(len(causes))],
        [plain(cause.replace("_", " ")) for cause in causes],
        fontsize=_FONT_SIZE,
    )
    axes.tick_params(length=0)
    for k in range(1, len(methods)):
        axes.axvline(k, color="white", linewidth=2)
    for k in range(1, len(causes)):
        axes.axhline(k, color="white", linewidth=2)
    axes.spines[:].set_visible(False)


def _label(row: LadderRow) -> str:
    if row.rung.level == 0:
        return f"AUC {row.auc:.2f}"
    share = row.kept.share
    return "–" if math.isnan(share) else f"{100.0 * share:.0f}"
