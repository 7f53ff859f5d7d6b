"""Pictures of a world by casting rays: no GPU, no display."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform, RotationMatrix

from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scene.perception_geometry import PerceptionGeometry

_SUN_W = np.array([0.45, -0.55, 0.70]) / np.linalg.norm([0.45, -0.55, 0.70])
_SUN_RGB = np.array([1.00, 0.95, 0.86])
_AMBIENT_RGB = np.array([0.52, 0.57, 0.66])
_HORIZON_RGB = np.array([0.83, 0.88, 0.93])
_ZENITH_RGB = np.array([0.42, 0.60, 0.84])
# Distance at which haze has taken two thirds of the contrast [m].
HAZE_LENGTH = 1200.0
_FAR = 5000.0
# Rows that are drawn at once.
_ROWS = 16
_DEFAULT_RGB = (0.7, 0.7, 0.7)


def look_at(p_WC: ArrayLike, p_WT: ArrayLike) -> RigidTransform:
    """Returns X_WC of a camera at C that looks at T, upright.

    The camera frame is x forward, y left, z up.
    """
    forward = np.asarray(p_WT, dtype=float) - np.asarray(p_WC, dtype=float)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    if np.linalg.norm(left) < 1e-6:  # Straight down, north is up.
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
    """Renders a view with sun, shadows, sky light and haze.

    Args:
        scene: the ray-casting scene of `geometries`.
        geometries: give the colours.
        X_WC: camera pose; x forward, y left, z up.
        width: columns [pixel].
        height: rows [pixel].
        fov_y_deg: vertical field of view [deg].
        samples: rays per pixel and axis.
        haze_length: distance at which haze has taken two thirds of the
            contrast; infinite: clear air [m].

    Returns:
        (height, width, 3) uint8 sRGB image.
    """
    rgb = np.array(
        [_DEFAULT_RGB if g.rgb is None else g.rgb for g in geometries]
    )
    image = np.zeros((height, width, 3))
    half_height = np.tan(np.deg2rad(fov_y_deg) / 2.0)
    half_width = half_height * width / height
    # What belongs to a block of rows stays in the processor's cache.
    for first in range(0, height, _ROWS):
        block = image[first : first + _ROWS]
        for k in range(samples**2):
            row = first + np.arange(len(block)) + (k // samples + 0.5) / samples
            column = np.arange(width) + (k % samples + 0.5) / samples
            y = half_width * (1.0 - 2.0 * column / width)
            z = half_height * (1.0 - 2.0 * row / height)
            d_C = np.stack(
                np.broadcast_arrays(1.0, y[None, :], z[:, None]), axis=-1
            ).reshape(-1, 3)
            d_C /= _lengths(d_C)
            d_W = d_C @ X_WC.rotation().matrix().T
            block += _shade(
                scene, rgb, X_WC.translation(), d_W, haze_length
            ).reshape(block.shape)
    srgb = np.clip(image / samples**2, 0.0, 1.0) ** (1.0 / 1.6)
    return np.round(255.0 * srgb).astype(np.uint8)


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
    # rays approximate the shade between other surfaces.
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
    """Returns the free share of short rays around the normal, from 0 to 1."""
    reach = 6.0
    total = np.zeros(len(p_W))
    tilts = ([0.6, 0.3, 0.4], [-0.5, 0.6, 0.5], [0.1, -0.8, 0.3])
    for tilt in tilts:
        d_W = normal + np.asarray(tilt)
        d_W /= _lengths(d_W) + 1e-9
        total += np.minimum(scene.cast_rays(p_W, d_W, reach).ranges, reach)
    return total / (len(tilts) * reach)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    """Returns (N, 1) lengths of vectors (N, 3).

    `numpy.linalg.norm` gives the same, and is slow along a short axis.
    """
    x, y, z = vectors.T
    return np.sqrt(x * x + y * y + z * z)[:, None]
