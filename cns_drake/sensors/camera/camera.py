"""Cameras on a vehicle, and what is recorded of them."""

from collections.abc import Callable, Mapping
import logging
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

from cns_drake.recording import messages
from cns_drake.recording.mcap_recorder import RecordedSensor
from cns_drake.recording.recorded_topics import camera_topic
from cns_drake.sensors.camera.camera_scene import RENDERER, CameraScene
from cns_drake.sensors.camera.config import CameraSection

# What is nearer or farther is not drawn; depths end before that [m].
_NEAREST, _FARTHEST, _DEEPEST = 0.05, 2000.0, 250.0
# Labels from here on are Drake's own: empty, or not to be told.
_RESERVED = 2**15 - 4
# The optical frame looks along z, with x to the right.
_OPTICAL = RigidTransform(
    RotationMatrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), np.zeros(3)
)


def optical_pose(config: CameraSection) -> RigidTransform:
    """Returns the pose X_BC of a camera's optical frame in base_link."""
    return RigidTransform(RollPitchYaw(config.rpy), config.xyz) @ _OPTICAL


def add_cameras(
    builder: DiagramBuilder,
    scene: CameraScene,
    base: FrameId,
    cameras: Mapping[str, CameraSection],
) -> dict[str, tuple[OutputPort, RecordedSensor]]:
    """Adds cameras to a diagram.

    Args:
        builder: holds the scene.
        scene: what they see.
        base: the vehicle's frame, as in the scene that was copied.
        cameras: name -> description.

    Returns:
        Name of a port of the recorder -> what measures, and how it is recorded.
    """
    found = {}
    # It warns that images of depths in 16 bits, of which there are none, end at
    # 65 m.
    logging.getLogger("drake").addFilter(_is_told)
    for name, config in cameras.items():
        info = CameraInfo(config.width, config.height, config.fov_y)
        clipping = ClippingRange(_NEAREST, _FARTHEST)
        core = RenderCameraCore(RENDERER, info, clipping, RigidTransform())
        X_BC = optical_pose(config)
        # No name of a scenario has a minus sign.
        camera = builder.AddNamedSystem(
            f"{name}-camera",
            RgbdSensor(
                scene.frames[base],
                X_BC,
                ColorRenderCamera(core),
                DepthRenderCamera(core, DepthRange(2 * _NEAREST, _DEEPEST)),
            ),
        )
        builder.Connect(
            scene.scene_graph.get_query_output_port(),
            camera.query_object_input_port(),
        )
        color = camera.color_image_output_port(), ImageRgba8U()
        ports = {"image": color, "camera_info": color}
        if config.depth:
            depth = camera.depth_image_32F_output_port()
            ports["depth"] = depth, ImageDepth32F()
        if config.label:
            ports["label"] = camera.label_image_output_port(), ImageLabel16I()
        make = _message_makers(info)
        for kind, (port, example) in ports.items():
            topic = camera_topic(name, kind)
            recorded = RecordedSensor(topic, X_BC, make[kind], name, example)
            found[f"{name}_{kind}"] = port, recorded
    return found


def _is_told(record: logging.LogRecord) -> bool:
    return "depth_image_16u" not in record.getMessage()


def _message_makers(info: CameraInfo) -> dict[str, Callable[..., Any]]:
    """Returns what makes the messages of images of each kind."""

    def label(image: Any, frame_id: str, stamp_ns: int) -> Any:
        classes = image.data.astype(np.uint16)
        classes[classes >= _RESERVED] = 0
        return messages.make_image(classes, "16UC1", frame_id, stamp_ns)

    return {
        "image": lambda image, frame_id, stamp_ns: (
            messages.make_compressed_image(
                image.data[:, :, :3], frame_id, stamp_ns
            )
        ),
        "depth": lambda image, frame_id, stamp_ns: messages.make_image(
            image.data, messages.ENCODINGS["depth"], frame_id, stamp_ns
        ),
        "label": label,
        "camera_info": lambda image, frame_id, stamp_ns: (
            messages.make_camera_info(info, frame_id, stamp_ns)
        ),
    }
