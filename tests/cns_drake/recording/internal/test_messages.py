import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from cns_drake.recording import messages
from evaluation.drives import serialize

# The variance of a value without noise.
EXACT = 1e-12
STAMP_NS = 1_700_000_000_150_000_001


def decode(message):
    """Reads a message back from its bytes with a typestore of its own."""
    return get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr(
        serialize(message), message.__msgtype__
    )


@pytest.mark.parametrize("variance", [0.0, 1e-13, 2e-12, 0.04])
def test_noise_has_its_variance_and_no_value_none(variance):
    vector = np.zeros(3)
    variances = (variance, 3 * variance)
    imu = decode(messages.make_imu(None, vector, vector, STAMP_NS, variances))
    for covariance, expected in zip(
        (imu.linear_acceleration_covariance, imu.angular_velocity_covariance),
        variances,
        strict=True,
    ):
        expected = max(expected, EXACT) * np.eye(3).ravel()
        np.testing.assert_array_equal(covariance, expected)
