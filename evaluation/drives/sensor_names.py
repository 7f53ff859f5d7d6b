"""Names of sensors, which are also the names of their frames and topics."""

from collections.abc import Collection, Iterable
import re

# Frames of every recording: the world, the vehicle and its IMU.
MAP_FRAME = "map"
BASE_FRAME = "base_link"
IMU_FRAME = "imu"
# Other names that no sensor can have: the first parts of common topics.
_TOPICS = ("odometry", "objects", "tf", "tf_static")
RESERVED_NAMES = frozenset({MAP_FRAME, BASE_FRAME, IMU_FRAME, *_TOPICS})
# A part of a ROS 2 topic; https://design.ros2.org, "Topic and Service names".
_TOPIC_PART = re.compile(r"(?!.*__)[A-Za-z_][A-Za-z0-9_]*")


def check_topic_part(name: str) -> None:
    """Checks that a name can be a part of a ROS 2 topic.

    Raises:
        ValueError: the name cannot be a part of a topic.
    """
    if not isinstance(name, str) or not _TOPIC_PART.fullmatch(name):
        raise ValueError(
            f"the name {name!r} cannot be a part of a ROS 2 topic; use "
            "letters, digits and single underscores, and no digit first"
        )


def check_sensor_name(
    name: str, taken: Collection[str] = (), own: str | None = None
) -> None:
    """Checks that the name of a sensor is allowed and not yet taken.

    Args:
        name: the name.
        taken: names of the other sensors.
        own: a reserved name that this sensor may nevertheless have.

    Raises:
        ValueError: the name cannot be a part of a ROS 2 topic, or belongs to
            another frame or topic.
    """
    check_topic_part(name)
    if name in taken or (name != own and name in RESERVED_NAMES):
        raise ValueError(f"'{name}' is the name of another frame or topic")


def check_sensor_names(names: Iterable[str]) -> None:
    """Checks the names of all sensors and frames of a recording.

    Raises:
        ValueError: a name occurs twice, cannot be a part of a ROS 2 topic, or
            is reserved.
    """
    taken: list[str] = []
    for name in names:
        check_sensor_name(name, taken)
        taken.append(name)
