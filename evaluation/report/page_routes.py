"""Maps from above with routes, as the page shows them."""

from __future__ import annotations

import base64
from collections.abc import Iterable

from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex
import numpy as np

from evaluation.report.figures import ROUTE_COLOURS
from evaluation.report.page_data import PageDrive
from evaluation.report.page_templates import render

# Number of pieces of one colour in a drawn route.
_NUM_PIECES = 48
# Size of the marks of start and end, as a part of the picture.
_MARK = 0.016
# Length of the scale bar [m].
BAR_LENGTH = 50.0


def route_picture(drive: PageDrive) -> Markup:
    """Returns an SVG element: the map, over it the route from red to blue.

    One unit is one metre, y points down. The element `image` in it has the
    id `view-` and the drive's name, and serves the query browser as well.
    """
    left, right, bottom, top = drive.extent
    width, height = right - left, top - bottom
    size = _MARK * max(width, height)
    data = base64.b64encode(drive.view).decode("ascii")
    route = drive.route * [1.0, -1.0]
    (x0, y0), (x1, y1) = route[0], route[-1]
    end, base = right - 0.03 * width, -bottom - 0.03 * height
    mark = [[x0, y0 - size], [x0 - size, y0 + size], [x0 + size, y0 + size]]
    return render(
        "route.svg",
        name=drive.name,
        box=_numbers([left, -top, width, height]),
        image=f"data:image/webp;base64,{data}",
        route=_points(route),
        pieces=_pieces(route),
        start=_points(np.array(mark)),
        end=_numbers([x1 - size, y1 - size, 2 * size]),
        bar=_numbers([end - BAR_LENGTH, end, base]),
    )


def route_colours(num: int = 9) -> list[str]:
    """Returns colours from the start of a route to its end."""
    colours = colormaps[ROUTE_COLOURS](np.linspace(0.0, 1.0, num))
    return [to_hex(colour) for colour in colours]


def _pieces(route: np.ndarray) -> list[tuple[str, str]]:
    """Returns colour and points of pieces, joined at their ends."""
    last = len(route) - 1
    num = min(_NUM_PIECES, max(last, 1))
    ends = np.linspace(0, last, num + 1).astype(int)
    return [
        (colour, _points(route[a : b + 1]))
        for a, b, colour in zip(
            ends[:-1], ends[1:], route_colours(num), strict=True
        )
    ]


def _points(line: np.ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _numbers(values: Iterable[float]) -> list[str]:
    return [f"{value:.2f}" for value in values]
