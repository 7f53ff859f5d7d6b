"""Layouts of points against the documents of drivers, and back."""

import math

from helpers.drive_files import write_recording
import numpy as np
import pytest

from cns_drake.recording.messages import encode_point_cloud
from cns_drake.sensors import POINT_DTYPE
from evaluation.drives import POINT_CLOUD, McapDrive, to_labels, to_layout
from evaluation.drives.point_cloud2 import to_points, to_records
from evaluation.drives.point_layouts import from_layout
from evaluation.drives.ros_messages import deserialize

# sensor_msgs/PointField: UINT8 2, UINT16 4, UINT32 6, FLOAT32 7.
XYZ = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
FIELDS = {
    # ouster_ros::Point of LIO-SAM and FAST-LIO2: 16 bytes of a position.
    "ouster": (
        48,
        [
            *XYZ,
            ("intensity", 16, 7),
            ("t", 20, 6),
            ("reflectivity", 24, 4),
            ("ring", 26, 2),
            ("ambient", 28, 4),
            ("range", 32, 6),
        ],
    ),
    # velodyne_pointcloud: packed.
    "velodyne": (
        22,
        [*XYZ, ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7)],
    ),
    # Nebula's PointXYZIRCAEDT.
    "autoware": (
        32,
        [
            *XYZ,
            ("intensity", 12, 2),
            ("return_type", 13, 2),
            ("channel", 14, 4),
            ("azimuth", 16, 7),
            ("elevation", 20, 7),
            ("distance", 24, 7),
            ("time_stamp", 28, 6),
        ],
    ),
}


@pytest.fixture
def points():
    rng = np.random.default_rng(1)
    points = np.zeros(500, POINT_DTYPE)
    for axis in "xyz":
        points[axis] = rng.uniform(-60.0, 60.0, 500)
    points["intensity"] = rng.uniform(0.0, 1.0, 500)
    points["ring"] = rng.integers(0, 128, 500)
    points["t"] = np.sort(rng.integers(0, 100_000_000, 500))
    points["label"] = rng.integers(0, 100, 500)
    points["instance"] = rng.integers(0, 65536, 500)
    return points


def sent(points):
    """Returns the message of points after a trip through its bytes."""
    return deserialize(encode_point_cloud(points, "lidar", 10**18), POINT_CLOUD)


@pytest.mark.parametrize("layout", FIELDS)
def test_fields_lie_where_readers_look(points, layout):
    message = sent(to_layout(points, layout))
    point_step, fields = FIELDS[layout]
    assert message.point_step == point_step
    assert fields == [
        (field.name, field.offset, field.datatype) for field in message.fields
    ]
    assert message.is_dense
    assert message.height == 1


@pytest.mark.parametrize("layout", ["cns", *FIELDS])
def test_points_come_back(points, layout):
    labels = None if layout == "cns" else to_records(sent(to_labels(points)))
    read = from_layout(
        to_points(sent(to_layout(points, layout))),
        labels,
        is_ideal=lambda: True,
    )
    for name in ("x", "y", "z", "ring", "label", "instance"):
        np.testing.assert_array_equal(read[name], points[name])
    # A float32 of a tenth of a second resolves 7 ns, a byte 1/255.
    t_error_ns = 4 if layout == "velodyne" else 0
    assert read["t"].dtype == np.uint32
    np.testing.assert_allclose(
        read["t"].astype(float), points["t"], rtol=0, atol=t_error_ns
    )
    step = 1 / 255 if layout == "autoware" else 0.0
    np.testing.assert_allclose(
        read["intensity"], points["intensity"], rtol=0, atol=step / 2 + 1e-6
    )


@pytest.mark.parametrize("most", [256, 2])
@pytest.mark.parametrize("layout", ["cns", *FIELDS])
def test_calibrated_intensities_come_back(points, layout, most):
    points["intensity"] = np.arange(500) % most
    read = from_layout(
        to_points(sent(to_layout(points, layout, is_calibrated=True)))
    )
    np.testing.assert_array_equal(read["intensity"], points["intensity"])
    if layout == "ouster":
        np.testing.assert_array_equal(read["reflectivity"], points["intensity"])


def test_velodynes_driver_counts_rings_from_below(points):
    for layout, from_below in (("velodyne", True), ("ouster", False)):
        ring = to_layout(points, layout, 128)["ring"].astype(int)
        expected = points["ring"].astype(int)
        if from_below:
            expected = 127 - expected
        np.testing.assert_array_equal(ring, expected)


def test_derived_fields(points):
    p = np.stack([points[axis].astype(float) for axis in "xyz"], axis=1)
    distance = np.linalg.norm(p, axis=1)
    ouster = to_layout(points, "ouster")
    np.testing.assert_allclose(ouster["range"], 1000.0 * distance, atol=0.51)
    np.testing.assert_allclose(
        ouster["reflectivity"], 255.0 * points["intensity"], atol=0.51
    )
    autoware = to_layout(points, "autoware")
    np.testing.assert_allclose(autoware["distance"], distance, rtol=1e-6)
    azimuth, elevation = autoware["azimuth"], autoware["elevation"]
    assert azimuth.min() >= 0.0
    assert azimuth.max() <= 2.0 * np.pi
    along = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=1,
    )
    np.testing.assert_allclose(along * distance[:, None], p, atol=1e-4)
    for echoes, kind in {"first": 0, "strongest": 1, "last": 2}.items():
        autoware = to_layout(points, "autoware", echoes=echoes)
        assert set(autoware["return_type"]) == {kind}


@pytest.mark.parametrize("seed", range(3))
def test_autoware_tells_two_echoes_of_a_beam_apart(seed):
    """Beams 0.05 deg apart, all at one time, as a flash LiDAR has them."""
    rng = np.random.default_rng(seed)
    rows, kinds = [], []
    for k in range(400):
        angle, near, far = k * math.radians(0.05), *np.sort(rng.random(2))
        # The strongest echo is the first in the message.
        ways, types = {
            0: ([near + 1], [7]),
            1: ([near + 1, far + 2], [3, 6]),
            2: ([far + 2, near + 1], [4, 5]),
        }[int(rng.integers(3))]
        for way, kind in zip(ways, types, strict=True):
            x, y = 50 * math.cos(angle), 50 * math.sin(angle)
            rows.append((way * x, way * y, way * 0.3, 0.5, 3, 70))
            kinds.append(kind)
    fields = [(name, "f4") for name in ("x", "y", "z", "intensity")]
    points = np.array(rows, [*fields, ("ring", "u2"), ("t", "u4")])
    made = to_layout(points, "autoware", echoes="dual")
    np.testing.assert_array_equal(made["return_type"], kinds)
    none = to_layout(points[:0], "autoware", echoes="dual")
    assert len(none) == 0


def test_points_of_others_stay_as_they_are():
    """Times before the stamp, or since 1970, are no `t`."""
    for time in (-0.05, 1.7e9):
        points = np.zeros(3, [("x", "f4"), ("time", "f8"), ("ring", "u2")])
        points["time"] = time
        assert from_layout(points) is points


@pytest.mark.parametrize("kind", ["f4", "u1", "u2"])
@pytest.mark.parametrize(
    ("library", "unit"), [("cns-drake 4.0.0", 1 / 255), ("nebula", 1.0)]
)
def test_only_own_files_have_a_unit_of_intensity(tmp_path, kind, library, unit):
    """Autoware's fields in files of this program, and of another one."""
    scan = np.zeros(
        4,
        [(axis, "<f4") for axis in "xyz"]
        + [("intensity", kind), ("channel", "<u2"), ("time_stamp", "<u4")],
    )
    scan["x"] = 5.0
    scan["intensity"] = [0, 1, 60, 255]
    scan["channel"] = [3, 2, 1, 0]
    scan["time_stamp"] = [0, 7, 8, 99_000_000]
    path = write_recording(
        tmp_path / "drive", [scan] * 2, [np.eye(4)] * 2, library=library
    )
    read = McapDrive(path).scan(1)
    np.testing.assert_allclose(
        read["intensity"], scan["intensity"] * unit, rtol=1e-6
    )
    np.testing.assert_array_equal(read["ring"], scan["channel"])
    np.testing.assert_array_equal(read["t"], scan["time_stamp"])


def test_a_time_stamp_needs_no_channel():
    points = np.zeros(2, [("x", "f4"), ("time_stamp", "u4")])
    points["time_stamp"] = [5, 9]
    np.testing.assert_array_equal(from_layout(points)["t"], [5, 9])


def test_labels_of_another_scan(points):
    with pytest.raises(ValueError, match="500 points, but 499 labels"):
        from_layout(points, to_labels(points)[1:])
