"""Draws curves: precision over recall, and errors along a tracked drive."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from evaluation.localisation.results import RIGHT_TRANSLATION
from evaluation.localisation.tracking import LOST
from evaluation.recognition.metrics import MODES, PlaceRecognitionMetrics
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.results.figure_files import save_figure
from evaluation.results.figure_text import escape_dollars, name_lines
from evaluation.results.styles import INK, PALE, MethodStyle, method_styles
from evaluation.results.table_forms import by_pair, in_table_order, title

# Size of the names of curves [pt]: 12 px on a phone, which shows one panel.
_NAME_SIZE = 10.0
# Distance between them, as a part of a panel's height.
_NAME_GAP = 0.1


def draw_pr_curves(
    map_name: str, results: Sequence[PlaceOutcome], stem: Path
) -> None:
    """Draws precision-recall curves of all methods and saves the figure.

    Each row of the figure is a pair of drives, each column a mode: all queries,
    or only queries with a match.

    Args:
        map_name: name of the map, for the titles.
        results: results on the pairs of drives of this map.
        stem: path of the files without the ending.
    """
    pairs = by_pair(results)
    style_of = method_styles(
        in_table_order(result.method for result in results)
    )
    size = (9.2, 0.3 + 2.6 * len(pairs))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(
        len(pairs), len(MODES), sharex=True, sharey=True, squeeze=False
    )
    for row, (pair, of_pair) in zip(grid, pairs.items(), strict=True):
        of_method = {outcome.method: outcome for outcome in of_pair}
        for axes, mode in zip(row, MODES, strict=True):
            for method in in_table_order(of_method):
                metrics = of_method[method].by_mode[mode]
                _draw_curve(axes, method, style_of[title(method)], metrics)
            axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02))
            # A phone shows one panel at a time.
            axes.tick_params(labelleft=True)
            axes.set_title(
                escape_dollars(
                    f"{map_name} {' → '.join(pair[1:])}, {mode} queries"
                ),
                fontsize=_NAME_SIZE,
            )
            axes.grid(alpha=0.3)
            # Beside the curves, which they would hide.
            name_lines(figure, axes, _NAME_GAP, _NAME_SIZE)
        row[0].set_ylabel("precision")
    for axes in grid[-1]:
        axes.set_xlabel("recall")
    save_figure(figure, stem)


def _draw_curve(
    axes: Axes,
    method: str,
    style: MethodStyle,
    metrics: PlaceRecognitionMetrics,
) -> None:
    curve = metrics.curve
    # The curve begins at recall 0 with the precision of its first point. The
    # drawn area is then the AUC.
    recall = np.concatenate([[0.0], curve.recall])
    precision = np.concatenate([curve.precision[:1], curve.precision])
    axes.plot(
        recall[: len(precision)],
        precision,
        color=style.colour,
        linestyle=style.line,
        linewidth=1.5,
        marker=style.marker,
        markersize=4,
        markevery=0.2,
        label=escape_dollars(f"{title(method)} {metrics.auc:.3f}"),
    )


def draw_track(rows: np.ndarray, stem: Path) -> None:
    """Draws the results of a tracked drive over its length, and saves them.

    The figure shows the position error, and the share of each scan's points
    that the map lacks. It also shows the limits of the error beyond which a
    pose is wrong, or the track is lost.

    Args:
        rows: records of `evaluation.localisation.tracking.TRACKED`.
        stem: path of the files without the ending.
    """
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for stretch in np.unique(rows["stretch"]):
        section = rows[rows["stretch"] == stretch]
        error = np.maximum(section["track_error"], 1e-4)
        top.plot(section["way"], error, "-", color=INK, linewidth=1.0)
        bottom.fill_between(
            section["way"], section["unmapped"], color=PALE, linewidth=0.0
        )
    levels = ((RIGHT_TRANSLATION, "--", "within"), (LOST, ":", "lost:"))
    for level, style, name in levels:
        top.axhline(level, color="0.4", linestyle=style, linewidth=0.8)
        top.annotate(
            f"{name}\n{level:g} m",
            (1.0, level),
            (4.0, 0.0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center",
        )
    top.set(yscale="log", ylabel="position error [m]")
    bottom.set(
        xlabel="distance driven [m]",
        ylabel="share of scan\nnot in the map",
        ylim=(0.0, max(0.1, 1.05 * float(np.nanmax(rows["unmapped"])))),
    )
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    save_figure(figure, stem, ("png",))
