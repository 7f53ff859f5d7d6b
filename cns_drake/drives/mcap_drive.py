"""Drives recorded as MCAP by cns-drake, or by programs with the same topics."""

from collections.abc import Iterable, Mapping
import contextlib
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import InputError, listed, parse_json, value_errors
from cns_drake.base import points as point_arrays
from cns_drake.drives import mcap_messages, ros_types
from cns_drake.drives.drive import (
    ODOMETRY_DTYPE,
    Drive,
    as_given,
    index_instances,
)
from cns_drake.drives.mcap_file import LOCATION, McapFile
from cns_drake.drives.mcap_messages import StaticTransforms, checked_poses
from cns_drake.drives.message_rows import (
    MessageRows,
    check_agreement,
    transform_row,
    vehicle_frames,
)
from cns_drake.drives.point_cloud2 import has_wrong_rows, to_points, to_records
from cns_drake.drives.point_layouts import from_layout

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
# `image_transport` adds this to the names of topics of depth images.
_DEPTH = "/compressedDepth"


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
    if the recording was cut off and recovered.

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
        self._topics = _McapTopics(_mcap_path(Path(path)))
        self._file = self._topics.file
        self._path = self._topics.path
        self.name = _drive_name(Path(path))
        self._lidar_topic = _choose_lidar_topic(
            self._file.topics, lidar, self._path
        )
        self._topics.require(self._lidar_topic, ros_types.POINT_CLOUD)
        self._topics.require(_ODOMETRY_TOPIC, ros_types.ODOMETRY)
        self._topics.require(_TF_STATIC_TOPIC, ros_types.TF)
        labels = self._lidar_topic.removesuffix("points") + "labels"
        self._labels_topic = labels if labels in self._file.topics else None
        if self._labels_topic is not None:
            self._topics.require(labels, ros_types.POINT_CLOUD)
        if _IMU_TOPIC in self._file.topics:
            self._topics.require(_IMU_TOPIC, ros_types.IMU)
        self._has_tf = _TF_TOPIC in self._topics.find(ros_types.TF)
        self._all_scans = self._file.locate(self._lidar_topic)
        self._images = _McapImages(self._topics)

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
        if not self._has_tf:
            return np.zeros(0, ODOMETRY_DTYPE)
        last = self._file.locate(_ODOMETRY_TOPIC)[-1]
        odometry = self._topics.message(_ODOMETRY_TOPIC, last)
        places = self._file.locate(_TF_TOPIC)
        found = [
            transform_row(edge)
            for place in places[places["log_time_ns"] > last["log_time_ns"]]
            for edge in self._topics.message(_TF_TOPIC, place).transforms
            if vehicle_frames(edge) == vehicle_frames(odometry)
        ]
        rows = np.array(found, ODOMETRY_DTYPE)
        return rows[rows["stamp_ns"] > mcap_messages.stamp_ns(odometry.header)]

    @property
    def lidar_names(self) -> tuple[str, ...]:
        """Names of the LiDARs; the first is the one that is read by default."""
        clouds = _cloud_topics(self._file.topics)
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
        return self._topics.first(_ODOMETRY_TOPIC).header.frame_id

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
        if has_wrong_rows(self._topics.first(self._lidar_topic)):
            notes.append(
                f"{self._path}: {self._lidar_topic}: row_step is not width x"
                " point_step; the points are read one after the other, which"
                " the length of the data shows"
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
            " (cns_drake.drives.deskewing takes the motion out)"
        )

    @property
    def scenario(self) -> Mapping | None:
        scenario = self._topics.json("scenario.json")
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
        found = self._topics.json("provenance.json")
        return found.get("inputs_sha256") if isinstance(found, dict) else None

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        table = self._topics.json("structures.json")
        if table is None:
            return None
        return index_instances(
            table, f"{self._path}: attachment structures.json"
        )

    def scan(self, index: int) -> np.ndarray:
        if not 0 <= index < len(self):
            raise IndexError(f"scan {index} of {len(self)}")
        place = self._scans[index]
        message = self._topics.message(self._lidar_topic, place)
        stamp_ns = mcap_messages.stamp_ns(message.header)
        with self._topics.faults(
            f"{self._lidar_topic}: scan {index} at {stamp_ns} ns"
        ):
            self._check_frame(message.header.frame_id)
            logged_ns = int(place["log_time_ns"])
            if self._logged_stamps_ns is not None and stamp_ns != logged_ns:
                raise ValueError(
                    f"its log time is {logged_ns} ns, though the file states"
                    " that log times are stamps"
                )
            points = to_points(message)
            point_arrays.check_range(points, point_arrays.FARTHEST_RETURN)
            return from_layout(
                points,
                self._labels(index, message),
                # Other programs have other units.
                lambda: (
                    self._file.library.startswith("cns-drake ")
                    and self.lidar_section.get("returns") != "calibrated"
                ),
            )

    def _labels(self, index: int, cloud: Any) -> np.ndarray | None:
        """Returns the labels of a scan from their own topic, if any."""
        topic = self._labels_topic
        if topic is None:
            return None
        message = self._topics.message(topic, self._file.locate(topic)[index])
        if message.header.stamp != cloud.header.stamp:
            raise ValueError(
                f"{topic}: number {index} has another stamp than the scan"
            )
        return to_records(message)

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
        if _IMU_TOPIC not in self._topics:
            return None
        return self._topics.rows(_IMU_TOPIC)

    @property
    def image_stamps_ns(self) -> np.ndarray:
        """(M,) int64 time of each image of the first camera [ns].

        The times are the stamps of the images. Images that were recorded in
        another order are sorted by their stamps.
        """
        return self._images.stamps_ns

    def image(self, index: int) -> bytes:
        return self._images.image(index)

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
            header = self._topics.message(_ODOMETRY_TOPIC, place).header
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
                with self._topics.faults(
                    f"{self._lidar_topic}: at {stamps_ns[index]} ns"
                ):
                    self._check_frame(frame)
            else:
                with self._topics.faults(_ODOMETRY_TOPIC):
                    rows.add(index - len(clouds), data)
        odometry = rows.rows()
        disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
        if len(disorder):
            raise InputError(
                f"{self._path}: {self._lidar_topic}: the stamp of scan"
                f" {disorder[0] + 1} is not later than the one before"
            )
        with self._topics.faults(_ODOMETRY_TOPIC):
            check_agreement(odometry)
        return stamps_ns, odometry

    @cached_property
    def _logged_stamps_ns(self) -> np.ndarray | None:
        """Stamps (N,) of all scans, if the file's index has them, or None."""
        return self._topics.logged_stamps_ns(self._lidar_topic)

    @cached_property
    def X_BS(self) -> np.ndarray:
        """Pose of the LiDAR S on the vehicle B, (4, 4), from /tf_static."""
        return self._mount(self._lidar_frame)

    @cached_property
    def X_BI(self) -> np.ndarray | None:
        """Pose of the IMU I on the vehicle B, (4, 4); None without an IMU."""
        if _IMU_TOPIC not in self._topics:
            return None
        return self._mount(self._topics.first(_IMU_TOPIC).header.frame_id)

    def _mount(self, frame: str) -> np.ndarray:
        """Returns the pose (4, 4) of a sensor's frame on the vehicle."""
        base = self._topics.first(_ODOMETRY_TOPIC).child_frame_id
        for topic, name, value in (
            (_ODOMETRY_TOPIC, "child_frame_id", base),
            ("the sensor's topic", "frame_id", frame),
        ):
            if not value:
                raise InputError(
                    f"{self._path}: {topic}: {name} is empty, so no mounting"
                    f" pose can be found ({self._transforms.listed()})"
                )
        return self._transforms.pose(base, frame)

    @cached_property
    def _transforms(self) -> StaticTransforms:
        topic = _TF_STATIC_TOPIC
        places = self._file.locate(topic)
        messages = (self._topics.message(topic, place) for place in places)
        return StaticTransforms(messages, f"{self._path}: {topic}")

    @cached_property
    def _lidar_frame(self) -> str:
        return self._topics.first(self._lidar_topic).header.frame_id

    def _check_frame(self, frame: str) -> None:
        """Refuses a scan whose frame differs from the first scan's frame.

        Raises:
            ValueError: the frames differ.
        """
        if frame != self._lidar_frame:
            raise ValueError(
                f"in frame {frame!r}, at first in {self._lidar_frame!r}"
            )

    def _read_cloud_header(self, data: memoryview) -> tuple[int, str]:
        """Returns the stamp [ns] and the frame of a scan."""
        with self._topics.faults(self._lidar_topic):
            return mcap_messages.read_cloud_header(data)


class _McapTopics:
    """Reads and decodes messages of an MCAP file; errors name file and topic.

    Attributes:
        file: the file.
        path: path of the file.
    """

    def __init__(self, path: Path):
        """Opens a file; no topic is read yet.

        Raises:
            InputError: there is no complete MCAP file.
        """
        self.file = McapFile(path)
        self.path = self.file.path
        self._types: dict[str, str] = {}

    def __contains__(self, topic: str) -> bool:
        """Returns whether messages of a topic can be decoded."""
        return topic in self._types

    def require(self, topic: str, message_type: str) -> None:
        """Checks that a topic has messages, all of one type in CDR.

        Raises:
            InputError: the topic has no message, or messages of other types.
        """
        found = self.file.topics.get(topic)
        if found is None:
            there = "; ".join(
                f"{name}: {' and '.join(kinds)}"
                for name, kinds in sorted(self.file.topics.items())
            )
            raise InputError(
                f"{self.path}: no topic {topic} of {message_type} (there are:"
                f" {there or 'no topics'})"
            )
        if found != [f"{message_type} in cdr"]:
            raise InputError(
                f"{self.path}: {topic}: {' and '.join(found)} instead of"
                f" {message_type} in cdr"
            )
        if len(self.file.locate(topic)) == 0:
            raise InputError(f"{self.path}: {topic}: no message")
        self._types[topic] = message_type

    def find(self, message_type: str) -> list[str]:
        """Returns all topics whose messages are of one type, in CDR.

        The messages of these topics can then be decoded.
        """
        found = [
            topic
            for topic, kinds in self.file.topics.items()
            if kinds == [f"{message_type} in cdr"]
        ]
        self._types |= dict.fromkeys(found, message_type)
        return found

    def message(self, topic: str, place: np.void) -> Any:
        """Returns the decoded message at a location in the file.

        Args:
            topic: topic of the message.
            place: the location, a row of `McapFile.locate`.

        Raises:
            InputError: the message cannot be read or decoded.
        """
        data = self.file.read(place)
        with self.faults(topic):
            return mcap_messages.decode(data, self._types[topic])

    def first(self, topic: str) -> Any:
        """Returns the first message of a topic, decoded."""
        return self.message(topic, self.file.locate(topic)[0])

    def rows(self, topic: str) -> np.ndarray:
        """Returns all messages of a topic of odometry or of an IMU as rows.

        Raises:
            InputError: a message cannot be read, or two different messages have
                the same stamp.
        """
        places = self.file.locate(topic)
        rows = MessageRows(self._types[topic], len(places))
        with self.faults(topic):
            for index, data in self.file.visit(places):
                rows.add(index, data)
            found = rows.rows()
            check_agreement(found)
        return found

    def logged_stamps_ns(self, topic: str) -> np.ndarray | None:
        """Returns the stamps (N,) of a topic's messages [ns] from the index.

        The result is None if the file does not state that the log times of the
        topic are stamps.
        """
        places = self.file.locate(topic)
        records = self.file.metadata(mcap_messages.STAMPED_RECORD)
        if [record.get(topic) for record in records] != [str(len(places))]:
            return None
        for place in places[[0, -1]]:
            with self.faults(topic):
                stamp_ns = mcap_messages.read_stamp(self.file.read(place))
            if stamp_ns != place["log_time_ns"]:
                return None
        return places["log_time_ns"].astype(np.int64)

    def json(self, name: str) -> Any:
        """Returns the value of a JSON attachment; None if the file lacks it.

        Raises:
            InputError: the attachment cannot be read, or is not JSON.
        """
        data = self.file.attachment(name)
        with self.faults(f"attachment {name}"):
            return None if data is None else parse_json(data)

    def faults(self, where: str) -> contextlib.AbstractContextManager[None]:
        """Turns a ValueError into an InputError that names file and place."""
        return value_errors(f"{self.path}: {where}")


class _McapImages:
    """The images of the first topic of compressed images, if there is one."""

    def __init__(self, topics: _McapTopics):
        self._topics = topics
        found = topics.find(ros_types.COMPRESSED_IMAGE)
        cameras = [topic for topic in found if not topic.endswith(_DEPTH)]
        self._topic = cameras[0] if cameras else None

    @property
    def stamps_ns(self) -> np.ndarray:
        """(M,) int64 stamp of each image, sorted [ns].

        Raises:
            InputError: an image has no stamp.
        """
        return self._sorted[0]

    def image(self, index: int) -> bytes:
        """Returns image `index`, in the order of the stamps, as encoded."""
        if self._topic is None:
            raise IndexError(f"image {index} of 0")
        place = self._sorted[1][index]
        return self._topics.message(self._topic, place).data.tobytes()

    @cached_property
    def _sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (M,) [ns] and places of the images, sorted by stamp."""
        topic = self._topic
        if topic is None:
            return np.zeros(0, np.int64), np.zeros(0, LOCATION)
        places = self._topics.file.locate(topic)
        stamps_ns = self._topics.logged_stamps_ns(topic)
        if stamps_ns is None:
            stamps_ns = np.zeros(len(places), np.int64)
            with self._topics.faults(topic):
                for index, data in self._topics.file.visit(places):
                    stamps_ns[index] = mcap_messages.read_stamp(data) or 0
        if (stamps_ns == 0).any():
            raise InputError(
                f"{self._topics.path}: {topic}: an image has no stamp"
            )
        order = np.argsort(stamps_ns, kind="stable")
        return stamps_ns[order], places[order]


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
    place = as_given(path)
    # rosbag2 numbers the files of a recording: <name>_0.mcap.
    return place.name if place.is_dir() else place.stem.removesuffix("_0")


_LIDAR_TOPIC = "/lidar/points"


def _cloud_topics(topics: Mapping[str, Iterable[str]]) -> list[str]:
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


def _choose_lidar_topic(
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
    clouds = _cloud_topics(topics)
    wanted = _LIDAR_TOPIC
    if lidar is not None:
        wanted = f"/{lidar}/points"
        named = (lidar, wanted, f"/{lidar}")
        wanted = next((topic for topic in named if topic in topics), wanted)
    elif _LIDAR_TOPIC not in topics and len(clouds) == 1:
        wanted = clouds[0]
    if wanted not in topics and clouds:
        advice = "" if lidar else "; choose one as the LiDAR"
        raise InputError(
            f"{source}: no topic {wanted} (point clouds:"
            f" {' '.join(clouds)}{advice})"
        )
    return wanted


def _lidar_name(topic: str) -> str:
    """Returns NAME for the topic /NAME/points, and other topics as they are."""
    name = topic.removeprefix("/").removesuffix("/points")
    return name if topic == f"/{name}/points" else topic
