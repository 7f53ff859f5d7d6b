"""Figures of localisation."""

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from evaluation.localisation.localise import RIGHT_TRANSLATION
from evaluation.localisation.tracking import LOST
from evaluation.report.drawing import save


def draw_track(rows: np.ndarray, stem: Path) -> None:
    """Draws the error over the way, and below it the share without a map.

    Args:
        rows: (K,) of `TRACKED`.
        stem: path to write, without ending.
    """
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
        ylabel="scan without map",
        ylim=(0.0, max(0.1, 1.05 * float(rows["unmapped"].max()))),
    )
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    save(figure, stem, ("png",))
