import numpy as np
from rosbags.typesys import Stores, get_typestore

from cns_drake.recording.messages import encode_point_cloud
from cns_drake.sensors import POINT_DTYPE
from evaluation.drives import POINT_CLOUD

STAMP_NS = 1_700_000_000_150_000_001


def decode_cloud(data):
    """Reads a point cloud back; its bytes are those of the typestore."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    cloud = store.deserialize_cdr(data, POINT_CLOUD)
    assert bytes(store.serialize_cdr(cloud, POINT_CLOUD)) == data
    return cloud


def random_points(num_points, seed=0):
    rng = np.random.default_rng(seed)
    points = np.zeros(num_points, POINT_DTYPE)
    for name in ("x", "y", "z", "intensity"):
        points[name] = rng.normal(size=num_points)
    for name in ("ring", "t", "label", "instance"):
        largest = np.iinfo(POINT_DTYPE[name]).max
        points[name] = rng.integers(0, largest, num_points, endpoint=True)
    return points


def test_point_cloud_holds_the_records_under_their_names_and_offsets():
    points = random_points(1000)
    cloud = decode_cloud(encode_point_cloud(points, "roof", STAMP_NS))

    assert cloud.header.frame_id == "roof"
    assert cloud.header.stamp.sec == 1_700_000_000
    assert cloud.header.stamp.nanosec == 150_000_001
    assert (cloud.height, cloud.width) == (1, 1000)
    assert cloud.point_step == 28
    assert cloud.row_step == 28_000
    assert cloud.is_dense
    assert not cloud.is_bigendian
    # Name, offset and datatype as in sensor_msgs/msg/PointField.
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
        ("intensity", 12, 7, 1),
        ("ring", 16, 4, 1),
        ("t", 20, 6, 1),
        ("label", 24, 4, 1),
        ("instance", 26, 4, 1),
    ]
    np.testing.assert_array_equal(cloud.data.view(POINT_DTYPE), points)


def test_point_cloud_bytes_do_not_depend_on_padding():
    points = random_points(10)
    littered = np.frombuffer(
        np.full(points.nbytes, 0xAB, np.uint8), POINT_DTYPE
    ).copy()
    littered.view(np.uint8)[:] = 0xAB
    for name in POINT_DTYPE.names:
        littered[name] = points[name]
    assert littered.tobytes() != points.tobytes()

    clean = encode_point_cloud(points, "lidar", STAMP_NS)
    dirty = encode_point_cloud(littered, "lidar", STAMP_NS)
    assert dirty == clean


def test_point_cloud_may_be_empty():
    cloud = decode_cloud(
        encode_point_cloud(random_points(0), "lidar", STAMP_NS)
    )
    assert (cloud.height, cloud.width, cloud.row_step) == (1, 0, 0)
    assert len(cloud.data) == 0
    assert cloud.point_step == 28


def test_point_cloud_takes_a_view_and_leaves_it_unchanged():
    points = random_points(20)
    points.flags.writeable = False
    cloud = decode_cloud(encode_point_cloud(points[::2], "lidar", STAMP_NS))
    np.testing.assert_array_equal(cloud.data.view(POINT_DTYPE), points[::2])
