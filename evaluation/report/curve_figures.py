"""Figures of numbers: precision and recall, charts of a report, a track."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
import numpy as np

from cns_drake.base.errors import InputError
from evaluation.localisation.localise import RIGHT_TRANSLATION
from evaluation.localisation.tracking import LOST
from evaluation.recognition.metrics import MODES, PlaceRecognitionMetrics
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.report.page import Report
from evaluation.report.page_data import Illustration, Section
from evaluation.report.rows import STAGE
from evaluation.results.charts import draw, styles, titled
from evaluation.results.drawing import INK, PALE, plain, save
from evaluation.results.table import Results
from evaluation.results.table_forms import in_table_order, title

_SCATTER = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
_DUMBBELL = {"kind": "dumbbell", "over": STAGE, "metric": "auc"}
_SURVIVAL = (
    "AUC without the change (hollow) and with it (filled), and the share that"
    " is kept"
)
# Width of charts [px].
_WIDTH = 480


def draw_pr_curves(
    map_name: str, results: Sequence[RecognitionResult], stem: Path
) -> None:
    """Draws precision over recall, a row a pair and a column a mode."""
    pairs = list(dict.fromkeys(result.pair for result in results))
    style_of = styles(in_table_order(result.method for result in results))
    size = (9.2, 0.3 + 2.7 * len(pairs))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(
        len(pairs), len(MODES), sharex=True, sharey=True, squeeze=False
    )
    for row, pair in zip(grid, pairs, strict=True):
        for axes, mode in zip(row, MODES, strict=True):
            of_method = {r.method: r for r in results if r.pair == pair}
            for method in in_table_order(of_method):
                metrics = of_method[method].metrics[mode]
                _draw_curve(axes, method, style_of[titled(method)], metrics)
            axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02))
            # A phone shows one panel at a time.
            axes.tick_params(labelleft=True)
            axes.set_title(
                plain(f"{map_name} {' → '.join(pair[1:])}, {mode} queries"),
                fontsize=9,
            )
            axes.grid(alpha=0.3)
            # Beside the curves, which it would hide.
            axes.legend(
                fontsize=7,
                frameon=False,
                loc="upper left",
                bbox_to_anchor=(1.0, 1.0),
            )
        row[0].set_ylabel("precision")
    for axes in grid[-1]:
        axes.set_xlabel("recall")
    save(figure, stem)


def _draw_curve(
    axes: Axes,
    method: str,
    look: tuple[str, str, str],
    metrics: PlaceRecognitionMetrics,
) -> None:
    colour, style, marker = look
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


def chart_illustrations(report: Report, folder: Path) -> list[Illustration]:
    """Draws the charts over all cities; returns those that have data.

    The charts of a reference stand next to ours.
    """
    name = "AUC against TCR_sym"
    charts: list[tuple[str, str, Section, dict[str, str], Results]] = [
        ("auc_over_tcr", name, "figures", _SCATTER, report.results)
    ]
    if report.compared:
        published = report.reference.to_results()
        name = f"{name}, of {report.reference.title}"
        stem = "auc_over_tcr_published"
        charts.insert(0, (stem, name, "figures", _SCATTER, published))
    if any(control for _, control in report.pairs):
        charts.append(
            ("survival", _SURVIVAL, "survival", _DUMBBELL, report.results)
        )
    shown = []
    for stem, words, section, chart, results in charts if report.pairs else ():
        gates = {"gate": tuple(results.distinct("gate"))}
        try:
            drawn = draw({**chart, **gates}, results, _WIDTH, alone=True)
        except InputError as error:
            report.notes = [*report.notes, f"{words}: left out: {error}"]
            continue
        save(drawn.figure, folder / stem)
        legend = []
        for label, (colour, *_) in drawn.legend.items():
            red, green, blue = (round(255 * part) for part in to_rgb(colour))
            legend.append(((red, green, blue), label))
        shown.append(
            Illustration(
                folder / stem,
                words,
                "svg",
                section=section,
                legend=tuple(legend),
            )
        )
    return shown


def draw_track(rows: np.ndarray, stem: Path) -> None:
    """Draws errors along the path, and the share without a map.

    The rows are of the type `TRACKED`.
    """
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for stretch in np.unique(rows["stretch"]):
        some = rows[rows["stretch"] == stretch]
        error = np.maximum(some["translation_error"], 1e-4)
        top.plot(some["way"], error, "-", color=INK, linewidth=1.0)
        bottom.fill_between(
            some["way"], some["unmapped"], color=PALE, linewidth=0.0
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
