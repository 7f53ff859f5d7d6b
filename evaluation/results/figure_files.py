"""Files of figures: equal bytes for equal figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
import re
import tempfile
from typing import Any

from markupsafe import Markup
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from evaluation.base import figure_style
from evaluation.base import save_figure as write_figure

# The formats of pictures, the one for the page last.
PIXELS = ("png", "webp")
# The formats of charts for print.
PRINTED = ("pdf", "png", "svg")
# Resolution of pictures for print [dots per inch].
_DPI = 200
# Resolution of pictures for the page [dots per inch].
_PAGE_DPI = 130
# Quality of compressed pictures, from 0 to 100.
_WEBP_QUALITY = 82


def save_figure(
    figure: Figure,
    stem: Path,
    kinds: Sequence[str],
    settings: Mapping[str, Any] | None = None,
) -> None:
    """Writes a figure as one file for each of several formats.

    Equal figures give equal bytes. WebP files are for web pages, and do not
    contain the legend at the bottom of the figure: the page itself writes this
    legend, in letters that can be read on a phone. The figure is changed: its
    layout is fixed, and its legends may be hidden.

    Args:
        figure: the figure.
        stem: path of the files without the ending.
        kinds: endings of the files, such as `pdf`.
        settings: Matplotlib's parameters with which the figure was drawn.

    Raises:
        InputError: a file cannot be written.
    """
    with figure_style(settings):
        _save(figure, stem, kinds, settings)


def _save(
    figure: Figure,
    stem: Path,
    kinds: Sequence[str],
    settings: Mapping[str, Any] | None,
) -> None:
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
        on_page = kind == "webp"
        for legend in figure.legends:
            legend.set_visible(not on_page)
        options: dict = {}
        if kind == "webp":
            options = {"pil_kwargs": {"quality": _WEBP_QUALITY}}
        if on_page and figure.legends:
            options["bbox_inches"] = above
        dpi = _PAGE_DPI if kind == "webp" else _DPI
        write_figure(figure, path, dpi, settings, **options)


def figure_svg(
    figure: Figure, prefix: str, settings: Mapping[str, Any] | None = None
) -> Markup:
    """Returns a figure as an element of a page.

    Args:
        figure: the figure.
        prefix: beginning of the element's ids, which no other figure has.
        settings: Matplotlib's parameters with which the figure was drawn.
    """
    with tempfile.TemporaryDirectory() as folder:
        stem = Path(folder) / "chart"
        save_figure(figure, stem, ("svg",), settings)
        text = stem.with_suffix(".svg").read_text()
    text = text[text.index("<svg") :]
    return Markup(re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", text))
