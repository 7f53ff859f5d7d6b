"""The metadata of a recording for rosbag2.

Metadata version 8 is the newest that ROS 2 Humble reads. Conventions are
those of rosbag2's own MCAP files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from cns_drake.base.recordings import ros_types

_VERSION = 8


@dataclass(frozen=True)
class Topic:
    """A topic of a recording.

    Attributes:
        name: e.g. `/lidar/points`.
        message_type: e.g. `sensor_msgs/msg/PointCloud2`.
        latched: whether late subscribers get the last message, as for
            `/tf_static` (QoS durability "transient local").
    """

    name: str
    message_type: str
    latched: bool = False


@dataclass(frozen=True)
class TopicMetadata:
    """The metadata of a topic for rosbag2.

    Attributes:
        name: e.g. `/lidar/points`.
        message_type: e.g. `sensor_msgs/msg/PointCloud2`.
        serialization_format: e.g. `cdr`.
        qos_yaml: the publishers' quality of service.
        message_hash: the message type's REP-2011 hash.
    """

    name: str
    message_type: str
    serialization_format: str
    qos_yaml: str
    message_hash: str


def make_topic_metadata(topic: Topic) -> TopicMetadata:
    """Returns the metadata of a topic of ours."""
    return TopicMetadata(
        name=topic.name,
        message_type=topic.message_type,
        serialization_format="cdr",
        qos_yaml=make_qos_yaml(topic),
        message_hash=ros_types.message_hash(topic.message_type),
    )


def make_bag_information(
    file_name: str,
    message_counts: Mapping[TopicMetadata, int],
    *,
    start_ns: int,
    end_ns: int,
    custom_data: Mapping[str, str],
) -> dict:
    """Returns the description of a recording of one file.

    Args:
        file_name: name of the MCAP file within its folder.
        message_counts: number of messages on each topic.
        start_ns: time of the first message [ns].
        end_ns: time of the last message [ns].
        custom_data: key -> text for `ros2 bag info`.
    """
    count = sum(message_counts.values())
    return {
        "version": _VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end_ns - start_ns},
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "message_count": count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.message_type,
                    "serialization_format": topic.serialization_format,
                    "offered_qos_profiles": topic.qos_yaml,
                    "type_description_hash": topic.message_hash,
                },
                "message_count": topic_count,
            }
            for topic, topic_count in message_counts.items()
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [
            {
                "path": file_name,
                "starting_time": {"nanoseconds_since_epoch": start_ns},
                "duration": {"nanoseconds": end_ns - start_ns},
                "message_count": count,
            }
        ],
        "custom_data": dict(custom_data) or None,
        "ros_distro": "humble",
    }


def make_qos_yaml(topic: Topic) -> str:
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
        value,
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=1000,
    )


class _Dumper(yaml.SafeDumper):
    """Writes equal values out each time: rosbag2 takes no YAML aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True
