from functools import partial
from types import SimpleNamespace

from helpers.scripted_car import ScriptedCar
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from scipy.spatial.transform import Rotation

from cns_drake.recording import (
    BagWriter,
    McapRecorder,
    make_calibration,
    recording_topics,
)
from cns_drake.sensors import POINT_DTYPE
from evaluation.base import InputError

START_NS = 1_700_000_000_000_000_000
PERIOD = 0.05
X_BSs = {
    "lidar": RigidTransform([0.0, 0.0, 1.6]),
    "rear": RigidTransform(RollPitchYaw(0.1, -0.2, 3.0), [-1.5, 0.3, 1.1]),
}
X_BI = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [-1.0, 0.0, 1.6])


def X_WB_at(time):
    """A turning climb, whose pose differs from frame to frame."""
    return RigidTransform(
        RollPitchYaw(0.1 * time, 0.05, 0.7 * time),
        [10.0 * time, 3.0 - time, 0.5 * time],
    )


def scan_at(time, lidar):
    seed = [round(time * 1e6), list(X_BSs).index(lidar)]
    rng = np.random.default_rng(seed)
    points = np.zeros(rng.integers(50, 100), POINT_DTYPE)
    points["x"] = rng.normal(size=len(points))
    points["instance"] = rng.integers(0, 65536, len(points))
    return points


def make_car(fail_at=np.inf):
    def V_WB_B_at(time):
        if time >= fail_at:
            raise InputError("car: it broke down")
        return 0, 0, time, 10.0, time, 0

    return ScriptedCar(
        X_WB_at,
        V_WB_B_at,
        lambda time: ((time, 2.0, 9.81), (0.1, time, 0.3)),
        {name: partial(scan_at, lidar=name) for name in X_BSs},
    )


def make_diagram(bag, **kwargs):
    builder = DiagramBuilder()
    car = builder.AddNamedSystem("car", make_car(**kwargs))
    given = {name: RigidTransform(X) for name, X in X_BSs.items()}
    X_BI_given = RigidTransform(X_BI)
    recorder = builder.AddNamedSystem(
        "recorder",
        McapRecorder(
            bag, X_BSs=given, X_BI=X_BI_given, period=PERIOD, start_ns=START_NS
        ),
    )
    # The recorder keeps the poses of the call.
    for X in (*given.values(), X_BI_given):
        X.SetIdentity()
    for i in range(recorder.num_input_ports()):
        port = recorder.get_input_port(i)
        builder.Connect(car.GetOutputPort(port.get_name()), port)
    return builder.Build()


def record(folder, num_frames, **kwargs):
    with BagWriter(
        folder,
        recording_topics(X_BSs),
        start_ns=START_NS,
        attachments={"calibration.json": make_calibration(X_BSs, X_BI)},
        scenario={"map": "town"},
    ) as bag:
        simulator = Simulator(make_diagram(bag, **kwargs))
        simulator.Initialize()
        simulator.AdvanceTo((num_frames - 1) * PERIOD)


NUM_FRAMES = 45


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorder") / "town_01"
    record(folder, NUM_FRAMES)
    return folder


def read_with_mcap_ros2(folder):
    """Returns topic -> list of (log time, decoded message)."""
    found = {}
    path = folder / f"{folder.name}_0.mcap"
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert message.publish_time == message.log_time
            found.setdefault(channel.topic, []).append(
                (message.log_time, decoded)
            )
    return found


def read_with_rosbags(path):
    found = {}
    with AnyReader([path]) as reader:
        for connection, stamp, data in reader.messages():
            found.setdefault(connection.topic, []).append(
                (stamp, reader.deserialize(data, connection.msgtype))
            )
    return found


@pytest.fixture(
    scope="module", params=["mcap-ros2", "rosbags-folder", "rosbags-file"]
)
def topics(request, recording):
    """The recording, as read by independent libraries."""
    if request.param == "mcap-ros2":
        return read_with_mcap_ros2(recording)
    if request.param == "rosbags-folder":
        return read_with_rosbags(recording)
    return read_with_rosbags(recording / f"{recording.name}_0.mcap")


FRAME_TOPICS = (
    "/lidar/points",
    "/rear/points",
    "/imu/data",
    "/odometry",
    "/tf",
)


def header_of(message):
    return getattr(message, "header", None) or message.transforms[0].header


def test_every_frame_is_there_once_with_its_exact_stamp(topics):
    expected = [START_NS + i * 50_000_000 for i in range(NUM_FRAMES)]
    assert sorted(topics) == sorted([*FRAME_TOPICS, "/tf_static"])
    for topic in FRAME_TOPICS:
        assert [stamp for stamp, _ in topics[topic]] == expected
        headers = [header_of(message).stamp for _, message in topics[topic]]
        assert [h.sec * 10**9 + h.nanosec for h in headers] == expected


def test_frame_ids(topics):
    expected = {
        "/lidar/points": "lidar",
        "/rear/points": "rear",
        "/imu/data": "imu",
        "/odometry": "map",
        "/tf": "map",
        "/tf_static": "base_link",
    }
    for topic, frame_id in expected.items():
        for _, message in topics[topic]:
            assert header_of(message).frame_id == frame_id


def test_scans_are_those_of_the_frame_and_the_lidar(topics):
    for name in X_BSs:
        for i, (_, cloud) in enumerate(topics[f"/{name}/points"]):
            points = np.frombuffer(bytes(cloud.data), POINT_DTYPE)
            np.testing.assert_array_equal(points, scan_at(i * PERIOD, name))
            assert [f.name for f in cloud.fields] == list(POINT_DTYPE.names)


def assert_pose_is(translation, rotation, X):
    assert [translation.x, translation.y, translation.z] == pytest.approx(
        list(X.translation()), abs=1e-12
    )
    matrix = Rotation.from_quat(
        [rotation.x, rotation.y, rotation.z, rotation.w]
    ).as_matrix()
    np.testing.assert_allclose(matrix, X.rotation().matrix(), atol=1e-12)


def test_odometry_and_tf_agree_with_the_motion(topics):
    for i in range(NUM_FRAMES):
        X_WB = X_WB_at(i * PERIOD)
        odometry = topics["/odometry"][i][1]
        pose = odometry.pose.pose
        assert_pose_is(pose.position, pose.orientation, X_WB)
        twist = odometry.twist.twist
        assert twist.linear.y == pytest.approx(i * PERIOD)
        assert twist.angular.z == pytest.approx(i * PERIOD)
        (transform,) = topics["/tf"][i][1].transforms
        assert transform.child_frame_id == "base_link"
        transform = transform.transform
        assert_pose_is(transform.translation, transform.rotation, X_WB)


def test_imu_is_in_its_own_frame(topics):
    for i, (_, imu) in enumerate(topics["/imu/data"]):
        force, rate = imu.linear_acceleration, imu.angular_velocity
        assert force.x == pytest.approx(i * PERIOD)
        assert (force.y, force.z) == (2.0, 9.81)
        assert rate.y == pytest.approx(i * PERIOD)
        X_WI = X_WB_at(i * PERIOD) @ X_BI
        assert_pose_is(
            SimpleNamespace(x=0.0, y=0.0, z=0.0),
            imu.orientation,
            RigidTransform(X_WI.rotation(), [0.0, 0.0, 0.0]),
        )


def test_static_transforms_come_once_at_the_start(topics):
    ((stamp, tf),) = topics["/tf_static"]
    assert stamp == START_NS
    poses = {t.child_frame_id: t.transform for t in tf.transforms}
    assert list(poses) == ["lidar", "rear", "imu"]
    for name, X_BC in {**X_BSs, "imu": X_BI}.items():
        assert_pose_is(poses[name].translation, poses[name].rotation, X_BC)


def test_static_transforms_are_latched(recording):
    with AnyReader([recording]) as reader:
        durability = {
            c.topic: c.ext.offered_qos_profiles[0].durability
            for c in reader.connections
        }
    assert durability.pop("/tf_static") == QosDurability.TRANSIENT_LOCAL
    assert set(durability.values()) == {QosDurability.VOLATILE}


def test_calibration_gives_the_sensor_frames():
    calibration = make_calibration(X_BSs, X_BI)
    assert list(calibration) == ["lidar", "rear", "imu"]
    for name, X_BC in {**X_BSs, "imu": X_BI}.items():
        entry = calibration[name]
        assert entry["parent"] == "base_link"
        assert entry["translation"] == list(X_BC.translation())
        np.testing.assert_allclose(
            Rotation.from_quat(entry["quat_xyzw"]).as_matrix(),
            X_BC.rotation().matrix(),
            atol=1e-14,
        )


def test_same_diagram_gives_same_bytes(recording, tmp_path):
    record(tmp_path / recording.name, NUM_FRAMES)
    for path in recording.iterdir():
        assert (tmp_path / recording.name / path.name).read_bytes() == (
            path.read_bytes()
        )


def test_one_frame_is_possible(tmp_path):
    record(tmp_path / "town_01", 1)
    topics = read_with_rosbags(tmp_path / "town_01")
    assert {len(found) for found in topics.values()} == {1}


def test_failing_sensor_leaves_no_recording(tmp_path):
    folder = tmp_path / "town_01"
    with pytest.raises(InputError, match="car: it broke down"):
        record(folder, NUM_FRAMES, fail_at=1.49)
    assert not folder.exists()


class _BagStub:
    def __init__(self):
        self.written = []

    def write(self, topic, stamp_ns, data, sequence):
        self.written.append((topic, stamp_ns, sequence))


@pytest.mark.parametrize("time", [2 * PERIOD, 2.5 * PERIOD])
def test_a_forced_publish_writes_nothing(time):
    bag = _BagStub()
    simulator = Simulator(make_diagram(bag))
    simulator.AdvanceTo(time)
    simulator.get_system().ForcedPublish(simulator.get_context())
    simulator.AdvanceTo(4 * PERIOD)
    frames = [number for topic, _, number in bag.written if topic == "/tf"]
    assert frames == [0, 1, 2, 3, 4]


def test_simulation_may_start_at_a_later_frame():
    bag = _BagStub()
    simulator = Simulator(make_diagram(bag))
    simulator.get_mutable_context().SetTime(30 * PERIOD)
    simulator.Initialize()
    simulator.AdvanceTo(33 * PERIOD)
    frames = [number for topic, _, number in bag.written if topic == "/tf"]
    assert frames == [30, 31, 32, 33]


def test_a_start_before_time_zero_is_refused():
    bag = _BagStub()
    simulator = Simulator(make_diagram(bag))
    simulator.get_mutable_context().SetTime(-2 * PERIOD)
    with pytest.warns(UserWarning, match=r"starts at -0\.1 s: nothing is rec"):
        simulator.Initialize()
    simulator.AdvanceTo(-PERIOD)
    assert bag.written == []
    simulator.AdvanceTo(PERIOD)
    frames = [number for topic, _, number in bag.written if topic == "/tf"]
    assert frames == [0, 1]
