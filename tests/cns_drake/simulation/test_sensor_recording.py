"""A robot of a plant, recorded with all its sensors, read by ROS tools."""

import numpy as np
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    Meshcat,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    RevoluteJoint,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from cns_drake.sensors import (
    Lidar,
    add_imu,
    add_lidar,
    add_lidar_view,
    add_odometry,
    make_beam_pattern,
)
from cns_drake.simulation import add_mcap_recorder
from evaluation.drives import open_drive

# Angular velocity of the arm [rad/s].
RATE = 0.7
# Time between frames [s].
PERIOD = 0.1
# Distance of the seat from the arm's axis [m].
RADIUS = 2.0
X_PL = RigidTransform(RollPitchYaw(0.1, -0.2, 0.3), [0.2, 0.1, 0.5])
PATTERN = make_beam_pattern("vlp-16", PERIOD, num_columns=90)


class Carousel:
    """An arm that turns at a constant rate, with its sensors."""

    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, 0.0
        )
        plant = self.plant
        inertia = SpatialInertia.SolidBoxWithDensity(1.0, 1.0, 1.0, 1.0)
        self.arm = plant.AddRigidBody("arm", inertia)
        self.joint = plant.AddJoint(
            RevoluteJoint(
                "hub",
                plant.world_frame(),
                self.arm.body_frame(),
                [0.0, 0.0, 1.0],
            )
        )
        self.seat = plant.AddFrame(
            FixedOffsetFrame("seat", self.arm, RigidTransform([RADIUS, 0, 0]))
        )
        plant.RegisterVisualGeometry(
            plant.world_body(),
            RigidTransform([9.0, 0.0, 0.0]),
            Box(1.0, 30.0, 6.0),
            "wall",
            [0.2, 0.4, 0.6, 1.0],
        )
        plant.Finalize()

    def simulate(self, num_frames, bag):
        simulator = Simulator(self.builder.Build())
        context = self.plant.GetMyMutableContextFromRoot(
            simulator.get_mutable_context()
        )
        self.joint.set_angular_rate(context, RATE)
        with bag:
            simulator.AdvanceTo((num_frames - 1) * PERIOD)
        return simulator.get_context()


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    """A recording with a LiDAR, an IMU and odometry on the seat."""
    folder = tmp_path_factory.mktemp("ride") / "ride"
    made = Carousel()
    lidar = add_lidar(
        made.builder, made.scene_graph, made.seat, X_PL, PATTERN, name="lidar"
    )
    still = add_lidar(
        made.builder,
        made.scene_graph,
        made.plant.world_body(),
        X_PL,
        PATTERN,
        name="still",
    )
    bag = add_mcap_recorder(
        made.builder,
        folder,
        period=PERIOD,
        lidars=[lidar, still],
        imu=add_imu(made.builder, made.seat, X_PL),
        odometry=add_odometry(made.builder, made.seat),
    )
    context = made.simulate(6, bag)
    last = [
        system.GetOutputPort("scan").Eval(system.GetMyContextFromRoot(context))
        for system in (lidar, still)
    ]
    return folder, last


def read(folder):
    """Returns topic -> messages, by an independent reader."""
    found = {}
    with AnyReader([folder]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append(message)
    return found


def test_odometry_of_a_frame_on_a_body(ride):
    """The oracle is a point on a circle, in closed form."""
    for k, message in enumerate(read(ride[0])["/odometry"]):
        angle = RATE * PERIOD * k
        p = message.pose.pose.position
        expected = RADIUS * np.array([np.cos(angle), np.sin(angle), 0.0])
        np.testing.assert_allclose([p.x, p.y, p.z], expected, atol=1e-3)
        twist = message.twist.twist
        v = [twist.linear.x, twist.linear.y, twist.linear.z]
        np.testing.assert_allclose(v, [0.0, RATE * RADIUS, 0.0], atol=1e-9)
        assert twist.angular.z == pytest.approx(RATE)


def test_imu_of_a_frame_on_a_body(ride):
    """The IMU measures centripetal acceleration and gravity at its place."""
    R_PI = X_PL.rotation().matrix()
    p_PI = np.array([RADIUS, 0.0, 0.0]) + X_PL.translation()
    a_P = -(RATE**2) * np.array([p_PI[0], p_PI[1], 0.0])
    for message in read(ride[0])["/imu/data"]:
        a, w = message.linear_acceleration, message.angular_velocity
        np.testing.assert_allclose(
            [a.x, a.y, a.z],
            R_PI.T @ (a_P + np.array([0.0, 0.0, 9.81])),
            atol=1e-9,
        )
        np.testing.assert_allclose(
            [w.x, w.y, w.z], R_PI.T @ [0, 0, RATE], atol=1e-12
        )
        assert message.orientation_covariance[0] == 1e-12


def test_points_are_those_of_the_lidars(ride):
    found = read(ride[0])
    for name, scan in zip(("lidar", "still"), ride[1], strict=True):
        messages = found[f"/{name}/points"]
        assert len(messages) == 6
        assert messages[-1].data.tobytes() == scan.tobytes()
        assert len(scan) > 50


def test_places_of_the_sensors(ride):
    """A sensor on the seat is posed there, a fixed one on the map."""
    found = read(ride[0])
    (static,) = found["/tf_static"]
    assert {t.child_frame_id for t in static.transforms} == {"lidar", "imu"}
    assert {t.header.frame_id for t in static.transforms} == {"base_link"}
    (place,) = (t for t in static.transforms if t.child_frame_id == "lidar")
    v = place.transform.translation
    np.testing.assert_allclose([v.x, v.y, v.z], X_PL.translation())
    for message in found["/tf"]:
        children = [t.child_frame_id for t in message.transforms]
        assert children == ["base_link", "still"]
        q = message.transforms[1].transform.rotation
        R = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
        np.testing.assert_allclose(R, X_PL.rotation().matrix(), atol=1e-12)


def test_the_evaluation_reads_it(ride):
    """All points lie on the wall, once they are in the world."""
    drive = open_drive(ride[0])
    for k in range(len(drive)):
        scan = drive.scan(k)
        p_S = np.stack([scan["x"], scan["y"], scan["z"]], axis=1)
        X_WS = drive.X_WS[k]
        p_W = p_S @ X_WS[:3, :3].T + X_WS[:3, 3]
        offset = np.abs(p_W - [9.0, 0.0, 0.0]) / [0.5, 15.0, 3.0]
        np.testing.assert_allclose(offset.max(axis=1), 1.0, atol=1e-4)


def test_a_lidar_alone(tmp_path):
    made = Carousel()
    lidar = add_lidar(
        made.builder, made.scene_graph, made.arm, X_PL, PATTERN, name="top"
    )
    view = add_lidar_view(made.builder, lidar, meshcat := Meshcat())
    bag = add_mcap_recorder(
        made.builder, tmp_path / "alone", period=PERIOD, lidars=[lidar]
    )
    made.simulate(3, bag)
    found = read(tmp_path / "alone")
    assert set(found) == {"/top/points", "/tf"}
    assert view.get_name() == "top_view"
    assert meshcat.HasPath("/drake/top")
    angle = RATE * PERIOD * 2
    (pose,) = found["/tf"][-1].transforms
    v = pose.transform.translation
    expected = RollPitchYaw(0, 0, angle).ToRotationMatrix() @ X_PL.translation()
    np.testing.assert_allclose([v.x, v.y, v.z], expected, atol=1e-3)


def test_an_imu_without_odometry_has_no_orientation(tmp_path):
    made = Carousel()
    imu = add_imu(made.builder, made.arm, X_PL)
    bag = add_mcap_recorder(
        made.builder, tmp_path / "imu", period=PERIOD, imu=imu
    )
    made.simulate(2, bag)
    (first, _) = read(tmp_path / "imu")["/imu/data"]
    assert first.orientation_covariance[0] == -1.0
    assert first.angular_velocity_covariance[0] == 1e-12


def test_images_of_drakes_camera(tmp_path):
    made = Carousel()
    try:
        renderer = MakeRenderEngineVtk(RenderEngineVtkParams())
    except RuntimeError as error:
        pytest.skip(f"no rendering here: {error}")
    made.scene_graph.AddRenderer("vtk", renderer)
    intrinsics = CameraInfo(width=40, height=30, fov_y=1.0)
    X_BC = RigidTransform(RollPitchYaw(0.0, 0.0, 0.2), [0.1, 0.0, 0.0])
    core = RenderCameraCore("vtk", intrinsics, ClippingRange(0.05, 50.0), X_BC)
    # Its z looks along x of the world.
    X_WB = RigidTransform(
        RollPitchYaw(-np.pi / 2, 0.0, -np.pi / 2), [1.0, 0.0, 0.0]
    )
    camera = made.builder.AddSystem(
        RgbdSensor(
            made.scene_graph.world_frame_id(),
            X_WB,
            DepthRenderCamera(core, DepthRange(0.1, 40.0)),
        )
    )
    made.builder.Connect(
        made.scene_graph.get_query_output_port(),
        camera.query_object_input_port(),
    )
    bag = add_mcap_recorder(
        made.builder, tmp_path / "photo", period=PERIOD, cameras={"eye": camera}
    )
    context = camera.GetMyContextFromRoot(made.simulate(2, bag))
    found = read(tmp_path / "photo")
    for kind, encoding, port in (
        ("color", "rgba8", camera.color_image_output_port()),
        ("depth", "32FC1", camera.depth_image_32F_output_port()),
        ("label", "16SC1", camera.label_image_output_port()),
    ):
        message = found[f"/eye/{kind}"][-1]
        pixels = port.Eval(context).data
        assert (message.height, message.width) == (30, 40)
        assert message.encoding == encoding
        assert message.step * 30 == len(message.data)
        assert message.data.tobytes() == pixels.tobytes()
    # The wall is 7.5 m before the middle of the image.
    depth = found["/eye/depth"][-1].data.view(np.float32).reshape(30, 40)
    assert depth[15, 20] == pytest.approx(7.5, abs=1e-3)
    info = found["/eye/camera_info"][-1]
    half = [[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
    np.testing.assert_array_equal(
        info.k.reshape(3, 3), intrinsics.intrinsic_matrix() - half
    )
    (pose,) = found["/tf"][-1].transforms
    v = pose.transform.translation
    expected = (X_WB @ X_BC).translation()
    np.testing.assert_allclose([v.x, v.y, v.z], expected, atol=1e-12)


def add_camera(made, color, depth):
    """Adds an RgbdSensor on the world, of (info, X_BC) for colour and depth."""
    try:
        renderer = MakeRenderEngineVtk(RenderEngineVtkParams())
    except RuntimeError as error:
        pytest.skip(f"no rendering here: {error}")
    made.scene_graph.AddRenderer("vtk", renderer)
    clipping = ClippingRange(0.05, 50.0)
    cores = [
        RenderCameraCore("vtk", info, clipping, X) for info, X in (color, depth)
    ]
    camera = made.builder.AddSystem(
        RgbdSensor(
            made.scene_graph.world_frame_id(),
            X_WB,
            ColorRenderCamera(cores[0]),
            DepthRenderCamera(cores[1], DepthRange(0.1, 40.0)),
        )
    )
    made.builder.Connect(
        made.scene_graph.get_query_output_port(),
        camera.query_object_input_port(),
    )
    return camera


# z looks along x of the world.
X_WB = RigidTransform(
    RollPitchYaw(-np.pi / 2, 0.0, -np.pi / 2), [1.0, 0.0, 0.0]
)
INFO = CameraInfo(40, 30, 35.0, 33.0, 18.0, 16.0)
X_BC = RigidTransform(RollPitchYaw(0.0, 0.0, 0.2), [0.1, 0.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize(
    "depth",
    [
        (CameraInfo(24, 20, 21.0, 22.0, 11.0, 9.0), X_BC),
        (CameraInfo(40, 30, 35.0, 33.0, 18.0, 15.0), X_BC),
        (INFO, RigidTransform([0.0, 0.3, 0.0])),
    ],
)
def test_depth_images_of_a_camera_of_their_own(tmp_path, depth):
    """Another size, another K or another pose than that of the colours."""
    made = Carousel()
    camera = add_camera(made, (INFO, X_BC), depth)
    bag = add_mcap_recorder(
        made.builder,
        tmp_path / "two",
        period=PERIOD,
        rates={"eye": 20.0},
        cameras={"eye": camera},
    )
    made.simulate(2, bag)
    found = read(tmp_path / "two")
    for topic, frame, (info, X), kinds in (
        ("/eye/camera_info", "eye", (INFO, X_BC), ("color", "label")),
        ("/eye/depth/camera_info", "eye_depth", depth, ("depth",)),
    ):
        message = found[topic][-1]
        assert (message.width, message.height) == (info.width(), info.height())
        K = info.intrinsic_matrix()
        K[:2, 2] -= 0.5
        np.testing.assert_array_equal(message.k.reshape(3, 3), K)
        assert message.header.frame_id == frame
        for kind in kinds:
            images = found[f"/eye/{kind}"]
            assert len(images) == len(found[topic]) == 3
            assert images[-1].header.frame_id == frame
            size = images[-1].width, images[-1].height
            assert size == (info.width(), info.height())
        (pose,) = (
            one.transform
            for one in found["/tf"][-1].transforms
            if one.child_frame_id == frame
        )
        v, q = pose.translation, pose.rotation
        X_WC = X_WB @ X
        np.testing.assert_allclose([v.x, v.y, v.z], X_WC.translation())
        R = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
        np.testing.assert_allclose(R, X_WC.rotation().matrix(), atol=1e-12)


def test_slips_in_the_arguments_of_a_recorder(tmp_path):
    made, other = Carousel(), Carousel()
    lidars = [
        add_lidar(one.builder, one.scene_graph, one.arm, X_PL, PATTERN)
        for one in (made, other)
    ]
    number = len(made.builder.GetSystems())
    for options, error, fault in (
        ({"imu": 3}, TypeError, "^imu: 3 is no Imu"),
        ({"odometry": made.plant}, TypeError, "^odometry: .* OdometrySensor"),
        (
            {"cameras": {"c": 3}},
            TypeError,
            "^cameras: c: 3 is no RgbdSensor",
        ),
        ({"rates": 5}, TypeError, "^rates: 5 is no Mapping"),
        ({"rates": {"lidar": "9"}}, TypeError, "^rates: lidar: '9' is not"),
        ({"period": "1"}, TypeError, "^period: '1' is not"),
        ({"start_ns": True}, TypeError, "^start_ns: True is not"),
        ({"overwrite": "no"}, TypeError, "^overwrite: 'no' is not"),
        ({"name": 3}, TypeError, "^name: 3 is not"),
        ({"lidars": lidars[0]}, TypeError, "^lidars: .* is no Collection"),
        ({"lidars": lidars}, RuntimeError, "^lidars: Lidar 'lidar' is not in"),
    ):
        given = {"lidars": lidars[:1]} | options
        with pytest.raises(error, match=fault):
            add_mcap_recorder(made.builder, tmp_path / "drive", **given)
        assert len(made.builder.GetSystems()) == number


def test_a_recording_ends_before_the_stamps_of_ros(tmp_path):
    """Their number of seconds is an int32."""
    made = Carousel()
    lidar = add_lidar(made.builder, made.scene_graph, made.arm, X_PL, PATTERN)
    bag = add_mcap_recorder(
        made.builder,
        tmp_path / "drive",
        lidars=[lidar],
        start_ns=(2**31 - 1) * 10**9 + 999_999_999,
    )
    with pytest.raises(ValueError, match="ROS 2 are below 2147483648 s"):
        made.simulate(2, bag)


def test_names_in_a_recording_are_unique_and_fit_ros(tmp_path):
    made = Carousel()
    lidars = {
        name: made.builder.AddNamedSystem(
            name, Lidar(made.scene_graph.world_frame_id(), X_PL, PATTERN)
        )
        for name in ("a/b", "tf_static", "x", "eye_depth")
    }
    camera = add_camera(made, (INFO, X_BC), (INFO, X_PL))
    for names, cameras, fault in (
        (["a/b"], {}, "'a/b' cannot be a part"),
        (["tf_static"], {}, "'tf_static' is the name of another"),
        (["x"], {"x": camera}, "'x' is the name of another"),
        (["x"], {"imu": camera}, "'imu' is the name of another"),
        ([], {"2nd": camera}, "'2nd' cannot be a part"),
        (["eye_depth"], {"eye": camera}, "'eye_depth' is the name of another"),
    ):
        with pytest.raises(ValueError, match=fault):
            add_mcap_recorder(
                made.builder,
                tmp_path / "bad",
                period=PERIOD,
                lidars=[lidars[name] for name in names],
                cameras=cameras,
            )
    add_mcap_recorder(made.builder, tmp_path / "one", lidars=[lidars["x"]])
    with pytest.raises(ValueError, match="has a system 'mcap_recorder'"):
        add_mcap_recorder(made.builder, tmp_path / "two", lidars=[lidars["x"]])
