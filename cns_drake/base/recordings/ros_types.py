"""Types of ROS 2 messages: classes, definitions, hashes and CDR.

All come from rosbags' table of ROS 2 Humble, but for those of vision_msgs,
which it lacks: their fields are those of vision_msgs 4, which is Humble's.
"""

from __future__ import annotations

from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
DETECTIONS_3D = "vision_msgs/msg/Detection3DArray"

_VISION_MSGS = {
    "ObjectHypothesis": "string class_id\nfloat64 score\n",
    "ObjectHypothesisWithPose": """\
vision_msgs/ObjectHypothesis hypothesis
geometry_msgs/PoseWithCovariance pose
""",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "Detection3D": """\
std_msgs/Header header
vision_msgs/ObjectHypothesisWithPose[] results
vision_msgs/BoundingBox3D bbox
string id
""",
    "Detection3DArray": """\
std_msgs/Header header
vision_msgs/Detection3D[] detections
""",
}

_TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)
for _name, _text in _VISION_MSGS.items():
    _TYPESTORE.register(get_types_from_msg(_text, f"vision_msgs/msg/{_name}"))


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
        Exception: of any type, if the data are no such message.
    """
    return _TYPESTORE.deserialize_cdr(data, message_type)
