"""A film of one drive, repeated in every stage of its city."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
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

from cns_drake.motion import Trajectory
from cns_drake.pictures import height_rgb
from cns_drake.scenarios import DrivePlan, Scenario, plan_drive
from cns_drake.sensors import CameraSection, check_renderer, optical_pose
from cns_drake.simulation.loaded_drive import load_drive
from cns_drake.simulation.station import make_station
from evaluation.base import (
    InputError,
    JobError,
    ProcessDiedError,
    Reporter,
    Step,
    check_writable,
    completing,
    doing,
    run_process,
)

# Images per second.
RATE = 10
# Cameras behind and above the car, in its frame; both look ahead and down.
_VIEWS = {
    "film_street": CameraSection(
        xyz=(-9.0, 0.0, 3.6), rpy_deg=(0.0, math.degrees(0.12), 0.0)
    ),
    "film_above": CameraSection(
        xyz=(-28.0, 0.0, 40.0), rpy_deg=(0.0, math.degrees(0.8), 0.0)
    ),
}
# Interval between the times at which a shot may begin [s].
_START_INTERVAL = 0.5
# Quality of a WebP image, from 0 to 100.
_QUALITY = 50
# Number of vehicles, and of pedestrians, in a film of a drive without traffic.
_TRAFFIC = 60


def with_some_traffic(scenario: Scenario) -> Scenario:
    """Adds 60 vehicles and 60 pedestrians to a scenario without traffic.

    A scenario that already has traffic, or whose map has no recorded traffic,
    is returned unchanged.
    """
    has_recorded = scenario.map is not None and (
        scenario.folder.traffic.is_file()
    )
    if not has_recorded or not scenario.traffic.is_off:
        return scenario
    return scenario.with_traffic(_TRAFFIC)


def check_film(path: Path, size: tuple[int, int]) -> None:
    """Checks, before a long run, that a film can be written.

    Raises:
        InputError: the film cannot be written.
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
    traffic: int | None = None,
    on_note: Callable[[str], None] = lambda text: None,
) -> int:
    """Films a drive and its LiDAR points in all stages of the city.

    The film shows the same stretch of the drive once in each stage, as seen
    from behind the car, and then once more in each stage, as seen from above.

    Args:
        scenario: the drive.
        path: file to write, .webp or .mp4.
        seconds: length of the film [s].
        size: width and height of the film's images [pixels].
        start: time of the drive at which the stretch begins [s]; by default the
            stretch whose two ends lie farthest apart is shown.
        traffic: number of vehicles, and of pedestrians, of the map's recorded
            traffic; by default those of the scenario, or 60 if it has none.
        on_note: called with notes for the user.

    Returns:
        The number of images.

    Raises:
        InputError: the drive cannot be run, or the film cannot be written.
    """
    check_film(path, size)
    views = {
        name: view.replaced(width=size[0], height=size[1])
        for name, view in _VIEWS.items()
    }
    if traffic is None:
        scenario = with_some_traffic(scenario)
    else:
        scenario = scenario.with_traffic(traffic)
    scenario = scenario.replaced(cameras=views)
    stages = (
        [scenario.stage]
        if scenario.stage is None or scenario.city.is_made
        else list(scenario.folder.stages())
    )
    of_view = max(1, round(seconds * RATE / len(stages) / len(views)))
    doing("planning the drive")
    times = _shot_times(plan_drive(scenario), of_view, start)
    total = of_view * len(stages) * len(views)
    with tempfile.TemporaryDirectory() as folder:
        for k, stage in enumerate(stages):

            def on_message(
                kind: str, *values: Any, k: int = k, stage: str | None = stage
            ) -> None:
                if kind == "doing":
                    activity, done, number, unit = values
                    if number:  # Of all stages.
                        done = len(views) * (k * of_view + done)
                        doing(activity, done, total, unit)
                    else:
                        doing(f"{stage}: {activity}")
                elif kind == "note":
                    on_note(*values)

            step = _FilmStage(
                scenario.replaced(stage=stage),
                times,
                Path(folder),
                tuple(range(k * of_view, total, of_view * len(stages))),
            )
            try:  # A diagram's memory is freed with its process only.
                run_process(pickle.dumps(step), on_message, lambda: True)
            except (JobError, ProcessDiedError) as error:
                raise InputError(f"{path}: {error}") from None
        doing("writing the film")
        _write_film(path, sorted(Path(folder).iterdir()))
    return total


def _shot_times(
    trajectory: Trajectory, number: int, start: float | None
) -> np.ndarray:
    """Returns the times (N,) of the images of a shot [s].

    If `start` is None, the shot shows that part of the drive, of the shot's
    length, whose two ends lie farthest apart.
    """
    end = trajectory.duration
    moments = np.arange(number) / RATE
    if start is None:
        starts = np.arange(
            0.0, max(end - moments[-1], _START_INTERVAL), _START_INTERVAL
        )
        ends = np.minimum(starts + moments[-1], end)
        way = trajectory.positions(ends) - trajectory.positions(starts)
        start = float(starts[np.argmax(np.linalg.norm(way, axis=1))])
    elif start > end:
        raise InputError(
            f"--start-time: {start:g} s: the drive takes {end:.1f} s"
        )
    return np.minimum(start + moments, end)


def _write_film(path: Path, files: Sequence[Path]) -> None:
    """Writes a film from images; the file gets its name when it is complete."""
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
        words = [
            "ffmpeg",
            "-y",
            "-loglevel",
            "error",
            "-framerate",
            str(RATE),
            "-i",
            str(files[0].parent / "%06d.png"),
            "-f",
            "mp4",
            "-pix_fmt",
            "yuv420p",
            "-movflags",
            "+faststart",
            str(part),
        ]
        done = subprocess.run(words, capture_output=True, check=False)
        if done.returncode:
            fault = " ".join(done.stderr.decode(errors="replace").split())
            raise InputError(f"{path}: ffmpeg: {fault}")


# A point is drawn unless it lies farther than this behind the visible surface
# [m].
_DEPTH_TOLERANCE = 0.4
# Nearer points are not drawn [m].
_NEAREST = 0.1


@dataclass(frozen=True)
class _FilmStage(Step):
    """Takes the images of one stage of a film, as files `<number>.png`.

    Attributes:
        scenario: the drive in that stage, with the cameras of the film.
        times: times at which images are taken [s].
        folder: folder to which the images are written.
        first: for each camera, the number of the camera's first image in the
            film; further images of the camera follow.
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
        title = (
            scenario.name
            if scenario.stage is None
            else f"{scenario.folder.name.capitalize()}, stage {scenario.stage}"
        )
        drive = load_drive(DrivePlan(scenario))
        for text in drive.world.notes:
            reporter.note(text)
        doing("filming", 0, len(self.times), "images")
        diagram = make_station(drive, cameras_see_vehicle=True)
        context = diagram.CreateDefaultContext()
        for k, time in enumerate(self.times):
            context.SetTime(time)
            points = np.concatenate(
                [
                    _world_points(diagram, context, name)
                    for name in scenario.lidars
                ]
            )
            for (name, camera), first in zip(
                scenario.cameras.items(), self.first, strict=True
            ):
                pixels = _image_with_points(
                    diagram, context, name, camera, points
                )
                _with_title(pixels, title).save(
                    self.folder / f"{first + k:06d}.png", compress_level=1
                )
            doing("filming", k + 1, len(self.times), "images")


def _image_with_points(
    diagram: Diagram,
    context: Context,
    name: str,
    camera: CameraSection,
    p_WQset: np.ndarray,
) -> np.ndarray:
    """Returns a camera's image with points p_WQset (N, 3) drawn into it."""
    eye = diagram.GetSubsystemByName(f"{name}-colours")
    depth = eye.depth_image_32F_output_port().Eval(
        eye.GetMyContextFromRoot(context)
    )
    X_WB = RigidTransform(diagram.GetOutputPort("odometry").Eval(context).X_WB)
    image = diagram.GetOutputPort(f"{name}_image").Eval(context)
    pixels = image.data[:, :, :3].copy()
    _draw_points(
        pixels,
        depth.data[:, :, 0],
        X_WB @ optical_pose(camera),
        camera,
        p_WQset,
    )
    return pixels


def _world_points(diagram: Diagram, context: Context, name: str) -> np.ndarray:
    """Returns the (N, 3) points of a LiDAR's scan in the world [m]."""
    scan = diagram.GetOutputPort(f"{name}_scan").Eval(context)
    lidar = diagram.GetSubsystemByName(name)
    X_WS = lidar.GetOutputPort("X_WS").Eval(lidar.GetMyContextFromRoot(context))
    return (X_WS @ np.stack([scan["x"], scan["y"], scan["z"]])).T


def _draw_points(
    pixels: np.ndarray,
    depth: np.ndarray,
    X_WC: RigidTransform,
    camera: CameraSection,
    p_WQset: np.ndarray,
) -> None:
    """Draws the points that a camera sees, coloured by height."""
    # Drake renders with this K if pixel (0, 0) begins at the origin.
    K = CameraInfo(
        camera.width, camera.height, math.radians(camera.fov_y_deg)
    ).intrinsic_matrix()
    x, y, z = K @ (X_WC.inverse() @ p_WQset.T)
    column, row = np.floor([x, y] / np.maximum(z, _NEAREST)).astype(int)
    seen = (z > _NEAREST) & (column >= 0) & (row >= 0)
    seen &= (column < camera.width) & (row < camera.height)
    seen[seen] = z[seen] < depth[row[seen], column[seen]] + _DEPTH_TOLERANCE
    rgb = np.round(255 * height_rgb(p_WQset[seen, 2]))
    pixels[row[seen], column[seen]] = rgb


def _with_title(pixels: np.ndarray, title: str) -> Image.Image:
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
