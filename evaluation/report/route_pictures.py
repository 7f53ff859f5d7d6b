"""Pictures of routes for a report's page, as SVG."""

import base64
from collections.abc import Iterable
import itertools

from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex
import numpy as np

from evaluation.report.map_figures import ROUTE_COLOURS
from evaluation.report.page_data import PageDrive
from evaluation.results.page_frame import environment

# Number of pieces of one colour in a drawn route.
_NUM_PIECES = 48
# Size of the marks of start and end, as a part of the picture.
_MARK = 0.016
# Distance of the scale bar from the edges, as a part of the picture.
_INSET = 0.03
# Length of the scale bar [m].
BAR_LENGTH = 50.0


def route_picture(drive: PageDrive) -> Markup:
    """Returns a drive's route on its map from above, as an SVG element.

    The route is red at its start and blue at its end. One unit is one metre;
    the x axis is directed to the right, the y axis downwards. The picture of
    the map is an element `image` with the id `view-<name of the drive>`, which
    the query browser uses as well.
    """
    left, right, bottom, top = drive.extent
    width, height = right - left, top - bottom
    size = _MARK * max(width, height)
    data = base64.b64encode(drive.view).decode("ascii")
    route = drive.route * [1.0, -1.0]
    (x0, y0), (x1, y1) = route[0], route[-1]
    end, base = right - _INSET * width, -bottom - _INSET * height
    mark = [[x0, y0 - size], [x0 - size, y0 + size], [x0 + size, y0 + size]]
    # Pieces are joined at their ends.
    last = len(route) - 1
    num = min(_NUM_PIECES, max(last, 1))
    ends = np.linspace(0, last, num + 1).astype(int)
    pieces = [route[a : b + 1] for a, b in itertools.pairwise(ends)]
    return Markup(
        environment(__package__, "page_template")
        .get_template("route.svg")
        .render(
            name=drive.name,
            box=_coordinates([left, -top, width, height]),
            image=f"data:image/webp;base64,{data}",
            route=_point_list(route),
            pieces=zip(
                route_colours(num), map(_point_list, pieces), strict=True
            ),
            start=_point_list(np.array(mark)),
            end=_coordinates([x1 - size, y1 - size, 2 * size]),
            bar=_coordinates([end - BAR_LENGTH, end, base]),
        )
    )


def route_colours(num: int) -> list[str]:
    """Returns colours from the start of a route to its end."""
    colours = colormaps[ROUTE_COLOURS](np.linspace(0.0, 1.0, num))
    return [to_hex(colour) for colour in colours]


def _point_list(line: np.ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _coordinates(values: Iterable[float]) -> list[str]:
    return [f"{value:.2f}" for value in values]
