"""Messages of poses and of IMUs as rows of an array.

A drive has thousands of such messages, and decoding a message takes longer than
reading it. After the names of frames, such a message contains only doubles. A
message that differs from the first message only in its stamp and its doubles
therefore has the same layout, and its bytes are copied without decoding.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import NS_PER_S, poses
from evaluation.drives import ros_messages
from evaluation.drives.drive import IMU_DTYPE, ODOMETRY_DTYPE
from evaluation.drives.mcap_messages import decode, stamp_ns, xyz, xyzw


def odometry_row(message: Any) -> tuple:
    """Returns a message nav_msgs/msg/Odometry as a record of `ODOMETRY_DTYPE`.

    The dtype is `evaluation.drives.drive.ODOMETRY_DTYPE`.
    """
    pose, twist = message.pose.pose, message.twist.twist
    return (
        stamp_ns(message.header),
        xyz(pose.position),
        xyzw(pose.orientation),
        xyz(twist.linear),
        xyz(twist.angular),
    )


def transform_row(message: Any) -> tuple:
    """Returns a geometry_msgs/msg/TransformStamped as `odometry_row` does.

    The velocities are zero.
    """
    transform = message.transform
    place = xyz(transform.translation), xyzw(transform.rotation)
    return stamp_ns(message.header), *place, 0.0, 0.0


def pose_row(message: Any) -> tuple:
    """Returns a message of a pose with a header as `odometry_row` does.

    The velocities are zero.
    """
    pose = getattr(message.pose, "pose", message.pose)
    place = xyz(pose.position), xyzw(pose.orientation)
    return stamp_ns(message.header), *place, 0.0, 0.0


# Type of messages with poses -> function that returns a message's rows, in the
# order in which topics are chosen.
POSE_ROWS: dict[str, Callable[[Any], list[tuple]]] = {
    ros_messages.ODOMETRY: lambda message: [odometry_row(message)],
    ros_messages.TRANSFORM: lambda message: [transform_row(message)],
    ros_messages.POSE_COVARIANCE: lambda message: [pose_row(message)],
    ros_messages.POSE: lambda message: [pose_row(message)],
    ros_messages.PATH: lambda message: list(map(pose_row, message.poses)),
}


def imu_row(message: Any) -> tuple:
    """Returns a message sensor_msgs/msg/Imu as a record of `IMU_DTYPE`.

    The dtype is `evaluation.drives.drive.IMU_DTYPE`.
    """
    return (
        stamp_ns(message.header),
        xyzw(message.orientation),
        xyz(message.angular_velocity),
        xyz(message.linear_acceleration),
    )


def vehicle_frames(message: Any) -> str:
    """Returns the frames of an odometry or a transform, `parent -> child`."""
    return f"{message.header.frame_id} -> {message.child_frame_id}"


class _Kind(NamedTuple):
    """A message type, and how it becomes a row.

    Attributes:
        row: function that returns a decoded message as a row.
        frames: function that returns the names of its frames.
        dtype: dtype of the rows.
        layout: dtype of the float64 values that end a serialised message.
    """

    row: Callable[[Any], tuple]
    frames: Callable[[Any], str]
    dtype: np.dtype
    layout: np.dtype


_KINDS = {
    ros_messages.ODOMETRY: _Kind(
        odometry_row,
        vehicle_frames,
        ODOMETRY_DTYPE,
        np.dtype(
            [
                ("position", "<f8", 3),
                ("quat_xyzw", "<f8", 4),
                ("pose_covariance", "<f8", 36),
                ("velocity", "<f8", 3),
                ("angular_velocity", "<f8", 3),
                ("twist_covariance", "<f8", 36),
            ]
        ),
    ),
    ros_messages.IMU: _Kind(
        imu_row,
        lambda message: message.header.frame_id,
        IMU_DTYPE,
        np.dtype(
            [
                ("quat_xyzw", "<f8", 4),
                ("orientation_covariance", "<f8", 9),
                ("angular_velocity", "<f8", 3),
                ("angular_velocity_covariance", "<f8", 9),
                ("specific_force", "<f8", 3),
                ("specific_force_covariance", "<f8", 9),
            ]
        ),
    ),
}
_STAMP = np.dtype([("sec", "<i4"), ("nanosec", "<u4")])
# The header of CDR for the order of bytes of `_KINDS`.
_LITTLE_ENDIAN = b"\0\1\0\0"


class MessageRows:
    """Collects the messages of one topic as rows of an array.

    All messages must have the same frames.
    """

    def __init__(self, message_type: str, count: int):
        """Prepares an array."""
        self._type = message_type
        self._kind = _KINDS[message_type]
        self._rows = np.zeros(count, self._kind.dtype)
        self._frames: str | None = None
        # The length of a message with the usual layout, and its bytes between
        # the stamp and the doubles.
        self._length = 0
        self._middle = b""
        self._copied: list[int] = []
        self._bytes = bytearray()

    def add(self, index: int, data: memoryview) -> None:
        """Adds a serialised message as row `index`.

        Raises:
            ValueError: the message cannot be decoded, or its frames differ from
                the frames of the first message.
        """
        split = self._length - self._kind.layout.itemsize
        if (
            len(data) == self._length
            and data[:4] == _LITTLE_ENDIAN
            and data[12:split] == self._middle
        ):
            self._copied.append(index)
            self._bytes += data[4:12]
            self._bytes += data[split:]
            return
        message = decode(data, self._type)
        row = self._kind.row(message)
        frames = self._kind.frames(message)
        if self._frames is None:
            self._frames = frames
            self._learn(data, row)
        elif frames != self._frames:
            raise ValueError(
                f"at {row[0]} ns in frame {frames!r}, at first in"
                f" {self._frames!r}"
            )
        self._rows[index] = row

    def _learn(self, data: memoryview, row: tuple) -> None:
        """Keeps a message's layout if copied bytes give the same `row`."""
        split = len(data) - self._kind.layout.itemsize
        if split < 12 or data[:4] != _LITTLE_ENDIAN:
            return
        copied = self._convert(data[4:12].tobytes() + data[split:].tobytes())
        if copied.tobytes() == np.array([row], self._kind.dtype).tobytes():
            self._length = len(data)
            self._middle = data[12:split].tobytes()

    def _convert(self, content: bytes | bytearray) -> np.ndarray:
        """Returns rows, given the stamps and doubles of messages."""
        layout = np.dtype([("stamp", _STAMP), ("values", self._kind.layout)])
        found = np.frombuffer(content, layout)
        rows = np.zeros(len(found), self._kind.dtype)
        sec = found["stamp"]["sec"].astype(np.int64)
        rows["stamp_ns"] = sec * NS_PER_S + found["stamp"]["nanosec"]
        for name in (self._kind.dtype.names or ())[1:]:
            rows[name] = found["values"][name]
        return rows

    def rows(self) -> np.ndarray:
        """Returns the rows (N,).

        Their dtype is `ODOMETRY_DTYPE` or `IMU_DTYPE` of
        `evaluation.drives.drive`.
        """
        self._rows[self._copied] = self._convert(self._bytes)
        return self._rows


def check_agreement(rows: np.ndarray) -> None:
    """Refuses two different messages with one stamp.

    Args:
        rows: (N,) rows of `MessageRows`.

    Raises:
        ValueError: two rows with the same stamp differ.
    """
    order = np.argsort(rows["stamp_ns"], kind="stable")
    twice = np.flatnonzero(np.diff(rows["stamp_ns"][order]) == 0)
    for one, other in zip(order[twice], order[twice + 1], strict=True):
        for name in rows.dtype.names or ():
            old, new = rows[name][one], rows[name][other]
            is_same = (
                poses.same_turns if name == "quat_xyzw" else poses.same_numbers
            )
            if not is_same(old, new):
                raise ValueError(
                    f"{name} at {rows['stamp_ns'][one]} ns: {old} and {new}"
                )
