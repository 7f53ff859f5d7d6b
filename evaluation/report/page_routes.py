"""Maps from above with routes, as the page shows them."""

from __future__ import annotations

import base64
import html

from matplotlib import colormaps
from matplotlib.colors import to_hex
import numpy as np

from evaluation.report.figures import ROUTE_COLOURS
from evaluation.report.page_data import PageDrive

# Pieces of one colour that a route is drawn in.
_NUM_PIECES = 48
# Size of start and end, as a part of the picture.
_MARK = 0.016
_BAR = 50.0


def route_picture(drive: PageDrive) -> str:
    """Returns an SVG element: the map, over it the route from red to blue.

    One unit is one metre, y points down. The element `image` in it has the
    id `view-` and the drive's name, and serves the query browser as well.
    """
    left, right, bottom, top = drive.extent
    width, height = right - left, top - bottom
    size = _MARK * max(width, height)
    data = base64.b64encode(drive.view).decode("ascii")
    name = html.escape(drive.name, quote=True)
    route = drive.route * [1.0, -1.0]
    (x0, y0), (x1, y1) = route[0], route[-1]
    end, base = right - 0.03 * width, -bottom - 0.03 * height
    return "".join(
        [
            f'<svg class="aerial" role="img" aria-label="{name} from above'
            f' with its route" viewBox="{left:.1f} {-top:.1f} {width:.1f}'
            f' {height:.1f}">',
            f'<image id="view-{name}" x="{left:.2f}" y="{-top:.2f}"'
            f' width="{width:.2f}" height="{height:.2f}"'
            f' href="data:image/webp;base64,{data}"/>',
            f'<polyline class="casing" points="{_points(route)}"/>',
            *_pieces(route),
            f'<polygon points="{x0:.1f},{y0 - size:.1f}'
            f" {x0 - size:.1f},{y0 + size:.1f}"
            f' {x0 + size:.1f},{y0 + size:.1f}"/>',
            f'<rect x="{x1 - size:.1f}" y="{y1 - size:.1f}"'
            f' width="{2 * size:.1f}" height="{2 * size:.1f}"/>',
            f'<line x1="{end - _BAR:.1f}" x2="{end:.1f}"'
            f' y1="{base:.1f}" y2="{base:.1f}"/>',
            "</svg>",
        ]
    )


def route_legend() -> str:
    """Returns a paragraph that explains the pictures."""
    colours = ",".join(_colours(9))
    return (
        '<p class="legend"><span>▲ start</span> <span class="colours"'
        f' style="background:linear-gradient(90deg,{colours})"></span>'
        " <span>■ end</span> <span>The higher, the darker; the bar is"
        f" {_BAR:.0f} m long.</span></p>"
    )


def _pieces(route: np.ndarray) -> list[str]:
    """Returns the route's pieces, each of which begins where one ended."""
    last = len(route) - 1
    num = min(_NUM_PIECES, max(last, 1))
    ends = np.linspace(0, last, num + 1).astype(int)
    return [
        f'<polyline stroke="{colour}" points="{_points(route[a : b + 1])}"/>'
        for a, b, colour in zip(ends[:-1], ends[1:], _colours(num), strict=True)
    ]


def _colours(num: int) -> list[str]:
    colours = colormaps[ROUTE_COLOURS](np.linspace(0.0, 1.0, num))
    return [to_hex(colour) for colour in colours]


def _points(line: np.ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)
