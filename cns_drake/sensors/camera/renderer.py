"""The renderers of cameras: their lights, and a check of this machine."""

import functools

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngine,
    RenderEngineVtkParams,
    Rgba,
)
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo, ImageRgba8U

from cns_drake.base import InputError, start_python
from cns_drake.sensors.camera.sky import HORIZON_RGB, SUN_W

# Name of the renderers in the SceneGraphs of cameras.
RENDERER = "cameras"
# Pixels of a side of the map of the sun's shadows, over the whole scene.
_SHADOW_PIXELS = 4096
# The sun, and far lamps without shadows in place of the sky: direction that the
# light comes from, strength and colour.
_LIGHTS = [
    LightParameter(
        type="directional",
        frame="world",
        direction=-SUN_W,
        intensity=4.0,
        color=Rgba(1.0, 0.94, 0.84),
    ),
    *(
        LightParameter(
            type="point",
            frame="world",
            position=1e5 * np.array(place),
            intensity=strength,
            color=Rgba(*rgb),
        )
        for place, strength, rgb in (
            ((0.1, -0.2, 1.0), 1.3, (0.75, 0.87, 1.0)),
            ((0.9, 0.3, -0.3), 0.75, (0.9, 0.95, 1.0)),
            ((-0.2, -0.9, -0.3), 0.75, (0.9, 0.95, 1.0)),
            ((-0.7, 0.7, -0.3), 0.65, (1.0, 0.95, 0.9)),
        )
    ),
]


def colour_renderer() -> RenderEngine:
    """Returns a renderer of colour images, with sun and shadows."""
    return MakeRenderEngineVtk(
        RenderEngineVtkParams(
            default_clear_color=HORIZON_RGB,
            lights=_LIGHTS,
            cast_shadows=True,
            shadow_map_size=_SHADOW_PIXELS,
        )
    )


def class_renderer() -> RenderEngine:
    """Returns a renderer of depth and label images."""
    return MakeRenderEngineVtk(RenderEngineVtkParams())


@functools.cache
def check_renderer() -> None:
    """Checks that Drake can render images on this machine.

    The check renders in a second process, because rendering without EGL kills
    the process.

    Raises:
        InputError: Drake cannot render here.
    """
    process = start_python(__name__)
    process.communicate()
    if process.returncode:
        raise InputError(
            "cameras: no renderer: Drake cannot draw here, for lack of EGL "
            "(Debian: apt install libegl1)"
        )


if __name__ == "__main__":
    core = RenderCameraCore(
        RENDERER,
        CameraInfo(4, 4, 1.0),
        ClippingRange(1.0, 2.0),
        RigidTransform(),
    )
    class_renderer().RenderColorImage(
        ColorRenderCamera(core), ImageRgba8U(4, 4)
    )
