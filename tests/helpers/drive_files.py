"""Writes small recordings and point cloud files for tests.

The recordings follow the contract of the project. They are written here with
the libraries alone, so that readers are tested against an independent writer.
"""

import json
from pathlib import Path

from mcap.writer import CompressionType, Writer
import numpy as np
from rosbags.typesys import Stores, get_typestore

TYPES = get_typestore(Stores.ROS2_HUMBLE)
T0_NS = 1_700_000_000_000_000_000
PERIOD_NS = 50_000_000
POINT_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("t", "<u4"),
        ("label", "u1"),
        ("instance", "<u2"),
    ],
    align=True,
)
_DATATYPES = {"<f4": 7, "<f8": 8, "<u2": 4, "<u4": 6, "|u1": 2}


def make_scan(coordinates: np.ndarray) -> np.ndarray:
    """Returns a scan of the contract's type with these points (N, 3)."""
    scan = np.zeros(len(coordinates), dtype=POINT_DTYPE)
    for axis, name in enumerate("xyz"):
        scan[name] = coordinates[:, axis]
    return scan


def yaw_pose(x: float, y: float, z: float, yaw: float) -> np.ndarray:
    """Returns a pose (4, 4) turned about z by `yaw` [rad]."""
    X = np.eye(4)
    X[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    X[:3, 3] = x, y, z
    return X


def write_recording(
    folder: Path,
    scans: list[np.ndarray],
    X_WBs: list[np.ndarray],
    *,
    p_BS=(0.0, 0.0, 1.6),
    quat_xyzw_BS=(0.0, 0.0, 0.0, 1.0),
    topics=("/lidar/points", "/odometry", "/tf_static"),
    odometry_shift_ns: int = 0,
    stamps_ns: list[int] | None = None,
    chunk_size: int = 1024 * 1024,
    attachments: dict | None = None,
    lidar_topic: str = "/lidar/points",
    world_frame: str = "map",
    mast: str = "mast",
    compression: CompressionType = CompressionType.ZSTD,
    later_poses: dict[int, np.ndarray] | None = None,
    library: str = "test",
    **writing,
) -> Path:
    """Writes a rosbag2 folder; rotations of X_WBs are about z only.

    Args:
        folder: created; its name becomes the drive's.
        scans: structured arrays, in the sensor frame.
        X_WBs: poses of the vehicle (4, 4).
        p_BS: position of the sensor on the vehicle [m].
        quat_xyzw_BS: its orientation there.
        topics: those that are written.
        odometry_shift_ns: added to the stamps of the odometry.
        stamps_ns: of the frames; every 50 ms by default.
        chunk_size: of the MCAP file [bytes].
        attachments: name -> JSON value.
        lidar_topic: topic of the scans.
        world_frame: of the odometry.
        mast: parent of the sensor's frame; the vehicle carries `mast`.
        compression: of the chunks.
        later_poses: stamp [ns] -> pose of the vehicle (4, 4), on /tf.
        library: name of the program that wrote the file.
        writing: further options of the writer.

    Returns:
        The path of the .mcap file.
    """
    folder.mkdir(parents=True)
    path = folder / f"{folder.name}_0.mcap"
    if stamps_ns is None:
        stamps_ns = [T0_NS + i * PERIOD_NS for i in range(len(scans))]
    with open(path, "wb") as stream:
        writer = Writer(
            stream, chunk_size=chunk_size, compression=compression, **writing
        )
        writer.start(profile="ros2", library=library)
        for name, value in (attachments or {}).items():
            writer.add_attachment(
                T0_NS,
                T0_NS,
                name,
                "application/json",
                json.dumps(value).encode(),
            )
        channels = {
            name: _register(
                writer, lidar_topic if name == "/lidar/points" else name, kind
            )
            for name, kind in {
                "/lidar/points": "sensor_msgs/msg/PointCloud2",
                "/odometry": "nav_msgs/msg/Odometry",
                "/tf_static": "tf2_msgs/msg/TFMessage",
                "/tf": "tf2_msgs/msg/TFMessage",
            }.items()
            if name in topics or (name == "/tf" and later_poses)
        }

        def add(topic, message, log_time, sequence):
            if topic in channels:
                data = TYPES.serialize_cdr(message, message.__msgtype__)
                writer.add_message(
                    channels[topic], log_time, bytes(data), log_time, sequence
                )

        for i, (scan, X_WB) in enumerate(zip(scans, X_WBs, strict=True)):
            stamp = stamps_ns[i]
            if i == 0:
                add(
                    "/tf_static",
                    _tf_static(p_BS, quat_xyzw_BS, mast, stamp),
                    stamp,
                    0,
                )
            add(
                "/odometry",
                _odometry(X_WB, world_frame, stamp + odometry_shift_ns),
                stamp,
                i,
            )
            add("/lidar/points", point_cloud(scan, stamp), stamp, i)
        for stamp, X_WB in (later_poses or {}).items():
            add("/tf", _tf(X_WB, world_frame, stamp), stamp, 0)
        writer.finish()
    return path


def point_cloud(scan: np.ndarray, stamp_ns: int = T0_NS, **changes):
    """Returns the PointCloud2 message of a scan; `changes` are fields."""
    field = TYPES.types["sensor_msgs/msg/PointField"]
    values = {
        "header": _header("lidar", stamp_ns),
        "height": 1,
        "width": len(scan),
        "fields": [
            field(
                name=name,
                offset=scan.dtype.fields[name][1],
                datatype=_DATATYPES[scan.dtype.fields[name][0].str],
                count=1,
            )
            for name in scan.dtype.names
        ],
        "is_bigendian": False,
        "point_step": scan.itemsize,
        "row_step": scan.nbytes,
        "data": np.frombuffer(scan.tobytes(), dtype=np.uint8),
        "is_dense": True,
    }
    return TYPES.types["sensor_msgs/msg/PointCloud2"](**{**values, **changes})


def _register(writer: Writer, topic: str, kind: str) -> int:
    text, _ = TYPES.generate_msgdef(kind, ros_version=2)
    schema = writer.register_schema(kind, "ros2msg", text.encode())
    return writer.register_channel(topic, "cdr", schema)


def _header(frame_id: str, stamp_ns: int):
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    time = TYPES.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return TYPES.types["std_msgs/msg/Header"](stamp=time, frame_id=frame_id)


def _odometry(X_WB: np.ndarray, frame_id: str, stamp_ns: int):
    t = TYPES.types
    half_yaw = 0.5 * np.arctan2(X_WB[1, 0], X_WB[0, 0])
    pose = t["geometry_msgs/msg/Pose"](
        position=t["geometry_msgs/msg/Point"](
            **dict(zip("xyz", X_WB[:3, 3].tolist(), strict=True))
        ),
        orientation=t["geometry_msgs/msg/Quaternion"](
            x=0.0, y=0.0, z=np.sin(half_yaw), w=np.cos(half_yaw)
        ),
    )
    zero = t["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    return t["nav_msgs/msg/Odometry"](
        header=_header(frame_id, stamp_ns),
        child_frame_id="base_link",
        pose=t["geometry_msgs/msg/PoseWithCovariance"](
            pose=pose, covariance=np.zeros(36)
        ),
        twist=t["geometry_msgs/msg/TwistWithCovariance"](
            twist=t["geometry_msgs/msg/Twist"](linear=zero, angular=zero),
            covariance=np.zeros(36),
        ),
    )


def _tf(X_WB: np.ndarray, frame_id: str, stamp_ns: int):
    t = TYPES.types
    pose = _odometry(X_WB, frame_id, stamp_ns).pose.pose
    place = t["geometry_msgs/msg/Transform"](
        translation=t["geometry_msgs/msg/Vector3"](**vars(pose.position)),
        rotation=pose.orientation,
    )
    edge = t["geometry_msgs/msg/TransformStamped"](
        header=_header(frame_id, stamp_ns),
        child_frame_id="base_link",
        transform=place,
    )
    return t["tf2_msgs/msg/TFMessage"](transforms=[edge])


def _tf_static(p_BS, quat_xyzw_BS, parent: str, stamp_ns: int):
    """Returns base_link -> mast, 0.5 m up, and parent -> lidar."""
    t = TYPES.types

    def edge(parent, child, p, q):
        return t["geometry_msgs/msg/TransformStamped"](
            header=_header(parent, stamp_ns),
            child_frame_id=child,
            transform=t["geometry_msgs/msg/Transform"](
                translation=t["geometry_msgs/msg/Vector3"](
                    **dict(zip("xyz", map(float, p), strict=True))
                ),
                rotation=t["geometry_msgs/msg/Quaternion"](
                    **dict(zip("xyzw", map(float, q), strict=True))
                ),
            ),
        )

    p_BM = (0.0, 0.0, 0.5)
    return t["tf2_msgs/msg/TFMessage"](
        transforms=[
            edge("base_link", "mast", p_BM, (0, 0, 0, 1)),
            edge(parent, "lidar", np.subtract(p_BS, p_BM), quat_xyzw_BS),
        ]
    )
