"""Draws the errors along a tracked drive."""

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from evaluation.base import figure_style
from evaluation.localisation import LOST, RIGHT_TRANSLATION
from evaluation.results.figure_files import save_figure
from evaluation.results.styles import INK, PALE


@figure_style()
def draw_track(rows: np.ndarray, stem: Path, title: str) -> None:
    """Draws the results of a tracked drive over its length, and saves them.

    The figure shows the position error, and the share of each scan's points
    that the map lacks. It also shows the limits of the error beyond which a
    pose is wrong, or the track is lost.

    Args:
        rows: records of `evaluation.localisation.tracking.TRACKED`.
        stem: path of the files without the ending.
        title: title of the figure.
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
    top.set_title(title, loc="left", wrap=True)
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
