"""The images of a film that show one stage of a city."""

from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram
from pydrake.systems.sensors import CameraInfo

from cns_drake.base import Reporter, Step, doing
from cns_drake.pictures import height_rgb
from cns_drake.scenarios import DrivePlan, Scenario
from cns_drake.sensors import CameraSection, optical_pose
from cns_drake.simulation.loaded_drive import load_drive
from cns_drake.simulation.station import make_station

# A point is drawn unless it lies farther than this behind the visible surface
# [m].
_DEPTH_TOLERANCE = 0.4
# Nearer points are not drawn [m].
_NEAREST = 0.1


@dataclass(frozen=True)
class FilmStage(Step):
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
