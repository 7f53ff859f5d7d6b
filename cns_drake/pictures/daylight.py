"""Sky, sun and camera of a Meshcat scene."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat

# Toward the sun: from the south-west, so that the sides in view are lit.
_SUN_W = np.array([-0.50, -0.55, 0.67]) / np.linalg.norm([-0.50, -0.55, 0.67])
# Range around the view in which shadows are cast, and height of their casters
# [m].
_SHADOW_MARGIN = 150.0
_SHADOW_HEIGHT = 120.0
_SHADOW_PIXELS = 4096.0


def set_view(meshcat: Meshcat, lower: np.ndarray, upper: np.ndarray) -> None:
    """Lights a scene by day and looks at it from the air, from the south.

    Args:
        meshcat: the scene.
        lower: (3,) least coordinates of the view [m].
        upper: (3,) greatest coordinates of the view [m].
    """
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    background = "/Background/<object>"
    meshcat.SetProperty(background, "top_color", [0.42, 0.60, 0.84])
    meshcat.SetProperty(background, "bottom_color", [0.90, 0.93, 0.96])
    _set_lights(meshcat, lower, upper)
    center = (lower + upper) / 2.0
    reach = float(np.linalg.norm((upper - lower)[:2])) / 2.0
    # The default camera sees only 100 m far.
    meshcat.SetCamera(
        Meshcat.PerspectiveCamera(fov=50.0, near=0.5, far=20.0 * reach + 500.0)
    )
    # The camera is south of the middle and looks north.
    target = np.array([center[0], center[1] - 0.15 * reach, lower[2]])
    meshcat.SetCameraPose(
        target + np.array([-0.35, -1.05, 0.85]) * max(reach, 10.0) * 1.5,
        target,
    )


def _set_lights(meshcat: Meshcat, lower: np.ndarray, upper: np.ndarray) -> None:
    # These lamps hang near the origin and would light one block only.
    for lamp in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 1.6)
    sun = "/Lights/FillLight/<object>"
    meshcat.SetProperty(sun, "intensity", 2.6)
    # The sun shines toward the origin and casts shadows in a box along its
    # rays; the box has to hold the whole view.
    low = np.array([*(lower[:2] - _SHADOW_MARGIN), lower[2] - 10.0])
    high = np.array([*(upper[:2] + _SHADOW_MARGIN), upper[2] + _SHADOW_HEIGHT])
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8)
    right = np.cross([0.0, 0.0, 1.0], _SUN_W)
    right /= np.linalg.norm(right)
    up = np.cross(_SUN_W, right)
    across, along, toward = np.array([right, up, _SUN_W]) @ corners
    distance = toward.max() + 10.0
    meshcat.SetProperty(sun, "position", list(distance * _SUN_W))
    for name, value in {
        "camera.left": across.min(),
        "camera.right": across.max(),
        "camera.bottom": along.min(),
        "camera.top": along.max(),
        "camera.near": 1.0,
        "camera.far": distance - toward.min() + 10.0,
        "mapSize.x": _SHADOW_PIXELS,
        "mapSize.y": _SHADOW_PIXELS,
        "normalBias": 0.3,
    }.items():
        meshcat.SetProperty(sun, f"shadow.{name}", float(value))
    meshcat.SetProperty(sun, "castShadow", True)
