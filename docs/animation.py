"""Draws the moving picture of the README: one drive, with traffic, twice.

python docs/animation.py docs/pictures/drive.webp

The same drive goes through two stages of a city. A photograph of each stage
lies behind the points that the LiDAR sees there, coloured by height;
orange points are on what moves.
"""

from __future__ import annotations

import itertools
from pathlib import Path
import sys
import tempfile

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import ConvexHull

from cns_drake.base.terminal import track
from cns_drake.pictures.stage_scene import StageScene, View
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario, world_file
from cns_drake.simulation.simulation import simulate
from evaluation import open_drive

DRIVE = "metropolis_01"
STAGES = ("01", "04")
TRAFFIC = 60
FIRST, LAST, STEP = 0, 160, 3  # frames of the recording
SIZE = (720, 405)
FRAME_MS = 120
FADE = 4  # pictures
_SMOOTHING = 2  # pixels of the photograph for one of the picture
_MOVING_COLOUR = (255, 140, 0)
_FIRST_MOVING_CLASS = 252  # of SemanticKITTI
_HEIGHTS = (0.0, 12.0)  # of the colours [m]
# Limits of the car's box in the LiDAR's frame [m].
_CAR = ((-1.0, 3.6), (-0.95, 0.95), (-1.4, -0.2))


def main(path: Path) -> None:
    """Simulates both drives and writes the picture."""
    drives = [
        load_scenario(DRIVE)
        .model_copy(update={"stage": stage, "name": f"stage_{stage}"})
        .with_traffic(TRAFFIC)
        .model_copy(update={"frames": LAST})
        for stage in STAGES
    ]
    view = _view(drives[0])
    films = []
    with tempfile.TemporaryDirectory() as folder:
        for drive in drives:
            run = simulate(drive, Path(folder))
            films.append(list(_film(drive, run.folder, view)))
    pictures = []
    for film, following in zip(films, films[1:] + films[:1], strict=True):
        pictures += film
        pictures += [
            Image.blend(film[-1], following[0], (k + 1) / (FADE + 1))
            for k in range(FADE)
        ]
    pictures[0].save(
        path,
        save_all=True,
        append_images=pictures[1:],
        duration=FRAME_MS,
        loop=0,
        quality=50,
        method=2,
    )


def _view(drive: Scenario) -> View:
    """Returns a view from above and behind, along what is shown."""
    trajectory = plan_drive(drive)
    start, end = (
        trajectory.pose(t / 20.0).translation() for t in (FIRST, LAST)
    )
    ahead = (end - start) / np.linalg.norm(end - start)
    left = np.array([-ahead[1], ahead[0], 0.0])
    return View(
        position=tuple(start - 28.0 * ahead - 12.0 * left + [0, 0, 24.0]),
        target=tuple(start + 0.8 * (end - start)),
        fov_y=50.0,
    )


def _film(drive: Scenario, folder: Path, view: View):
    """Yields the pictures of one drive."""
    width, height = (_SMOOTHING * pixels for pixels in SIZE)
    photograph = StageScene(world_file(drive), drive.without).photograph(
        view, width, height
    )
    still = np.asarray(
        Image.fromarray(photograph).resize(SIZE, Image.Resampling.LANCZOS)
    )
    font = ImageFont.load_default(size=22)
    recorded = open_drive(folder)
    frames = range(FIRST, len(recorded), STEP)
    for i in track(frames, f"stage {drive.stage}", len(frames)):
        pixels = still.copy()
        _draw_scan(pixels, recorded.scan(i), recorded.X_WS[i], view)
        picture = Image.fromarray(pixels)
        pen = ImageDraw.Draw(picture)
        _draw_car(pen, recorded.X_WS[i], view)
        title = f"Metropolis, stage {drive.stage}"
        pen.text(
            (14, 10),
            title,
            "white",
            font,
            stroke_width=2,
            stroke_fill="#303030",
        )
        yield picture


def _draw_scan(
    picture: np.ndarray, scan: np.ndarray, X_WS: np.ndarray, view: View
) -> None:
    p_S = np.stack([scan["x"], scan["y"], scan["z"]], axis=1)
    p_W = p_S @ X_WS[:3, :3].T + X_WS[:3, 3]
    pixels, seen = view.project(p_W, *SIZE)
    column, row = pixels.astype(int).T
    low, high = _HEIGHTS
    shares = np.clip((p_W[seen, 2] - low) / (high - low), 0.0, 1.0)
    colours = matplotlib.colormaps["viridis"](shares)[:, :3]
    picture[row, column] = 255 * colours
    moving = scan["label"][seen] >= _FIRST_MOVING_CLASS
    for down, right in itertools.product((-1, 0, 1), repeat=2):
        rows = np.clip(row[moving] + down, 0, SIZE[1] - 1)
        columns = np.clip(column[moving] + right, 0, SIZE[0] - 1)
        picture[rows, columns] = _MOVING_COLOUR


def _draw_car(pen: ImageDraw.ImageDraw, X_WS: np.ndarray, view: View) -> None:
    p_S = np.array(list(itertools.product(*_CAR)))
    pixels, _ = view.project(p_S @ X_WS[:3, :3].T + X_WS[:3, 3], *SIZE)
    if len(pixels) == len(p_S):
        corners = pixels[ConvexHull(pixels).vertices]
        outline = [tuple(corner) for corner in corners]
        pen.polygon(outline, fill=(235, 60, 60), outline="white")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
