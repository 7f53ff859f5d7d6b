"""Pictures of an ageing city, from the air and from three streets."""

from pathlib import Path

from matplotlib.figure import Figure
import matplotlib.image
import numpy as np

from cns_drake.motion import Trajectory
from cns_drake.pictures.camera_views import View
from cns_drake.pictures.stage_scene import StageScene
from evaluation.base import doing, figure_style, save_figure
from worlds.ageing import AgedMap
from worlds.maps import stage_name

PICTURES = "pictures"
# Size of a picture in pixels.
_WIDTH = 480
_HEIGHT = 270
_STREETS = 3
# Height of the camera above the street [m].
_EYE_HEIGHT = 2.4
# Distance from the camera to its target [m].
_TARGET_AHEAD = 30.0
# Possible views along the drive are this far apart, and chosen ones three times
# as far [m].
_SPACING = 25.0
# A change counts if it is within this distance ahead [m].
_SEEN = 60.0


def street_views(
    changed: np.ndarray, trajectory: Trajectory
) -> dict[str, View]:
    """Returns camera views that show many changed buildings.

    The cameras stand apart from each other on the path of a drive, and look in
    the direction of travel.

    Args:
        changed: (N, 3) places of changed buildings in W [m].
        trajectory: the drive.

    Returns:
        Name -> view. The names are `street_1`, `street_2` and so on, in the
        order in which the drive passes the cameras.
    """
    number = int(trajectory.length / _SPACING) + 2
    times = np.linspace(0.0, trajectory.duration, number)[:-1]
    R_WBs, p_WBs = trajectory.poses(times)
    ahead = np.array(R_WBs)[:, :, 0]
    seen = []
    for p, d in zip(p_WBs, ahead, strict=True):
        to = changed - p
        far = np.linalg.norm(to[:, :2], axis=1)
        is_seen = (far < _SEEN) & (to @ d > 0.5 * far)
        seen.append(int(is_seen.sum()))
    chosen: list[int] = []
    for k in np.argsort(-np.array(seen), kind="stable"):
        apart = [np.linalg.norm(p_WBs[k] - p_WBs[j]) for j in chosen]
        if min(apart, default=np.inf) > 3 * _SPACING and len(chosen) < _STREETS:
            chosen.append(int(k))
    views = {}
    for n, k in enumerate(sorted(chosen), start=1):
        x, y, z = p_WBs[k]
        u, v, w = p_WBs[k] + _TARGET_AHEAD * ahead[k]
        views[f"street_{n}"] = View(
            position=(x, y, z + _EYE_HEIGHT),
            target=(u, v, w + _EYE_HEIGHT + 1.0),
            fov_y_deg=60,
        )
    return views


def air_view(trajectory: Trajectory) -> View:
    """Returns a view from the air of the area around a drive."""
    _, p = trajectory.poses(np.linspace(0.0, trajectory.duration, 99))
    x, y, z = (p.min(axis=0) + p.max(axis=0)) / 2
    half = float(np.ptp(p, axis=0)[:2].max()) / 2
    up = (x - 0.9 * half, y - 1.1 * half, z + 1.2 * half)
    return View(position=up, target=(x, y, z), fov_y_deg=52)


@figure_style()
def draw_aged_city(folder: Path, aged: AgedMap, trajectory: Trajectory) -> None:
    """Writes a picture of each view in each year, and a picture of all views.

    The files are `pictures/year_<year>_<view>.jpg` and `pictures/film.jpg` in
    the map's folder.

    Args:
        folder: folder of the map.
        aged: stages of the map.
        trajectory: drive from which the streets are seen.
    """
    streets = street_views(aged.changed, trajectory)
    views = {"air": air_view(trajectory), **streets}
    years = sorted(aged.years, key=lambda stage: aged.years[stage])
    (folder / PICTURES).mkdir()
    figure = Figure(
        figsize=(len(views) * 3.2, len(years) * 1.85), layout="compressed"
    )
    panels = figure.subplots(len(years), len(views), squeeze=False)
    for row, stage in zip(panels, years, strict=True):
        year = aged.years[stage]
        doing(f"drawing year {year}")
        scene = None  # The scenes of two years would need twice the memory.
        scene = StageScene(folder / stage_name(stage))
        for axes, (name, view) in zip(row, views.items(), strict=True):
            picture = scene.photograph(view, _WIDTH, _HEIGHT)
            file = folder / PICTURES / f"year_{year:03d}_{name}.jpg"
            matplotlib.image.imsave(file, picture)
            axes.imshow(picture)
            axes.set_axis_off()
        row[0].set_title(f"year {year}" if year else "today", loc="left")
    save_figure(figure, folder / PICTURES / "film.jpg", dpi=110)
