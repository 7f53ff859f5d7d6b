"""Drives recorded as MCAP by cns-drake, or by other programs on its topics."""

from collections.abc import Mapping
import contextlib
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.drives import mcap_messages, point_layouts, ros_types
from cns_drake.base.drives.drive import ODOMETRY_DTYPE, Drive, index_instances
from cns_drake.base.drives.mcap_file import McapFile
from cns_drake.base.drives.mcap_messages import StaticTransforms, checked_poses
from cns_drake.base.drives.message_rows import (
    MessageRows,
    transform_row,
    vehicle_frames,
)
from cns_drake.base.errors import InputError, value_errors
from cns_drake.base.json_text import parse_json
from cns_drake.base.listing import listed

_LIDAR_TOPIC = "/lidar/points"
_ODOMETRY_TOPIC = "/odometry"
_IMU_TOPIC = "/imu/data"
_TF_TOPIC = "/tf"
_TF_STATIC_TOPIC = "/tf_static"
_KALIBR = "imu.yaml"
# By REP 105 of ROS, other frames, such as `odom`, may start anew in each drive.
_SHARED_FRAME = "map"
# If log times in a file step back by more than this, the messages are not late:
# the clock was set back [s].
_LATEST = 1.0


class McapDrive(Drive):
    """A drive in an MCAP file with /lidar/points, /odometry and /tf_static.

    Without `/lidar/points`, the scans come from the file's only topic of point
    clouds. If there are several LiDARs, the argument `lidar` chooses one. Two
    topics are optional: /imu/data, and /<lidar>/labels with `label` and
    `instance` of each point. Images come from the first topic of compressed
    images.

    Scan i is the i-th point cloud of the LiDAR by log time. The pose of the
    scan is the pose in the `/odometry` message with exactly the same stamp,
    composed with the pose of the LiDAR on the vehicle from `/tf_static`. Poses
    are not interpolated. At the start and end of the recording, scans without a
    pose or labels are left out, and a note says so. This happens, for example,
    if the recording was cut off and repaired.

    Contradictions raise an error: two poses for one stamp, two mounts of a
    sensor, or a frame that changes during the drive.

    Opening a drive reads the file's index; reading a scan reads one chunk. The
    first use of stamps or poses reads the chunks that hold odometry. If the
    file does not state that log times equal stamps, the first use of stamps
    also reads all clouds. Recordings of cns-drake contain this statement, and
    each chunk in them holds only one topic.
    """

    def __init__(self, path: Path, lidar: str | None = None):
        """Opens a recording.

        Args:
            path: the .mcap file, or the folder that holds it.
            lidar: name of the LiDAR, whose scans are on the topic
                /<lidar>/points; or a topic of scans, with any name.

        Raises:
            InputError: if there is no complete recording at `path`, or no
                such LiDAR in it.
        """
        self._file = McapFile(_mcap_path(Path(path)))
        self._path = self._file.path
        self.name = _drive_name(Path(path))
        self._lidar_topic = self._find_lidar_topic(lidar)
        self._message_types = {
            self._lidar_topic: ros_types.POINT_CLOUD,
            _ODOMETRY_TOPIC: ros_types.ODOMETRY,
            _TF_STATIC_TOPIC: ros_types.TF,
        }
        labels = self._lidar_topic.removesuffix("points") + "labels"
        self._labels_topic = labels if labels in self._file.topics else None
        if self._labels_topic is not None:
            self._message_types[labels] = ros_types.POINT_CLOUD
        if _IMU_TOPIC in self._file.topics:
            self._message_types[_IMU_TOPIC] = ros_types.IMU
        for topic, message_type in self._message_types.items():
            self._check_topic(topic, message_type)
        if self._file.topics.get(_TF_TOPIC) == [f"{ros_types.TF} in cdr"]:
            self._message_types[_TF_TOPIC] = ros_types.TF
        self._all_scans = self._file.locate(self._lidar_topic)
        # `image_transport` adds compressedDepth to the names of depth images.
        self._camera_topics = [
            topic
            for topic, kinds in self._file.topics.items()
            if kinds == [f"{ros_types.COMPRESSED_IMAGE} in cdr"]
            and not topic.endswith("/compressedDepth")
        ]
        self._message_types.update(
            dict.fromkeys(self._camera_topics, ros_types.COMPRESSED_IMAGE)
        )

    def __len__(self) -> int:
        return len(self._scans)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._track[0]

    @property
    def X_WS(self) -> np.ndarray:
        return self._track[1]

    @cached_property
    def motion(self) -> tuple[np.ndarray, np.ndarray]:
        _, odometry = self._stamps_and_odometry
        rows = np.concatenate([odometry, self._later_poses()])
        stamps_ns, kept = np.unique(rows["stamp_ns"], return_index=True)
        X_WB = checked_poses(
            rows["position"][kept], rows["quat_xyzw"][kept], str(self._path)
        )
        return stamps_ns, X_WB @ self.X_BS

    def _later_poses(self) -> np.ndarray:
        """Returns poses of the vehicle on /tf that are later than the odometry.

        They are records of `ODOMETRY_DTYPE` with velocities of zero.
        """
        if _TF_TOPIC not in self._message_types:
            return np.zeros(0, ODOMETRY_DTYPE)
        last = self._file.locate(_ODOMETRY_TOPIC)[-1]
        odometry = self._message(_ODOMETRY_TOPIC, last)
        places = self._file.locate(_TF_TOPIC)
        found = [
            transform_row(edge)
            for place in places[places["log_time_ns"] > last["log_time_ns"]]
            for edge in self._message(_TF_TOPIC, place).transforms
            if vehicle_frames(edge) == vehicle_frames(odometry)
        ]
        rows = np.array(found, ODOMETRY_DTYPE)
        return rows[rows["stamp_ns"] > mcap_messages.stamp_ns(odometry.header)]

    @property
    def lidar_names(self) -> tuple[str, ...]:
        """Names of the LiDARs; the first is the one that is read by default."""
        clouds = self._cloud_topics()
        clouds.sort(key=lambda topic: topic != _LIDAR_TOPIC)
        return tuple(map(_lidar_name, clouds))

    @property
    def lidar_name(self) -> str:
        """Name of the LiDAR whose scans are read."""
        return _lidar_name(self._lidar_topic)

    @cached_property
    def lidar_section(self) -> Mapping:
        lidars = (self.scenario or {}).get("lidars")
        section = lidars.get(self.lidar_name) if isinstance(lidars, dict) else 0
        return section if isinstance(section, dict) else {}

    @property
    def world_frame(self) -> str:  # type: ignore[override]  # Read late.
        return self._first(_ODOMETRY_TOPIC).header.frame_id

    @property
    def notes(self) -> tuple[str, ...]:
        notes = []
        missing = len(self._all_scans) - len(self)
        if missing:
            notes.append(
                f"{self._path}: {_ODOMETRY_TOPIC}: no pose (or no labels) for"
                f" {missing} of {len(self._all_scans)} scans at the ends of the"
                " drive; they are left out"
            )
        for topic in (self._lidar_topic, _ODOMETRY_TOPIC):
            back = self._file.step_back_ns(topic) * 1e-9
            if back > _LATEST:
                notes.append(
                    f"{self._path}: {topic}: the clock goes back by {back:.3g}"
                    " s; messages are read in the order of their log times"
                )
        if self.world_frame != _SHARED_FRAME:
            notes.append(
                f"{self._path}: {_ODOMETRY_TOPIC}: all drives with poses in a"
                f" frame {self.world_frame!r} count as drives in one world"
                " (--align always aligns them nevertheless)"
            )
        return (*notes, *filter(None, [self.distortion_note]))

    @property
    def files(self) -> tuple[Path, ...]:
        return (self._path,)

    @property
    def distortion_note(self) -> str | None:
        """A note for the user if the scans contain motion distortion.

        The value is None if the scans contain no motion distortion, and for
        recordings of real LiDARs, which do not state whether their scans are
        distorted.
        """
        if not self.lidar_section.get("motion_distortion"):
            return None
        return (
            f"{self._path}: taken while the LiDAR moved, and used as taken"
            " (evaluation.drives.deskewing takes the motion out)"
        )

    @property
    def scenario(self) -> Mapping | None:
        scenario = self._json("scenario.json")
        if scenario is not None and not isinstance(scenario, dict):
            raise InputError(
                f"{self._path}: attachment scenario.json: not a JSON object"
            )
        return scenario

    @property
    def inputs(self) -> Any:
        """SHA-256 digests of the files that a simulated drive was made from.

        The digests are the value of `inputs_sha256` in the attachment
        `provenance.json`; None if the recording lacks this value.
        """
        found = self._json("provenance.json")
        return found.get("inputs_sha256") if isinstance(found, dict) else None

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
        place = self._scans[index]
        message = self._message(self._lidar_topic, place)
        stamp_ns = mcap_messages.stamp_ns(message.header)
        with self._faults(
            f"{self._lidar_topic}: scan {index} at {stamp_ns} ns"
        ):
            self._check_frame(message.header.frame_id)
            logged_ns = int(place["log_time_ns"])
            if self._logged_stamps_ns is not None and stamp_ns != logged_ns:
                raise ValueError(
                    f"its log time is {logged_ns} ns, though the file states"
                    " that log times are stamps"
                )
            points = point_layouts.to_points(message)
            point_arrays.check_range(points, point_arrays.FARTHEST_RETURN)
            return point_layouts.from_layout(
                points,
                self._labels(index, message),
                lambda: self.lidar_section.get("returns") == "calibrated",
            )

    def _labels(self, index: int, cloud: Any) -> np.ndarray | None:
        """Returns the labels of a scan from their own topic, if any."""
        topic = self._labels_topic
        if topic is None:
            return None
        message = self._message(topic, self._file.locate(topic)[index])
        if message.header.stamp != cloud.header.stamp:
            raise ValueError(
                f"{topic}: number {index} has another stamp than the scan"
            )
        return point_layouts.to_records(message)

    @property
    def kalibr(self) -> str | None:
        """Noise of the IMU as text in Kalibr's file format; None without noise.

        Raises:
            InputError: the recording's attachment with the noise is no text.
        """
        data = self._file.attachment(_KALIBR)
        try:
            return None if data is None else data.decode()
        except UnicodeDecodeError as error:
            raise InputError(
                f"{self._path}: attachment {_KALIBR}: no text"
            ) from error

    @property
    def odometry(self) -> np.ndarray:
        return self._stamps_and_odometry[1]

    @cached_property
    def imu(self) -> np.ndarray | None:
        if _IMU_TOPIC not in self._message_types:
            return None
        places = self._file.locate(_IMU_TOPIC)
        rows = MessageRows(ros_types.IMU, len(places))
        with self._faults(_IMU_TOPIC):
            for index, data in self._file.visit(places):
                rows.add(index, data)
        imu = rows.rows()
        self._check_agreement(_IMU_TOPIC, imu)
        return imu

    @property
    def image_stamps_ns(self) -> np.ndarray:
        """(M,) int64 time of each image of the first camera [ns].

        The times are the stamps of the images. Images that were recorded in
        another order are sorted by their stamps.
        """
        return self._images[0]

    def image(self, index: int) -> bytes:
        topic = self._camera_topics[0]
        return self._message(topic, self._images[1][index]).data.tobytes()

    @cached_property
    def _images(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (M,) [ns] and places of the first camera's images."""
        if not self._camera_topics:
            return super().image_stamps_ns, self._all_scans[:0]
        topic = self._camera_topics[0]
        places = self._file.locate(topic)
        stamps_ns = self._read_logged_stamps(topic)
        if stamps_ns is None:
            stamps_ns = np.zeros(len(places), np.int64)
            with self._faults(topic):
                for index, data in self._file.visit(places):
                    stamps_ns[index] = mcap_messages.read_stamp(data) or 0
        if (stamps_ns == 0).any():
            raise InputError(f"{self._path}: {topic}: an image has no stamp")
        order = np.argsort(stamps_ns, kind="stable")
        return stamps_ns[order], places[order]

    @cached_property
    def _scans(self) -> np.ndarray:
        """Locations of the scans, except scans at the ends that lack a pose."""
        scans = self._all_scans
        odometry = self._file.locate(_ODOMETRY_TOPIC)
        num_labelled = len(scans)
        if self._labels_topic is not None:
            num_labelled = len(self._file.locate(self._labels_topic))
        if (
            num_labelled >= len(scans)
            and self._is_posed(scans[0], odometry)
            and self._is_posed(scans[-1], odometry[::-1])
        ):
            return scans
        stamps_ns, rows = self._stamps_and_odometry
        usable = np.isin(stamps_ns, rows["stamp_ns"])
        usable[num_labelled:] = False
        kept = np.flatnonzero(usable)
        # Without any pose, the fault is not at the ends.
        return scans[kept[0] : kept[-1] + 1] if len(kept) else scans

    def _is_posed(self, scan: np.void, odometry: np.ndarray) -> bool:
        """Returns whether one of the first messages has a scan's stamp."""
        wanted, _ = self._read_cloud_header(self._file.read(scan))
        backward = odometry[0]["log_time_ns"] > odometry[-1]["log_time_ns"]
        for place in odometry:
            header = self._message(_ODOMETRY_TOPIC, place).header
            later = mcap_messages.stamp_ns(header) - wanted
            if later == 0:
                return True
            if (-later if backward else later) > _LATEST * 1e9:
                return False
        return False

    @cached_property
    def _track(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (N,) [ns] and poses (N, 4, 4) of the scans."""
        stamps_ns, odometry = self._stamps_and_odometry
        first = np.flatnonzero(self._all_scans == self._scans[0])[0]
        stamps_ns = stamps_ns[first : first + len(self)]
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
        X_WB = checked_poses(
            matching["position"], matching["quat_xyzw"], str(self._path)
        )
        return stamps_ns, X_WB @ self.X_BS

    @cached_property
    def _stamps_and_odometry(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps of all scans, and the odometry, in one pass."""
        places = self._file.locate(_ODOMETRY_TOPIC)
        rows = MessageRows(ros_types.ODOMETRY, len(places))
        logged_ns = self._logged_stamps_ns
        if logged_ns is None:
            clouds = self._all_scans
            stamps_ns = np.zeros(len(clouds), np.int64)
        else:
            clouds = self._all_scans[:0]
            stamps_ns = logged_ns
        for index, data in self._file.visit(np.concatenate([clouds, places])):
            if index < len(clouds):
                stamps_ns[index], frame = self._read_cloud_header(data)
                with self._faults(
                    f"{self._lidar_topic}: at {stamps_ns[index]} ns"
                ):
                    self._check_frame(frame)
            else:
                with self._faults(_ODOMETRY_TOPIC):
                    rows.add(index - len(clouds), data)
        odometry = rows.rows()
        disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
        if len(disorder):
            raise InputError(
                f"{self._path}: {self._lidar_topic}: the stamp of scan"
                f" {disorder[0] + 1} is not later than the one before"
            )
        self._check_agreement(_ODOMETRY_TOPIC, odometry)
        return stamps_ns, odometry

    @cached_property
    def _logged_stamps_ns(self) -> np.ndarray | None:
        """Stamps (N,) of all scans from the file's index; None if not there."""
        return self._read_logged_stamps(self._lidar_topic)

    def _read_logged_stamps(self, topic: str) -> np.ndarray | None:
        """Returns a topic's log times [ns], if the file calls them stamps."""
        places = self._file.locate(topic)
        records = self._file.metadata(mcap_messages.STAMPED_RECORD)
        if [one.get(topic) for one in records] != [str(len(places))]:
            return None
        for place in places[[0, -1]]:
            with self._faults(topic):
                stamp_ns = mcap_messages.read_stamp(self._file.read(place))
            if stamp_ns != place["log_time_ns"]:
                return None
        return places["log_time_ns"].astype(np.int64)

    @cached_property
    def X_BS(self) -> np.ndarray:
        """Pose of the LiDAR S on the vehicle B, (4, 4), from /tf_static."""
        return self._mount(self._lidar_frame)

    @cached_property
    def X_BI(self) -> np.ndarray | None:
        """Pose of the IMU I on the vehicle B, (4, 4); None without an IMU."""
        if _IMU_TOPIC not in self._message_types:
            return None
        return self._mount(self._first(_IMU_TOPIC).header.frame_id)

    def _mount(self, frame: str) -> np.ndarray:
        """Returns the pose (4, 4) of a sensor's frame on the vehicle."""
        base = self._first(_ODOMETRY_TOPIC).child_frame_id
        return self._transforms.pose(base, frame)

    @cached_property
    def _transforms(self) -> StaticTransforms:
        topic = _TF_STATIC_TOPIC
        places = self._file.locate(topic)
        messages = (self._message(topic, place) for place in places)
        return StaticTransforms(messages, f"{self._path}: {topic}")

    def _first(self, topic: str) -> Any:
        return self._message(topic, self._file.locate(topic)[0])

    def _message(self, topic: str, place: np.void) -> Any:
        return self._decode(topic, self._file.read(place))

    def _decode(self, topic: str, data: memoryview) -> Any:
        with self._faults(topic):
            return mcap_messages.decode(data, self._message_types[topic])

    def _faults(self, where: str) -> contextlib.AbstractContextManager[None]:
        """Turns a ValueError into an InputError that names file and place."""
        return value_errors(f"{self._path}: {where}")

    @cached_property
    def _lidar_frame(self) -> str:
        return self._first(self._lidar_topic).header.frame_id

    def _check_frame(self, frame: str) -> None:
        """Refuses a scan in another frame than the first.

        Raises:
            ValueError: the frame is another.
        """
        if frame != self._lidar_frame:
            raise ValueError(
                f"in frame {frame!r}, at first in {self._lidar_frame!r}"
            )

    def _read_cloud_header(self, data: memoryview) -> tuple[int, str]:
        """Returns the stamp [ns] and the frame of a scan."""
        with self._faults(self._lidar_topic):
            return mcap_messages.read_cloud_header(data)

    def _check_agreement(self, topic: str, rows: np.ndarray) -> None:
        """Refuses two different messages with one stamp."""
        order = np.argsort(rows["stamp_ns"], kind="stable")
        twice = np.flatnonzero(np.diff(rows["stamp_ns"][order]) == 0)
        for one, other in zip(order[twice], order[twice + 1], strict=True):
            for name in rows.dtype.names or ():
                old, new = rows[name][one], rows[name][other]
                if not np.array_equal(old, new, equal_nan=True):
                    raise InputError(
                        f"{self._path}: {topic}: {name} at"
                        f" {rows['stamp_ns'][one]} ns: {old} and {new}"
                    )

    def _find_lidar_topic(self, lidar: str | None) -> str:
        """Returns the named LiDAR's topic, /lidar/points, or the only one."""
        clouds = self._cloud_topics()
        topics = self._file.topics
        wanted = _LIDAR_TOPIC
        if lidar is not None:
            wanted = f"/{lidar}/points"
            named = (lidar, wanted, f"/{lidar}")
            wanted = next((one for one in named if one in topics), wanted)
        elif _LIDAR_TOPIC not in topics and len(clouds) == 1:
            wanted = clouds[0]
        if wanted not in topics and clouds:
            advice = "" if lidar else "; --lidar takes one of them"
            raise InputError(
                f"{self._path}: no topic {wanted} (point clouds:"
                f" {' '.join(clouds)}{advice})"
            )
        return wanted

    def _cloud_topics(self) -> list[str]:
        return [
            topic
            for topic, kinds in self._file.topics.items()
            if any(kind.startswith(ros_types.POINT_CLOUD) for kind in kinds)
            and not topic.endswith("/labels")
        ]

    def _check_topic(self, topic: str, message_type: str) -> None:
        found = self._file.topics.get(topic)
        if found is None:
            raise InputError(f"{self._path}: no topic {topic}")
        if found != [f"{message_type} in cdr"]:
            raise InputError(
                f"{self._path}: {topic}: {' and '.join(found)} instead of"
                f" {message_type} in cdr"
            )
        if len(self._file.locate(topic)) == 0:
            raise InputError(f"{self._path}: {topic}: no message")

    def _json(self, name: str) -> Any:
        data = self._file.attachment(name)
        with self._faults(f"attachment {name}"):
            return None if data is None else parse_json(data)


def holds_mcap(path: Path) -> bool:
    """Returns whether `path` is an .mcap file or a folder with one."""
    if path.is_dir():
        return bool(listed(path, "*.mcap"))
    return path.suffix == ".mcap"


def _mcap_path(path: Path) -> Path:
    if not path.is_dir():
        return path
    files = listed(path, "*.mcap")
    if len(files) != 1:
        raise InputError(f"{path}: {len(files)} .mcap files instead of one")
    return files[0]


def _drive_name(path: Path) -> str:
    resolved = path.resolve()
    # rosbag2 numbers the files of a recording: <name>_0.mcap.
    return (
        resolved.name if resolved.is_dir() else resolved.stem.removesuffix("_0")
    )


def _lidar_name(topic: str) -> str:
    """Returns NAME for the topic /NAME/points, and other topics as they are."""
    name = topic.removeprefix("/").removesuffix("/points")
    return name if topic == f"/{name}/points" else topic
