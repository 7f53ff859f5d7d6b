"""Frames that are fixed to others, from messages of /tf_static."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from cns_drake.base import poses
from cns_drake.base.errors import InputError
from cns_drake.base.recordings import mcap_messages
from cns_drake.base.recordings.mcap_messages import xyz, xyzw


class StaticTransforms:
    """Poses of frames in their parents."""

    def __init__(self, messages: Iterable[Any], where: str):
        """Reads the transforms.

        Args:
            messages: of type tf2_msgs/msg/TFMessage.
            where: file and topic, for errors.

        Raises:
            InputError: two messages place one frame differently.
        """
        self._where = where
        # Frame C -> its parent P, p_PC, quat_xyzw_PC.
        self._edges: dict[str, tuple] = {}
        for message in messages:
            for edge in message.transforms:
                self._add(edge)

    def pose(self, base: str, frame: str) -> np.ndarray:
        """Returns the pose (4, 4) of a frame in another one, its ancestor.

        Raises:
            InputError: no transforms lead from one to the other, or one of
                them is no pose.
        """
        X_CF = np.eye(4)
        child = frame
        for _ in range(len(self._edges) + 1):
            if child == base:
                return X_CF
            if child not in self._edges:
                break
            child, p_PC, quat_PC = self._edges[child]
            X_PC = checked_poses(np.array(p_PC), np.array(quat_PC), self._where)
            X_CF = X_PC @ X_CF
        raise InputError(f"{self._where}: no transform from {base} to {frame}")

    def _add(self, edge: Any) -> None:
        child, transform = edge.child_frame_id, edge.transform
        new = (
            edge.header.frame_id,
            xyz(transform.translation),
            xyzw(transform.rotation),
        )
        # Nodes repeat what is fixed.
        old = self._edges.setdefault(child, new)
        if old != new:
            raise InputError(
                f"{self._where}: {child}: at"
                f" {mcap_messages.stamp_ns(edge.header)} ns {new},"
                f" before {old}"
            )


def checked_poses(
    p: np.ndarray, quat_xyzw: np.ndarray, where: str
) -> np.ndarray:
    """Returns poses (..., 4, 4) of positions and quaternions in a recording.

    Args:
        p: (..., 3) [m].
        quat_xyzw: (..., 4).
        where: the file, for errors.

    Raises:
        InputError: a number is not finite, a position is too far away, or a
            quaternion has no length.
    """
    if not (np.isfinite(p).all() and np.isfinite(quat_xyzw).all()):
        raise InputError(f"{where}: a pose is not finite")
    if not (np.abs(p) < poses.FARTHEST).all():
        raise InputError(
            f"{where}: a pose is {np.abs(p).max():g} m from the origin"
        )
    try:
        R = poses.rotation_from_quaternion(quat_xyzw)
    except ValueError as error:
        raise InputError(f"{where}: a pose has {error}") from error
    return poses.make_pose(R, p)
