"""Topics of LiDARs in a recording, and the names of these LiDARs."""

from collections.abc import Iterable, Mapping

from cns_drake.base import InputError
from cns_drake.drives import ros_types

LIDAR_TOPIC = "/lidar/points"


def cloud_topics(topics: Mapping[str, Iterable[str]]) -> list[str]:
    """Returns the topics with point clouds, except topics of labels.

    Args:
        topics: topic -> message types, as in `McapFile.topics`.
    """
    return [
        topic
        for topic, kinds in topics.items()
        if any(kind.startswith(ros_types.POINT_CLOUD) for kind in kinds)
        and not topic.endswith("/labels")
    ]


def choose_lidar_topic(
    topics: Mapping[str, Iterable[str]], lidar: str | None, source: object
) -> str:
    """Returns the topic of the wanted LiDAR.

    If the file has no topic of point clouds, the result need not be in
    `topics`.

    Args:
        topics: topic -> message types, as in `McapFile.topics`.
        lidar: name or topic of the LiDAR. None stands for `/lidar/points` or,
            if this topic is missing, for the only topic of point clouds.
        source: the file, with which an error message begins.

    Raises:
        InputError: the topic does not exist, but other topics of point clouds
            do; the message names them.
    """
    clouds = cloud_topics(topics)
    wanted = LIDAR_TOPIC
    if lidar is not None:
        wanted = f"/{lidar}/points"
        named = (lidar, wanted, f"/{lidar}")
        wanted = next((topic for topic in named if topic in topics), wanted)
    elif LIDAR_TOPIC not in topics and len(clouds) == 1:
        wanted = clouds[0]
    if wanted not in topics and clouds:
        advice = "" if lidar else "; --lidar takes one of them"
        raise InputError(
            f"{source}: no topic {wanted} (point clouds:"
            f" {' '.join(clouds)}{advice})"
        )
    return wanted


def lidar_name(topic: str) -> str:
    """Returns NAME for the topic /NAME/points, and other topics as they are."""
    name = topic.removeprefix("/").removesuffix("/points")
    return name if topic == f"/{name}/points" else topic
