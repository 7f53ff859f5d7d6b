"""A stage of a city, of which images and scans can be made.

Images are rendered by casting rays, without a GPU or a display.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydrake.math import RigidTransform, RotationMatrix

from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scene.perception_geometry import (
    PerceptionGeometry,
    read_perception_geometry,
)
from cns_drake.scene.world import load_world

_Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = tuple[_Coordinate, _Coordinate, _Coordinate]

_SUN_W = np.array([0.45, -0.55, 0.70]) / np.linalg.norm([0.45, -0.55, 0.70])
_SUN_RGB = np.array([1.00, 0.95, 0.86])
_AMBIENT_RGB = np.array([0.52, 0.57, 0.66])
_HORIZON_RGB = np.array([0.83, 0.88, 0.93])
_ZENITH_RGB = np.array([0.42, 0.60, 0.84])
# Distance at which haze has removed two thirds of the contrast [m].
HAZE_LENGTH = 1200.0
_FAR = 5000.0
_DEFAULT_RGB = (0.7, 0.7, 0.7)


class View(BaseModel):
    """The position and direction of a camera.

    Attributes:
        position: position of the camera in W [m].
        target: point in W that is in the centre of the picture [m].
        fov_y_deg: vertical field of view [deg].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    position: Place
    target: Place
    fov_y_deg: float = Field(default=50.0, ge=0.1, le=179.0)

    @model_validator(mode="before")
    @classmethod
    def _names_its_unit(cls, values: Any) -> Any:
        if isinstance(values, dict) and "fov_y" in values:
            raise ValueError("fov_y: this field is now fov_y_deg")
        return values

    @model_validator(mode="after")
    def _looks_somewhere(self) -> View:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("position and target are the same")
        return self

    def pose(self) -> RigidTransform:
        """Returns the pose X_WC of the camera, with x forward, y left, z up."""
        return look_at(self.position, self.target)

    def project(
        self, p_WQset: np.ndarray, width: int, height: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns where points are in the picture of the camera.

        Points outside the picture are left out, but not points that an object
        hides.

        Args:
            p_WQset: (N, 3) points in W [m].
            width, height: size of the picture [pixels].

        Returns:
            (M, 2) positions in the picture, from its upper left corner
            [pixels]; the indices (M,) of these points.
        """
        scale = height / 2 / np.tan(np.deg2rad(self.fov_y_deg) / 2)
        p_C = (self.pose().inverse() @ p_WQset.T).T
        ahead = np.flatnonzero(p_C[:, 0] > 0.1)
        slopes = p_C[ahead, 1:] / p_C[ahead, :1]
        pixels = np.array([width, height]) / 2 - scale * slopes
        inside = ((pixels > 0) & (pixels < [width, height])).all(axis=1)
        return pixels[inside], ahead[inside]


class StageScene:
    """The geometry of a stage, for pictures.

    Attributes:
        scene: the geometry, on which rays can be cast.
    """

    def __init__(self, path: Path, without: Collection[str] = ()):
        """Loads an SDF world.

        Raises:
            InputError: the world cannot be loaded.
        """
        world = load_world(path, without=without)
        self._geometries = read_perception_geometry(
            world.scene_graph.model_inspector()
        )
        self.scene = RayCastingScene(
            self._geometries,
            {geometry.frame_id for geometry in self._geometries},
            lambda frame_id: RigidTransform(),
        )

    def photograph(
        self,
        view: View,
        width: int,
        height: int,
        haze_length: float = HAZE_LENGTH,
    ) -> np.ndarray:
        """Returns a rendered picture of a view, (height, width, 3) uint8.

        Args:
            view: position and direction of the camera.
            width, height: size of the picture [pixels].
            haze_length: distance at which haze has removed two thirds of the
                contrast [m]; infinite for clear air.
        """
        return render(
            self.scene,
            self._geometries,
            view.pose(),
            width=width,
            height=height,
            fov_y_deg=view.fov_y_deg,
            haze_length=haze_length,
        )


def look_at(p_WC: ArrayLike, p_WT: ArrayLike) -> RigidTransform:
    """Returns the pose X_WC of an upright camera at C that looks at T.

    The camera frame is x forward, y left, z up.
    """
    forward = np.asarray(p_WT, dtype=float) - np.asarray(p_WC, dtype=float)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    if np.linalg.norm(left) < 1e-6:  # If it looks straight down, north is up.
        left = np.array([-1.0, 0.0, 0.0])
    left /= np.linalg.norm(left)
    up = np.cross(forward, left)
    R_WC = RotationMatrix(np.column_stack([forward, left, up]))
    return RigidTransform(R_WC, p_WC)


def render(
    scene: RayCastingScene,
    geometries: Sequence[PerceptionGeometry],
    X_WC: RigidTransform,
    *,
    width: int = 960,
    height: int = 540,
    fov_y_deg: float = 50.0,
    samples: int = 2,
    haze_length: float = HAZE_LENGTH,
) -> np.ndarray:
    """Returns an image of a scene with sun, shadows, sky light and haze.

    Args:
        scene: the scene, on which rays are cast.
        geometries: the scene's geometries, in order, with their colours.
        X_WC: pose of the camera: x forward, y left, z up.
        width, height: size of the image in pixels.
        fov_y_deg: vertical field of view [deg].
        samples: number of rays per pixel along each axis.
        haze_length: distance at which haze has removed two thirds of the
            contrast [m]; infinite for clear air.

    Returns:
        (height, width, 3) uint8 sRGB image.
    """
    rgb = np.array(
        [_DEFAULT_RGB if g.rgb is None else g.rgb for g in geometries]
    )
    image = np.zeros((height * width, 3))
    half_height = np.tan(np.deg2rad(fov_y_deg) / 2.0)
    half_width = half_height * width / height
    for k in range(samples**2):
        row = np.arange(height) + (k // samples + 0.5) / samples
        column = np.arange(width) + (k % samples + 0.5) / samples
        y = half_width * (1.0 - 2.0 * column / width)
        z = half_height * (1.0 - 2.0 * row / height)
        d_C = np.stack(
            np.broadcast_arrays(1.0, y[None, :], z[:, None]), axis=-1
        ).reshape(-1, 3)
        d_C /= np.linalg.norm(d_C, axis=1, keepdims=True)
        d_W = d_C @ X_WC.rotation().matrix().T
        image += _shade(scene, rgb, X_WC.translation(), d_W, haze_length)
    srgb = np.clip(image / samples**2, 0.0, 1.0) ** (1.0 / 1.6)
    pixels = np.round(255.0 * srgb).astype(np.uint8)
    return pixels.reshape(height, width, 3)


def _shade(
    scene: RayCastingScene,
    rgb: np.ndarray,
    p_WC: np.ndarray,
    d_W: np.ndarray,
    haze_length: float,
) -> np.ndarray:
    hits = scene.cast_rays(p_WC, d_W, _FAR, with_normals=True)
    height = np.clip(d_W[:, 2:], 0.0, 1.0) ** 0.6
    color = (1.0 - height) * _HORIZON_RGB + height * _ZENITH_RGB
    hit = np.flatnonzero(hits.geometry >= 0)
    if len(hit) == 0:
        return color
    normal = hits.normals_W[hit].astype(float)
    distance = hits.ranges[hit].astype(float)[:, None]
    p_W = p_WC + distance * d_W[hit] + 0.01 * normal
    facing = normal @ _SUN_W
    sun = np.broadcast_to(_SUN_W, p_W.shape)
    lit = ~np.isfinite(scene.cast_rays(p_W, sun, _FAR).ranges)
    # Walls get half of the sky's light, roofs and streets all of it. Two short
    # rays approximate the shade between surfaces.
    sky = 0.65 + 0.35 * normal[:, 2]
    sky *= 0.55 + 0.45 * _openness(scene, p_W, normal)
    light = (
        np.where(lit, np.clip(facing, 0.0, None), 0.0)[:, None] * _SUN_RGB
        + sky[:, None] * _AMBIENT_RGB
    )
    albedo = rgb[hits.geometry[hit]] ** 1.6
    haze = np.exp(-distance / haze_length)
    color[hit] = haze * albedo * light + (1.0 - haze) * _HORIZON_RGB
    return color


def _openness(
    scene: RayCastingScene, p_W: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Returns the share of short rays around the normal that hit nothing."""
    reach = 6.0
    total = np.zeros(len(p_W))
    tilts = ([0.6, 0.3, 0.4], [-0.5, 0.6, 0.5], [0.1, -0.8, 0.3])
    for tilt in tilts:
        d_W = normal + np.asarray(tilt)
        d_W /= np.linalg.norm(d_W, axis=1, keepdims=True) + 1e-9
        total += np.minimum(scene.cast_rays(p_W, d_W, reach).ranges, reach)
    return total / (len(tilts) * reach)
