"""Drives in bags of ROS: recordings of cns-drake, and those of robots."""

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from functools import cached_property, partial
from pathlib import Path
import re
from typing import Any, NamedTuple, NoReturn

import numpy as np

from evaluation.base import (
    FARTHEST_RETURN,
    NS_PER_S,
    InputError,
    check_range,
    is_there,
    listed,
    parse_json,
    poses,
    read_text,
    read_yaml,
    reading,
    value_errors,
    xyz,
)
from evaluation.clouds import coarse_note
from evaluation.drives import mcap_messages, ros_messages
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import (
    ODOMETRY_DTYPE,
    Drive,
    as_given,
    index_instances,
    poses_frame,
)
from evaluation.drives.drive_scenario import SCENARIO, read_scenario
from evaluation.drives.mcap_file import LOCATION, McapFile
from evaluation.drives.mcap_messages import (
    StaticTransforms,
    checked_poses,
    frame_name,
)
from evaluation.drives.message_rows import (
    POSE_ROWS,
    MessageRows,
    check_agreement,
    transform_row,
    vehicle_frames,
)
from evaluation.drives.point_cloud2 import (
    has_wrong_rows,
    livox_points,
    to_points,
    to_records,
)
from evaluation.drives.point_layouts import from_layout
from evaluation.drives.rosbag_file import RosbagFile, check_finished
from evaluation.drives.scan_files import are_returns
from evaluation.drives.stamped_poses import PosedScans, PoseSteps, StampedPoses
from evaluation.drives.trajectories import read_trajectory

_IMU_TOPIC = "/imu/data"
_TF_TOPIC = "/tf"
_TF_STATIC_TOPIC = "/tf_static"
_KALIBR = "imu.yaml"
_METADATA = "metadata.yaml"
# rosbag2 compresses each file or message if its metadata say so.
_PACKED = r"^\s*compression_mode: *[\"']?(file|message)"
# The second scan of a simulator's clock is earlier than this [ns].
_SIMULATED_NS = 10 * NS_PER_S
# A function that returns the poses of the LiDAR, given the scans' stamps [ns].
_Poses = Callable[[np.ndarray], StampedPoses]
# `image_transport` adds this to the names of topics of depth images.
_DEPTH = "/compressedDepth"


class _Stream(NamedTuple):
    """What a drive reads from a topic.

    Attributes:
        title, role: what there are several of, and which is read, in words.
        usual: usual name of the topic.
        types: types of its messages; topics of the first of these types that is
            there are chosen from.
        option: option that chooses a topic.
        ending: what follows a name in the name of its topic.
        advice: what helps if there is none.
    """

    title: str
    role: str
    usual: str
    types: tuple[tuple[str, ...], ...]
    option: str
    ending: str = ""
    advice: str = ""


_LIDAR_TOPIC = "/lidar/points"
# Frames of worlds by ROS' REP 105, and those of LOAM and FAST-LIO.
_WORLD_FRAMES = ("map", "odom", "world", "earth", "camera_init")
_CLOUDS = _Stream(
    "point clouds",
    "LiDAR",
    _LIDAR_TOPIC,
    (ros_messages.CLOUDS,),
    "--lidar TOPIC",
    "/points",
)
_POSES = _Stream(
    "poses",
    "odometry",
    "/odometry",
    tuple((kind,) for kind in POSE_ROWS),
    "--odometry TOPIC",
    advice="; --poses FILE gives poses of the LiDAR",
)


class McapDrive(Drive):
    """A drive in a bag: a topic of scans, one of poses, and `/tf_static`.

    The bag is an MCAP file, a bag of rosbag2 with SQLite, of several files or
    compressed, or a bag of ROS 1. The scans are on `/lidar/points`, or on the
    only topic of point clouds; if there are several LiDARs, the argument
    `lidar` chooses one. The poses are on `/odometry`, or on the only topic of
    odometry or, without one, of poses. Topics without a message do not count.
    Two topics are optional: /imu/data, and /<lidar>/labels with `label` and
    `instance` of each point. Images come from the first topic of compressed
    images.

    Scans are in the order of their stamps, whatever their log times are. The
    pose of a scan is interpolated at its stamp, see `StampedPoses.at_scans`,
    and composed with the pose of the LiDAR on the vehicle from `/tf_static`.
    Without such a transform, the poses are taken as those of the LiDAR. Points
    in the frame of the world are moved into the frame of the LiDAR. Notes say
    each of these.

    Contradictions raise an error: two poses for one stamp, two mounts of a
    sensor, or a frame that changes during the drive.

    Opening a drive reads the file's index; reading a scan reads one chunk. The
    first use of stamps or poses reads the chunks that hold poses. If the file
    does not state that log times equal stamps, the first use of stamps also
    reads all clouds. Recordings of cns-drake contain this statement, and each
    chunk in them holds only one topic.
    """

    placing = (
        " (bags share a world if their poses are in a frame map, utm, earth,"
        " world or enu, or a scenario.yaml in the folder of each names one map;"
        " --odometry TOPIC and --poses FILE choose other poses)"
    )

    def __init__(
        self,
        path: Path,
        lidar: str | None = None,
        odometry: str | None = None,
        poses: _Poses | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a recording.

        Args:
            path: the bag: a file, or the folder that holds it. A folder can
                also hold the scenario, see `read_scenario`.
            lidar: name of the LiDAR, whose scans are on the topic
                /<lidar>/points; or a topic of scans, with any name.
            odometry: topic of the poses.
            poses: function that returns poses of the LiDAR, which are used
                instead of those of a topic.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: if there is no complete recording at `path`, or no such
                topic in it.
        """
        self._topics = _Topics(Path(path))
        self._file = self._topics.file
        self._path = self._topics.path
        self._folder = Path(path)
        self.name = _drive_name(self._folder)
        if self._scenario_beside is not None:
            self.name = str((self.scenario or {}).get("name", self.name))
        self._lidar_topic = self._topics.choose(_CLOUDS, lidar)
        self._given = poses
        self.has_own_world = None if poses is None else False
        self._pose_gap = pose_gap
        self._pose_topic = None
        if poses is None:
            self._pose_topic = self._topics.choose(_POSES, odometry)
        labels = self._lidar_topic.removesuffix("points") + "labels"
        self._labels_topic = labels if labels in self._file.topics else None
        for topic, kind in (
            (labels, ros_messages.POINT_CLOUD),
            (_IMU_TOPIC, ros_messages.IMU),
            (_TF_STATIC_TOPIC, ros_messages.TF),
        ):
            if topic in self._file.topics:
                self._topics.require(topic, kind)
        poses_and_mounts = [self._pose_topic, _TF_STATIC_TOPIC]
        self._topics.read_together(
            self._lidar_topic,
            [one for one in poses_and_mounts if one and one in self._topics],
        )
        self._has_tf = _TF_TOPIC in self._topics.find(ros_messages.TF)
        self._images = _McapImages(self._topics)

    def __len__(self) -> int:
        return len(self._scans)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._all_scans[0][self._kept]

    @cached_property
    def X_WS(self) -> np.ndarray:
        start = self._kept.start - self._posed.kept.start
        return self._posed.X_WB[start : start + len(self)] @ self.X_BS

    @cached_property
    def motion(self) -> tuple[np.ndarray, np.ndarray]:
        found = self._trajectory(self._later_poses())
        return found.stamps_ns, found.X_WB @ self.X_BS

    def _later_poses(self) -> np.ndarray:
        """Returns poses of the vehicle on /tf that are later than the odometry.

        They are records of `ODOMETRY_DTYPE` with velocities of zero.
        """
        topic = self._pose_topic
        if not self._has_tf or topic is None:
            return np.zeros(0, ODOMETRY_DTYPE)
        last_ns = self.odometry["stamp_ns"][-1]
        places = self._file.locate(_TF_TOPIC)
        if self._topics.logged_stamps_ns(topic) is not None:
            places = places[places["log_time_ns"] > last_ns]
        frames = vehicle_frames(self._topics.first(topic))
        found = [
            transform_row(edge)
            for place in places
            for edge in self._topics.message(_TF_TOPIC, place).transforms
            if vehicle_frames(edge) == frames
        ]
        rows = np.array(found, ODOMETRY_DTYPE)
        return rows[rows["stamp_ns"] > last_ns]

    @property
    def lidar_names(self) -> tuple[str, ...]:
        clouds = self._topics.of_types(*_CLOUDS.types)
        clouds.sort(key=lambda topic: topic != _LIDAR_TOPIC)
        return tuple(map(_lidar_name, clouds))

    @property
    def lidar_name(self) -> str:
        return _lidar_name(self._lidar_topic)

    @cached_property
    def lidar_section(self) -> Mapping:
        lidars = (self.scenario or {}).get("lidars")
        if not isinstance(lidars, dict):
            return {}
        section = lidars.get(self.lidar_name)
        if section is None and [*lidars] == ["lidar"]:
            section = lidars["lidar"]  # A user's file; topics have any name.
        return section if isinstance(section, dict) else {}

    @property
    def world_frame(self) -> str:  # type: ignore[override]  # Read late.
        if self._pose_topic is None:
            return poses_frame(Path(str(self._posed_by.source)))
        return frame_name(self._topics.first(self._pose_topic).header.frame_id)

    @property
    def notes(self) -> tuple[str, ...]:
        notes = [*self._file.notes, *self._posed.notes, *self._mounted[1]]
        missing = self._posed.kept.stop - self._kept.stop
        if missing:
            notes.append(
                f"{self._path}: {self._labels_topic}: no labels for the last"
                f" {missing} scans; they are left out"
            )
        first = self._topics.first(self._lidar_topic)
        if not self._is_livox:
            if has_wrong_rows(first):
                notes.append(
                    f"{self._path}: {self._lidar_topic}: row_step is not width"
                    " x point_step; the points are read one after the other,"
                    " which the length of the data shows"
                )
            if coarse := coarse_note(to_points(first)):
                notes.append(f"{self._path}: {self._lidar_topic}: {coarse}")
        return (*notes, *filter(None, [self.distortion_note]))

    @property
    def files(self) -> tuple[Path, ...]:
        given = None if self._given is None else self._posed_by.source
        beside = [one for one in (given, self._scenario_beside) if one]
        return (*self._file.files, *map(Path, map(str, beside)))

    @property
    def distortion_note(self) -> str | None:
        if not self.lidar_section.get("motion_distortion"):
            return None
        return (
            f"{self._path}: taken while the LiDAR moved, and used as taken"
            " (evaluation.drives.deskewing takes the motion out)"
        )

    @cached_property
    def scenario(self) -> Mapping | None:
        scenario = self._topics.json("scenario.json")
        if scenario is None:
            return read_scenario(self._folder)
        if not isinstance(scenario, dict):
            raise InputError(
                f"{self._path}: attachment scenario.json: not a JSON object"
            )
        return scenario

    @property
    def _scenario_beside(self) -> Path | None:
        """The file with the scenario of a bag that holds none."""
        path = self._folder / SCENARIO
        is_read = self._topics.json("scenario.json") is None and is_there(path)
        return path if is_read else None

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
            frame = frame_name(message.header.frame_id)
            if frame != self._lidar_frame:
                raise ValueError(
                    f"in frame {frame!r}, at first in {self._lidar_frame!r}"
                )
            if stamp_ns != self.stamps_ns[index]:
                raise ValueError(
                    f"its log time is {self.stamps_ns[index]} ns, though the"
                    " file states that log times are stamps"
                )
            points = (
                livox_points(message) if self._is_livox else to_points(message)
            )
            is_return = are_returns(points)
            if self._is_in_world:
                points = points.copy()
                X_SW = poses.inverse(self.X_WS[index])
                moved = poses.transform(X_SW, xyz(points))
                for axis, values in zip("xyz", moved.T, strict=True):
                    points[axis] = values
            check_range(points, FARTHEST_RETURN)
            found = from_layout(
                points,
                self._labels(index, message),
                # Other programs have other units.
                lambda: (
                    self._file.library.startswith("cns-drake ")
                    and self.lidar_section.get("returns") != "calibrated"
                ),
                stamp_ns,
            )
            return found if is_return.all() else found[is_return]

    def _labels(self, index: int, cloud: Any) -> np.ndarray | None:
        """Returns the labels of a scan from their own topic, if any."""
        topic = self._labels_topic
        if topic is None:
            return None
        _, places = self._topics.by_stamp(topic)
        message = self._topics.message(topic, places[self._kept.start + index])
        if message.header.stamp != cloud.header.stamp:
            raise ValueError(
                f"{topic}: number {index} has another stamp than the scan"
            )
        return to_records(message)

    @property
    def kalibr(self) -> str | None:
        data = self._file.attachment(_KALIBR)
        try:
            return None if data is None else data.decode()
        except UnicodeDecodeError as error:
            raise InputError(
                f"{self._path}: attachment {_KALIBR}: no text"
            ) from error

    @cached_property
    def odometry(self) -> np.ndarray:
        if self._pose_topic is None:
            return np.zeros(0, ODOMETRY_DTYPE)
        return self._topics.rows(self._pose_topic)

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

    @property
    def _scans(self) -> np.ndarray:
        """Locations of the scans that have a pose and labels."""
        return self._all_scans[1][self._kept]

    @property
    def _all_scans(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps [ns] and locations of all scans, in the order of stamps."""
        return self._topics.by_stamp(self._lidar_topic)

    @cached_property
    def _kept(self) -> slice:
        """The scans that have a pose and labels, as a slice of all."""
        kept = self._posed.kept
        if self._labels_topic is None:
            return kept
        stamps_ns, _ = self._topics.by_stamp(self._labels_topic)
        return slice(kept.start, min(kept.stop, len(stamps_ns)))

    @cached_property
    def _posed(self) -> PosedScans:
        """The poses of the scans."""
        return self._posed_by.at_scans(self._all_scans[0], self._pose_gap)

    @cached_property
    def _posed_by(self) -> StampedPoses:
        """The poses of the vehicle, or those of the LiDAR from a file."""
        if self._given is not None:
            return self._given(self._all_scans[0])
        return self._trajectory()

    def _trajectory(self, *later: np.ndarray) -> StampedPoses:
        """Returns the poses of the vehicle in rows of `ODOMETRY_DTYPE`."""
        rows = np.concatenate([self.odometry, *later])
        # SLAM programs send such poses before they have started.
        length = np.linalg.norm(rows["quat_xyzw"], axis=1)
        known = np.isfinite(rows["position"]).all(axis=1) & (length > 0.0)
        num_unknown = len(rows) - int(known.sum())
        rows = rows[known] if known.any() else rows
        source = f"{self._path}: {self._pose_topic}"
        X_WB = checked_poses(rows["position"], rows["quat_xyzw"], source)
        found = StampedPoses.of(
            source,
            rows["stamp_ns"],
            X_WB,
            num_unknown=num_unknown,
        )
        self._check_joints(source, found.stamps_ns, found.X_WB)
        return found

    def _check_joints(
        self, source: str, stamps_ns: np.ndarray, X_WB: np.ndarray
    ) -> None:
        """Refuses files that are joined where the poses begin anew.

        Args:
            source: file and topic of the poses, for errors.
            stamps_ns: (N,) stamps of the poses [ns].
            X_WB: (N, 4, 4) the poses.
        """
        steps = PoseSteps.of(stamps_ns, X_WB)
        for joint_ns in self._file.joints_ns:
            # Stamps are up to a second before or after the log's times.
            first, last = np.searchsorted(
                stamps_ns, [joint_ns - NS_PER_S, joint_ns + NS_PER_S]
            )
            near = slice(max(first - 1, 0), last)
            if steps.is_jump[near].any():
                raise InputError(
                    f"{source}: several recordings: the poses jump by"
                    f" {steps.moves[near].max():.1f} m where a file ends and"
                    " the next begins; give one of"
                    f" {' '.join(self._file.names)}"
                )

    @property
    def X_BS(self) -> np.ndarray:
        return self._mounted[0]

    @cached_property
    def X_BI(self) -> np.ndarray | None:
        if _IMU_TOPIC not in self._topics or self._base is None:
            return None
        frame = frame_name(self._topics.first(_IMU_TOPIC).header.frame_id)
        return self._transforms.pose(self._base, frame)

    @cached_property
    def _base(self) -> str | None:
        """Frame of the vehicle B; None if the poses name none."""
        if self._pose_topic is None:
            return None
        first = self._topics.first(self._pose_topic)
        return frame_name(getattr(first, "child_frame_id", "")) or None

    @property
    def _is_in_world(self) -> bool:
        """Whether points are in the frame of the poses, as of FAST-LIO's."""
        if self._pose_topic is None:
            return self._lidar_frame in _WORLD_FRAMES
        return self._lidar_frame == self.world_frame

    @cached_property
    def _mounted(self) -> tuple[np.ndarray, list[str]]:
        """The pose X_BS (4, 4), and notes on how it was found."""
        topic, base, frame = self._pose_topic, self._base, self._lidar_frame
        where = f"{self._path}: {self._lidar_topic}"
        if topic is None and self._is_in_world:
            return np.eye(4), [
                f"{where}: the frame {frame!r} is that of a world, which the"
                " poses share; the points are moved into the frame of the LiDAR"
            ]
        if topic is None or base == frame:
            return np.eye(4), []
        if self._is_in_world:
            return np.eye(4), [
                f"{where}: the points are in the frame {frame!r} of the poses;"
                f" they are moved into the frame {base or 'of the vehicle'!r}"
            ]
        if base is not None and frame:
            if self._transforms.has(base, frame):
                return self._transforms.pose(base, frame), []
            if self._has_tf:
                # The package tf, before tf2, repeats fixed transforms there.
                self._transforms.add_fixed(self._edges(_TF_TOPIC))
            if self._transforms.has(base, frame):
                return self._transforms.pose(base, frame), [
                    f"{where}: the LiDAR is mounted as {_TF_TOPIC} says, where"
                    f" {frame!r} does not move in {base!r}"
                ]
            if _TF_STATIC_TOPIC in self._topics:
                self._transforms.pose(base, frame)  # It raises the error.
        why = (
            f"{topic} names no frame of the vehicle"
            if base is None
            else f"no {_TF_STATIC_TOPIC} says where it is in {base!r}"
        )
        if frame in self._transforms.moving:
            why += f", and it moves on {_TF_TOPIC}"
        return np.eye(4), [
            f"{where}: {why}; the poses on {topic} are taken as those of this"
            " LiDAR"
        ]

    @cached_property
    def _transforms(self) -> StaticTransforms:
        topic = _TF_STATIC_TOPIC
        edges = self._edges(topic) if topic in self._topics else ()
        return StaticTransforms(edges, f"{self._path}: {topic}")

    def _edges(self, topic: str) -> Iterator[Any]:
        """Yields the transforms of a topic."""
        for _, data in self._topics.visit(topic):
            with self._topics.faults(topic):
                message = mcap_messages.decode(data, ros_messages.TF)
            yield from message.transforms

    @cached_property
    def _lidar_frame(self) -> str:
        first = self._topics.first(self._lidar_topic)
        return frame_name(first.header.frame_id)

    @property
    def _is_livox(self) -> bool:
        return self._topics.kind(self._lidar_topic) != ros_messages.POINT_CLOUD


class _Topics:
    """Reads and decodes messages of a bag; errors name file and topic.

    Attributes:
        path: path of the file.
    """

    def __init__(self, path: Path):
        """Opens a bag; no topic is read yet."""
        self.file = _open_bag(path)
        self.path = self.file.path
        self._types: dict[str, str] = {}
        self._by_stamp: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def __contains__(self, topic: str) -> bool:
        """Returns whether messages of a topic can be decoded."""
        return topic in self._types

    def choose(self, stream: _Stream, wanted: str | None) -> str:
        """Returns the topic that a drive reads.

        Args:
            stream: what the topic has.
            wanted: its name, with or without a slash; None for the usual topic
                or, without it, the only one.
        """
        found = [stream.usual] if stream.usual in self.file.topics else []
        usual = stream.usual
        if wanted is not None:
            named = (wanted, f"/{wanted}{stream.ending}", f"/{wanted}")
            usual = wanted if wanted.startswith("/") else named[1]
            for name in named:
                if name in self.file.empty_topics:
                    raise InputError(f"{self.path}: {name}: no message")
            found = [name for name in named if name in self.file.topics]
        there = [self.of_types(types) for types in stream.types]
        if wanted is None and not found:
            found = next(filter(None, there), [])
        if not found or (wanted is None and len(found) > 1):
            known = [topic for topics in there for topic in topics]
            self._refuse(usual, stream, wanted, known)
        (topic, *_) = found
        kinds = self.kinds(topic)
        types = [kind for one in stream.types for kind in one]
        is_known = len(kinds) == 1 and kinds[0] in types
        self.require(topic, kinds[0] if is_known else types[0])
        return topic

    def _refuse(
        self, usual: str, stream: _Stream, wanted: str | None, there: list[str]
    ) -> NoReturn:
        """Raises an error for a topic that is missing or has to be chosen."""
        if there:
            advice = "" if wanted else f"; choose one as the {stream.role}"
            raise InputError(
                f"{self.path}: no topic {usual} ({stream.title}:"
                f" {' '.join(there)}{advice}, with {stream.option})"
            )
        found = [
            f"{name}: {' and '.join(kinds)}"
            for name, kinds in sorted(self.file.topics.items())
        ]
        advice = _ros_1_advice(found) or stream.advice
        if empty := self.file.empty_topics:
            found.append(f"without a message: {' '.join(empty)}")
        raise InputError(
            f"{self.path}: no topic {usual} of {stream.types[0][0]} (there are:"
            f" {'; '.join(found) or 'no topics'}){advice}"
        )

    def of_types(self, types: tuple[str, ...]) -> list[str]:
        """Returns the topics with messages of some types, except of labels."""
        return [
            topic
            for topic in self.file.topics
            if not set(self.kinds(topic)).isdisjoint(types)
            and not topic.endswith("/labels")
        ]

    def kinds(self, topic: str) -> list[str]:
        """Returns the types of a topic's messages."""
        kinds = self.file.topics.get(topic, [])
        return [kind.partition(" in ")[0] for kind in kinds]

    def kind(self, topic: str) -> str:
        """Returns the type of a topic whose messages can be decoded."""
        return self._types[topic]

    def require(self, topic: str, message_type: str) -> None:
        """Checks that all messages of a topic are of one type in CDR."""
        found = self.file.topics[topic]
        if found != [message_type]:
            raise InputError(
                f"{self.path}: {topic}: {' and '.join(found)} instead of"
                f" {message_type}{_ros_1_advice(found)}"
            )
        self._types[topic] = message_type

    def find(self, message_type: str) -> list[str]:
        """Returns all topics whose messages are of one type, in CDR.

        The messages of these topics can then be decoded.
        """
        found = [
            topic
            for topic, kinds in self.file.topics.items()
            if kinds == [message_type]
        ]
        self._types |= dict.fromkeys(found, message_type)
        return found

    def message(self, topic: str, place: np.void) -> Any:
        """Returns the decoded message at a location in the file.

        Args:
            topic: topic of the message.
            place: the location, a row of `McapFile.locate`.
        """
        with reading(self.file.path), self.faults(topic):
            data = self.file.read(place)
            return mcap_messages.decode(data, self._types[topic])

    def first(self, topic: str) -> Any:
        """Returns the first message of a topic, decoded."""
        return self.message(topic, self.file.locate(topic)[0])

    def rows(self, topic: str) -> np.ndarray:
        """Returns all messages of a topic of poses or of an IMU as rows.

        Returns:
            (N,) rows, by stamp, of `ODOMETRY_DTYPE` or `IMU_DTYPE`.
        """
        kind = self._types[topic]
        with self.faults(topic):
            if kind == ros_messages.PATH:
                found = self._path(topic)
            elif kind in (ros_messages.ODOMETRY, ros_messages.IMU):
                rows = MessageRows(kind, len(self.file.locate(topic)))
                for index, data in self.visit(topic):
                    rows.add(index, data)
                found = rows.rows()
            else:
                made = [
                    row
                    for _, data in self.visit(topic)
                    for row in POSE_ROWS[kind](mcap_messages.decode(data, kind))
                ]
                found = np.array(made, ODOMETRY_DTYPE)
            if kind == ros_messages.IMU:
                check_agreement(found)
        return found[np.argsort(found["stamp_ns"], kind="stable")]

    def _path(self, topic: str) -> np.ndarray:
        """Returns the poses of a topic of paths; the last of each stamp counts.

        Usually the last message has all poses, or else each has the latest.
        """
        places = self.file.locate(topic)

        def rows(place: np.void) -> np.ndarray:
            made = POSE_ROWS[ros_messages.PATH](self.message(topic, place))
            return np.array([*made], ODOMETRY_DTYPE)

        first, found = rows(places[0]), rows(places[-1])
        starts_ns = [
            one["stamp_ns"].min(initial=np.iinfo(np.int64).max)
            for one in (first, found)
        ]
        if starts_ns[0] < starts_ns[1]:
            found = np.concatenate([rows(place) for place in places[::-1]])
            _, kept = np.unique(found["stamp_ns"], return_index=True)
            found = found[kept]
        return found

    def by_stamp(self, topic: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns the stamps (N,) [ns] and locations (N,) of a topic, sorted.

        A message that is there twice counts once.
        """
        if topic not in self._by_stamp:
            self._by_stamp[topic] = self._sorted(topic)
        return self._by_stamp[topic]

    def read_together(self, clouds: str, small: Sequence[str]) -> None:
        """Names the topics of a drive, so that the bag is read once for all.

        Args:
            clouds: topic of the scans.
            small: topics with messages whose contents are kept.
        """
        # Of a bag whose log times are stamps, not all messages are read.
        if self.logged_stamps_ns(clouds) is None:
            self.file.index.prepare(
                [(clouds, False), *((one, True) for one in small)]
            )

    def visit(self, topic: str) -> Iterator[tuple[int, memoryview]]:
        """Yields the number and the content of each message of a topic."""
        if topic in self.file.index:
            index = self.file.index.of(topic)
            if index.has_contents:
                for number in range(len(index.log_times_ns)):
                    yield number, index.message(number)
                return
        yield from self.file.visit(self.file.locate(topic))

    def _sorted(self, topic: str) -> tuple[np.ndarray, np.ndarray]:
        logged_ns = self.logged_stamps_ns(topic)
        places = self.file.locate(topic)
        if logged_ns is not None and (np.diff(logged_ns) > 0).all():
            return logged_ns, places
        found = self.file.index.of(topic)
        stamps_ns, digests = found.stamps_ns, found.checksums
        with self.faults(topic):
            order = np.argsort(stamps_ns, kind="stable")
            # A simulator's clock may begin at 0.
            first, *second = stamps_ns[order[:2]].tolist()
            if first == 0 and second and not 0 < second[0] < _SIMULATED_NS:
                raise ValueError("a message has no stamp")
            twice = np.diff(stamps_ns[order], prepend=-1) == 0
            for k in np.flatnonzero(twice).tolist():
                if digests[int(order[k])] != digests[int(order[k - 1])]:
                    raise ValueError(
                        "two different messages with the stamp"
                        f" {stamps_ns[order[k]]} ns"
                    )
        order = order[~twice]
        return stamps_ns[order], places[order]

    def logged_stamps_ns(self, topic: str) -> np.ndarray | None:
        """Returns the stamps (N,) of a topic's messages [ns] from the index.

        The result is None if the file does not state that the log times of the
        topic are stamps.
        """
        records = self.file.metadata(mcap_messages.STAMPED_RECORD)
        if not records:
            return None
        places = self.file.locate(topic)
        if [record.get(topic) for record in records] != [str(len(places))]:
            return None
        for place in places[[0, -1]]:
            with self.faults(topic):
                stamp_ns = mcap_messages.read_stamp(self.file.read(place))
            if stamp_ns != place["log_time_ns"]:
                return None
        return places["log_time_ns"].astype(np.int64)

    def json(self, name: str) -> Any:
        """Returns the value of a JSON attachment; None if the file lacks it."""
        data = self.file.attachment(name)
        with self.faults(f"attachment {name}"):
            return None if data is None else parse_json(data)

    def faults(self, where: str) -> contextlib.AbstractContextManager[None]:
        """Turns a ValueError into an InputError that names file and place."""
        return value_errors(f"{self.path}: {where}")


class _McapImages:
    """The images of the first topic of compressed images, if there is one."""

    def __init__(self, topics: _Topics):
        self._topics = topics
        found = topics.find(ros_messages.COMPRESSED_IMAGE)
        cameras = [topic for topic in found if not topic.endswith(_DEPTH)]
        self._topic = cameras[0] if cameras else None

    @property
    def stamps_ns(self) -> np.ndarray:
        """(M,) int64 stamp of each image, sorted [ns]."""
        return self._sorted[0]

    def image(self, index: int) -> bytes:
        """Returns image `index`, in the order of the stamps, as encoded."""
        if self._topic is None:
            raise IndexError(f"image {index} of 0")
        place = self._sorted[1][index]
        return self._topics.message(self._topic, place).data.tobytes()

    @property
    def _sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (M,) [ns] and places of the images, sorted by stamp."""
        if self._topic is None:
            return np.zeros(0, np.int64), np.zeros(0, LOCATION)
        return self._topics.by_stamp(self._topic)


def holds_mcap(path: Path) -> bool:
    """Returns whether `path` is a bag of ROS or a folder with one."""
    if not path.is_dir():
        return path.suffix.lower() in _ENDINGS
    return (path / _METADATA).is_file() or any(_bags(path).values())


def _bags(folder: Path) -> dict[str, list[Path]]:
    """Returns ending -> the files of bags in a folder, in natural order."""
    files = listed(folder)
    return {
        ending: [one for one in files if one.suffix.lower() == ending]
        for ending in _ENDINGS
    }


def _open_bag(path: Path) -> McapFile | RosbagFile:
    """Opens the bag at a path, or in a folder."""
    if not path.is_dir():
        if path.suffix.lower() in (".bag", ".db3"):
            return RosbagFile([path])
        return McapFile(path)
    files = _bags(path)
    mcap, sqlite, ros1 = files.values()
    for file in listed(path, "*.bag.active"):
        check_finished([file.with_suffix("")])
    if sum(map(bool, files.values())) > 1:
        names = " ".join(one.name for some in files.values() for one in some)
        raise InputError(f"{path}: several recordings; give one of {names}")
    metadata = path / _METADATA
    told = read_text(metadata) if metadata.is_file() else ""
    if told:
        _check_listed(metadata, [*mcap, *sqlite])
    if len(mcap) == 1 and not re.search(_PACKED, told, re.I | re.M):
        return McapFile(mcap[0])
    if len(sqlite) == 1 and not re.search(_PACKED, told, re.I | re.M):
        return RosbagFile(sqlite)
    if told:
        return RosbagFile([path])
    if ros1:
        return RosbagFile(ros1)
    number, ending = (len(mcap), ".mcap") if mcap else (len(sqlite), ".db3")
    raise InputError(
        f"{path}: {number} {ending} files instead of one, and no {_METADATA},"
        " which says that they are one bag (`ros2 bag reindex` writes it)"
    )


def _check_listed(metadata: Path, files: Sequence[Path]) -> None:
    """Refuses a bag of which rosbag2's list names fewer or more files."""
    content = read_yaml(metadata)
    try:
        told = content["rosbag2_bagfile_information"]["relative_file_paths"]
        names = {Path(str(one)).name for one in told}
    except (TypeError, KeyError):
        return  # The reader says what is wrong.
    packed = (".zstd", ".lz4")
    there = {one.name for one in files} | {
        one.name
        for ending in packed
        for one in listed(metadata.parent, f"*{ending}")
    }
    if len(names) == len(there):
        return
    for name in sorted(there - names):
        raise InputError(
            f"{metadata.parent / name}: not one of the files in"
            f" {metadata.name} ({' '.join(sorted(names))}); `ros2 bag reindex`"
            " lists all, or move it to a folder of its own"
        )
    missing = " ".join(sorted(names - there))
    raise InputError(f"{metadata}: names files that are not there: {missing}")


def _drive_name(path: Path) -> str:
    place = as_given(path)
    # rosbag2 numbers the files of a recording: <name>_0.mcap.
    return place.name if place.is_dir() else place.stem.removesuffix("_0")


def _ros_1_advice(kinds: Sequence[str]) -> str:
    """Returns what helps if messages in an MCAP file are of ROS 1, or ""."""
    if not any(kind.endswith(" in ros1") for kind in kinds):
        return ""
    return (
        "; messages of ROS 1 are read in a .bag only: give the one that was"
        " converted"
    )


# Endings of bags: of rosbag2, with MCAP or SQLite, and of ROS 1.
_ENDINGS = (".mcap", ".db3", ".bag")


def _lidar_name(topic: str) -> str:
    """Returns NAME for the topic /NAME/points, and other topics as they are."""
    name = topic.removeprefix("/").removesuffix("/points")
    return name if topic == f"/{name}/points" else topic


def _open(
    path: Path,
    lidar: str | None = None,
    odometry: str | None = None,
    poses: Path | None = None,
    pose_gap: float | None = None,
) -> McapDrive:
    """Opens a bag; the arguments are those of `open_drive`."""
    given = None if poses is None else partial(read_trajectory, Path(poses))
    return McapDrive(path, lidar, odometry, given, pose_gap)


DATA_SET = DataSet(
    "MCAP",
    holds_mcap,
    _open,
    (
        "the bag: an `.mcap`, `.db3` or `.bag` file, or the folder with it:"
        " recordings of cns-drake, and others with a topic of `PointCloud2`"
        " and one of poses"
    ),
    has_lidars=True,
)
