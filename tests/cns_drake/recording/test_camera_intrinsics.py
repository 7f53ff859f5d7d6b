"""The intrinsics in `camera_info` are those of the images that Drake renders.

Oracle: planes in closed form.
"""

import numpy as np
from pydrake.geometry import (
    Box,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    GeometryInstance,
    MakeRenderEngineVtk,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor
import pytest
from scipy.optimize import least_squares

from cns_drake.recording import make_camera_info

INFOS = (
    CameraInfo(64, 48, 1.0),
    CameraInfo(33, 27, 1.9),
    CameraInfo(40, 50, 70.0, 60.0, 30.0, 20.0),
    CameraInfo(3, 90, 0.8),
)
TILTS = ([0.5, 0.4, 0.2], [-0.5, 0.3, 0.0], [0.1, -0.6, 0.7])


def rendered(X_WG, size, port):
    """Returns an image of a box for each camera of INFOS, at the origin."""
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    try:
        renderer = MakeRenderEngineVtk(RenderEngineVtkParams())
    except RuntimeError as error:
        pytest.skip(f"no rendering here: {error}")
    graph.AddRenderer("vtk", renderer)
    box = GeometryInstance(X_WG, Box(*size), "box")
    properties = PerceptionProperties()
    properties.AddProperty("label", "id", RenderLabel(5))
    box.set_perception_properties(properties)
    graph.RegisterAnchoredGeometry(graph.RegisterSource("s"), box)
    cameras = []
    for info in INFOS:
        clipping = ClippingRange(0.05, 100.0)
        core = RenderCameraCore("vtk", info, clipping, RigidTransform())
        depth = DepthRenderCamera(core, DepthRange(0.1, 60.0))
        world = graph.world_frame_id()
        camera = builder.AddSystem(RgbdSensor(world, RigidTransform(), depth))
        builder.Connect(
            graph.get_query_output_port(), camera.query_object_input_port()
        )
        cameras.append(camera)
    context = builder.Build().CreateDefaultContext()
    return [
        getattr(camera, port)()
        .Eval(camera.GetMyContextFromRoot(context))
        .data[:, :, 0]
        .astype(float)
        for camera in cameras
    ]


def published(info):
    message = make_camera_info(info, "eye", 0)
    K = np.array(message.k).reshape(3, 3)
    np.testing.assert_array_equal(np.reshape(message.p, (3, 4))[:, :3], K)
    return K


def rays(K, shape):
    """Returns directions with z = 1 of all pixels."""
    v, u = np.indices(shape)
    return np.stack([u, v, np.ones_like(u)], axis=2) @ np.linalg.inv(K).T


@pytest.mark.slow
def test_depths_are_those_along_the_rays_of_K():
    """The best principal point is the published one, to a 50th of a pixel."""
    planes = []
    for rpy in TILTS:
        X_WG = RigidTransform(RollPitchYaw(*rpy), [0.0, 0.0, 10.0])
        n = X_WG.rotation().matrix()[:, 2]
        images = rendered(
            X_WG, (99.0, 99.0, 0.02), "depth_image_32F_output_port"
        )
        planes.append((n, n @ X_WG.translation() - 0.01, images))
    for k, info in enumerate(INFOS):
        K = published(info)

        def errors(shift, K=K, k=k):
            moved = K.copy()
            moved[:2, 2] += shift
            off = [
                (distance / (rays(moved, images[k].shape) @ n) - images[k])
                for n, distance, images in planes
            ]
            off = np.concatenate([one.ravel() for one in off])
            return off[np.isfinite(off)]

        assert np.abs(errors([0.0, 0.0])).max() < 1e-3
        best = least_squares(errors, [0.1, -0.1], xtol=1e-12).x
        np.testing.assert_allclose(best, 0.0, atol=0.02)


@pytest.mark.slow
def test_edges_of_labels_are_where_K_has_them():
    """The wall fills a quadrant whose corner is ahead; no pixel is off."""
    size = 40.0
    z = 10.0
    for corner in ([0.021, -0.013], [-0.037, 0.045]):
        place = [corner[0] + size / 2, corner[1] + size / 2, z + 0.5]
        images = rendered(
            RigidTransform(place), (size, size, 1.0), "label_image_output_port"
        )
        for info, image in zip(INFOS, images, strict=True):
            p = z * rays(published(info), image.shape)[:, :, :2]
            away = (p - corner) * [info.focal_x(), info.focal_y()] / z
            sure = (np.abs(away) > 0.05).all(axis=2)
            assert sure.mean() > 0.8
            expected = (away > 0.0).all(axis=2)
            np.testing.assert_array_equal((image == 5)[sure], expected[sure])
