"""Draws a map's stages: side by side in one view, or from above with drives."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
import numpy as np
from pydantic import TypeAdapter, ValidationError

from cns_drake.base.errors import InputError, describe_validation_error
from cns_drake.base.files import completing, make_folder
from cns_drake.base.yaml_files import read_yaml
from cns_drake.pictures.stage_scene import StageScene, View
from cns_drake.recording.schedule import FRAME_PERIOD
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.sensors.lidar.presets import make_beam_pattern

# Size of a camera's view [pixels].
_WIDTH = 704
_HEIGHT = 396
# Side of a picture from above [pixels].
_SIDE = 600
# Height of the LiDAR, which stands below the camera [m].
_SENSOR_HEIGHT = 1.6
# Margin around the routes [m].
_MARGIN = 40.0
# Height of the camera: so high that towers hardly lean [m].
_CAMERA_HEIGHT = 1200.0
# Red at the start and blue at the end, as in the paper.
_COLOURS = "turbo_r"
# Number of points at which a route is drawn.
_POINTS = 400
# Number of drives side by side.
_COLUMNS = 2
# Side of a drive's panel [inch].
_PANEL_INCHES = 4.0


def load_views(path: Path) -> dict[str, View]:
    """Returns name -> view, from a YAML file.

    Raises:
        InputError: the file is missing or not a mapping of views.
    """
    content = read_yaml(path)
    try:
        return TypeAdapter(dict[str, View]).validate_python(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def draw_stages(stages: dict[str, Path], view: View, path: Path) -> None:
    """Draws stages side by side as a camera sees them.

    Under the picture of each stage is a picture of a scan. The LiDAR stands on
    the ground below the camera. Its points are drawn as seen from the camera,
    coloured by distance.

    Args:
        stages: title -> SDF file of each stage, from left to right.
        view: position and direction of the camera.
        path: file of the picture; its ending determines the format.

    Raises:
        InputError: a world cannot be loaded, or the picture cannot be written.
    """
    figure = Figure(
        figsize=(3.2 * len(stages), 2 * 1.8 + 0.3), layout="constrained"
    )
    axes = figure.subplots(2, len(stages), squeeze=False)
    for column, (title, world) in enumerate(stages.items()):
        scene = StageScene(world)
        axes[0, column].imshow(scene.photograph(view, _WIDTH, _HEIGHT))
        axes[0, column].set_title(title)
        pixels, distances = _scan_seen_by(scene, view)
        axes[1, column].scatter(
            *pixels.T, c=distances, s=0.4, cmap="viridis_r", vmin=0, vmax=100,
            linewidths=0, rasterized=True,
        )  # fmt: skip
        axes[1, column].set_xlim(0, _WIDTH)
        axes[1, column].set_ylim(_HEIGHT, 0)
        axes[1, column].set_aspect("equal")
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    _save(figure, path, dpi=220)


def draw_drives(scenarios: Mapping[str, Scenario], path: Path) -> None:
    """Draws drives in two columns of panels, seen from above, with north up.

    All panels show the same part of the world, so that they can be compared.

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
        figsize=(columns * _PANEL_INCHES, rows * (_PANEL_INCHES + 0.25)),
        layout="constrained",
    )
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    pictures: dict[tuple, np.ndarray] = {}
    for axes, (title, positions) in zip(panels, drives.items(), strict=False):
        scenario = scenarios[title]
        world = (scenario.world_file, scenario.without)
        if world not in pictures:
            pictures[world] = StageScene(*world).photograph(
                view, _SIDE, _SIDE, haze_length=np.inf
            )
        axes.imshow(pictures[world])
        axes.set_title(title)
        _draw_route(axes, view, positions)
    _save(figure, path, dpi=150)


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
    # Slightly above the car, so that the line lies over everything that is
    # drawn.
    pixels, _ = view.project(positions, _SIDE, _SIDE)
    segments = list(np.stack([pixels[:-1], pixels[1:]], axis=1))
    # The line gets thinner, so that a street that is driven twice shows both
    # lines.
    widths = np.linspace(5.0, 2.0, len(segments))
    # A white rim distinguishes the line from roofs of the same colour.
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


def _scan_seen_by(
    scene: StageScene, view: View
) -> tuple[np.ndarray, np.ndarray]:
    """Returns pixels and distances [m] of the scan points in a view."""
    x, y, z = view.position
    down = scene.scene.cast_rays(
        np.array([x, y, z]), np.array([[0.0, 0.0, -1.0]]), 100.0
    )
    p_WS = np.array([x, y, z - down.ranges[0] + _SENSOR_HEIGHT])
    pattern = make_beam_pattern("cns", FRAME_PERIOD)
    hits = scene.scene.cast_rays(
        p_WS, pattern.beams(0).d_Sset, pattern.max_range
    )
    hit = np.isfinite(hits.ranges)
    ranges = hits.ranges[hit]
    points = p_WS + ranges[:, None] * pattern.beams(0).d_Sset[hit]
    pixels, seen = view.project(points, _WIDTH, _HEIGHT)
    return pixels, ranges[seen]


def _save(figure: Figure, path: Path, dpi: float) -> None:
    make_folder(path.parent)
    with completing(path) as part:
        figure.savefig(part, dpi=dpi, format=path.suffix.removeprefix("."))
