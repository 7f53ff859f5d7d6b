"""The same view of a city at two stages, as rendered and as scanned."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np
from pydantic import TypeAdapter, ValidationError

from cns_drake.base.errors import (
    InputError,
    describe_validation_error,
)
from cns_drake.base.files import (
    complete_part,
    part_path,
    user_errors,
)
from cns_drake.base.yaml_files import read_yaml
from cns_drake.pictures.stage_scene import StageScene, View
from cns_drake.recording.schedule import FRAME_PERIOD
from cns_drake.sensors.lidar_presets import make_beam_pattern

# As many pixels as a panel has.
_WIDTH, _HEIGHT = 704, 396
# Height of the LiDAR below the camera's mast [m].
_SENSOR_HEIGHT = 1.6


def load_views(path: Path) -> dict[str, View]:
    """Reads the views of a map.

    Raises:
        InputError: the file is missing or not a mapping of views.
    """
    content = read_yaml(path)
    try:
        return TypeAdapter(dict[str, View]).validate_python(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def draw_stages(stages: dict[str, Path], view: View, path: Path) -> None:
    """Draws a view of stages side by side, above the scans taken there.

    The LiDAR stands below the camera; its points are seen by the camera,
    coloured by distance.

    Args:
        stages: title -> SDF world, from left to right.
        view: the camera.
        path: the picture to write; its ending chooses the format.

    Raises:
        InputError: a world cannot be loaded or the picture not be written.
    """
    figure = Figure(
        figsize=(2 * 6.4, len(stages) * 3.6 + 0.3), layout="constrained"
    )
    axes = figure.subplots(2, len(stages), squeeze=False)
    for column, (title, world) in enumerate(stages.items()):
        scene = StageScene(world)
        axes[0, column].imshow(scene.photograph(view, _WIDTH, _HEIGHT))
        axes[0, column].set_title(title)
        pixels, distances = _scan_seen_by(scene, view)
        axes[1, column].scatter(
            *pixels.T, c=distances, s=1.5, cmap="viridis_r", vmin=0, vmax=100,
            linewidths=0, rasterized=True,
        )  # fmt: skip
        axes[1, column].set_xlim(0, _WIDTH)
        axes[1, column].set_ylim(_HEIGHT, 0)
        axes[1, column].set_aspect("equal")
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    with user_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(
            part_path(path), dpi=110, format=path.suffix.removeprefix(".")
        )
    complete_part(path)


def _scan_seen_by(
    scene: StageScene, view: View
) -> tuple[np.ndarray, np.ndarray]:
    """Returns pixels of a scan's points and their distances [m]."""
    x, y, z = view.position
    down = scene.cast_rays(
        np.array([x, y, z]), np.array([[0.0, 0.0, -1.0]]), 100.0
    )
    p_WS = np.array([x, y, z - down.ranges[0] + _SENSOR_HEIGHT])
    pattern = make_beam_pattern("cns", FRAME_PERIOD)
    hits = scene.cast_rays(p_WS, pattern.beams(0).d_Sset, pattern.max_range)
    hit = np.isfinite(hits.ranges)
    ranges = hits.ranges[hit]
    points = p_WS + ranges[:, None] * pattern.beams(0).d_Sset[hit]
    pixels, seen = view.project(points, _WIDTH, _HEIGHT)
    return pixels, ranges[seen]
