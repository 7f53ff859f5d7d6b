"""Packed messages of an IMU are those of rosbags, byte by byte."""

import itertools

import numpy as np
from pydrake.math import RollPitchYaw
import pytest

from cns_drake.base.recordings import ros_types
from cns_drake.recording import messages
from cns_drake.recording.imu_packing import ImuPacker


@pytest.mark.parametrize(
    "given", list(itertools.product([True, False], repeat=3))
)
def test_a_packed_message_is_what_rosbags_serialises(given):
    rng = np.random.default_rng(3)
    variances = (1e-4, 2e-6)
    packer = ImuPacker(variances)
    # A second sample must not show anything of the first one.
    for stamp_ns in (1_700_000_000_999_999_999, 1_700_000_003_000_000_001):
        values = (
            RollPitchYaw(rng.uniform(-1.5, 1.5, 3)).ToRotationMatrix(),
            rng.normal(size=3),
            rng.normal(size=3) * 9.81,
        )
        chosen = [
            value if is_given else None
            for value, is_given in zip(values, given, strict=True)
        ]
        expected = messages.make_imu(*chosen, stamp_ns, variances)
        packed = packer.pack(*chosen, stamp_ns)
        assert packed == ros_types.serialize(expected)
