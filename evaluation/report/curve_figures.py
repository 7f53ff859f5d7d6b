"""Figures of numbers: precision and recall, AUC over change, a track."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from evaluation.localisation.localise import RIGHT_TRANSLATION
from evaluation.localisation.tracking import LOST
from evaluation.recognition.metrics import MODES, PlaceRecognitionMetrics
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.report.drawing import method_entry, method_style, plain, save
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.tables import in_table_order, title

# The least number of points that a line is fitted through.
_LEAST_POINTS = 5


def draw_pr_curves(
    map_name: str, results: Sequence[RecognitionResult], stem: Path
) -> None:
    """Draws precision over recall, a column a pair and a row a mode."""
    pairs = list(dict.fromkeys(result.pair for result in results))
    figure = Figure(figsize=(0.4 + 2.7 * len(pairs), 5.4), layout="constrained")
    grid = figure.subplots(
        len(MODES), len(pairs), sharex=True, sharey=True, squeeze=False
    )
    for row, mode in zip(grid, MODES, strict=True):
        for axes, pair in zip(row, pairs, strict=True):
            of_method = {r.method: r for r in results if r.pair == pair}
            for method in in_table_order(of_method):
                _draw_curve(axes, method, of_method[method].metrics[mode])
            axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02))
            # A phone shows one panel at a time.
            axes.tick_params(labelleft=True)
            axes.set_title(
                plain(f"{map_name} {' → '.join(pair[1:])}, {mode} queries"),
                fontsize=9,
            )
            axes.grid(alpha=0.3)
            axes.legend(fontsize=7, framealpha=0.8)
        row[0].set_ylabel("precision")
    for axes in grid[-1]:
        axes.set_xlabel("recall")
    save(figure, stem)


def draw_auc_over_change(
    results: Sequence[RecognitionResult],
    changes: Mapping[tuple[str, str, str], float],
    stem: Path,
    reference: Reference = NO_REFERENCE,
) -> None:
    """Draws AUC against TCR_sym, with 95 % intervals.

    The left panel counts all queries, the next one those with a match. Right of
    them are the reference's values, if there are any.
    """
    methods = in_table_order(result.method for result in results)
    with_reference = any(map(reference.auc_over_change, methods))
    count = len(MODES) + with_reference
    figure = Figure(figsize=(3.4 * count, 3.7), layout="constrained")
    panels = figure.subplots(1, count, sharex=True, sharey=True)
    with_line = set()
    for axes, mode in zip(panels, MODES, strict=False):
        for index, method in enumerate(methods):
            points = [
                (changes[r.pair], r.metrics[mode])
                for r in results
                if r.method == method and r.pair in changes
            ]
            # Side by side, so that the intervals of one pair do not hide each
            # other.
            shift = 0.0008 * (index - 0.5 * (len(methods) - 1))
            if _draw_points(axes, method, points, shift):
                with_line.add(method)
        axes.set_title(f"this report, {mode} queries", fontsize=9)
    if with_reference:
        for method in methods:
            _draw_published(
                panels[-1], method, reference.auc_over_change(method)
            )
        panels[-1].set_title(reference.counting[1], fontsize=9)
    for axes in panels:
        axes.tick_params(labelleft=True)
        axes.set(xlabel=r"TCR$_\mathrm{sym}$", ylim=(0.0, 1.02))
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("AUC")
    panels[0].legend(
        handles=[
            method_entry(method, with_line=method in with_line)
            for method in methods
        ],
        fontsize=7,
        framealpha=0.8,
    )
    save(figure, stem)


def _draw_curve(
    axes: Axes, method: str, metrics: PlaceRecognitionMetrics
) -> None:
    colour, style, marker = method_style(method)
    curve = metrics.curve
    # The curve begins at recall 0 with the precision of its first point. The
    # drawn area is then the AUC.
    recall = np.concatenate([[0.0], curve.recall])
    precision = np.concatenate([curve.precision[:1], curve.precision])
    axes.plot(
        recall[: len(precision)],
        precision,
        color=colour,
        linestyle=style,
        linewidth=1.5,
        marker=marker,
        markersize=4,
        markevery=0.2,
        label=plain(f"{title(method)} {metrics.auc:.3f}"),
    )


def _draw_points(
    axes: Axes,
    method: str,
    points: Sequence[tuple[float, PlaceRecognitionMetrics]],
    shift: float,
) -> bool:
    """Draws a method's points; returns whether there is a line, too."""
    if not points:
        return False
    colour, style, marker = method_style(method)
    points = sorted(points, key=lambda point: point[0])
    x = np.array([change for change, _ in points]) + shift
    y = np.array([metrics.auc for _, metrics in points])
    below = [m.auc - m.auc_interval.low for _, m in points]
    above = [m.auc_interval.high - m.auc for _, m in points]
    # A percentile interval rarely leaves out the value itself.
    lengths = np.maximum([below, above], 0.0)
    axes.errorbar(
        x,
        y,
        yerr=lengths,
        color=colour,
        marker=marker,
        markersize=5,
        linestyle="none",
        capsize=2,
        linewidth=1.0,
    )
    return _draw_line(axes, x, y, colour, style)


def _draw_published(
    axes: Axes, method: str, values: Sequence[tuple[float, float]]
) -> None:
    if not values:
        return
    colour, style, marker = method_style(method)
    x, y = np.array(sorted(values)).T
    axes.plot(x, y, marker, color=colour, markersize=5, fillstyle="none")
    _draw_line(axes, x, y, colour, style)


def _draw_line(
    axes: Axes, x: np.ndarray, y: np.ndarray, colour: str, style: str
) -> bool:
    """Draws the least-squares line; False if there are too few points."""
    if len(x) < _LEAST_POINTS or np.ptp(x) == 0.0:
        return False
    slope, offset = np.polyfit(x, y, 1)
    ends = np.array([x.min(), x.max()])
    axes.plot(
        ends, slope * ends + offset, color=colour, linestyle=style, alpha=0.7
    )
    return True


def draw_track(rows: np.ndarray, stem: Path) -> None:
    """Draws errors of `TRACKED` rows over the way, and shares without a map."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for stretch in np.unique(rows["stretch"]):
        some = rows[rows["stretch"] == stretch]
        error = np.maximum(some["translation_error"], 1e-4)
        top.plot(some["way"], error, "-", color="#0072B2", linewidth=1.0)
        bottom.fill_between(
            some["way"], some["unmapped"], color="#E69F00", linewidth=0.0
        )
    for level, style in ((RIGHT_TRANSLATION, "--"), (LOST, ":")):
        top.axhline(level, color="0.4", linestyle=style, linewidth=0.8)
    top.set(yscale="log", ylabel="error of position [m]")
    bottom.set(
        xlabel="way [m]",
        ylabel="scan\nwithout map",
        ylim=(0.0, max(0.1, 1.05 * float(rows["unmapped"].max()))),
    )
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    save(figure, stem, ("png",))
