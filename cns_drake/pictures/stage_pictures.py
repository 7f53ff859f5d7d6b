"""Draws stages of a map side by side: photographs and scans from one place."""

from pathlib import Path

from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
import numpy as np

from cns_drake.pictures.camera_views import View
from cns_drake.pictures.stage_scene import StageScene
from cns_drake.recording import FRAME_PERIOD
from cns_drake.sensors import make_beam_pattern
from evaluation.base import figure_style, make_folder, save_figure

# Size of a camera's view [pixels].
_WIDTH = 704
_HEIGHT = 396
# Distance at which the colours of points end [m].
_FARTHEST = 100.0
# From dark where points are near; no yellow, which is pale on white.
_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.8, 256)))
# Height of the LiDAR, which stands below the camera [m].
_SENSOR_HEIGHT = 1.6


@figure_style()
def draw_stages(stages: dict[str, Path], view: View, path: Path) -> None:
    """Draws stages side by side as a camera sees them.

    Under the picture of each stage is a picture of a scan. The LiDAR stands on
    the ground below the camera. The points of the scan are drawn as seen from
    the camera, coloured by distance from the LiDAR; a colour bar is at the
    bottom.

    Args:
        stages: title -> SDF file of each stage, from left to right.
        view: position and direction of the camera.
        path: file of the picture; its ending determines the format.

    Raises:
        InputError: a world cannot be loaded, or the picture cannot be written.
    """
    figure = Figure(
        figsize=(3.2 * len(stages), 2 * 1.8 + 0.9), layout="compressed"
    )
    axes = figure.subplots(2, len(stages), squeeze=False)
    for column, (title, world) in enumerate(stages.items()):
        scene = StageScene(world)
        axes[0, column].imshow(scene.photograph(view, _WIDTH, _HEIGHT))
        axes[0, column].set_title(title)
        pixels, distances = _scan_seen_by(scene, view)
        points = axes[1, column].scatter(
            *pixels.T, c=distances, s=0.4, cmap=_COLOURS, vmin=0,
            vmax=_FARTHEST, linewidths=0, rasterized=True,
        )  # fmt: skip
        axes[1, column].set_xlim(0, _WIDTH)
        axes[1, column].set_ylim(_HEIGHT, 0)
        axes[1, column].set_aspect("equal")
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    figure.colorbar(
        points, ax=axes, location="bottom", shrink=0.5, aspect=40,
        extend="max", label="distance from the LiDAR [m]",
    )  # fmt: skip
    make_folder(path.parent)
    save_figure(figure, path, dpi=220)


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
