"""Types of ROS 2 messages: classes, definitions, hashes and CDR.

Most come from rosbags' table of ROS 2 Humble. Types that it lacks are in
`messages`: vision_msgs in version 4, which is Humble's, and foxglove_msgs after
Foxglove's schemas. A recording contains the text of its types.
"""

from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
DETECTIONS_3D = "vision_msgs/msg/Detection3DArray"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"

_TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)
_FOLDER = Path(__file__).with_name("messages")
for _path in sorted(_FOLDER.glob("*/msg/*.msg")):
    _name = _path.relative_to(_FOLDER).with_suffix("").as_posix()
    _TYPESTORE.register(
        get_types_from_msg(_path.read_text(encoding="utf-8"), _name)
    )


def message_class(message_type: str) -> type:
    """Returns the class of a type of messages."""
    return _TYPESTORE.types[message_type]


def message_definition(message_type: str) -> str:
    """Returns the .msg text of a type with the types it depends on."""
    text, _ = _TYPESTORE.generate_msgdef(message_type, ros_version=2)
    return text


def message_hash(message_type: str) -> str:
    """Returns the type's hash in REP-2011 form (`RIHS01_...`)."""
    return _TYPESTORE.hash_rihs01(message_type)


def serialize(message: Any) -> bytes:
    """Returns the CDR form of a message."""
    return bytes(_TYPESTORE.serialize_cdr(message, message.__msgtype__))


def deserialize(data: bytes | memoryview, message_type: str) -> Any:
    """Returns the message of a CDR form.

    Raises:
        Exception: any type of error, if the data are no such message.
    """
    return _TYPESTORE.deserialize_cdr(data, message_type)
