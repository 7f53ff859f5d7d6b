"""Types of ROS 2 messages: classes, definitions, hashes and CDR.

Most come from rosbags' table of ROS 2 Humble. Types that it lacks are written
here: vision_msgs in version 4, which is Humble's, and foxglove_msgs after
Foxglove's schemas. A recording contains the text of its types.
"""

from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
DETECTIONS_3D = "vision_msgs/msg/Detection3DArray"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"

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

_FOXGLOVE_MSGS = {
    "Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "KeyValuePair": "string key\nstring value\n",
    "ArrowPrimitive": """\
geometry_msgs/Pose pose
float64 shaft_length
float64 shaft_diameter
float64 head_length
float64 head_diameter
foxglove_msgs/Color color
""",
    "CubePrimitive": """\
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
foxglove_msgs/Color color
""",
    "SpherePrimitive": """\
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
foxglove_msgs/Color color
""",
    "CylinderPrimitive": """\
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
float64 bottom_scale
float64 top_scale
foxglove_msgs/Color color
""",
    "LinePrimitive": """\
uint8 LINE_STRIP=0
uint8 LINE_LOOP=1
uint8 LINE_LIST=2
uint8 type
geometry_msgs/Pose pose
float64 thickness
bool scale_invariant
geometry_msgs/Point[] points
foxglove_msgs/Color color
foxglove_msgs/Color[] colors
uint32[] indices
""",
    "TriangleListPrimitive": """\
geometry_msgs/Pose pose
geometry_msgs/Point[] points
foxglove_msgs/Color color
foxglove_msgs/Color[] colors
uint32[] indices
""",
    "TextPrimitive": """\
geometry_msgs/Pose pose
bool billboard
float64 font_size
bool scale_invariant
foxglove_msgs/Color color
string text
""",
    "ModelPrimitive": """\
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
foxglove_msgs/Color color
bool override_color
string url
string media_type
uint8[] data
""",
    "SceneEntity": """\
builtin_interfaces/Time timestamp
string frame_id
string id
builtin_interfaces/Duration lifetime
bool frame_locked
foxglove_msgs/KeyValuePair[] metadata
foxglove_msgs/ArrowPrimitive[] arrows
foxglove_msgs/CubePrimitive[] cubes
foxglove_msgs/SpherePrimitive[] spheres
foxglove_msgs/CylinderPrimitive[] cylinders
foxglove_msgs/LinePrimitive[] lines
foxglove_msgs/TriangleListPrimitive[] triangles
foxglove_msgs/TextPrimitive[] texts
foxglove_msgs/ModelPrimitive[] models
""",
    "SceneEntityDeletion": """\
builtin_interfaces/Time timestamp
uint8 MATCHING_ID=0
uint8 ALL=1
uint8 type
string id
""",
    "SceneUpdate": """\
foxglove_msgs/SceneEntityDeletion[] deletions
foxglove_msgs/SceneEntity[] entities
""",
}

_TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)
for _package, _texts in (
    ("vision_msgs", _VISION_MSGS),
    ("foxglove_msgs", _FOXGLOVE_MSGS),
):
    for _name, _text in _texts.items():
        _TYPESTORE.register(
            get_types_from_msg(_text, f"{_package}/msg/{_name}")
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
