"""Draws the drives of a map from above."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
import numpy as np

from cns_drake.pictures.camera_views import View
from cns_drake.pictures.stage_scene import StageScene
from cns_drake.scenarios import Scenario, lost_structures, plan_drive
from evaluation.base import (
    distances_along,
    figure_style,
    make_folder,
    save_figure,
)

# Side of a picture from above [pixels].
_SIDE = 600
# Margin around the routes [m].
_MARGIN = 40.0
# Height of the camera: so high that towers hardly lean [m].
_CAMERA_HEIGHT = 1200.0
# As the routes in reports.
_ROUTE_COLOUR = "#1c2430"
# Parts of a route at which an arrow head points along it.
_ARROW_HEADS = np.linspace(0.1, 0.9, 7)
# Markers of the start and of the end of a route.
_MARKERS = {"start": "o", "end": "s"}
_MARKER_STYLE: dict[str, Any] = {
    "markersize": 8,
    "mfc": "white",
    "mec": "black",
}
# Possible lengths of the scale bar [m], which is at most a quarter as wide as
# a picture.
_SCALE_BARS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
# Number of points at which a route is drawn.
_POINTS = 400
# Number of drives side by side.
_COLUMNS = 2
# Side of a drive's panel [inch].
_PANEL_INCHES = 4.0


@figure_style()
def draw_drives(scenarios: Mapping[str, Scenario], path: Path) -> None:
    """Draws drives in two columns of panels, seen from above, with north up.

    All panels show the same part of the world, so that they can be compared.
    Each has a scale bar. A key at the bottom explains the markers.

    Args:
        scenarios: title -> scenario of each drive.
        path: file of the picture; its ending determines the format.

    Raises:
        InputError: a drive cannot be planned, a world cannot be loaded, or the
            picture cannot be written.
    """
    drives = {}
    for title, scenario in scenarios.items():
        trajectory = plan_drive(scenario)
        times = np.linspace(0.0, trajectory.duration, _POINTS)
        drives[title] = np.array(
            [trajectory.pose(t).translation() for t in times]
        )
    view = view_from_above(np.concatenate(list(drives.values())))
    rows = -(-len(drives) // _COLUMNS)
    columns = min(len(drives), _COLUMNS)
    figure = Figure(
        figsize=(columns * _PANEL_INCHES, rows * (_PANEL_INCHES + 0.3) + 0.4),
        layout="compressed",
    )
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    pictures: dict[tuple, np.ndarray] = {}
    for axes, (title, positions) in zip(panels, drives.items(), strict=False):
        scenario = scenarios[title]
        without = (*scenario.without, *lost_structures(scenario))
        world = scenario.world_file, without, scenario.model_paths
        if world not in pictures:
            pictures[world] = StageScene(*world).photograph(
                view, _SIDE, _SIDE, haze_length=np.inf
            )
        axes.imshow(pictures[world])
        axes.set_title(title)
        _draw_route(axes, view, positions)
        _draw_scale_bar(axes, view)
    _draw_key(figure)
    make_folder(path.parent)
    save_figure(figure, path, dpi=150)


def view_from_above(positions: np.ndarray) -> View:
    """Returns a view straight down that shows all positions (N, 3) [m]."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    x, y, z = (low + high) / 2
    half = (high - low)[:2].max() / 2 + _MARGIN
    return View(
        position=(x, y, z + _CAMERA_HEIGHT),
        target=(x, y, z),
        fov_y_deg=float(np.rad2deg(2 * np.arctan2(half, _CAMERA_HEIGHT))),
    )


def _draw_route(axes: Axes, view: View, positions: np.ndarray) -> None:
    """Draws a route through positions (N, 3) [m], with arrow heads."""
    # Slightly above the car, so that the line lies over everything that is
    # drawn.
    pixels, _ = view.project(positions, _SIDE, _SIDE)
    segments = list(np.stack([pixels[:-1], pixels[1:]], axis=1))
    # The line gets thinner, so that a street that is driven twice shows both
    # lines.
    widths = np.linspace(5.0, 2.0, len(segments))
    # A white rim distinguishes the line from roofs of the same colour.
    for colour, wider in (("white", 1.5), (_ROUTE_COLOUR, 0.0)):
        axes.add_collection(
            LineCollection(
                segments, colors=colour, linewidths=widths + wider,
                capstyle="round",
            )
        )  # fmt: skip
    travelled = distances_along(pixels)
    for part in _ARROW_HEADS:
        k = int(np.searchsorted(travelled, part * travelled[-1]))
        k = min(max(k, 1), len(pixels) - 1)
        right, down = pixels[k] - pixels[k - 1]
        # A triangle that points up is turned against the clock.
        angle = float(np.rad2deg(np.arctan2(-down, right))) - 90.0
        axes.plot(
            *pixels[k], marker=(3, 0, angle), markersize=10,
            mfc=_ROUTE_COLOUR, mec="white",
        )  # fmt: skip
    ends = pixels[0], pixels[-1]
    for place, marker in zip(ends, _MARKERS.values(), strict=True):
        axes.plot(*place, marker, **_MARKER_STYLE)


def _draw_scale_bar(axes: Axes, view: View) -> None:
    """Draws a scale bar, for lengths on the ground, and its length.

    Both lie in the margin below the routes.
    """
    # The view looks straight down at its target.
    half = _CAMERA_HEIGHT * np.tan(np.deg2rad(view.fov_y_deg) / 2)
    length = max(one for one in _SCALE_BARS if one <= half / 2)
    end, base = 0.97 * _SIDE, 0.97 * _SIDE
    start = end - length * _SIDE / (2 * half)
    # White rims keep the bar and its length legible on roofs and trees.
    (bar,) = axes.plot([start, end], [base, base], color="black", linewidth=3)
    bar.set_path_effects([withStroke(linewidth=6, foreground="white")])
    axes.annotate(
        f"{length} m",
        (start, base),
        xytext=(-6, 0),
        textcoords="offset points",
        ha="right",
        va="center_baseline",
        path_effects=[withStroke(linewidth=3, foreground="white")],
    )


def _draw_key(figure: Figure) -> None:
    figure.legend(
        handles=[
            Line2D(
                [], [], color=_ROUTE_COLOUR, lw=4, marker=marker,
                label=label, **_MARKER_STYLE,
            )
            for label, marker in _MARKERS.items()
        ],
        loc="outside lower center",
        ncols=len(_MARKERS),
        frameon=False,
    )  # fmt: skip
