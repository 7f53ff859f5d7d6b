import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
import pytest
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from cns_drake.drives import (
    POINT_CLOUD,
    message_definition,
    message_hash,
    serialize,
)
from cns_drake.recording import messages

# The variance of a value without noise.
EXACT = 1e-12
STAMP_NS = 1_700_000_000_150_000_001


def decode(message):
    """Reads a message back from its bytes with a typestore of its own."""
    return get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr(
        serialize(message), message.__msgtype__
    )


def random_pose(seed):
    rng = np.random.default_rng(seed)
    return RigidTransform(
        RollPitchYaw(rng.uniform(-1.5, 1.5, 3)), rng.uniform(-300, 300, 3)
    )


def assert_quaternion_is(quaternion, R):
    matrix = Rotation.from_quat(
        [quaternion.x, quaternion.y, quaternion.z, quaternion.w]
    ).as_matrix()
    np.testing.assert_allclose(matrix, R.matrix(), atol=1e-14)


def test_imu_puts_each_vector_in_its_place():
    R_WI = random_pose(1).rotation()
    imu = decode(
        messages.make_imu(
            messages.to_quat_xyzw(R_WI),
            angular_velocity=np.array([0.1, 0.2, 0.3]),
            specific_force=np.array([1.0, 2.0, 9.81]),
            stamp_ns=STAMP_NS,
        )
    )
    assert imu.header.frame_id == "imu"
    assert_quaternion_is(imu.orientation, R_WI)
    rate = imu.angular_velocity
    assert (rate.x, rate.y, rate.z) == (0.1, 0.2, 0.3)
    force = imu.linear_acceleration
    assert (force.x, force.y, force.z) == (1.0, 2.0, 9.81)
    for covariance in (
        imu.orientation_covariance,
        imu.angular_velocity_covariance,
        imu.linear_acceleration_covariance,
    ):
        np.testing.assert_array_equal(covariance, EXACT * np.eye(3).ravel())


def test_imu_says_what_it_does_not_measure():
    imu = decode(messages.make_imu(None, None, np.zeros(3), STAMP_NS))
    for covariance in (
        imu.orientation_covariance,
        imu.angular_velocity_covariance,
    ):
        np.testing.assert_array_equal(covariance, [-1.0] + 8 * [0.0])
    measured = imu.linear_acceleration_covariance
    np.testing.assert_array_equal(measured, EXACT * np.eye(3).ravel())


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


def test_odometry_is_exact():
    X_WB = random_pose(2)
    V_WB_B = SpatialVelocity(w=[0.1, 0.2, 0.3], v=[7.0, 8.0, 9.0])
    odometry = decode(messages.make_odometry(X_WB, V_WB_B, STAMP_NS))

    assert odometry.header.frame_id == "map"
    assert odometry.child_frame_id == "base_link"
    pose = odometry.pose.pose
    p = pose.position
    assert [p.x, p.y, p.z] == list(X_WB.translation())
    assert_quaternion_is(pose.orientation, X_WB.rotation())
    linear = odometry.twist.twist.linear
    assert (linear.x, linear.y, linear.z) == (7.0, 8.0, 9.0)
    angular = odometry.twist.twist.angular
    assert (angular.x, angular.y, angular.z) == (0.1, 0.2, 0.3)
    # Zeros would stand for an unknown covariance.
    for part in (odometry.pose, odometry.twist):
        covariance = part.covariance.reshape(6, 6)
        np.testing.assert_array_equal(covariance, EXACT * np.eye(6))


def test_tf_lists_every_child_in_order():
    X_BS, X_BI = random_pose(3), random_pose(4)
    tf = decode(
        messages.make_tf("base_link", {"roof": X_BS, "imu": X_BI}, STAMP_NS)
    )
    assert [t.child_frame_id for t in tf.transforms] == ["roof", "imu"]
    for transform, X in zip(tf.transforms, (X_BS, X_BI), strict=True):
        assert transform.header.frame_id == "base_link"
        assert transform.header.stamp.nanosec == 150_000_001
        p = transform.transform.translation
        assert [p.x, p.y, p.z] == list(X.translation())
        assert_quaternion_is(transform.transform.rotation, X.rotation())


@pytest.mark.parametrize("yaw", [0.0, 3.0, -3.0, np.pi])
def test_quaternion_comes_in_ros_order(yaw):
    x, y, z, w = messages.to_quat_xyzw(
        RigidTransform(RollPitchYaw(0, 0, yaw), [0, 0, 0]).rotation()
    )
    assert x == pytest.approx(0.0, abs=1e-15)
    assert y == pytest.approx(0.0, abs=1e-15)
    assert np.hypot(z, w) == pytest.approx(1.0, abs=1e-15)
    assert 2 * np.arctan2(z, w) == pytest.approx(yaw, abs=1e-14)


def test_definition_and_hash_are_the_published_ones():
    assert "sensor_msgs/PointField" in message_definition(POINT_CLOUD)
    # As published with sensor_msgs of ROS 2 Iron and later.
    assert message_hash(POINT_CLOUD) == (
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"
    )
