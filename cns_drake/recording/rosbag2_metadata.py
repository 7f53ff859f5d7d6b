"""The metadata of a recording for rosbag2.

Metadata version 8 is the newest that ROS 2 Humble reads. The conventions are
the same as in the MCAP files that rosbag2 writes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from evaluation.drives import message_hash

# Version of the format of `metadata.yaml`.
_VERSION = 8


@dataclass(frozen=True)
class Topic:
    """A topic of a recording.

    Attributes:
        name: name of the topic, such as `/lidar/points`.
        message_type: type of its messages, such as
            `sensor_msgs/msg/PointCloud2`.
        latched: whether late subscribers get the last message, as for
            `/tf_static` (QoS durability "transient local").
    """

    name: str
    message_type: str
    latched: bool = False


def channel_metadata(topic: Topic) -> dict[str, str]:
    """Returns a channel's metadata for rosbag2: QoS and the type's hash."""
    return {
        "offered_qos_profiles": _qos_yaml(topic),
        "topic_type_hash": message_hash(topic.message_type),
    }


def describe_topic(
    name: str,
    message_type: str,
    count: int,
    metadata: Mapping[str, str],
) -> dict:
    """Returns the entry of a topic for rosbag2's `metadata.yaml`.

    Args:
        name: name of the topic.
        message_type: ROS type, such as `sensor_msgs/msg/Imu`.
        count: number of messages.
        metadata: metadata of the topic's channel in the MCAP file.
    """
    return {
        "topic_metadata": {
            "name": name,
            "type": message_type,
            "serialization_format": "cdr",
            "offered_qos_profiles": metadata.get("offered_qos_profiles", ""),
            "type_description_hash": metadata.get("topic_type_hash", ""),
        },
        "message_count": count,
    }


def make_bag_information(
    file_name: str,
    topics: Sequence[dict],
    *,
    start_ns: int,
    end_ns: int,
    custom_data: Mapping[str, str] | None = None,
) -> dict:
    """Returns the content of `metadata.yaml` for a recording of one file.

    Args:
        file_name: name of the MCAP file.
        topics: entries of the topics, from `describe_topic`.
        start_ns, end_ns: times of the first and the last message [ns].
        custom_data: key -> text, which `ros2 bag info` shows as well.
    """
    count = sum(topic["message_count"] for topic in topics)
    span = {
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "duration": {"nanoseconds": end_ns - start_ns},
        "message_count": count,
    }
    return {
        "version": _VERSION,
        "storage_identifier": "mcap",
        "duration": span["duration"],
        "starting_time": span["starting_time"],
        "message_count": count,
        "topics_with_message_count": list(topics),
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span}],
        "custom_data": dict(custom_data or {}) or None,
        "ros_distro": "humble",
    }


def _qos_yaml(topic: Topic) -> str:
    """Returns the publisher's quality of service.

    Enums are the integers of rmw's header, since ROS 2 Humble reads no
    names. A reliable publisher serves subscribers of either reliability.
    """
    infinite = {"sec": 9223372036, "nsec": 854775807}
    profile = {
        "history": 1,  # keep last
        "depth": 1 if topic.latched else 10,
        "reliability": 1,  # reliable
        "durability": 1 if topic.latched else 2,  # transient local, volatile
        "deadline": infinite,
        "lifespan": infinite,
        "liveliness": 1,  # automatic
        "liveliness_lease_duration": infinite,
        "avoid_ros_namespace_conventions": False,
    }
    return to_yaml([profile])


def to_yaml(value: Any) -> str:
    """Returns plain YAML in the order of `value`, without aliases."""
    return yaml.dump(
        value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1000
    )


class _Dumper(yaml.SafeDumper):
    """Writes equal values out each time: rosbag2 takes no YAML aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True
