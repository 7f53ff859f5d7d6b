"""Adding cameras on a vehicle to a diagram, and recording their images."""

from collections.abc import Callable, Mapping
import logging
import math
from typing import Any

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    RenderCameraCore,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.sensors import (
    CameraInfo,
    ImageDepth32F,
    ImageLabel16I,
    ImageRgba8U,
    RgbdSensor,
)

from cns_drake.recording import (
    ENCODINGS,
    RecordedSensor,
    camera_topic,
    make_camera_info,
    make_compressed_image,
    make_image,
)
from cns_drake.sensors.camera.camera_scene import CameraScene
from cns_drake.sensors.camera.config import CameraSection
from cns_drake.sensors.camera.renderer import RENDERER, SkyPainter

# Near clipping distance [m].
_NEAR = 0.05
# Far clipping distance [m].
_FAR = 2000.0
# Greatest measured depth [m].
_DEEPEST = 250.0
# Drake reserves labels from here on, for pixels without a label.
_RESERVED = 2**15 - 4
# The optical frame looks along z, with x to the right.
_OPTICAL = RigidTransform(
    RotationMatrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), np.zeros(3)
)


def optical_pose(config: CameraSection) -> RigidTransform:
    """Returns the pose X_BC of a camera's optical frame C in base_link (B).

    The axes of C follow the image: x right, y down, z forward.
    """
    return (
        RigidTransform(RollPitchYaw(np.radians(config.rpy_deg)), config.xyz)
        @ _OPTICAL
    )


def add_cameras(
    builder: DiagramBuilder,
    scene: CameraScene,
    base: FrameId,
    cameras: Mapping[str, CameraSection],
) -> dict[str, tuple[OutputPort, RecordedSensor]]:
    """Adds cameras to a diagram.

    Args:
        builder: builder of a diagram with the scene.
        scene: scene that the cameras see.
        base: the vehicle's frame in the original SceneGraph, of which `scene`
            is a copy.
        cameras: name of each camera -> its description.

    Returns:
        Name of a stream of images, such as `front_depth` -> the output port
        that supplies the images, and a description of how they are recorded.
        Connect the output port to the recorder's input port of the same name.
    """
    # Drake warns that 16-bit depth images end at 65 m; no such images are
    # recorded.
    logging.getLogger("drake").addFilter(_is_worth_telling)
    streams = {}
    for name, config in cameras.items():
        info = CameraInfo(
            config.width, config.height, math.radians(config.fov_y_deg)
        )
        X_BC = optical_pose(config)
        sensors = _add_sensors(builder, scene, base, name, info, X_BC)
        color = _add_sky(builder, name, info, sensors["colours"])
        # Kind of stream -> the port of its images, and an image.
        ports = {
            "image": (color, ImageRgba8U()),
            "camera_info": (color, ImageRgba8U()),
        }
        if config.depth:
            depth = sensors["classes"].depth_image_32F_output_port()
            ports["depth"] = depth, ImageDepth32F()
        if config.label:
            label = sensors["classes"].label_image_output_port()
            ports["label"] = label, ImageLabel16I()
        make = _message_makers(info)
        for kind, (port, example) in ports.items():
            topic = camera_topic(name, kind)
            recorded = RecordedSensor(topic, X_BC, make[kind], name, example)
            streams[f"{name}_{kind}"] = port, recorded
    return streams


def _add_sensors(
    builder: DiagramBuilder,
    scene: CameraScene,
    base: FrameId,
    name: str,
    info: CameraInfo,
    X_BC: RigidTransform,
) -> dict[str, RgbdSensor]:
    """Adds a camera's sensor for each copy of the scene.

    For the arguments, see `add_cameras`; X_BC is the camera's optical pose.

    Returns:
        The sensors, by the kind of the copy (see `CameraScene`).
    """
    clipping = ClippingRange(_NEAR, _FAR)
    core = RenderCameraCore(RENDERER, info, clipping, RigidTransform())
    sensors = {}
    for kind, scene_graph in scene.scene_graphs.items():
        # The names cannot clash: no name in a scenario has a minus sign.
        sensors[kind] = builder.AddNamedSystem(
            f"{name}-{kind}",
            RgbdSensor(
                scene.frames[base],
                X_BC,
                ColorRenderCamera(core),
                DepthRenderCamera(core, DepthRange(2 * _NEAR, _DEEPEST)),
            ),
        )
        builder.Connect(
            scene_graph.get_query_output_port(),
            sensors[kind].query_object_input_port(),
        )
    return sensors


def _add_sky(
    builder: DiagramBuilder, name: str, info: CameraInfo, sensor: RgbdSensor
) -> OutputPort:
    """Adds the sky to a camera's colour images; returns their new port."""
    painter = builder.AddNamedSystem(f"{name}-sky", SkyPainter(info))
    for port in (
        sensor.color_image_output_port(),
        sensor.body_pose_in_world_output_port(),
    ):
        builder.Connect(port, painter.GetInputPort(port.get_name()))
    return painter.get_output_port()


def _is_worth_telling(record: logging.LogRecord) -> bool:
    """Returns whether Drake's message is not a warning about 16-bit depths."""
    return "depth_image_16u" not in record.getMessage()


def _message_makers(info: CameraInfo) -> dict[str, Callable[..., Any]]:
    """Returns kind of image -> function that makes its message."""

    def label(image: Any, frame_id: str, stamp_ns: int) -> Any:
        classes = image.data.astype(np.uint16)
        classes[classes >= _RESERVED] = 0
        return make_image(classes, "16UC1", frame_id, stamp_ns)

    return {
        "image": lambda image, frame_id, stamp_ns: make_compressed_image(
            image.data[:, :, :3], frame_id, stamp_ns
        ),
        "depth": lambda image, frame_id, stamp_ns: make_image(
            image.data, ENCODINGS["depth"], frame_id, stamp_ns
        ),
        "label": label,
        "camera_info": lambda image, frame_id, stamp_ns: make_camera_info(
            info, frame_id, stamp_ns
        ),
    }
