"""Decodes messages of a recording; refuses oversized or inconsistent ones."""

from collections.abc import Iterable
import struct
from typing import Any

import numpy as np

from evaluation.base import NS_PER_S, InputError, poses, value_errors
from evaluation.drives import ros_messages

# The header of CDR that gives the order of bytes.
_ENCAPSULATION_BYTES = 4
# What compressed data begin with -> the name of the compression. No message in
# CDR begins alike.
_COMPRESSIONS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
# Name of the metadata record of an MCAP file that gives, for each topic, the
# number of messages that were seen to have their log time as their stamp. If
# these are all of its messages, the file's index has their stamps.
STAMPED_RECORD = "log_times_are_header_stamps"


def decode(data: bytes | memoryview, message_type: str) -> Any:
    """Decodes a serialised message.

    Args:
        data: the message, serialised as CDR.
        message_type: type of the message, such as `nav_msgs/msg/Odometry`.

    Raises:
        ValueError: the data are not a message of this type.
    """
    _check_uncompressed(data)
    try:
        return ros_messages.deserialize(data, message_type)
    except MemoryError:
        raise
    except Exception as error:
        # rosbags raises any error of its generated code.
        raise ValueError(
            f"a message cannot be decoded ({type(error).__name__}: {error})"
        ) from error


def _check_uncompressed(data: bytes | memoryview) -> None:
    """Refuses a message that rosbag2 has compressed.

    Raises:
        ValueError: the message is compressed.
    """
    name = _COMPRESSIONS.get(bytes(data[:4]))
    if name is not None:
        raise ValueError(
            f"each message is compressed by {name} (rosbag2's mode `message`);"
            " convert the recording to one without compression"
        )


def read_cloud_header(data: bytes | memoryview) -> tuple[int, str]:
    """Returns the stamp [ns] and frame of a PointCloud2, and nothing else.

    Raises:
        ValueError: the message is cut off or compressed.
    """
    _check_uncompressed(data)
    try:
        order = "<" if data[1] & 1 else ">"
        body = data[_ENCAPSULATION_BYTES:]
        sec, nanosec, length = struct.unpack_from(f"{order}iII", body)
        # Strings end with a zero.
        (text,) = struct.unpack_from(f"{length}s", body, 12)
    except (struct.error, IndexError) as error:
        raise ValueError("a message is cut off") from error
    frame_id = text.rstrip(b"\0").decode("utf-8", "backslashreplace")
    return sec * NS_PER_S + nanosec, frame_id


def read_stamp(data: bytes | memoryview) -> int | None:
    """Returns the stamp of a message that begins with a header [ns].

    The result is None if the message is too short. For a message without a
    header, the result is meaningless.

    Raises:
        ValueError: the message is compressed.
    """
    _check_uncompressed(data)
    if len(data) < _ENCAPSULATION_BYTES + 8:
        return None
    order = "<" if data[1] & 1 else ">"
    sec, nanosec = struct.unpack_from(f"{order}iI", data, _ENCAPSULATION_BYTES)
    return sec * NS_PER_S + nanosec


def stamp_ns(header: Any) -> int:
    """Returns the time of a message's header [ns]."""
    return header.stamp.sec * NS_PER_S + header.stamp.nanosec


def xyz(v: Any) -> tuple[float, float, float]:
    """Returns the components of a vector message."""
    return v.x, v.y, v.z


def xyzw(q: Any) -> tuple[float, float, float, float]:
    """Returns the components of a quaternion message, with w last."""
    return q.x, q.y, q.z, q.w


def frame_name(name: str) -> str:
    """Returns the name of a frame; before tf2, names began with a slash."""
    return name.removeprefix("/")


class StaticTransforms:
    """The frames in /tf_static: a tree with each frame's pose in its parent.

    Attributes:
        moving: frames on /tf that move in their parent.
    """

    def __init__(self, edges: Iterable[Any], where: str):
        """Collects the transforms on /tf_static.

        Args:
            edges: messages of type geometry_msgs/msg/TransformStamped.
            where: file or topic, with which an error message begins.

        Raises:
            InputError: two messages give different poses for one frame.
        """
        self._where = where
        self.moving: set[str] = set()
        # Frame C -> its parent P, p_PC, quat_xyzw_PC.
        self._edges: dict[str, tuple] = {}
        for edge in edges:
            # Nodes repeat what is fixed.
            child, new = _numbers(edge)
            old = self._edges.setdefault(child, new)
            if not _is_same(old, new):
                raise InputError(
                    f"{where}: {edge.child_frame_id}: at"
                    f" {stamp_ns(edge.header)} ns {new}, before {old}"
                )

    def add_fixed(self, edges: Iterable[Any]) -> None:
        """Adds frames on /tf that never move in their parent."""
        found: dict[str, tuple] = {}
        for edge in edges:
            child, new = _numbers(edge)
            if not _is_same(found.setdefault(child, new), new):
                self.moving.add(child)
        for child in found.keys() - self.moving:
            self._edges.setdefault(child, found[child])

    def has(self, base: str, frame: str) -> bool:
        """Returns whether transforms lead from a frame to another."""
        return (
            not self._in_ancestors(base)
            .keys()
            .isdisjoint(self._in_ancestors(frame))
        )

    def pose(self, base: str, frame: str) -> np.ndarray:
        """Returns the pose (4, 4) of a frame in another frame of the tree.

        Args:
            base: name of the other frame.
            frame: name of the frame.

        Raises:
            InputError: no transforms lead from one frame to the other, or one
                of these transforms is not rigid.
        """
        X_AF, X_AB = self._in_ancestors(frame), self._in_ancestors(base)
        common = next((name for name in X_AF if name in X_AB), None)
        if common is None:
            raise InputError(
                f"{self._where}: no transform from {base} to {frame}"
                f" ({self.listed()})"
            )
        if common == base:
            return X_AF[base]
        return poses.inverse(X_AB[common]) @ X_AF[common]

    def _in_ancestors(self, frame: str) -> dict[str, np.ndarray]:
        """Returns ancestor -> pose (4, 4) of a frame in it, itself first."""
        found = {frame: np.eye(4)}
        child = frame
        while child in self._edges:
            X_CF = found[child]
            child, p_PC, quat_PC = self._edges[child]
            if child in found:
                break
            X_PC = checked_poses(np.array(p_PC), np.array(quat_PC), self._where)
            found[child] = X_PC @ X_CF
        return found

    def listed(self) -> str:
        """Returns what transforms there are, for error messages."""
        edges = [
            f"{parent or 'a frame without a name'} to {child}"
            for child, (parent, *_) in sorted(self._edges.items())
        ]
        return f"there are: {', '.join(edges) or 'none'}"


def _numbers(edge: Any) -> tuple[str, tuple]:
    """Returns a frame C, and its parent P with p_PC and quat_xyzw_PC."""
    return frame_name(edge.child_frame_id), (
        frame_name(edge.header.frame_id),
        xyz(edge.transform.translation),
        xyzw(edge.transform.rotation),
    )


def _is_same(old: tuple, new: tuple) -> bool:
    return (
        old[0] == new[0]
        and poses.same_numbers(old[1], new[1])
        and poses.same_turns(old[2], new[2])
    )


def checked_poses(
    p: np.ndarray, quat_xyzw: np.ndarray, where: str
) -> np.ndarray:
    """Returns poses (..., 4, 4) from recorded positions and quaternions.

    Args:
        p: (..., 3) positions [m].
        quat_xyzw: (..., 4) quaternions.
        where: file or topic, with which an error message begins.

    Raises:
        InputError: a number is not finite, a position is too far away, or the
            norm of a quaternion is zero.
    """
    if not (np.isfinite(p).all() and np.isfinite(quat_xyzw).all()):
        raise InputError(f"{where}: a pose is not finite")
    if not (np.abs(p) < poses.FARTHEST).all():
        raise InputError(
            f"{where}: a pose is {np.abs(p).max():g} m from the origin"
        )
    with value_errors(f"{where}: a pose"):
        R = poses.rotation_from_quaternion(quat_xyzw)
    return poses.make_pose(R, p)
