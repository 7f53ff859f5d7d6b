"""A film of a drive through all stages of its city."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
import pickle
import shutil
import subprocess
import tempfile
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram
from pydrake.systems.sensors import CameraInfo

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_writable, completing
from cns_drake.base.jobs.processes import (
    JobError,
    ProcessDiedError,
    run_process,
)
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.motion.trajectory import Trajectory
from cns_drake.pictures.meshcat_drawing import height_rgb
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files, map_folder
from cns_drake.sensors.camera.camera import optical_pose
from cns_drake.sensors.camera.camera_scene import check_renderer
from cns_drake.sensors.camera.config import CameraSection
from cns_drake.simulation import loaded_drive
from cns_drake.simulation.station import make_station
from cns_drake.traffic.vehicles import room_for_vehicles
from cns_drake.traffic.walkers import room_for_walkers

# Images a second.
RATE = 10
# Behind the car and above it, in its frame; both look ahead and down.
_VIEWS = {
    "film_street": CameraSection(xyz=(-9.0, 0.0, 3.6), rpy=(0.0, 0.12, 0.0)),
    "film_above": CameraSection(xyz=(-28.0, 0.0, 40.0), rpy=(0.0, 0.8, 0.0)),
}
# A point this far behind what a camera sees is still drawn [m].
_BEHIND = 0.4
# Where a shot may begin, every so often [s].
_PLACES = 0.5
_QUALITY = 50
_TRAFFIC = 60


def with_some_traffic(scenario: Scenario) -> Scenario:
    """Returns a scenario with traffic, if its streets have room for it."""
    folder = map_folder(scenario)
    is_possible = folder.roads.is_file() or folder.lanes.is_file()
    if scenario.map is None or not is_possible or not scenario.traffic.is_off:
        return scenario
    graph, walkways, _ = loaded_drive.load_ways(folder)
    room = min(room_for_vehicles(graph), room_for_walkers(walkways))
    return scenario if room < _TRAFFIC else scenario.with_traffic(_TRAFFIC)


def check_film(path: Path, size: tuple[int, int]) -> None:
    """Checks, before a long run, that a film can be written.

    Raises:
        InputError: it cannot.
    """
    if path.suffix not in (".webp", ".mp4"):
        raise InputError(f"{path}: the name of a film ends in .webp or .mp4")
    if path.suffix == ".mp4":
        if shutil.which("ffmpeg") is None:
            raise InputError(
                f"{path}: there is no ffmpeg, which writes .mp4; take .webp"
            )
        if any(side % 2 for side in size):
            raise InputError(
                f"{path}: the sides of an .mp4 are even numbers of pixels, not "
                f"{size[0]}x{size[1]}"
            )
    check_writable(path)
    check_renderer()


def make_film(
    scenario: Scenario,
    path: Path,
    *,
    seconds: float = 20.0,
    size: tuple[int, int] = (640, 360),
    start: float | None = None,
    on_frame: Callable[[int, int], None] = lambda done, total: None,
    on_note: Callable[[str], None] = lambda text: None,
) -> int:
    """Films a drive, and what its LiDARs measure, in all stages of its city.

    The film shows the same place from behind the car in each stage, then from
    above.

    Args:
        scenario: the drive.
        path: file to write, .webp or .mp4.
        seconds: length of the film [s].
        size: width and height of its images [pixels].
        start: time of the drive at which each shot begins [s]; by default
            where the way ahead is straightest.
        on_frame: called with the progress.
        on_note: called with notes for the user.

    Returns:
        The number of images.

    Raises:
        InputError: the drive cannot be run, or the film not be written.
    """
    check_film(path, size)
    check_files(scenario)
    width, height = size
    views = {
        name: view.replaced(width=width, height=height)
        for name, view in _VIEWS.items()
    }
    scenario = scenario.replaced(cameras=views)
    stages: list[str | None] = [scenario.stage]
    if scenario.stage is not None:
        stages = list(map_folder(scenario).stages())
    of_view = max(1, round(seconds * RATE / len(stages) / len(views)))
    times = _times(plan_drive(scenario), of_view, start)
    total = of_view * len(stages) * len(views)
    with tempfile.TemporaryDirectory() as folder:
        for k, stage in enumerate(stages):

            def on_message(
                kind: str, *values: Any, done: int = total // len(stages) * k
            ) -> None:
                if kind == "progress":
                    on_frame(done + values[0], total)
                elif kind == "note":
                    on_note(*values)

            first = range(k * of_view, total, of_view * len(stages))
            own = scenario.replaced(stage=stage)
            step = FilmStage(own, times, Path(folder), tuple(first))
            # A diagram's memory is freed with its process only.
            try:
                run_process(pickle.dumps(step), on_message, lambda: True)
            except (JobError, ProcessDiedError) as error:
                raise InputError(str(error)) from None
        _write(path, sorted(Path(folder).iterdir()))
    return total


@dataclass(frozen=True)
class FilmStage(Step):
    """Takes the images of one stage, as `<number>.png`.

    Attributes:
        scenario: the drive in that stage, with the cameras of the film.
        times: when images are taken [s].
        folder: where they are written.
        first: number of each camera's first image in the film.
    """

    scenario: Scenario
    times: np.ndarray
    folder: Path
    first: tuple[int, ...]

    @property
    def output(self) -> None:
        return None

    def is_done(self) -> bool:
        return False

    def run(self, reporter: Reporter) -> None:
        scenario = self.scenario
        if not scenario.traffic.is_off:
            reporter.note(f"stage {scenario.stage}: planning the traffic")
        world, traffic, trajectory = loaded_drive.load_stage_and_traffic(
            scenario, plan_drive(scenario)
        )
        for text in world.notes:
            reporter.note(text)
        diagram = make_station(
            scenario,
            world=world,
            trajectory=trajectory,
            traffic=traffic,
            cameras_see_vehicle=True,
        )
        context = diagram.CreateDefaultContext()
        title, done = scenario.name, 0
        if scenario.stage is not None:
            name = map_folder(scenario).name.capitalize()
            title = f"{name}, stage {scenario.stage}"
        for k, time in enumerate(self.times):
            context.SetTime(time)
            points = np.concatenate(
                [_scan(diagram, context, name) for name in scenario.lidars]
            )
            for name, first in zip(scenario.cameras, self.first, strict=True):
                camera = scenario.cameras[name]
                pixels = _picture(diagram, context, name, camera, points)
                _titled(pixels, title).save(
                    self.folder / f"{first + k:06d}.png", compress_level=1
                )
                done += 1
                reporter.progress(done, len(self.times) * len(self.first))


def _times(
    trajectory: Trajectory, count: int, start: float | None
) -> np.ndarray:
    """Returns the (N,) times of a shot [s].

    Raises:
        InputError: the start is not within the drive.
    """
    end = trajectory.duration
    if start is None:
        starts = np.arange(0.0, max(end - count / RATE, _PLACES), _PLACES)
        R_WBs, p_WBs = trajectory.poses(
            np.minimum(starts[:, None] + np.arange(count) / RATE, end).ravel()
        )
        ahead = np.array(R_WBs)[:, :, 0].reshape(-1, count, 3)
        places = np.reshape(p_WBs, (-1, count, 3))
        way = np.linalg.norm(places[:, -1] - places[:, 0], axis=1)
        bend = np.linalg.norm(ahead - ahead[:, :1], axis=2).max(axis=1)
        start = float(starts[np.argmax(way - 100.0 * bend)])
    elif start > end:
        raise InputError(f"--start: {start:g} s: the drive takes {end:.1f} s")
    return np.minimum(start + np.arange(count) / RATE, end)


def _picture(
    diagram: Diagram,
    context: Context,
    name: str,
    camera: CameraSection,
    p_WQset: np.ndarray,
) -> np.ndarray:
    """Returns what a camera sees, with the points (N, 3) in the world."""
    eye = diagram.GetSubsystemByName(f"{name}-colours")
    own = eye.GetMyContextFromRoot(context)
    depth = eye.depth_image_32F_output_port().Eval(own).data[:, :, 0]
    X_WB = RigidTransform(diagram.GetOutputPort("odometry").Eval(context).X_WB)
    image = diagram.GetOutputPort(f"{name}_image").Eval(context)
    pixels = image.data[:, :, :3].copy()
    _draw_points(pixels, depth, X_WB @ optical_pose(camera), camera, p_WQset)
    return pixels


def _scan(diagram: Diagram, context: Context, name: str) -> np.ndarray:
    """Returns the (N, 3) points of a LiDAR's scan in the world [m]."""
    scan = diagram.GetOutputPort(f"{name}_scan").Eval(context)
    lidar = diagram.GetSubsystemByName(name)
    own = lidar.GetMyContextFromRoot(context)
    X_WS = lidar.GetOutputPort("X_WS").Eval(own)
    return (X_WS @ np.stack([scan["x"], scan["y"], scan["z"]])).T


def _draw_points(
    pixels: np.ndarray,
    depth: np.ndarray,
    X_WC: RigidTransform,
    camera: CameraSection,
    p_WQset: np.ndarray,
) -> None:
    """Draws the points that a camera sees, coloured by height."""
    K = CameraInfo(camera.width, camera.height, camera.fov_y).intrinsic_matrix()
    x, y, z = K @ (X_WC.inverse() @ p_WQset.T)
    ahead = z > 0.1
    x, y, z, heights = (a[ahead] for a in (x, y, z, p_WQset[:, 2]))
    column, row = np.floor([x / z, y / z]).astype(int)
    inside = (column >= 0) & (column < camera.width)
    inside &= (row >= 0) & (row < camera.height)
    column, row, z, heights = (a[inside] for a in (column, row, z, heights))
    seen = z < depth[row, column] + _BEHIND
    rgb = np.round(255 * height_rgb(heights[seen]))
    size = max(1, round(camera.height / 360))
    for down, right in np.ndindex(size, size):
        rows = np.minimum(row[seen] + down, camera.height - 1)
        columns = np.minimum(column[seen] + right, camera.width - 1)
        pixels[rows, columns] = rgb


def _titled(pixels: np.ndarray, title: str) -> Image.Image:
    image = Image.fromarray(pixels)
    size = max(image.height // 16, 8)
    ImageDraw.Draw(image).text(
        (size // 2, size // 3),
        title,
        "white",
        ImageFont.load_default(size=size),
        stroke_width=max(size // 12, 1),
        stroke_fill="#303030",
    )
    return image


def _write(path: Path, files: Sequence[Path]) -> None:
    """Writes a film of images, which gets its name when it is complete."""
    with completing(path) as part:
        if path.suffix == ".webp":
            first, *others = map(Image.open, files)
            first.save(
                part,
                "WEBP",
                save_all=True,
                append_images=others,
                duration=1000 // RATE,
                quality=_QUALITY,
                method=4,
            )
            return
        words = ["ffmpeg", "-y", "-loglevel", "error", "-framerate", str(RATE)]
        words += ["-i", str(files[0].parent / "%06d.png"), "-f", "mp4"]
        words += ["-pix_fmt", "yuv420p", "-movflags", "+faststart", str(part)]
        done = subprocess.run(words, capture_output=True, check=False)
        if done.returncode:
            fault = " ".join(done.stderr.decode(errors="replace").split())
            raise InputError(f"{path}: ffmpeg: {fault}")
