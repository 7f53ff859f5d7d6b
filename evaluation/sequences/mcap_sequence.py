"""Drives recorded as MCAP by cns-drake (or by others on the same topics)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
import json
from pathlib import Path
import struct
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from evaluation.geometry import poses
from evaluation.sequences.mcap_file import Location, McapFile
from evaluation.sequences.motion import IMU_DTYPE, ODOMETRY_DTYPE
from evaluation.sequences.point_cloud2 import to_points
from evaluation.sequences.sequence import Sequence, index_instances
from evaluation.support.errors import InputError

_LIDAR_TOPIC = "/lidar/points"
_ODOMETRY_TOPIC = "/odometry"
_IMU_TOPIC = "/imu/data"
_TF_STATIC_TOPIC = "/tf_static"

_POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
_ODOMETRY = "nav_msgs/msg/Odometry"
_IMU = "sensor_msgs/msg/Imu"
_TF = "tf2_msgs/msg/TFMessage"

_TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)


class McapSequence(Sequence):
    """A recording on the topics /lidar/points, /odometry and /tf_static.

    Without `/lidar/points` the only topic of point clouds takes its place;
    of several LiDARs, `lidar` chooses one. The topic /imu/data is optional.
    Scan i is the i-th message of that topic by log time. Its pose is
    that of the `/odometry` message with exactly the same stamp, composed
    with the sensor's place on the vehicle from `/tf_static`; nothing is
    interpolated.

    Opening reads the file's index. Stamps and poses take one pass over the
    file when they are first asked for; a scan takes one chunk.
    """

    def __init__(self, path: Path, lidar: str | None = None):
        """Opens a recording.

        Args:
            path: the .mcap file, or the folder that holds it.
            lidar: whose scans to read: those of the topic /<lidar>/points.

        Raises:
            InputError: if there is no complete recording at `path`, or no
                such LiDAR in it.
        """
        self._file = McapFile(_mcap_path(Path(path)))
        self._path = self._file.path
        self.name = _sequence_name(Path(path))
        self._lidar_topic = self._find_lidar_topic(lidar)
        self._message_types = {
            self._lidar_topic: _POINT_CLOUD,
            _ODOMETRY_TOPIC: _ODOMETRY,
            _TF_STATIC_TOPIC: _TF,
        }
        if _IMU_TOPIC in self._file.topics:
            self._message_types[_IMU_TOPIC] = _IMU
        for topic, message_type in self._message_types.items():
            self._check_topic(topic, message_type)
        self._scans = self._file.locate(self._lidar_topic)

    def __len__(self) -> int:
        return len(self._scans)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._track[0]

    @property
    def X_WS(self) -> np.ndarray:
        return self._track[1]

    @property
    def world_frame(self) -> str:  # type: ignore[override]  # Read late.
        first = self._file.locate(_ODOMETRY_TOPIC)[0]
        return self._message(_ODOMETRY_TOPIC, first).header.frame_id

    @property
    def notes(self) -> tuple[str, ...]:
        lidars = (self.scenario or {}).get("lidars")
        name = self._lidar_topic.strip("/").split("/")[0]
        lidar = lidars.get(name) if isinstance(lidars, dict) else None
        if not (isinstance(lidar, dict) and lidar.get("motion_distortion")):
            return ()
        return (
            f"{self._path}: taken while the LiDAR moved, and used as taken"
            " (evaluation.sequences.deskewing takes the motion out)",
        )

    @property
    def scenario(self) -> Mapping | None:
        scenario = self._json("scenario.json")
        if scenario is not None and not isinstance(scenario, dict):
            raise InputError(
                f"{self._path}: attachment scenario.json: no JSON object"
            )
        return scenario

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        table = self._json("structures.json")
        if table is None:
            return None
        return index_instances(
            table, f"{self._path}: attachment structures.json"
        )

    def scan(self, index: int) -> np.ndarray:
        if not 0 <= index < len(self):
            raise IndexError(f"scan {index} of {len(self)}")
        message = self._message(self._lidar_topic, self._scans[index])
        try:
            return to_points(message)
        except ValueError as error:
            raise InputError(
                f"{self._path}: {self._lidar_topic}: scan {index}: {error}"
            ) from error

    @property
    def odometry(self) -> np.ndarray:
        return self._stamps_and_odometry[1]

    @cached_property
    def imu(self) -> np.ndarray | None:
        if _IMU_TOPIC not in self._message_types:
            return None
        messages = self._file.parse_each(
            self._file.locate(_IMU_TOPIC), lambda _, data: bytes(data)
        )
        return np.array(
            [_imu_row(self._decode(_IMU_TOPIC, data)) for data in messages],
            dtype=IMU_DTYPE,
        )

    @cached_property
    def _track(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (N,) [ns] and poses (N, 4, 4) of the scans."""
        stamps_ns, odometry = self._stamps_and_odometry
        disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
        if len(disorder):
            raise InputError(
                f"{self._path}: {self._lidar_topic}: the stamp of scan"
                f" {disorder[0] + 1} is not later than the one before"
            )
        rows = {stamp: i for i, stamp in enumerate(odometry["stamp_ns"])}
        missing = [
            index for index, stamp in enumerate(stamps_ns) if stamp not in rows
        ]
        if missing:
            raise InputError(
                f"{self._path}: {_ODOMETRY_TOPIC}: no pose with the stamp"
                f" {stamps_ns[missing[0]]} of scan {missing[0]}"
                f" ({len(missing)} of {len(self)} scans have none)"
            )
        matching = odometry[[rows[stamp] for stamp in stamps_ns]]
        X_WB = self._to_poses(matching["position"], matching["quat_xyzw"])
        return stamps_ns, X_WB @ self.X_BS

    @cached_property
    def _stamps_and_odometry(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (N,) of the scans, and the odometry, in one pass."""
        num_scans = len(self)

        def parse(position: int, data: memoryview) -> tuple[int, bytes]:
            if position < num_scans:
                return self._scan_stamp_ns(data), b""
            return 0, bytes(data)

        parsed = self._file.parse_each(
            self._scans + self._file.locate(_ODOMETRY_TOPIC), parse
        )
        rows = [
            _odometry_row(self._decode(_ODOMETRY_TOPIC, data))
            for _, data in parsed[num_scans:]
        ]
        return (
            np.array([stamp for stamp, _ in parsed[:num_scans]], np.int64),
            np.array(rows, dtype=ODOMETRY_DTYPE),
        )

    @cached_property
    def X_BS(self) -> np.ndarray:
        """Pose of the LiDAR on the vehicle B, (4, 4), from /tf_static."""
        return self._mount(self._message(self._lidar_topic, self._scans[0]))

    @cached_property
    def X_BI(self) -> np.ndarray | None:
        """Pose of the IMU on the vehicle B, (4, 4); None without an IMU."""
        if _IMU_TOPIC not in self._message_types:
            return None
        first = self._file.locate(_IMU_TOPIC)[0]
        return self._mount(self._message(_IMU_TOPIC, first))

    def _mount(self, message: Any) -> np.ndarray:
        """Returns the pose of a sensor's frame, that of its message, in B."""
        first = self._file.locate(_ODOMETRY_TOPIC)[0]
        base = self._message(_ODOMETRY_TOPIC, first).child_frame_id
        sensor = message.header.frame_id
        parents = {}
        for place in self._file.locate(_TF_STATIC_TOPIC):
            for edge in self._message(_TF_STATIC_TOPIC, place).transforms:
                parents[edge.child_frame_id] = edge
        X_CS = np.eye(4)
        child = sensor
        for _ in range(len(parents) + 1):
            if child == base:
                return X_CS
            if child not in parents:
                break
            edge = parents[child]
            X_PC = self._to_poses(
                np.array(_xyz(edge.transform.translation)),
                np.array(_xyzw(edge.transform.rotation)),
            )
            X_CS = X_PC @ X_CS
            child = edge.header.frame_id
        raise InputError(
            f"{self._path}: {_TF_STATIC_TOPIC}: no transform from {base} to"
            f" {sensor}"
        )

    def _to_poses(self, p: np.ndarray, quat_xyzw: np.ndarray) -> np.ndarray:
        """Returns poses (..., 4, 4) of positions and quaternions."""
        if not (np.isfinite(p).all() and np.isfinite(quat_xyzw).all()):
            raise InputError(f"{self._path}: a pose is not finite")
        if not (np.abs(p) < poses.FARTHEST).all():
            raise InputError(
                f"{self._path}: a pose is {np.abs(p).max():g} m from the origin"
            )
        try:
            R = poses.rotation_from_quaternion(quat_xyzw)
        except ValueError as error:
            raise InputError(f"{self._path}: a pose has {error}") from error
        return poses.make_pose(R, p)

    def _message(self, topic: str, place: Location) -> Any:
        return self._decode(topic, self._file.read(place))

    def _decode(self, topic: str, data: bytes | memoryview) -> Any:
        try:
            return _TYPESTORE.deserialize_cdr(data, self._message_types[topic])
        except Exception as error:
            # rosbags raises whatever its generated code trips over.
            raise InputError(
                f"{self._path}: {topic}: a message cannot be decoded"
                f" ({type(error).__name__}: {error})"
            ) from error

    def _scan_stamp_ns(self, data: memoryview) -> int:
        """Reads a scan's stamp, which leads the message, and no more."""
        try:
            order = "<" if data[1] & 1 else ">"
            sec, nanosec = struct.unpack_from(f"{order}iI", data, 4)
        except (struct.error, IndexError) as error:
            raise InputError(
                f"{self._path}: {self._lidar_topic}: a message is cut off"
            ) from error
        return sec * 1_000_000_000 + nanosec

    def _find_lidar_topic(self, lidar: str | None) -> str:
        """Returns the named LiDAR's topic, /lidar/points, or the only one."""
        clouds = [
            topic
            for topic, message_type in self._file.topics.items()
            if message_type == _POINT_CLOUD
        ]
        if lidar is not None:
            wanted = f"/{lidar}/points"
        elif _LIDAR_TOPIC in self._file.topics or len(clouds) != 1:
            wanted = _LIDAR_TOPIC
        else:
            wanted = clouds[0]
        if wanted not in self._file.topics and clouds:
            raise InputError(
                f"{self._path}: no topic {wanted} (point clouds:"
                f" {' '.join(clouds)})"
            )
        return wanted

    def _check_topic(self, topic: str, message_type: str) -> None:
        found = self._file.topics.get(topic)
        if found is None:
            raise InputError(f"{self._path}: no topic {topic}")
        if found != message_type or self._file.encoding(topic) != "cdr":
            raise InputError(
                f"{self._path}: {topic}: {found} in"
                f" {self._file.encoding(topic)} instead of {message_type} in"
                " cdr"
            )
        if not self._file.locate(topic):
            raise InputError(f"{self._path}: {topic}: no message")

    def _json(self, name: str) -> Any:
        data = self._file.attachment(name)
        if data is None:
            return None
        try:
            return json.loads(data)
        except ValueError as error:
            raise InputError(
                f"{self._path}: attachment {name}: {error}"
            ) from error


def holds_mcap(path: Path) -> bool:
    """Returns whether `path` is an .mcap file or a folder with one."""
    if path.is_dir():
        return any(path.glob("*.mcap"))
    return path.suffix == ".mcap"


def _mcap_path(path: Path) -> Path:
    if not path.is_dir():
        return path
    files = sorted(path.glob("*.mcap"))
    if len(files) != 1:
        raise InputError(f"{path}: {len(files)} .mcap files instead of one")
    return files[0]


def _sequence_name(path: Path) -> str:
    resolved = path.resolve()
    # rosbag2 numbers the files of a recording: <name>_0.mcap.
    return (
        resolved.name if resolved.is_dir() else resolved.stem.removesuffix("_0")
    )


def _stamp_ns(header: Any) -> int:
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def _odometry_row(message: Any) -> tuple:
    pose, twist = message.pose.pose, message.twist.twist
    return (
        _stamp_ns(message.header),
        _xyz(pose.position),
        _xyzw(pose.orientation),
        _xyz(twist.linear),
        _xyz(twist.angular),
    )


def _imu_row(message: Any) -> tuple:
    return (
        _stamp_ns(message.header),
        _xyzw(message.orientation),
        _xyz(message.angular_velocity),
        _xyz(message.linear_acceleration),
    )


def _xyz(v: Any) -> tuple[float, float, float]:
    return v.x, v.y, v.z


def _xyzw(q: Any) -> tuple[float, float, float, float]:
    return q.x, q.y, q.z, q.w
