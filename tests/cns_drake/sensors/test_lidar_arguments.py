"""Slips in the arguments of a LiDAR are found at the call."""

import warnings

import numpy as np
from pydrake.geometry import Box, GeometryFrame, Meshcat, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.planning import RobotDiagramBuilder
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
import pytest

from cns_drake.sensors import (
    ApplyImuConfig,
    ApplyLidarConfig,
    ApplyOdometryConfig,
    CalibratedReturns,
    DirectionPattern,
    Lidar,
    MeasurementModel,
    OdometrySensor,
    add_imu,
    add_lidar,
    add_lidar_view,
    add_odometry,
    make_beam_pattern,
    make_flash_pattern,
)

X_PS = RigidTransform([0.0, 0.0, 1.0])


class Site:
    """A wall 8 m ahead of the world's origin, or nothing."""

    def __init__(self, with_wall=True, is_finalized=True):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, 0.0
        )
        self.world = self.plant.world_body()
        if with_wall:
            self.plant.RegisterVisualGeometry(
                self.world,
                RigidTransform([8.0, 0.0, 0.0]),
                Box(0.2, 20.0, 6.0),
                "wall",
                np.full(4, 0.5),
            )
        if is_finalized:
            self.plant.Finalize()

    def add(self, body=None, pose=X_PS, pattern="vlp-16", **options):
        return add_lidar(
            self.builder,
            self.scene_graph,
            self.world if body is None else body,
            pose,
            pattern,
            **options,
        )

    def ranges(self, time=0.0, **options):
        lidar = self.add(**options)
        root = self.builder.Build().CreateDefaultContext()
        root.SetTime(time)
        scan = lidar.GetOutputPort("scan").Eval(
            lidar.GetMyContextFromRoot(root)
        )
        return np.linalg.norm([scan["x"], scan["y"], scan["z"]], axis=0)


@pytest.mark.parametrize(
    ("options", "error", "fault"),
    [
        ({"body": "wall"}, TypeError, r"plant.GetBodyByName\('wall'\)"),
        ({"body": 3}, TypeError, "body: 3 is not a RigidBody"),
        ({"pose": [0, 0, 1]}, TypeError, "X_PB: .* is no RigidTransform"),
        (
            {"pose": RigidTransform([np.nan, 0, 0])},
            ValueError,
            "X_PB: not finite",
        ),
        ({"pattern": 16}, TypeError, "pattern: 16 is neither a BeamPattern"),
        ({"pattern": "vlp-61"}, ValueError, "no preset 'vlp-61'"),
        (
            {"range_noise": -0.1},
            ValueError,
            "range_noise: -0.1 is not a length",
        ),
        ({"range_noise": None}, TypeError, "range_noise: None is not a num"),
        ({"dropout": True}, TypeError, "dropout: True is not a number"),
        ({"dropout": 1.01}, ValueError, "dropout: 1.01 is not a probability"),
        ({"seed": -1}, ValueError, "seed: -1 is not an integer"),
        ({"seed": "7"}, TypeError, "^seed: '7' is not a whole number"),
        ({"pose": np.eye(4)}, TypeError, r"^X_PB: array\(.* is no RigidT"),
        (
            {"range_noise": 0.1, "measurement": MeasurementModel()},
            ValueError,
            "measurement: give either it or range_noise",
        ),
        ({"noise": 0.1}, TypeError, "noise"),
        ({"rate": 1e9}, ValueError, "^rate: 1000000000.0 is not .* up to 1000"),
        ({"rate": 0.2}, ValueError, "^rate: 0.2 is not .*, at least 0.25"),
        (
            {"motion_distortion": True, "motion": ConstantVectorSource([0])},
            RuntimeError,
            "^motion: ConstantVectorSource .* not in this builder",
        ),
        ({"num_threads": 0}, ValueError, "^num_threads: 0 is less than 1"),
        ({"num_threads": 1.5}, TypeError, "^num_threads: 1.5 is no Int"),
        ({"measurement": 0.1}, TypeError, "^measurement: 0.1 is no Meas"),
        ({"structures": "x"}, TypeError, "^structures: 'x' is no Struct"),
        ({"anchored_frames": 3}, TypeError, "^anchored_frames: 3 is no Coll"),
        ({"moving_bodies": 3}, TypeError, "^moving_bodies: 3 is no Map"),
        ({"causal": "no"}, TypeError, "^causal: 'no' is no bool"),
        ({"unseen": ["wall"]}, TypeError, "^unseen: 'wall' is no FrameId"),
        ({"unseen": "wall"}, TypeError, "^unseen: 'wall' is no FrameId"),
        ({"role": "visual"}, TypeError, "^role: 'visual' is not a role .*"),
        ({"role": Role.kUnassigned}, TypeError, "^role: .* is not a role .*"),
    ],
)
def test_a_slip_is_found_at_once(options, error, fault):
    site = Site()
    with pytest.raises(error, match=fault) as caught:
        site.add(**options)
    assert "\n" not in str(caught.value)
    assert len(site.builder.GetSystems()) == 2


def test_a_lidar_names_nothing_of_another_scene_graph():
    site, other = Site(), Site()
    body = other.plant.world_body()
    (geometry_id,) = other.plant.GetVisualGeometriesForBody(body)
    source = other.scene_graph.RegisterSource("other")
    frame_id = other.scene_graph.RegisterFrame(source, GeometryFrame("f"))
    fault = "its plant is not registered with this SceneGraph"
    for place in (body, body.body_frame()):
        with pytest.raises(RuntimeError, match=f"^unseen: {fault}"):
            site.add(unseen=[place])
    for options in (
        {"body": frame_id},
        {"unseen": [frame_id]},
        {"unseen": [geometry_id]},
        {"anchored_frames": [frame_id]},
        {"moving_bodies": {frame_id: 0}},
    ):
        (argument,) = options
        fault = f"^{argument}: this SceneGraph has no .*Id [0-9]+$"
        with pytest.raises(RuntimeError, match=fault):
            site.add(**options)


def test_a_wrong_type_is_named_in_one_line():
    site, made = Site(), Site()
    lidar, meshcat = made.add(), Meshcat()
    site.builder = RobotDiagramBuilder()
    frame = made.scene_graph.world_frame_id()
    limits = {"min_range": 0.1, "max_range": 9.0, "period": 0.1}
    for make, fault in (
        (site.add, "builder: .* is no DiagramBuilder"),
        (lambda: ApplyLidarConfig({}, made.builder), "config: {} is no Lidar"),
        (lambda: ApplyImuConfig(3, made.builder), "config: 3 is no ImuConfig"),
        (lambda: ApplyOdometryConfig("", made.builder), "config: '' is no Odo"),
        (lambda: OdometrySensor("body"), "body: 'body' is no RigidBody"),
        (lambda: Lidar("f", X_PS, lidar.pattern), "parent_frame_id: 'f' is no"),
        (lambda: Lidar(frame, None, lidar.pattern), "X_PB: None is no Rigid"),
        (lambda: Lidar(frame, X_PS, "vlp-16"), "pattern: 'vlp-16' is no Beam"),
        (lambda: add_lidar_view(made.builder, None, meshcat), "lidar: None is"),
        (
            lambda: add_lidar_view(made.builder, lidar, meshcat, period="1"),
            "period: '1' is not a number",
        ),
        (lambda: make_beam_pattern("vlp-16", "1"), "period: '1' is not a num"),
        (
            lambda: DirectionPattern([[1, 0, 0]], **limits | {"period": "1"}),
            "period: '1' is not a number",
        ),
        (
            lambda: make_flash_pattern("2", 2, (9.0, 9.0), **limits),
            "width: '2' is not a whole number",
        ),
        (
            lambda: CalibratedReturns.of_preset("vlp-16", weather="rain"),
            "weather: 'rain' is no Weather",
        ),
    ):
        with pytest.raises(TypeError, match=f"^{fault}") as caught:
            make()
        assert "\n" not in str(caught.value)


def test_a_scan_needs_a_time():
    site = Site()
    lidar = site.add()
    context = site.builder.Build().CreateDefaultContext()
    for time in (np.nan, np.inf):
        context.SetTime(time)
        with pytest.raises(ValueError, match=r"^time of the LiDAR's Context: "):
            lidar.scan_output_port().Eval(lidar.GetMyContextFromRoot(context))


def test_a_scan_a_nanosecond_is_refused_with_a_pattern_too():
    pattern = make_beam_pattern("vlp-16", 1e-9)
    with pytest.raises(ValueError, match=r"^rate: 1000000000\.0 is"):
        Site().add(pattern=pattern, rate=1e9)
    with pytest.raises(ValueError, match=r"^rate: 1000000000\.0 is"):
        Lidar(Site().scene_graph.world_frame_id(), X_PS, pattern, rate=1e9)


class Speed(LeafSystem):
    """Its velocities are no spatial velocities of bodies."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort(
            "body_spatial_velocities", 6, lambda context, output: None
        )


@pytest.mark.parametrize(
    "fault", ["port", "type of port", "other graph", "nothing to see"]
)
def test_a_lidar_that_cannot_be_connected_is_not_added(fault):
    site = Site(with_wall=fault != "nothing to see")
    is_typed = fault == "type of port"
    motion = Speed() if is_typed else ConstantVectorSource([0.0])
    site.builder.AddSystem(motion)
    if fault == "other graph":
        site.scene_graph = Site().scene_graph
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises((RuntimeError, UserWarning)):
            site.add(motion_distortion="port" in fault, motion=motion, seed=1)
    assert len(site.builder.GetSystems()) == 3


def test_a_plant_is_no_scene_graph():
    site = Site()
    site.scene_graph = site.plant
    with pytest.raises(TypeError, match="MultibodyPlant is not a SceneGraph"):
        site.add()


@pytest.mark.parametrize("place", ["world_body", "world_frame"])
def test_sensors_need_a_finalized_plant(place):
    """A body that is welded to theirs later would not be known."""
    site = Site(is_finalized=False)
    body = getattr(site.plant, place)()
    for add in (
        lambda: site.add(body),
        lambda: add_imu(site.builder, body, X_PS),
        lambda: add_odometry(site.builder, body),
    ):
        with pytest.raises(RuntimeError, match=r"^body: .*plant\.Finalize\(\)"):
            add()
    assert len(site.builder.GetSystems()) == 2
    site.plant.Finalize()
    site.add(body)
    add_imu(site.builder, body, X_PS)
    add_odometry(site.builder, body)
    site.builder.Build()


@pytest.mark.parametrize(
    ("options", "error", "fault"),
    [
        ({"rate": "200"}, TypeError, "^rate: '200' is not"),
        ({"rate": True}, TypeError, "^rate: True is not"),
        ({"rate": 9, "noise": "x"}, TypeError, "^noise: 'x' is no ImuNoise"),
        ({}, ValueError, "^X_PB: not finite"),
    ],
)
def test_slips_in_the_arguments_of_imu_and_odometry(options, error, fault):
    site = Site()
    place = X_PS if options else RigidTransform([0.0, np.inf, 0.0])
    adders = [lambda: add_imu(site.builder, site.world, place, **options)]
    if not options:
        adders += [lambda: add_odometry(site.builder, site.world, X_PB=place)]
    for add in adders:
        with pytest.raises(error, match=fault):
            add()
    assert len(site.builder.GetSystems()) == 2


def test_odometry_keeps_the_pose_of_the_call():
    site = Site()
    X_PB = RigidTransform([0.0, 0.0, 1.0])
    odometry = add_odometry(site.builder, site.world, X_PB=X_PB)
    X_PB.SetIdentity()
    assert odometry.X_PB.translation().tolist() == [0.0, 0.0, 1.0]


def test_a_carrier_of_imu_or_odometry_is_a_body():
    site = Site()
    for add in (
        lambda: add_imu(site.builder, "robot", X_PS),
        lambda: add_odometry(site.builder, "robot"),
    ):
        with pytest.raises(TypeError, match=r"plant.GetBodyByName\('robot'\)"):
            add()


def test_a_plant_without_this_scene_graph_is_named():
    site = Site()
    site.scene_graph = site.builder.AddSystem(SceneGraph())
    lonely = MultibodyPlant(0.0)
    lonely.Finalize()
    # An error comes alone, without a warning that nothing can be seen.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for one, body in ((site, None), (Site(), lonely.world_body())):
            with pytest.raises(RuntimeError, match="plant is not registered"):
                one.add(body)


def test_each_lidar_has_a_name_of_its_own():
    site = Site()
    site.add(name="front")
    with pytest.raises(ValueError, match="has a system 'front'; give each"):
        site.add(name="front")
    site.add(name="rear")


def test_noise_is_that_of_a_measurement_model():
    noise = {"range_noise": 0.05, "dropout": 0.2, "seed": 3}
    model = MeasurementModel(**noise, sensor_name="lidar")
    noisy = Site().ranges(**noise)
    np.testing.assert_array_equal(noisy, Site().ranges(measurement=model))
    unnamed = MeasurementModel(**noise)
    np.testing.assert_array_equal(noisy, Site().ranges(measurement=unnamed))
    exact = Site().ranges()
    assert 0.75 < len(noisy) / len(exact) < 0.85
    for options in (noise, {"measurement": unnamed}):
        other = Site().ranges(**options, name="other")
        assert not np.array_equal(noisy, other)
    other = Site().ranges(measurement=model, name="other")
    np.testing.assert_array_equal(noisy, other)
    # A turn before time zero has noise of its own.
    earlier = Site().ranges(time=-1.0, **noise)
    assert 0.75 < len(earlier) / len(exact) < 0.85
    assert not np.array_equal(noisy, earlier)


def test_nothing_to_see_is_said():
    with pytest.warns(UserWarning, match="no geometry of Role.kPerception"):
        Site(with_wall=False).add()
    with pytest.warns(UserWarning, match="no geometry of Role.kProximity"):
        Site().add(role=Role.kProximity)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Site().add()
