"""Drives recorded as MCAP by cns-drake (or by others on the same topics)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
import json
from pathlib import Path
import struct

import numpy as np
from rosbags.typesys import Stores, get_typestore

from evaluation import poses
from evaluation.errors import InputError
from evaluation.sequences.mcap_file import Location, McapFile
from evaluation.sequences.point_cloud2 import to_points
from evaluation.sequences.sequence import Sequence

_LIDAR_TOPIC = "/lidar/points"
_ODOMETRY_TOPIC = "/odometry"
_TF_STATIC_TOPIC = "/tf_static"

_POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
_ODOMETRY = "nav_msgs/msg/Odometry"
_TF = "tf2_msgs/msg/TFMessage"

_TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)


class McapSequence(Sequence):
    """A recording on the topics /lidar/points, /odometry and /tf_static.

    Without `/lidar/points` the only topic of point clouds takes its place.
    Scan i is the i-th message of that topic by log time. Its pose is
    that of the `/odometry` message with exactly the same stamp, composed
    with the sensor's place on the vehicle from `/tf_static`; nothing is
    interpolated.

    Opening reads the file's index. Stamps and poses take one pass over the
    file when they are first asked for; a scan takes one chunk.
    """

    def __init__(self, path: Path):
        """Opens a recording.

        Args:
            path: the .mcap file, or the folder that holds it.

        Raises:
            InputError: if there is no complete recording at `path`.
        """
        self._file = McapFile(_mcap_path(Path(path)))
        self._path = self._file.path
        self.name = _sequence_name(Path(path))
        self._lidar_topic = self._find_lidar_topic()
        self._message_types = {
            self._lidar_topic: _POINT_CLOUD,
            _ODOMETRY_TOPIC: _ODOMETRY,
            _TF_STATIC_TOPIC: _TF,
        }
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
    def world_frame(self) -> str:
        first = self._file.locate(_ODOMETRY_TOPIC)[0]
        return self._message(_ODOMETRY_TOPIC, first).header.frame_id

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
        try:
            return {entry["instance"]: entry for entry in table}
        except (TypeError, KeyError) as error:
            raise InputError(
                f"{self._path}: attachment structures.json: no list of"
                " entries with an instance"
            ) from error

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

    @cached_property
    def _track(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (N,) [ns] and poses (N, 4, 4) of the scans."""
        stamps_ns, odometry = self._read_stamps_and_odometry()
        disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
        if len(disorder):
            raise InputError(
                f"{self._path}: {self._lidar_topic}: the stamp of scan"
                f" {disorder[0] + 1} is not later than the one before"
            )
        missing = [
            index
            for index, stamp in enumerate(stamps_ns.tolist())
            if stamp not in odometry
        ]
        if missing:
            raise InputError(
                f"{self._path}: {_ODOMETRY_TOPIC}: no pose with the stamp"
                f" {stamps_ns[missing[0]]} of scan {missing[0]}"
                f" ({len(missing)} of {len(self)} scans have none)"
            )
        X_WB = self._to_poses([odometry[stamp] for stamp in stamps_ns.tolist()])
        return stamps_ns, X_WB @ self._X_BS

    def _read_stamps_and_odometry(
        self,
    ) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Returns the stamps of the scans, and stamp -> pose of the vehicle.

        The latter is a row of p_WB (3) and the quat_xyzw of R_WB (4).
        """
        stamps_ns = np.zeros(len(self), dtype=np.int64)
        odometry = {}
        visits = [(place, index) for index, place in enumerate(self._scans)]
        visits += [
            (place, None) for place in self._file.locate(_ODOMETRY_TOPIC)
        ]
        # In the order of the file, so that each chunk is unpacked once.
        visits.sort(key=lambda visit: (visit[0].chunk, visit[0].offset))
        for place, scan_index in visits:
            if scan_index is not None:
                stamps_ns[scan_index] = self._scan_stamp_ns(place)
                continue
            message = self._message(_ODOMETRY_TOPIC, place)
            odometry[_stamp_ns(message.header)] = _position_quaternion(
                message.pose.pose.position, message.pose.pose.orientation
            )
        return stamps_ns, odometry

    @cached_property
    def _X_BS(self) -> np.ndarray:
        """Pose of the LiDAR on the vehicle, (4, 4), from /tf_static."""
        first = self._file.locate(_ODOMETRY_TOPIC)[0]
        base = self._message(_ODOMETRY_TOPIC, first).child_frame_id
        scan = self._message(self._lidar_topic, self._scans[0])
        sensor = scan.header.frame_id
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
            row = _position_quaternion(
                edge.transform.translation, edge.transform.rotation
            )
            X_CS = self._to_poses([row])[0] @ X_CS
            child = edge.header.frame_id
        raise InputError(
            f"{self._path}: {_TF_STATIC_TOPIC}: no transform from {base} to"
            f" {sensor}"
        )

    def _to_poses(self, rows: list[np.ndarray]) -> np.ndarray:
        """Returns poses (N, 4, 4) of N rows of position and quat_xyzw."""
        values = np.array(rows)
        if not np.isfinite(values).all():
            raise InputError(f"{self._path}: a pose is not finite")
        try:
            R = poses.rotation_from_quaternion(values[:, 3:])
        except ValueError as error:
            raise InputError(f"{self._path}: a pose has {error}") from error
        return poses.make_pose(R, values[:, :3])

    def _message(self, topic: str, place: Location):
        data = self._file.read(place)
        try:
            return _TYPESTORE.deserialize_cdr(data, self._message_types[topic])
        except Exception as error:
            # rosbags raises whatever its generated code trips over.
            raise InputError(
                f"{self._path}: {topic}: a message cannot be decoded"
                f" ({type(error).__name__}: {error})"
            ) from error

    def _scan_stamp_ns(self, place: Location) -> int:
        """Reads a scan's stamp, which leads the message, and no more."""
        data = self._file.read(place)
        try:
            order = "<" if data[1] & 1 else ">"
            sec, nanosec = struct.unpack_from(f"{order}iI", data, 4)
        except (struct.error, IndexError) as error:
            raise InputError(
                f"{self._path}: {self._lidar_topic}: a message is cut off"
            ) from error
        return sec * 1_000_000_000 + nanosec

    def _find_lidar_topic(self) -> str:
        """Returns /lidar/points, or else the only topic of point clouds."""
        clouds = [
            topic
            for topic, message_type in self._file.topics.items()
            if message_type == _POINT_CLOUD
        ]
        if _LIDAR_TOPIC in self._file.topics or len(clouds) != 1:
            return _LIDAR_TOPIC
        return clouds[0]

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

    def _json(self, name: str):
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


def _stamp_ns(header) -> int:
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def _position_quaternion(p, q) -> np.ndarray:
    return np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
