"""The CDR form of IMU messages, of which there are many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.base.recordings.ros_types import message_class
from cns_drake.recording.message_template import (
    STAMP_MARK_NS,
    MessageTemplate,
    number_marks,
)
from cns_drake.recording.messages import make_imu

# Sizes of orientation, angular velocity and specific force.
_SIZES = (4, 3, 3)


class ImuMessages:
    """Makes the messages of many samples at once."""

    def __init__(self, variances: tuple[float, float]):
        """Takes the variances of `make_imu`."""
        self._variances = variances
        self._templates: dict[tuple[bool, ...], MessageTemplate] = {}

    def encode(
        self,
        quat_xyzw: np.ndarray | None,
        angular_velocity: np.ndarray | None,
        specific_force: np.ndarray | None,
        stamps_ns: Sequence[int],
    ) -> list[bytes]:
        """Returns N serialised messages.

        Args:
            quat_xyzw: (N, 4) orientations, see `make_imu`; None if unknown,
                as may be what follows.
            angular_velocity: (N, 3) [rad/s].
            specific_force: (N, 3) [m/s^2].
            stamps_ns: their times [ns].
        """
        values = (quat_xyzw, angular_velocity, specific_force)
        given = tuple(value is not None for value in values)
        if given not in self._templates:
            self._templates[given] = self._make_template(given)
        numbers = np.zeros((len(stamps_ns), 0))
        known = [value for value in values if value is not None]
        if known:
            numbers = np.hstack(known)
        return self._templates[given].fill_all(numbers, stamps_ns)

    def _make_template(self, given: tuple[bool, ...]) -> MessageTemplate:
        """Returns the message with the values that are given."""
        marks = number_marks(sum(np.array(_SIZES)[list(given)]))
        parts: list[np.ndarray | None] = []
        for size, is_given in zip(_SIZES, given, strict=True):
            parts.append(marks[:size] if is_given else None)
            marks = marks[size:] if is_given else marks
        quat_xyzw, turn, force = parts
        message = make_imu(quat_xyzw, turn, force, 0, self._variances)
        time = message_class("builtin_interfaces/msg/Time")
        message.header.stamp = time(*STAMP_MARK_NS)
        count = sum(len(part) for part in parts if part is not None)
        return MessageTemplate(message, count)
