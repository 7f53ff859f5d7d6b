"""Topics of a recording, and the frames of its sensors."""

from collections import Counter
from collections.abc import Iterable, Mapping

from pydrake.math import RigidTransform

from cns_drake.recording import messages
from cns_drake.recording.messages import CAMERA_INFO, ENCODINGS, IMAGE
from cns_drake.recording.rosbag2_metadata import Topic
from evaluation.drives import (
    BASE_FRAME,
    COMPRESSED_IMAGE,
    DETECTIONS_3D,
    IMU,
    IMU_FRAME,
    ODOMETRY,
    POINT_CLOUD,
    SCENE_UPDATE,
    TF,
)

TF_STATIC_TOPIC = Topic("/tf_static", TF, latched=True)
TF_TOPIC = Topic("/tf", TF)
ODOMETRY_TOPIC = Topic("/odometry", ODOMETRY)
IMU_TOPIC = Topic("/imu/data", IMU)
OBJECTS_TOPIC = Topic("/objects", DETECTIONS_3D)
BOXES_TOPIC = Topic("/objects/boxes", SCENE_UPDATE)
MOTION_TOPIC = Topic("/objects/motion", POINT_CLOUD)
OBJECT_TOPICS = (OBJECTS_TOPIC, BOXES_TOPIC, MOTION_TOPIC)


def recording_topics(
    lidar_names: Iterable[str],
    *,
    camera_names: Iterable[str] = (),
    with_imu: bool = True,
    with_odometry: bool = True,
    layouts: Mapping[str, str] | None = None,
    with_objects: bool = False,
    further: Iterable[Topic] = (),
    depth_camera_names: Iterable[str] = (),
) -> tuple[Topic, ...]:
    """Returns the topics of a recording with their types and encodings.

    Args:
        lidar_names: names of the LiDARs.
        camera_names: names of the cameras.
        with_imu: whether an IMU is recorded.
        with_odometry: whether odometry is recorded.
        layouts: LiDAR name -> layout of the points, if the layout is not `cns`.
        with_objects: whether boxes of moving objects are recorded.
        further: topics of sensors of other kinds.
        depth_camera_names: names of the cameras whose depth images have
            intrinsics or a pose of their own.

    Raises:
        ValueError: two topics have the same name.

    Example:
        from cns_drake import recording_topics

        topics = recording_topics(["lidar"])
    """
    topics = []
    for name in lidar_names:
        topics.append(points_topic(name))
        if (layouts or {}).get(name, "cns") != "cns":
            topics.append(labels_topic(name))
    for name in camera_names:
        topics += [
            camera_topic(name, kind) for kind in (*ENCODINGS, "camera_info")
        ]
    topics += map(depth_info_topic, depth_camera_names)
    topics += [IMU_TOPIC] if with_imu else []
    topics += [ODOMETRY_TOPIC] if with_odometry else []
    topics += OBJECT_TOPICS if with_objects else []
    topics += further
    topics += [TF_TOPIC, TF_STATIC_TOPIC]
    for name, count in Counter(topic.name for topic in topics).items():
        if count > 1:
            raise ValueError(f"{name}: two sensors have this topic")
    return tuple(topics)


def make_calibration(
    X_BSs: Mapping[str, RigidTransform], X_BI: RigidTransform | None
) -> dict:
    """Returns the poses of LiDARs S and the IMU I on the vehicle, for JSON.

    Returns:
        Frame name -> mapping with the parent frame, `translation` [m] and
        `quat_xyzw`.
    """
    X_BCs = dict(X_BSs)
    if X_BI is not None:
        X_BCs[IMU_FRAME] = X_BI
    return {
        name: {
            "parent": BASE_FRAME,
            "translation": [float(x) for x in X_BC.translation()],
            "quat_xyzw": list(messages.to_quat_xyzw(X_BC.rotation())),
        }
        for name, X_BC in X_BCs.items()
    }


def points_topic(lidar_name: str) -> Topic:
    """Returns the topic of a LiDAR's points."""
    return Topic(f"/{lidar_name}/points", POINT_CLOUD)


def labels_topic(lidar_name: str) -> Topic:
    """Returns the topic of labels for points whose layout is not `cns`."""
    return Topic(f"/{lidar_name}/labels", POINT_CLOUD)


def camera_topic(camera_name: str, kind: str) -> Topic:
    """Returns a topic of a camera.

    Args:
        camera_name: name of the camera.
        kind: what the topic carries: `image` (compressed), `color`, `depth`,
            `label` or `camera_info`.
    """
    message_type = {
        "image": COMPRESSED_IMAGE,
        "camera_info": CAMERA_INFO,
    }
    return Topic(f"/{camera_name}/{kind}", message_type.get(kind, IMAGE))


def depth_info_topic(camera_name: str) -> Topic:
    """Returns the topic of the intrinsics that only the depth images have."""
    return Topic(f"/{camera_name}/depth/camera_info", CAMERA_INFO)
