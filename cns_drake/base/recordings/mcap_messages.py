"""Decodes messages of a recording, and refuses oversized ones."""

from __future__ import annotations

from dataclasses import dataclass
import struct
from typing import Any

from cns_drake.base.recordings.ros_types import (
    IMU,
    ODOMETRY,
    POINT_CLOUD,
    TF,
    deserialize,
)

# More bytes than a message of each type can need [bytes]. A few compressed
# kilobytes can hold gigabytes of padding. A cloud fills a chunk at most.
_LONGEST = {ODOMETRY: 1 << 12, IMU: 1 << 12, TF: 1 << 20}
_MOST_FIELDS = 256
_LONGEST_NAME = 1 << 10
# The header of CDR that gives the order of bytes.
_ENCAPSULATION_BYTES = 4


@dataclass(frozen=True)
class CloudHeader:
    """The header of a point cloud.

    Attributes:
        stamp_ns: when it was taken [ns].
        frame_id: the frame of its points.
    """

    stamp_ns: int
    frame_id: str


def decode(data: bytes | memoryview, message_type: str) -> Any:
    """Returns the message of serialised bytes.

    Raises:
        ValueError: if the bytes are no such message, or more than one can have.
    """
    if len(data) > _LONGEST.get(message_type, len(data)):
        raise ValueError(
            f"a message of {len(data)} bytes, more than one of its type holds"
        )
    if message_type == POINT_CLOUD:
        read_cloud_header(data)
    try:
        return deserialize(data, message_type)
    except Exception as error:
        # rosbags raises any error of its generated code.
        raise ValueError(
            f"a message cannot be decoded ({type(error).__name__}: {error})"
        ) from error


def read_cloud_header(data: bytes | memoryview) -> CloudHeader:
    """Reads the header of a serialised PointCloud2 and nothing else.

    Raises:
        ValueError: if it is cut off, or claims more than makes sense.
    """
    try:
        order = "<" if data[1] & 1 else ">"
        body = data[_ENCAPSULATION_BYTES:]
        sec, nanosec, length = struct.unpack_from(f"{order}iII", body)
        if length > _LONGEST_NAME:
            raise ValueError(f"a name of a frame of {length} bytes")
        # Strings end with a zero; numbers begin at multiples of four.
        (text,) = struct.unpack_from(f"{length}s", body, 12)
        behind = 12 + -(-length // 4) * 4
        _, _, num_fields = struct.unpack_from(f"{order}III", body, behind)
    except (struct.error, IndexError) as error:
        raise ValueError("a message is cut off") from error
    if num_fields > _MOST_FIELDS:
        raise ValueError(f"a point cloud of {num_fields} fields")
    frame_id = text.rstrip(b"\0").decode("utf-8", "backslashreplace")
    return CloudHeader(sec * 1_000_000_000 + nanosec, frame_id)


def stamp_ns(header: Any) -> int:
    """Returns the time of a message's header [ns]."""
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def odometry_row(message: Any) -> tuple:
    """Returns a message as a record of `ODOMETRY_DTYPE`."""
    pose, twist = message.pose.pose, message.twist.twist
    return (
        stamp_ns(message.header),
        xyz(pose.position),
        xyzw(pose.orientation),
        xyz(twist.linear),
        xyz(twist.angular),
    )


def imu_row(message: Any) -> tuple:
    """Returns a message as a record of `IMU_DTYPE`."""
    return (
        stamp_ns(message.header),
        xyzw(message.orientation),
        xyz(message.angular_velocity),
        xyz(message.linear_acceleration),
    )


def xyz(v: Any) -> tuple[float, float, float]:
    """Returns the numbers of a vector."""
    return v.x, v.y, v.z


def xyzw(q: Any) -> tuple[float, float, float, float]:
    """Returns the numbers of a quaternion."""
    return q.x, q.y, q.z, q.w
