"""Renders images of a stage by casting rays, without a GPU or a display."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.pictures.camera_views import View
from cns_drake.pictures.city_parts import DEFAULT_RGB
from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import (
    PerceptionGeometry,
    load_world,
    read_perception_geometry,
)

# Direction towards the sun.
_SUN_W = np.array([0.45, -0.55, 0.70]) / np.linalg.norm([0.45, -0.55, 0.70])
_SUN_RGB = np.array([1.00, 0.95, 0.86])
_AMBIENT_RGB = np.array([0.52, 0.57, 0.66])
_HORIZON_RGB = np.array([0.83, 0.88, 0.93])
_ZENITH_RGB = np.array([0.42, 0.60, 0.84])
# Distance at which haze has removed two thirds of the contrast [m].
HAZE_LENGTH = 1200.0
# Range of rays [m].
_FAR = 5000.0
# Secondary rays begin this far above their surface [m].
_SKIN = 0.01
# Between linear light and sRGB values.
_GAMMA = 1.6
# Length of the rays that find the shade between surfaces [m].
_SHADE_REACH = 6.0
# What is added to the normal for the direction of each of these rays.
_TILTS = ((0.6, 0.3, 0.4), (-0.5, 0.6, 0.5), (0.1, -0.8, 0.3))


class StageScene:
    """The geometry of a stage, for pictures.

    Attributes:
        scene: the geometry, on which rays can be cast.
    """

    def __init__(
        self,
        path: Path,
        without: Collection[str] = (),
        model_paths: Collection[str] = (),
    ):
        """Loads an SDF world; the arguments are as for `load_world`.

        Raises:
            InputError: the world cannot be loaded.
        """
        world = load_world(path, without=without, model_paths=model_paths)
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
        [DEFAULT_RGB if g.rgb is None else g.rgb for g in geometries]
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
    srgb = np.clip(image / samples**2, 0.0, 1.0) ** (1.0 / _GAMMA)
    pixels = np.round(255.0 * srgb).astype(np.uint8)
    return pixels.reshape(height, width, 3)


def _shade(
    scene: RayCastingScene,
    rgb: np.ndarray,
    p_WC: np.ndarray,
    d_W: np.ndarray,
    haze_length: float,
) -> np.ndarray:
    """Returns linear colours (N, 3) of rays from C in directions d_W (N, 3).

    `rgb` contains the sRGB colour of each geometry of the scene.
    """
    hits = scene.cast_rays(p_WC, d_W, _FAR, with_normals=True)
    height = np.clip(d_W[:, 2:], 0.0, 1.0) ** 0.6
    color = (1.0 - height) * _HORIZON_RGB + height * _ZENITH_RGB
    hit = np.flatnonzero(hits.geometry >= 0)
    if len(hit) == 0:
        return color
    normal = hits.normals_W[hit].astype(float)
    distance = hits.ranges[hit].astype(float)[:, None]
    p_W = p_WC + distance * d_W[hit] + _SKIN * normal
    facing = normal @ _SUN_W
    sun = np.broadcast_to(_SUN_W, p_W.shape)
    lit = ~np.isfinite(scene.cast_rays(p_W, sun, _FAR).ranges)
    # Walls get 65 % of the sky's light; roofs and streets get all of it. Two
    # short rays approximate the shade between surfaces.
    sky = 0.65 + 0.35 * normal[:, 2]
    sky *= 0.55 + 0.45 * _openness(scene, p_W, normal)
    light = (
        np.where(lit, np.clip(facing, 0.0, None), 0.0)[:, None] * _SUN_RGB
        + sky[:, None] * _AMBIENT_RGB
    )
    albedo = rgb[hits.geometry[hit]] ** _GAMMA
    haze = np.exp(-distance / haze_length)
    color[hit] = haze * albedo * light + (1.0 - haze) * _HORIZON_RGB
    return color


def _openness(
    scene: RayCastingScene, p_W: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Returns which share of the short rays around a normal hits nothing."""
    total = np.zeros(len(p_W))
    for tilt in _TILTS:
        d_W = normal + np.asarray(tilt)
        d_W /= np.linalg.norm(d_W, axis=1, keepdims=True) + 1e-9
        ranges = scene.cast_rays(p_W, d_W, _SHADE_REACH).ranges
        total += np.minimum(ranges, _SHADE_REACH)
    return total / (len(_TILTS) * _SHADE_REACH)
