"""Files of figures: equal bytes for equal figures, with checked values."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import Bbox
import numpy as np

from cns_drake.base import figure_style
from cns_drake.base import save_figure as write_figure
from evaluation.results.ranges import check_all

# The formats of pictures, the one for the page last.
PIXELS = ("png", "webp")
# Resolution of pictures for print [dots per inch].
_DPI = 200
# Resolution of pictures for the page [dots per inch].
_PAGE_DPI = 130
# Quality of compressed pictures, from 0 to 100.
_WEBP_QUALITY = 82


@figure_style()
def save_figure(figure: Figure, stem: Path, kinds: Sequence[str]) -> None:
    """Writes a figure as one file for each of several formats.

    Equal figures give equal bytes. SVG and WebP files are for web pages, and do
    not contain the legend at the bottom of the figure: the page itself writes
    this legend, in letters that can be read on a phone. The figure is changed:
    its layout is fixed, and its legends may be hidden.

    Args:
        figure: the figure.
        stem: path of the files without the ending.
        kinds: endings of the files, such as `pdf`.

    Raises:
        InputError: if a file cannot be written, or the figure shows a value
            that its axis cannot have, see `evaluation.results.ranges`.
    """
    _check_ranges(figure)
    FigureCanvasAgg(figure)
    # The layout is computed once for all formats.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    bottom = max(
        (legend.get_window_extent().y1 for legend in figure.legends),
        default=0.0,
    )
    width, height = figure.get_size_inches()
    above = Bbox.from_extents(0.0, bottom / figure.dpi, width, height)
    for kind in kinds:
        path = stem.with_name(f"{stem.name}.{kind}")
        on_page = kind in ("svg", "webp")
        for legend in figure.legends:
            legend.set_visible(not on_page)
        options: dict = {}
        if kind == "webp":
            options = {"pil_kwargs": {"quality": _WEBP_QUALITY}}
        if on_page and figure.legends:
            options["bbox_inches"] = above
        dpi = _PAGE_DPI if kind == "webp" else _DPI
        write_figure(figure, path, dpi, **options)


def _check_ranges(figure: Figure) -> None:
    """Raises an error unless each axis shows values in its label's range."""
    for axes in figure.axes:
        of_figure = figure.get_supxlabel(), figure.get_supylabel()
        labels = axes.get_xlabel(), axes.get_ylabel()
        drawn = _drawn_values(axes)
        for k, label in enumerate(labels):
            check_all(label or of_figure[k], drawn[k])


def _drawn_values(axes: Axes) -> tuple[list[float], list[float]]:
    """Returns all x and all y that are drawn in coordinates of the data."""
    found: tuple[list[float], list[float]] = ([], [])
    # All that is drawn, without the frame.
    for artist in (*axes.lines, *axes.collections, *axes.patches):
        transform = artist.get_transform()
        if isinstance(artist, Line2D):
            corners = [np.column_stack(artist.get_data())]
        elif isinstance(artist, Patch):
            path = artist.get_path().transformed(artist.get_patch_transform())
            corners = [np.asarray(path.vertices)]
            transform = artist.get_data_transform()
        elif isinstance(artist, PathCollection):
            # The markers of a scatter plot, whose paths have no position.
            corners = [np.ma.filled(artist.get_offsets(), np.nan)]
            transform = artist.get_offset_transform()
        elif isinstance(artist, Collection):
            corners = [np.asarray(path.vertices) for path in artist.get_paths()]
        else:
            continue
        of_data = transform.contains_branch_seperately(axes.transData)
        for values, is_data, column in zip(found, of_data, (0, 1), strict=True):
            for vertices in corners if is_data else ():
                values.extend(np.asarray(vertices, dtype=float)[:, column])
    return found
