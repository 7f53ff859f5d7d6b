"""Text in figures: names of lines at their ends, and dollar signs."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import BboxTransformTo, ScaledTranslation
import numpy as np
from sklearn.isotonic import isotonic_regression

from evaluation.results.styles import INK


def escape_dollars(text: str) -> str:
    """Returns text with its dollar signs escaped for matplotlib.

    A dollar sign that is not escaped begins a formula.
    """
    return text.replace("$", r"\$")


def name_lines(figure: Figure, axes: Axes, gap: float, size: float) -> None:
    """Writes the names of lines at their ends, to the right of the panel.

    Names that would overlap are moved apart, as little as possible. Lines
    without a label get no name.

    Args:
        figure: the figure that the panel is in.
        axes: the panel. The limits of its axes must be final.
        gap: least distance between two names, as a part of the panel's height.
        size: size of the letters [pt].
    """
    lines = [line for line in axes.lines if str(line.get_label())[:1] != "_"]
    bottom, top = axes.get_ylim()
    values = [np.asarray(line.get_ydata(), dtype=float) for line in lines]
    known = [y[np.isfinite(y)] for y in values]
    ends = [y[-1] if len(y) else bottom for y in known]
    heights = (np.array(ends) - bottom) / (top - bottom)
    order = np.argsort(heights, kind="stable")
    # In steps of the gap, names in order must not descend.
    steps = gap * np.arange(len(lines))
    moved = isotonic_regression(heights[order] - steps)
    moved = np.clip(moved, 0.0, max(1.0 - steps[-1], 0.0)) + steps
    for index, height in zip(order, moved, strict=True):
        line = lines[index]
        # In inches from the panel's edge, so that letters have room.
        inches = figure.dpi_scale_trans + ScaledTranslation(
            1.0, height, BboxTransformTo(axes.bbox)
        )
        axes.plot(
            [0.1, 0.25, 0.4], [0.0] * 3, transform=inches, clip_on=False,
            color=line.get_color(), linestyle=line.get_linestyle(),
            linewidth=line.get_linewidth(), marker=line.get_marker(),
            markersize=line.get_markersize(), markevery=[1],
        )  # fmt: skip
        axes.text(
            0.48, 0.0, line.get_label(), fontsize=size, color=INK, va="center",
            transform=inches,
        )  # fmt: skip
