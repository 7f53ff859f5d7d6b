"""ROS 2 message types: Python classes, definitions, hashes, serialisation.

Most types come from rosbags' table of ROS 2 Humble. The types that this table
lacks are in the module `messages`: the types of vision_msgs in version 4, as in
Humble, and the types of foxglove_msgs after Foxglove's schemas. A recording
contains the definitions of its message types.
"""

from collections.abc import Mapping
import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
PATH = "nav_msgs/msg/Path"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TRANSFORM = "geometry_msgs/msg/TransformStamped"
# Points of Livox's driver for ROS 2, and of the one for ROS 1, which are alike.
LIVOX = "livox_ros_driver2/msg/CustomMsg"
LIVOX_1 = "livox_ros_driver/msg/CustomMsg"
# Types of point clouds.
CLOUDS = (POINT_CLOUD, LIVOX, LIVOX_1)
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
DETECTIONS_3D = "vision_msgs/msg/Detection3DArray"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"

_FOLDER = Path(__file__).with_name("messages")


@functools.cache
def known_types() -> Typestore:
    """Returns the table of message types, which takes long to make."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    for path in sorted(_FOLDER.glob("*/msg/*.msg")):
        name = path.relative_to(_FOLDER).with_suffix("").as_posix()
        types.register(get_types_from_msg(path.read_text("utf-8"), name))
    return types


def message_class(message_type: str) -> type:
    """Returns the Python class of a message type."""
    return known_types().types[message_type]


def make_message(message_type: str, **fields: Any) -> Any:
    """Returns a message made from plain values.

    Fields that are left out are zero or empty. The value for a field that is
    itself a message can be a message, a mapping of that message's fields, or a
    sequence of all its fields.
    """
    _, kinds = known_types().fielddefs[message_type]
    values = {
        name: _field_value(kind, fields.pop(name, None)) for name, kind in kinds
    }
    return message_class(message_type)(**values, **fields)


def _field_value(kind: tuple, given: Any) -> Any:
    """Converts a value to the type of a message's field; None becomes zero."""
    node, inner = kind
    if node is Nodetype.NAME:
        if dataclasses.is_dataclass(given):
            return given
        if given is not None and not isinstance(given, Mapping):
            names = [name for name, _ in known_types().fielddefs[inner][1]]
            given = dict(zip(names, given, strict=True))
        return make_message(inner, **(given or {}))
    if node is Nodetype.BASE:
        python_type = {"string": str, "bool": bool}.get(
            inner[0], float if inner[0].startswith("float") else int
        )
        return python_type() if given is None else python_type(given)
    element, length = inner
    if element[0] is Nodetype.NAME:
        return [_field_value(element, entry) for entry in given or ()]
    scalar = element[1][0]
    return (
        np.zeros(length, scalar) if given is None else np.asarray(given, scalar)
    )


def message_definition(message_type: str) -> str:
    """Returns the .msg text of a type and of all types that it contains."""
    text, _ = known_types().generate_msgdef(message_type, ros_version=2)
    return text


def message_hash(message_type: str) -> str:
    """Returns the hash of a message type in REP-2011 form (`RIHS01_...`)."""
    return known_types().hash_rihs01(message_type)


def serialize(message: Any) -> bytes:
    """Returns a message, also one of ROS 1, serialised as CDR."""
    return bytes(
        known_types().serialize_cdr(message, _known(message.__msgtype__))
    )


def deserialize(data: bytes | memoryview, message_type: str) -> Any:
    """Returns the message of a given type from bytes serialised as CDR.

    Raises:
        Exception: of any class, if the data are not a message of this type.
    """
    return known_types().deserialize_cdr(data, _known(message_type))


def _known(message_type: str) -> str:
    return LIVOX if message_type == LIVOX_1 else message_type
