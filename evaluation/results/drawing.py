"""What all figures share: colours, names of lines, and checked files."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import Bbox, BboxTransformTo, ScaledTranslation
import numpy as np
from sklearn.isotonic import isotonic_regression

from cns_drake.base.complete_files import completing
from evaluation.results.ranges import check_all

# Okabe and Ito's colours, distinct for all kinds of colour vision; line
# styles and markers for prints without colour.
METHOD_STYLES = {
    "ring++": ("#0072B2", "-", "o"),
    "btc": ("#D55E00", "--", "s"),
    "scan-context++": ("#009E73", "-.", "^"),
    "solid": ("#CC79A7", ":", "D"),
    "layered-overlap": ("#E69F00", "-", "v"),
    "learned": ("#56B4E9", "--", "P"),
}

# Colours of what belongs to no method.
INK = "#1C2430"
PALE = "#7A8594"
# Colour of points that are in the older of two maps alone.
GONE = (214, 48, 49)
# Colour of points that are in the newer of two maps alone.
NEW = (38, 96, 214)

# Colours (red, green, blue) and what they mean.
Legend = tuple[tuple[tuple[int, int, int], str], ...]

# The formats of figures, first those for print. Figures of lines stay lines in
# PDF, and on the page in SVG.
LINES = ("pdf", "png", "svg")
PIXELS = ("png", "webp")
_DPI = 200
_PAGE_DPI = 130
_WEBP_QUALITY = 82


def unit_rgb(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """Scales a colour from 0 to 255 to 0 to 1, as matplotlib needs it."""
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


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
    known = [some[np.isfinite(some)] for some in values]
    ends = [some[-1] if len(some) else bottom for some in known]
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


def save(figure: Figure, stem: Path, kinds: Sequence[str] = LINES) -> None:
    """Writes a figure as one file for each of several formats.

    Equal figures give equal bytes. SVG and WebP files are for web pages, and do
    not contain the legend at the bottom of the figure: the page itself writes
    this legend, in letters that can be read on a phone.

    Args:
        figure: the figure.
        stem: path of the files without the ending.
        kinds: endings of the files, such as `pdf`.

    Raises:
        InputError: if a file cannot be written, or the figure shows a value
            that its axis cannot have, see `evaluation.results.ranges`.
    """
    _check(figure)
    FigureCanvasAgg(figure)
    # The layout is computed once for all formats.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    bottom = max(
        (one.get_window_extent().y1 for one in figure.legends), default=0.0
    )
    width, height = figure.get_size_inches()
    above = Bbox.from_extents(0.0, bottom / figure.dpi, width, height)
    for kind in kinds:
        path = stem.with_name(f"{stem.name}.{kind}")
        on_page = kind in ("svg", "webp")
        for legend in figure.legends:
            legend.set_visible(not on_page)
        options: dict = {"dpi": _DPI}
        if kind in ("pdf", "svg"):
            dated = "CreationDate" if kind == "pdf" else "Date"
            options["metadata"] = {dated: None}
        if kind == "webp":
            options = {
                "dpi": _PAGE_DPI,
                "pil_kwargs": {"quality": _WEBP_QUALITY},
            }
        if on_page and figure.legends:
            options["bbox_inches"] = above
        with (
            completing(path) as part,
            # TrueType fonts stay text in PDF; ids of SVG follow the salt.
            matplotlib.rc_context(
                {
                    "pdf.fonttype": 42,
                    "svg.hashsalt": "cns",
                    "svg.fonttype": "path",
                }
            ),
        ):
            figure.savefig(part, format=kind, **options)


def _check(figure: Figure) -> None:
    """Raises an error unless each axis shows values in its label's range."""
    for axes in figure.axes:
        of_figure = figure.get_supxlabel(), figure.get_supylabel()
        labels = axes.get_xlabel(), axes.get_ylabel()
        drawn = _in_data(axes)
        for k, label in enumerate(labels):
            check_all(label or of_figure[k], drawn[k])


def _in_data(axes: Axes) -> tuple[list[float], list[float]]:
    """Returns all x and all y that are drawn in coordinates of the data."""
    found: tuple[list[float], list[float]] = ([], [])
    # All that is drawn, without the frame.
    for one in (*axes.lines, *axes.collections, *axes.patches):
        transform = one.get_transform()
        if isinstance(one, Line2D):
            corners = [np.column_stack(one.get_data())]
        elif isinstance(one, Patch):
            path = one.get_path().transformed(one.get_patch_transform())
            corners = [np.asarray(path.vertices)]
            transform = one.get_data_transform()
        elif isinstance(one, PathCollection):
            # The markers of a scatter plot, whose paths have no position.
            corners = [np.ma.filled(one.get_offsets(), np.nan)]
            transform = one.get_offset_transform()
        elif isinstance(one, Collection):
            corners = [np.asarray(path.vertices) for path in one.get_paths()]
        else:
            continue
        of_data = transform.contains_branch_seperately(axes.transData)
        for values, is_data, column in zip(found, of_data, (0, 1), strict=True):
            for some in corners if is_data else ():
                values.extend(np.asarray(some, dtype=float)[:, column])
    return found
