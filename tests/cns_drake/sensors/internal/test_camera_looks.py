"""Textures of what cameras see, and where they lie."""

import io

import numpy as np
from PIL import Image
from pydrake import geometry
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo, ImageRgba8U
import pytest

from cns_drake.sensors.camera import camera_scene, looks, renderer
from cns_drake.sensors.camera.camera_scene import repeated_coordinates


@pytest.mark.parametrize("name", looks.LOOKS)
def test_a_texture_keeps_the_colour_of_its_surface(name):
    """Up to what is clipped and rounded; a face has its own colours."""
    png, white = looks.texture(name)
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGBA")) / 255.0
    assert pixels.shape == (512, 512, 4)
    light = white * pixels[pixels[:, :, 3] > 0.0][:, :3] ** 2.2
    if looks.LOOKS[name].is_face:
        assert white == 1.0
    else:
        assert light.mean() == pytest.approx(1.0, abs=0.02)
    # Leaves alone have gaps.
    assert (pixels[:, :, 3].min() == 0.0) == (name == "leaves")


def test_grey_is_twice_as_bright_as_half_of_it():
    """On a screen, in the same light; with each release of Drake."""
    lamp = geometry.LightParameter(type="directional", frame="camera")
    size = 64, 48
    camera = geometry.ColorRenderCamera(
        geometry.RenderCameraCore(
            "",
            CameraInfo(*size, 1.0),
            geometry.ClippingRange(0.1, 100.0),
            RigidTransform(),
        )
    )
    corners = 50.0 * np.array(
        [
            [[-1, -1, 0], [1, -1, 0], [1, 1, 0]],
            [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]],
        ]
    )
    brightness = []
    for grey in (0.3, 0.6):
        engine = geometry.MakeRenderEngineVtk(
            geometry.RenderEngineVtkParams(lights=[lamp])
        )
        mesh = camera_scene.make_mesh(
            corners,
            np.zeros(3),
            np.full((2, 3), grey),
            "asphalt",
            np.zeros(2, int),
            np.array([[0.0, 0.0, 1.0]]),
        )
        engine.RegisterVisual(
            geometry.GeometryId.get_new_id(),
            mesh,
            geometry.PerceptionProperties(),
            RigidTransform(),
            False,
        )
        engine.UpdateViewpoint(
            RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0, 0, 9.0])
        )
        image = ImageRgba8U(*size)
        engine.RenderColorImage(camera, image)
        brightness.append(image.data[:, :, :3].mean())
    assert brightness[1] / brightness[0] == pytest.approx(2.0, rel=0.08)


@pytest.mark.parametrize("heading", [0.0, 0.3, 2.0, -2.5])
def test_walls_have_heights_in_rows_and_metres_across(heading):
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    across = np.array([-ahead[1], ahead[0], 0.0])
    corners = np.array([[100 * ahead + s * across + (0, 0, h)
                         for s, h in ((0, 0), (2, 0), (2, 3))]])  # fmt: skip
    places = repeated_coordinates(corners, ahead[None])[0]
    step = places - places[0]
    # Seen from outside, left of a wall that looks ahead is its right hand.
    np.testing.assert_allclose(step, [(0, 0), (2, 0), (2, -3)], atol=5e-3)


def test_the_sky_is_brighter_below_and_brightest_at_the_sun():
    tilt = np.deg2rad([1.0, 30.0, 85.0])
    d_W = np.stack([np.cos(tilt), 0 * tilt, np.sin(tilt)], axis=1)
    colours = renderer.sky_rgb(np.vstack([d_W, renderer.SUN_W])).astype(int)
    assert colours[0, 0] > colours[2, 0]
    assert (colours[3] == 255).all()
    assert (colours[:, 2] >= colours[:, 0]).all()
