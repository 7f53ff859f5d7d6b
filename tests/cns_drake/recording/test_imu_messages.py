"""Packed messages of an IMU are those of rosbags, byte by byte."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.base.recordings import ros_types
from cns_drake.recording import messages
from cns_drake.recording.imu_messages import ImuMessages


@pytest.mark.parametrize(
    "given", list(itertools.product([True, False], repeat=3))
)
def test_a_packed_message_is_what_rosbags_serialises(given):
    rng = np.random.default_rng(3)
    variances = (1e-4, 2e-6)
    stamps_ns = [
        1_700_000_000_999_999_999,
        1_700_000_003_000_000_001,
        1_700_000_004_000_000_000,
    ]
    values = (
        Rotation.random(3, rng).as_quat(),
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)) * 9.81,
    )
    chosen = [
        value if is_given else None
        for value, is_given in zip(values, given, strict=True)
    ]
    packed = ImuMessages(variances).encode(*chosen, stamps_ns)
    for k, stamp_ns in enumerate(stamps_ns):
        one = [None if value is None else value[k] for value in chosen]
        expected = messages.make_imu(*one, stamp_ns, variances)
        assert packed[k] == ros_types.serialize(expected)
