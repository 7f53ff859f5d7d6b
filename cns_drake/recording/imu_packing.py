"""The CDR form of IMU messages, made fast."""

from __future__ import annotations

import struct

import numpy as np
from pydrake.math import RotationMatrix

from cns_drake.base.recordings import ros_types
from cns_drake.recording import messages

# Offsets of the stamp, and of orientation, angular velocity and linear
# acceleration, each before a covariance of nine numbers. The frame's name takes
# 8 bytes with its length, so that the numbers begin at a multiple of 8 after
# the first four bytes.
_STAMP = struct.Struct("<iI")
_QUATERNION, _VECTOR = struct.Struct("<4d"), struct.Struct("<3d")
_STAMP_AT, _ORIENTATION_AT = 4, 20
_ANGULAR_VELOCITY_AT = _ORIENTATION_AT + 8 * (4 + 9)
_ACCELERATION_AT = _ANGULAR_VELOCITY_AT + 8 * (3 + 9)
_SIZE = _ACCELERATION_AT + 8 * (3 + 9)
_NS_PER_S = 1_000_000_000


class ImuPacker:
    """Fills samples into a message that was serialised once.

    That takes a tenth of the time to make and serialise each message.
    """

    def __init__(self, variances: tuple[float, float]):
        """Takes the variances of `messages.make_imu`."""
        self._variances = variances
        self._templates: dict[tuple[bool, bool, bool], bytearray] = {}

    def pack(
        self,
        R_WI: RotationMatrix | None,
        angular_velocity: np.ndarray | None,
        specific_force: np.ndarray | None,
        stamp_ns: int,
    ) -> bytes:
        """Returns the serialised message of `messages.make_imu`."""
        values = R_WI, angular_velocity, specific_force
        given = (
            R_WI is not None,
            angular_velocity is not None,
            specific_force is not None,
        )
        if given not in self._templates:
            message = messages.make_imu(*values, stamp_ns, self._variances)
            template = bytearray(ros_types.serialize(message))
            assert len(template) == _SIZE
            self._templates[given] = template
        data = self._templates[given]
        _STAMP.pack_into(data, _STAMP_AT, *divmod(stamp_ns, _NS_PER_S))
        if R_WI is not None:
            quaternion = messages.to_quat_xyzw(R_WI)
            _QUATERNION.pack_into(data, _ORIENTATION_AT, *quaternion)
        if angular_velocity is not None:
            _VECTOR.pack_into(data, _ANGULAR_VELOCITY_AT, *angular_velocity)
        if specific_force is not None:
            _VECTOR.pack_into(data, _ACCELERATION_AT, *specific_force)
        return bytes(data)
