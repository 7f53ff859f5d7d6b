"""The drives of a map from above, each over its stage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
import numpy as np

from cns_drake.base.files import (
    complete_part,
    part_path,
    user_errors,
)
from cns_drake.pictures.stage_scene import StageScene, View
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import world_file

# As many pixels as a panel has.
_WIDTH, _HEIGHT = 600, 600
# Margin around the routes [m].
_MARGIN = 40.0
# From far up, so that towers lean little [m].
_CAMERA_HEIGHT = 1200.0
# Red at the start and blue at the end, as in the paper.
_COLOURS = "turbo_r"
_POINTS = 400
_COLUMNS = 4
_PANEL_INCHES = 4.0


def draw_drives(scenarios: Mapping[str, Scenario], path: Path) -> None:
    """Draws drives side by side, from above, north up.

    All panels show the same piece of the world, so that they compare.

    Args:
        scenarios: title -> drive.
        path: the picture to write; its ending chooses the format.

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
        figsize=(columns * _PANEL_INCHES, rows * (_PANEL_INCHES + 0.25)),
        layout="constrained",
    )
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    pictures: dict[tuple, np.ndarray] = {}
    for axes, (title, positions) in zip(panels, drives.items(), strict=False):
        scenario = scenarios[title]
        world = (world_file(scenario), scenario.without)
        if world not in pictures:
            pictures[world] = StageScene(*world).photograph(
                view, _WIDTH, _HEIGHT, haze_length=np.inf
            )
        axes.imshow(pictures[world])
        axes.set_title(title)
        _draw_route(axes, view, positions)
    with user_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(
            part_path(path), dpi=150, format=path.suffix.removeprefix(".")
        )
    complete_part(path)


def view_from_above(positions: np.ndarray) -> View:
    """Returns a view straight down that shows all positions."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    x, y, z = (low + high) / 2
    half = (high - low)[:2].max() / 2 + _MARGIN
    return View(
        position=(x, y, z + _CAMERA_HEIGHT),
        target=(x, y, z),
        fov_y=float(np.rad2deg(2 * np.arctan2(half, _CAMERA_HEIGHT))),
    )


def _draw_route(axes: Axes, view: View, positions: np.ndarray) -> None:
    # Above the car, so that the line lies over everything that is drawn.
    pixels, _ = view.project(positions, _WIDTH, _HEIGHT)
    segments = list(np.stack([pixels[:-1], pixels[1:]], axis=1))
    # The line gets thinner, so that a street that is driven twice shows both.
    widths = np.linspace(5.0, 2.0, len(segments))
    # A rim sets the line apart from roofs of its colour.
    axes.add_collection(
        LineCollection(segments, colors="white", linewidths=widths + 1.5)
    )
    line = LineCollection(segments, cmap=_COLOURS, linewidths=widths)
    line.set_array(np.linspace(0.04, 0.92, len(segments)))
    line.set_clim(0, 1)
    axes.add_collection(line)
    for place, marker in ((pixels[0], "o"), (pixels[-1], "s")):
        axes.plot(
            *place, marker, markersize=8, markerfacecolor="white",
            markeredgecolor="black",
        )  # fmt: skip
