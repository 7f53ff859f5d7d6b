"""ROS 2 messages of what moves: boxes as detections."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.base.recordings.ros_types import DETECTIONS_3D, message_class
from cns_drake.recording.messages import (
    MAP_FRAME,
    make_header,
    make_pose,
    make_vector,
)


class RecordedObject(Protocol):
    """What a recording needs of a vehicle or a walker."""

    @property
    def instance(self) -> int:
        """Its id in points and tables."""
        ...

    @property
    def semantic_class(self) -> str:
        """A key of `CLASS_IDS`."""
        ...

    @property
    def X_WO(self) -> RigidTransform:
        """Pose of the middle of its box."""
        ...

    @property
    def size(self) -> tuple[float, float, float]:
        """Length, width, height of its box [m]."""
        ...


def make_detections(objects: Iterable[RecordedObject], stamp_ns: int) -> Any:
    """Returns a Detection3DArray with the boxes of objects in the map.

    Args:
        objects: all that are there.
        stamp_ns: the time of all of them [ns].
    """
    return message_class(DETECTIONS_3D)(
        header=make_header(MAP_FRAME, stamp_ns),
        detections=[_detection(one, stamp_ns) for one in objects],
    )


def _detection(one: RecordedObject, stamp_ns: int) -> Any:
    pose = make_pose(one.X_WO)
    hypothesis = message_class("vision_msgs/msg/ObjectHypothesis")(
        class_id=one.semantic_class, score=1.0
    )
    certain = message_class("geometry_msgs/msg/PoseWithCovariance")(
        pose=pose, covariance=np.zeros(36)
    )
    result = message_class("vision_msgs/msg/ObjectHypothesisWithPose")(
        hypothesis=hypothesis, pose=certain
    )
    box = message_class("vision_msgs/msg/BoundingBox3D")(
        center=pose, size=make_vector(np.array(one.size))
    )
    return message_class("vision_msgs/msg/Detection3D")(
        header=make_header(MAP_FRAME, stamp_ns),
        results=[result],
        bbox=box,
        id=str(one.instance),
    )
