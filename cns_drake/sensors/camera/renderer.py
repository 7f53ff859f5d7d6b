"""The renderers of cameras: their lights, and a check of this machine."""

import functools

import numpy as np
from pydrake.common.value import AbstractValue, Value
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
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import CameraInfo, ImageRgba8U

from cns_drake.sensors.camera.looks import tiling_noise
from evaluation.base import InputError, start_python

# Direction towards the sun.
SUN_W = np.array([-0.5, 0.55, 0.75]) / np.linalg.norm([-0.5, 0.55, 0.75])
# Colour of the sky at the horizon.
HORIZON_RGB = np.array([204.0, 221.0, 237.0]) / 255.0


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


@functools.cache
def _cloud_cover() -> np.ndarray:
    """Returns the cloud cover (N, N) of a part of the sky, from 0 to 1.

    The part can be repeated in both directions without a seam.
    """
    noise = tiling_noise(np.random.default_rng(0), 1.6)[:, :, 0]
    return np.clip(0.9 * noise - 0.1, 0.0, 1.0)


def sky_rgb(d_W: np.ndarray) -> np.ndarray:
    """Returns the colour of the sky, (N, 3) uint8, for directions (N, 3).

    The directions are unit vectors in the world, z up.
    """
    height = np.maximum(d_W[:, 2:], 0.0)
    blue = HORIZON_RGB + height**0.45 * ((0.23, 0.43, 0.78) - HORIZON_RGB)
    # Clouds lie in a plane; their pattern repeats after three times its height.
    cover = _cloud_cover()
    side = len(cover)
    column, row = (d_W[:, :2] / (height + 0.08)).T * side / 3.0
    clouds = cover[row.astype(int) % side, column.astype(int) % side]
    clouds = clouds[:, None] * np.clip(4.0 * height, 0.0, 0.9)
    sun = np.maximum(d_W @ SUN_W, 0.0)[:, None]
    glow = 0.25 * sun**16 + 0.8 * sun**800
    colour = blue + clouds * (0.97 - blue) + glow
    return np.round(255.0 * np.minimum(colour, 1.0)).astype(np.uint8)


class SkyPainter(LeafSystem):
    """Draws the sky in those pixels of an image that show no geometry.

    .. pydrake_system::

        name: SkyPainter
        input_ports:
        - color_image
        - body_pose_in_world
        output_ports:
        - color_image
    """

    def __init__(self, info: CameraInfo):
        """Draws into the images of a pinhole camera."""
        super().__init__()
        rows = np.indices((info.height(), info.width()))
        pixels = np.stack([rows[1], rows[0], np.ones_like(rows[0])], axis=2)
        d_C = pixels @ np.linalg.inv(info.intrinsic_matrix()).T
        self._d_C = d_C / np.linalg.norm(d_C, axis=2, keepdims=True)
        self._image = self.DeclareAbstractInputPort(
            "color_image", Value(ImageRgba8U())
        )
        self._pose = self.DeclareAbstractInputPort(
            "body_pose_in_world", Value(RigidTransform())
        )
        self.DeclareAbstractOutputPort(
            "color_image", lambda: Value(ImageRgba8U()), self._calc_color_image
        )

    def _calc_color_image(
        self, context: Context, output: AbstractValue
    ) -> None:
        image = self._image.Eval(context)
        R_WC = self._pose.Eval(context).rotation().matrix()
        drawn = ImageRgba8U(image.width(), image.height())
        drawn.mutable_data[:] = image.data
        clear = (image.data[:, :, :3] == np.round(255 * HORIZON_RGB)).all(2)
        drawn.mutable_data[clear, :3] = sky_rgb(self._d_C[clear] @ R_WC.T)
        output.set_value(drawn)
