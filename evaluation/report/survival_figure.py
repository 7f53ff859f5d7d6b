"""The figure of the survival of each method under structural change."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evaluation.recognition.survival import Survival
from evaluation.report.drawing import method_style, plain, save
from evaluation.report.method_titles import title
from evaluation.report.survival_tables import by_pair, percent

# The width of a phone's screen, on which letters stay legible [inches].
_WIDTH = 3.9
_ROW = 0.17
_EDGES = 0.75
_FONT_SIZE = 8.5
_LEGEND_COLOUR = "#444444"
# Height of a pair's title and the gap above it, in rows.
_TITLE_ROWS = 1.5


def draw_survival(survivals: Sequence[Survival], stem: Path) -> None:
    """Draws AUC without and with the change, for each pair and method.

    A hollow marker is AUC without the change, a full one AUC with it; the kept
    share stands beside them. Pairs without a control are left out.

    Args:
        survivals: of all pairs and methods; at least one has a control.
        stem: path to write, without ending.
    """
    groups = by_pair([one for one in survivals if one.unchanged is not None])
    rows = sum(_TITLE_ROWS + len(group) for group in groups.values())
    figure = Figure(
        figsize=(_WIDTH, _EDGES + _ROW * rows), layout="constrained"
    )
    axes = figure.subplots()
    height, ticks = 0.0, []
    for (map_name, *stages), group in groups.items():
        height += _TITLE_ROWS
        axes.text(
            0.0,
            height - 0.8,
            plain(f"{map_name} {' → '.join(stages)}"),
            fontsize=_FONT_SIZE,
            fontweight="bold",
            va="center",
        )
        for one in group:
            _draw_row(axes, one, height)
            ticks.append((height, plain(title(one.method))))
            height += 1.0
    axes.set_yticks(*zip(*ticks, strict=True), fontsize=_FONT_SIZE)
    axes.set(xlim=(0.0, 1.0), ylim=(height - 0.2, 0.0))
    axes.tick_params(axis="x", labelsize=_FONT_SIZE)
    axes.tick_params(axis="y", length=0, pad=6)
    _write_beside(axes, "kept", 0.0)
    axes.set_xlabel("AUC (all queries)", fontsize=_FONT_SIZE)
    axes.grid(axis="x", alpha=0.3)
    axes.spines[["top", "left", "right"]].set_visible(False)
    axes.legend(
        handles=[
            Line2D(
                [],
                [],
                color=_LEGEND_COLOUR,
                marker="o",
                markerfacecolor=face,
                linestyle="none",
                label=label,
            )
            for face, label in (
                ("white", "without change"),
                (_LEGEND_COLOUR, "with change"),
            )
        ],
        loc="lower center",
        bbox_to_anchor=(0.33, 1.0),
        ncols=2,
        frameon=False,
        fontsize=_FONT_SIZE,
        handletextpad=0.2,
        columnspacing=1.0,
    )
    save(figure, stem)


def _draw_row(axes: Axes, one: Survival, height: float) -> None:
    colour, _, marker = method_style(one.method)
    before, after = one.auc.unchanged, one.auc.changed
    axes.plot(
        [before, after], [height] * 2, color=colour, linewidth=1.5, alpha=0.6
    )
    for value, face in ((before, "white"), (after, colour)):
        axes.plot(
            value,
            height,
            marker,
            color=colour,
            markerfacecolor=face,
            markersize=5,
            clip_on=False,
            zorder=3,
        )
    _write_beside(axes, percent(one.auc.share), height)


def _write_beside(axes: Axes, text: str, height: float) -> None:
    axes.annotate(
        text,
        (1.0, height),
        xytext=(34, 0),
        textcoords="offset points",
        ha="right",
        va="center",
        fontsize=_FONT_SIZE,
        annotation_clip=False,
    )
