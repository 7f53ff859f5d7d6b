"""The recorder's ports of LiDARs, cameras and objects, and their messages."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import (
    CameraInfo,
    ImageDepth32F,
    ImageLabel16I,
    ImageRgba8U,
)

from cns_drake.base.drives.point_layouts import to_labels, to_layout
from cns_drake.recording import messages
from cns_drake.recording.input_values import declare_object, value_of
from cns_drake.recording.messages import (
    ENCODINGS,
    make_camera_info,
    make_image,
)
from cns_drake.recording.object_messages import (
    BoxMessages,
    marked_boxes,
    marked_detections,
    motion_table,
)
from cns_drake.recording.recorded_topics import (
    BOXES_TOPIC,
    MOTION_TOPIC,
    OBJECTS_TOPIC,
    camera_info_topic,
    image_topic,
    labels_topic,
    points_topic,
)
from cns_drake.recording.rosbag2_metadata import Topic

_IMAGES = {
    "color": ImageRgba8U,
    "depth": ImageDepth32F,
    "label": ImageLabel16I,
}


class RecordedCamera(NamedTuple):
    """A camera of a recording.

    Attributes:
        info: its intrinsics.
        X_BC: pose of its optical frame C (z ahead, y down) in the sensor's
            frame B, whose pose is on the port `<camera>_pose`.
    """

    info: CameraInfo
    X_BC: RigidTransform


class ScanPort:
    """The port `<lidar>_scan`."""

    def __init__(self, system: LeafSystem, name: str, layout: str):
        """Declares the port of a LiDAR with a layout of its points."""
        self._name, self._layout = name, layout
        self._scan = declare_object(system, f"{name}_scan")
        self.due_topic = points_topic(name)

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of points, and of labels beside them."""
        scan = value_of(self._scan, context)
        if scan is None:
            return {}
        outgoing = {
            self.due_topic: messages.encode_point_cloud(
                to_layout(scan, self._layout), self._name, stamp_ns
            )
        }
        if self._layout != "cns":
            outgoing[labels_topic(self._name)] = messages.encode_point_cloud(
                to_labels(scan), self._name, stamp_ns
            )
        return outgoing


class CameraPorts:
    """The ports `<camera>_color`, `<camera>_depth` and `<camera>_label`."""

    def __init__(self, system: LeafSystem, name: str, camera: RecordedCamera):
        """Declares the ports of a camera."""
        self._name, self._info = name, camera.info
        self._images = {
            kind: system.DeclareAbstractInputPort(
                f"{name}_{kind}", Value(image())
            )
            for kind, image in _IMAGES.items()
        }
        self.due_topic = camera_info_topic(name)

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of images, and of the intrinsics."""
        outgoing = {}
        for kind, port in self._images.items():
            image = value_of(port, context)
            if image is not None:
                outgoing[image_topic(self._name, kind)] = make_image(
                    image.data, ENCODINGS[kind], self._name, stamp_ns
                )
        if outgoing:
            outgoing[self.due_topic] = make_camera_info(
                self._info, self._name, stamp_ns
            )
        return outgoing


class ObjectsPort:
    """The port `objects`."""

    due_topic = OBJECTS_TOPIC

    def __init__(self, system: LeafSystem):
        """Declares the port."""
        self._objects = declare_object(system, "objects")
        self._detections = BoxMessages(marked_detections)
        self._boxes = BoxMessages(marked_boxes)

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of moving objects."""
        objects = value_of(self._objects, context)
        if objects is None:
            return {}
        return {
            OBJECTS_TOPIC: self._detections.encode(objects, stamp_ns),
            BOXES_TOPIC: self._boxes.encode(objects, stamp_ns),
            MOTION_TOPIC: messages.encode_point_cloud(
                motion_table(objects), messages.MAP_FRAME, stamp_ns
            ),
        }
