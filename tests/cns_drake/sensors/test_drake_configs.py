"""Sensors described and applied as Drake does it with its cameras."""

from concurrent.futures import ThreadPoolExecutor
import dataclasses
import inspect
import typing

from drake import lcmt_drake_signal, lcmt_point_cloud
from helpers.browser import chromium, has_chromium
import numpy as np
from pydrake.common.schema import Transform
from pydrake.common.yaml import yaml_dump_typed, yaml_load, yaml_load_typed
from pydrake.geometry import Box
from pydrake.lcm import DrakeLcm, DrakeLcmParams
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import ApplyLcmBusConfig, LcmSubscriberSystem
from pydrake.visualization._meldis import Meldis
import pytest

from cns_drake import (
    ApplyImuConfig,
    ApplyLidarConfig,
    ApplyOdometryConfig,
    ImuConfig,
    ImuNoise,
    LidarConfig,
    MeasurementModel,
    OdometryConfig,
    Weather,
    add_imu,
    add_lidar,
    load_scenario,
)
from cns_drake.scene import find_bus
from cns_drake.sensors import ImuErrors

X_WR = RigidTransform(RollPitchYaw(0.0, 0.0, 0.6), [1.0, -2.0, 0.5])
X_RS = RigidTransform(RollPitchYaw(0.1, -0.2, 2.0), [0.3, 0.1, 0.9])
ROOF = """
name: roof
preset: vlp-16
rate: 10
range_noise: 0.01
seed: 3
X_PB:
  base_frame: robot
  translation: [0.3, 0.1, 0.9]
  rotation: !Rpy
    deg: [5.729577951308232, -11.459155902616464, 114.59155902616465]
"""


def make_site():
    """Returns builder and plant of a robot in a closed room."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.01)
    for k, xyz in enumerate([[9, 0, 0], [-7, 0, 0], [0, 8, 0], [0, -6, 0]]):
        size = [0.2, 30.0, 9.0] if k < 2 else [30.0, 0.2, 9.0]
        plant.RegisterVisualGeometry(
            plant.world_body(),
            RigidTransform(xyz),
            Box(*size),
            f"wall_{k}",
            np.full(4, 0.5),
        )
    inertia = SpatialInertia.SolidBoxWithMass(10.0, 0.5, 0.3, 0.2)
    robot = plant.AddRigidBody("robot", inertia)
    plant.WeldFrames(plant.world_frame(), robot.body_frame(), X_WR)
    plant.Finalize()
    return builder, plant


def read_roof():
    return yaml_load_typed(
        schema=LidarConfig, data=ROOF, defaults=LidarConfig()
    )


def advance(builder, lcm, duration, *channels):
    """Returns the messages of channels that a simulation published."""
    received = {channel: [] for channel in channels}
    for channel in channels:
        lcm.Subscribe(channel, received[channel].append)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    while lcm.HandleSubscriptions(0):
        pass
    return simulator, received


def points_of(message):
    """Returns the (N, 3) float32 points of an encoded cloud."""
    cloud = lcmt_point_cloud.decode(message)
    rows = np.frombuffer(cloud.data, np.uint8).reshape(cloud.width, -1)
    return cloud, rows[:, :12].copy().view(np.float32)


def test_yaml_and_back():
    config = read_roof()
    X_PB = config.X_PB.GetDeterministicValue()
    assert X_PB.IsNearlyEqualTo(X_RS, 1e-12)
    text = yaml_dump_typed(config, schema=LidarConfig)
    again = yaml_load_typed(schema=LidarConfig, data=text)
    assert yaml_dump_typed(again, schema=LidarConfig) == text
    assert "preset: vlp-16" in text
    with pytest.raises(RuntimeError, match="furrows"):
        yaml_load_typed(schema=LidarConfig, data="{furrows: 3}")
    with pytest.raises(AttributeError, match=r"no field 'rate_hz'.*rate"):
        config.rate_hz = 3


@pytest.mark.parametrize(
    ("struct", "section"),
    [
        (LidarConfig, lambda scenario: scenario.lidars["lidar"]),
        (ImuConfig, lambda scenario: scenario.imu),
        (OdometryConfig, lambda scenario: scenario.odometry),
    ],
)
def test_fields_are_those_of_a_scenario(struct, section):
    described = section(load_scenario("riverside_01"))
    fields = {f.name: f.default for f in dataclasses.fields(struct)}
    for name in ("name", "X_PB", "lcm_bus"):
        del fields[name]
    # Odometry is exact.
    assert ("seed" in fields) == (struct is not OdometryConfig)
    fields.pop("seed", None)
    names = set(type(described).model_fields) - {"xyz", "rpy_deg", "layout"}
    if struct is LidarConfig:
        # These are as in `add_lidar`.
        own = {"rate": None, "resolution": 0.0, "causal": False}
        own |= {"capture_offset": 0.0, "output_delay": 0.0}
        own |= {"role": "perception", "unseen": None, "num_threads": 1}
        assert {name: fields.pop(name) for name in own} == own
        names -= own.keys()
    assert set(fields) == names
    for name, default in fields.items():
        kept = getattr(described, name)
        assert default == getattr(kept, "value", kept), name
    # What a type checker reads are the fields themselves.
    assert list(inspect.signature(struct).parameters) == [
        f.name for f in dataclasses.fields(struct)
    ]
    assert typing.get_type_hints(struct).keys() >= fields.keys()


@pytest.mark.parametrize("preset", ["vlp-16", "hokuyo-ust-20lx", "avia"])
def test_a_preset_is_that_of_add_lidar(preset):
    builder, plant = make_site()
    config = LidarConfig(preset=preset, name="config")
    lidars = [
        ApplyLidarConfig(config, builder, lcm=DrakeLcm("memq://")),
        add_lidar(
            builder,
            builder.GetSubsystemByName("scene_graph"),
            plant.world_body(),
            RigidTransform(),
            preset,
        ),
    ]
    assert lidars[0].pattern == lidars[1].pattern
    assert lidars[0].samples is lidars[1].samples is None
    context = builder.Build().CreateDefaultContext()
    first, second = (
        one.GetOutputPort("scan").Eval(one.GetMyContextFromRoot(context))
        for one in lidars
    )
    assert len(first) > 100
    np.testing.assert_array_equal(first, second)


@pytest.mark.filterwarnings("ignore:rate. ")
@pytest.mark.parametrize("rate", [3, 7.5, 12, 400.0])
def test_any_rate(rate):
    builder, _ = make_site()
    lcm = DrakeLcm("memq://")
    data = f"{{preset: mid-70, rate: {rate}}}"
    config = yaml_load_typed(schema=LidarConfig, data=data)
    lidar = ApplyLidarConfig(config, builder, lcm=lcm)
    period = min(0.1, 1.0 / rate)
    assert lidar.pattern.period == period
    assert lidar.samples == (1.0 / rate, 0.0, 0.0)
    assert lidar.pattern.num_beams == round(100_000 * period)
    channel = "DRAKE_POINT_CLOUD_lidar"
    _, received = advance(builder, lcm, 2.5 / rate, channel)
    assert len(received[channel]) == 3


def test_clouds_have_intensities_as_greys():
    builder, _ = make_site()
    lcm = DrakeLcm("memq://")
    lidar = ApplyLidarConfig(LidarConfig(), builder, lcm=lcm)
    channel = "DRAKE_POINT_CLOUD_lidar"
    simulator, received = advance(builder, lcm, 0.0, channel)
    cloud = lcmt_point_cloud.decode(received[channel][0])
    fields = [field.name for field in cloud.fields]
    assert fields == ["x", "y", "z", "rgb"]
    rows = np.frombuffer(cloud.data, np.uint8).reshape(cloud.width, -1)
    context = lidar.GetMyContextFromRoot(simulator.get_context())
    scan = lidar.GetOutputPort("scan").Eval(context)
    grey = np.rint(255.0 * scan["intensity"])
    assert 1 < len(np.unique(grey)) < 30
    np.testing.assert_array_equal(rows[:, 12:15], grey[:, None].repeat(3, 1))
    for port in ("point_cloud_S", "point_cloud_W"):
        rgbs = lidar.GetOutputPort(port).Eval(context).rgbs()
        np.testing.assert_array_equal(rgbs, [grey] * 3)
    assert not lidar.GetOutputPort("positions_W").Eval(context).has_rgbs()


def test_published_scans_are_the_lidars():
    builder, _ = make_site()
    lcm = DrakeLcm("memq://")
    lidar = ApplyLidarConfig(read_roof(), builder, lcm=lcm)
    channel = "DRAKE_POINT_CLOUD_roof"
    simulator, received = advance(builder, lcm, 0.4, channel)
    assert len(received[channel]) == 5
    cloud, p_WPs = points_of(received[channel][-1])
    assert cloud.frame_name == "world"
    context = lidar.GetMyContextFromRoot(simulator.get_context())
    expected = lidar.GetOutputPort("point_cloud_W").Eval(context).xyzs()
    np.testing.assert_array_equal(p_WPs, expected.T)
    X_WS = lidar.GetOutputPort("X_WS").Eval(context)
    assert X_WS.IsNearlyEqualTo(X_WR @ X_RS, 1e-12)
    # Each point is on a wall, but for noise and rounding.
    off = np.abs(p_WPs[:, :1] - [8.9, -6.9]).min(axis=1)
    off = np.minimum(off, np.abs(p_WPs[:, 1:2] - [7.9, -5.9]).min(axis=1))
    assert off.std() > 0.003
    assert off.max() < 0.06


@pytest.mark.parametrize("period", [0.02, 0.05, 0.1])
def test_a_scan_depends_on_its_time_alone(period):
    """However often others publish, a Simulator gives the same scan."""
    builder, _ = make_site()
    lidar = ApplyLidarConfig(read_roof(), builder, lcm=DrakeLcm("memq://"))
    odometry = OdometryConfig(rate=round(1.0 / period))
    ApplyOdometryConfig(odometry, builder, lcm=DrakeLcm("memq://"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.4)
    port = lidar.GetOutputPort("scan")
    seen = port.Eval(lidar.GetMyContextFromRoot(simulator.get_context()))
    builder, _ = make_site()
    config = dataclasses.replace(read_roof(), rate=None)
    lidar = ApplyLidarConfig(config, builder, lcm=DrakeLcm("memq://"))
    fresh = lidar_at(lidar, builder.Build(), 0.4)
    np.testing.assert_array_equal(seen, fresh)


def lidar_at(lidar, diagram, time):
    context = diagram.CreateDefaultContext()
    context.SetTime(time)
    port = lidar.GetOutputPort("scan")
    return port.Eval(lidar.GetMyContextFromRoot(context)).copy()


@pytest.mark.parametrize("preset", ["vlp-16", "mid-360"])
def test_two_threads_with_contexts_of_their_own(preset):
    builder, _ = make_site()
    config = dataclasses.replace(read_roof(), preset=preset, rate=None)
    lidar = ApplyLidarConfig(config, builder, lcm=DrakeLcm("memq://"))
    diagram = builder.Build()
    times = [0.05 * k for k in range(8)]
    expected = [lidar_at(lidar, diagram, time) for time in times]
    with ThreadPoolExecutor(2) as pool:
        again = 3 * list(range(8))
        scans = pool.map(lambda k: lidar_at(lidar, diagram, times[k]), again)
        for k, scan in zip(again, scans, strict=True):
            np.testing.assert_array_equal(scan, expected[k])


def test_imu_and_odometry_publish_signals():
    builder, plant = make_site()
    lcm = DrakeLcm("memq://")
    place = Transform(X_RS)
    place.base_frame = "robot"
    ApplyImuConfig(
        ImuConfig(X_PB=place, rate=100), builder, plant=plant, lcm=lcm
    )
    ApplyOdometryConfig(OdometryConfig(X_PB=place), builder, lcm=lcm)
    names = ("DRAKE_IMU_imu", "DRAKE_ODOMETRY_odometry")
    _, received = advance(builder, lcm, 0.2, *names)
    imu, odometry = (
        [lcmt_drake_signal.decode(one) for one in received[name]]
        for name in names
    )
    assert [m.timestamp for m in imu] == [10 * k for k in range(21)]
    assert len(odometry) == 5
    X_WS = X_WR @ X_RS
    # At rest an accelerometer measures what holds it up.
    up_S = X_WS.rotation().inverse() @ [0.0, 0.0, 9.81]
    np.testing.assert_allclose(imu[-1].val, [*up_S, 0, 0, 0], atol=1e-12)
    assert imu[-1].coord[:2] == ["specific_force_x", "specific_force_y"]
    quaternion = X_WS.rotation().ToQuaternion().wxyz()
    np.testing.assert_allclose(
        odometry[-1].val,
        [*quaternion, *X_WS.translation(), *np.zeros(6)],
        atol=1e-12,
    )


def test_an_imu_has_the_errors_of_its_config():
    builder, _ = make_site()
    lcm = DrakeLcm("memq://")
    config = ImuConfig(rate=200, gyroscope_turn_on_bias=0.1, seed=5)
    ApplyImuConfig(config, builder, lcm=lcm)
    _, received = advance(builder, lcm, 0.1, "DRAKE_IMU_imu")
    values = [
        lcmt_drake_signal.decode(m).val for m in received["DRAKE_IMU_imu"]
    ]
    bias = np.array(values)[:, 3:]
    assert (bias == bias[0]).all()
    assert 0.01 < np.abs(bias[0]).max() < 0.5


def test_imus_with_different_names_have_different_errors():
    builder, plant = make_site()
    noise = ImuNoise(gyroscope_turn_on_bias=0.1, seed=5)
    imus = [
        add_imu(builder, plant.world_body(), X_RS, rate=9, noise=one, name=name)
        for name, one in (
            ("front", noise),
            ("rear", noise),
            ("roof", dataclasses.replace(noise, sensor_name="own")),
        )
    ]
    config = ImuConfig(name="left", gyroscope_turn_on_bias=0.1, seed=5)
    imus.append(ApplyImuConfig(config, builder, lcm=DrakeLcm("memq://")))
    context = builder.Build().CreateDefaultContext()
    for name, imu in zip(("front", "rear", "own", "left"), imus, strict=True):
        port = imu.ports()["angular_velocity"]
        found = port.Eval(port.get_system().GetMyContextFromRoot(context))
        named = dataclasses.replace(noise, sensor_name=name)
        expected = ImuErrors(named, 9).measure(0, np.zeros((1, 6)))[0, 3:]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_buses_by_name():
    builder, _ = make_site()
    params = DrakeLcmParams(lcm_url="memq://")
    buses = ApplyLcmBusConfig({"default": params, "second": params}, builder)
    config = dataclasses.replace(read_roof(), lcm_bus="second")
    ApplyLidarConfig(config, builder, lcm_buses=buses)
    heard = {}
    for name in ("default", "second"):
        heard[name] = builder.AddNamedSystem(
            f"heard_{name}",
            LcmSubscriberSystem.Make(
                "DRAKE_POINT_CLOUD_roof",
                lcmt_point_cloud,
                find_bus(builder, buses, "test", name),
            ),
        )
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.2)
    counts = {}
    for name, system in heard.items():
        context = system.GetMyContextFromRoot(simulator.get_context())
        counts[name] = system.get_output_port().Eval(context).width
    assert counts["default"] == 0
    assert counts["second"] > 0
    config = dataclasses.replace(read_roof(), name="b", lcm_bus="third")
    builder, _ = make_site()
    buses = ApplyLcmBusConfig({"default": params}, builder)
    before = len(builder.GetSystems())
    with pytest.raises(RuntimeError, match=r"LidarConfig b.*third"):
        ApplyLidarConfig(config, builder, lcm_buses=buses)
    assert len(builder.GetSystems()) == before
    with pytest.raises(RuntimeError, match=r"b: lcm_bus.*'third'"):
        ApplyLidarConfig(dataclasses.replace(config, name="b"), make_site()[0])


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"preset": "vlp16"}, "roof: preset: no preset 'vlp16'"),
        ({"rate": 0}, "roof: rate: 0.0 is not .*, at least 0.25 and"),
        ({"rate": 0.001}, "roof: rate: 0.001 is not .*, at least 0.25 and"),
        ({"rate": -7}, "roof: rate: "),
        ({"rate": 1000.1}, "roof: rate: "),
        ({"rate": np.nan}, "roof: rate: "),
        ({"X_PB": Transform(RigidTransform([np.nan, 0, 0]))}, "roof: X_PB: "),
        ({"dropout": 1.5}, "roof: dropout: "),
        ({"returns": "calibrated"}, "roof: .*range_noise"),
        ({"echoes": "some"}, "roof: echoes: "),
        ({"role": "nothing"}, "roof: role: 'nothing' is not one of"),
        ({"num_threads": 0}, "roof: num_threads: 0 is less than 1"),
        ({"capture_offset": np.inf}, "roof: capture_offset: inf is not a"),
        ({"output_delay": 0.1}, "roof: output_delay: 0.1 is not .* below 0.1"),
        ({"unseen": ["robt"]}, "roof: unseen: no body.* 'robt': .*robot"),
    ],
)
def test_faults_name_config_and_field(change, fault):
    config = dataclasses.replace(read_roof(), **change)
    builder, _ = make_site()
    with pytest.raises(ValueError, match=fault):
        ApplyLidarConfig(config, builder)
    assert len(builder.GetSystems()) == 2


@pytest.mark.parametrize(
    ("struct", "text", "fault"),
    [
        (LidarConfig, "{rate: fast}", r"\.rate: 'fast' is not a number"),
        (LidarConfig, "{rate: true}", r"\.rate: True is not a number"),
        (LidarConfig, "{rings: 3.5}", r"\.rings: 3\.5 is not a whole number"),
        (LidarConfig, "{columns: many}", r"\.columns: 'many' is not a whole"),
        (LidarConfig, "{dropout: some}", r"\.dropout: 'some' is not a number"),
        (LidarConfig, "{causal: maybe}", r"\.causal: 'maybe' is not true or"),
        (LidarConfig, "{motion_distortion: 1}", r"\.motion_distortion: 1 is"),
        (LidarConfig, "{name: 3}", r"\.name: 3 is not a text"),
        (LidarConfig, "{X_PB: 3}", r"\.X_PB: 3 is no Transform"),
        (LidarConfig, "{unseen: robot}", r"\.unseen: 'robot' is no list"),
        (LidarConfig, "{num_threads: two}", r"\.num_threads: 'two' is not a"),
        (ImuConfig, "{rate: fast}", r"\.rate: 'fast' is not a number"),
        (OdometryConfig, "{rate: 2.5}", r"\.rate: 2\.5 is not a whole number"),
    ],
)
def test_wrong_types_name_the_field_in_one_line(struct, text, fault):
    fault = rf"^{struct.__name__}{fault}.*\Z"
    (field, value), *_ = yaml_load(data=text).items()
    for make in (
        lambda: yaml_load_typed(schema=struct, data=text),
        lambda: struct(**{field: value}),
        lambda: dataclasses.replace(struct(), **{field: value}),
        lambda: setattr(struct(), field, value),
    ):
        with pytest.raises((TypeError, ValueError), match=fault):
            make()


@pytest.mark.parametrize("text", ["{rate: 10}", "{rate: 1e1}", "{rate: '10'}"])
def test_numbers_are_read_as_drake_reads_them(text):
    """As texts they are numbers in YAML alone."""
    config = yaml_load_typed(schema=LidarConfig, data=text)
    assert (config.rate, type(config.rate)) == (10.0, float)
    assert yaml_dump_typed(config, defaults=LidarConfig()) == "rate: 10.0\n"
    assert LidarConfig(rate=np.float32(10), rings=np.int64(4)).rings == 4


@pytest.mark.parametrize(
    "struct",
    [
        LidarConfig,
        ImuConfig,
        OdometryConfig,
        MeasurementModel,
        ImuNoise,
        Weather,
    ],
)
def test_fields_from_python_have_their_types(struct):
    """Texts that spell a number, bools and NaN are none, in any field."""
    refused = (TypeError, ValueError)
    usable = {float: (True, "1", 1j), int: (True, "1", 1.5), bool: (1, "true")}
    for field, kind in typing.get_type_hints(struct).items():
        kind, *others = typing.get_args(kind) or (kind,)
        wrong = (*usable.get(kind, (3,)), [1j], b"1", np.eye(2))
        for value in wrong if others else (*wrong, None):
            with pytest.raises(refused, match=f"{field}: ") as found:
                struct(**{field: value})
            assert "\n" not in str(found.value)
        if kind is float:
            with pytest.raises(ValueError, match=f"{field}: .*"):
                getattr(struct(**{field: np.nan}), "ValidateOrThrow", list)()


def ahead_of(**fields):
    """What a beam ahead of the robot sees first: range and geometry."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    inertia = SpatialInertia.SolidBoxWithMass(10.0, 0.5, 0.3, 0.2)
    for x, name in ((0.0, "robot"), (4.0, "near"), (6.0, "far")):
        body = plant.AddRigidBody(name, inertia)
        plant.WeldFrames(
            plant.world_frame(), body.body_frame(), RigidTransform([x, 0, 0])
        )
        box = (body, RigidTransform(), Box(1, 1, 1), "box")
        if name == "near":
            plant.RegisterCollisionGeometry(*box, CoulombFriction())
        else:
            plant.RegisterVisualGeometry(*box, np.ones(4))
    near = plant.GetBodyByName("near")
    plant.RegisterVisualGeometry(
        near, RigidTransform([1, 0, 0]), Box(0.5, 1, 1), "behind", np.ones(4)
    )
    plant.Finalize()
    place = Transform()
    place.base_frame = "robot"
    fields = {"preset": "hokuyo-ust-20lx", "columns": 8, **fields}
    lidar = ApplyLidarConfig(
        LidarConfig(X_PB=place, **fields), builder, lcm=DrakeLcm("memq://")
    )
    context = builder.Build().CreateDefaultContext()
    context = lidar.GetMyContextFromRoot(context)
    hits = lidar.CastRays(context, np.zeros(3), np.eye(3)[:1])
    (found,) = hits.geometry_ids
    name = found and scene_graph.model_inspector().GetName(found)
    return round(float(hits.ranges[0]), 3), name


@pytest.mark.parametrize(
    ("fields", "ahead"),
    [
        ({}, (4.75, "behind")),
        ({"role": "illustration"}, (4.75, "behind")),
        ({"role": "proximity"}, (3.5, "box")),
        ({"unseen": ["robot", "near"]}, (5.5, "box")),
        ({"unseen": ["robot", "behind"]}, (5.5, "box")),
        ({"unseen": ["box"]}, (4.75, "behind")),
        ({"unseen": ["box", "near"]}, (np.inf, None)),
        ({"unseen": ["behind"]}, (0.5, "box")),
        ({"unseen": []}, (0.5, "box")),
        ({"num_threads": 2}, (4.75, "behind")),
    ],
)
def test_a_config_says_what_is_seen(fields, ahead):
    assert ahead_of(**fields) == ahead
    text = yaml_dump_typed(LidarConfig(**fields))
    again = yaml_load_typed(schema=LidarConfig, data=text)
    assert {name: getattr(again, name) for name in fields} == fields
    assert yaml_dump_typed(again) == text


APPLIED = (
    (LidarConfig, ApplyLidarConfig),
    (ImuConfig, ApplyImuConfig),
    (OdometryConfig, ApplyOdometryConfig),
)


@pytest.mark.parametrize(
    ("struct", "apply", "good", "bad"),
    [
        (OdometryConfig, ApplyOdometryConfig, (1, 1000), (1001, 10**9)),
        (ImuConfig, ApplyImuConfig, (0.5, 62.5, 1e6), (1.1e6, np.nan)),
    ],
)
def test_rates_out_of_range(struct, apply, good, bad):
    """An IMU has any rate that `add_imu` takes."""
    for rate in good:
        builder, plant = make_site()
        found = apply(struct(rate=rate), builder, lcm=DrakeLcm("memq://"))
        if struct is ImuConfig:
            body = plant.world_body()
            other = add_imu(builder, body, X_RS, rate=rate, name="other")
            assert found.rate == other.rate == rate
    for rate in (0, -1, *bad):
        with pytest.raises(ValueError, match="rate"):
            apply(struct(rate=rate), make_site()[0], lcm=DrakeLcm("memq://"))


def test_scans_are_captured_after_an_offset_and_published_after_a_delay():
    """Messages keep the time of the capture; a scan under way is not there."""
    channel = "DRAKE_POINT_CLOUD_lidar"
    for offset, delay, end, captures in (
        (0.0, 0.0, 0.25, (0.0, 0.1, 0.2)),
        (0.03, 0.0, 0.25, (0.03, 0.13, 0.23)),
        (0.03, 0.06, 0.28, (0.03, 0.13)),
        (0.03, 0.06, 0.295, (0.03, 0.13, 0.23)),
        (0.0, 0.09, 0.28, (0.0, 0.1)),
        (0.25, 0.02, 0.26, ()),
    ):
        builder, _ = make_site()
        lcm = DrakeLcm("memq://")
        config = LidarConfig(
            preset="vlp-16",
            rate=10.0,
            columns=20,
            capture_offset=offset,
            output_delay=delay,
        )
        ApplyLidarConfig(config, builder, lcm=lcm)
        _, received = advance(builder, lcm, end, channel)
        clouds = [points_of(message) for message in received[channel]]
        times = [cloud.utime for cloud, _ in clouds]
        assert times == [round(1e6 * time) for time in captures]
        assert all(len(points) > 100 for _, points in clouds)


@pytest.mark.parametrize(("struct", "apply"), APPLIED)
def test_equal_configs_are_equal(struct, apply):
    place = Transform(RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3]))
    place.base_frame = "robot"
    first, second = (
        struct(
            name="top",
            rate=7,
            X_PB=yaml_load_typed(schema=Transform, data=yaml_dump_typed(place)),
        )
        for _ in range(2)
    )
    assert first == second
    assert first != struct(name="top", rate=7)
    second.rate = 8
    assert first != second
    assert first != "top"
    first.ValidateOrThrow()
    for field, value in (("rate", -1), ("name", "")):
        broken = dataclasses.replace(first, **{field: value})
        with pytest.raises(ValueError, match=f"Config.*: {field}: "):
            broken.ValidateOrThrow()


@pytest.mark.parametrize(("struct", "apply"), APPLIED)
def test_nothing_is_published_on_a_null_bus(struct, apply):
    """As Drake's `ApplyCameraConfig`, which adds its camera alone."""
    added = {}
    for url in ("memq://", None):
        builder, _ = make_site()
        params = url and DrakeLcmParams(lcm_url=url)
        buses = ApplyLcmBusConfig({"default": params}, builder)
        before = len(builder.GetSystems())
        apply(struct(name="top"), builder, lcm_buses=buses)
        systems = builder.GetSystems()[before:]
        added[url] = [system.get_name() for system in systems]
    published = ["top_publisher"]
    assert added["memq://"] == added[None] + published


@pytest.mark.parametrize(("struct", "apply"), APPLIED)
@pytest.mark.parametrize("value", [".nan", ".inf", "-.inf"])
def test_places_that_are_no_numbers(struct, apply, value):
    text = f"{{name: top, X_PB: {{translation: [0, {value}, 0]}}}}"
    config = yaml_load_typed(schema=struct, data=text)
    with pytest.raises(ValueError, match=r"Config top: X_PB: not finite"):
        apply(config, make_site()[0], lcm=DrakeLcm("memq://"))


def test_a_frame_that_is_not_there():
    config = read_roof()
    config.X_PB.base_frame = "mast"
    with pytest.raises(RuntimeError, match="mast"):
        ApplyLidarConfig(config, make_site()[0], lcm=DrakeLcm("memq://"))


def test_scalar_conversion_is_refused_by_name():
    """As Drake's own RgbdSensor, a LiDAR is for double alone."""
    builder, _ = make_site()
    ApplyLidarConfig(read_roof(), builder, lcm=DrakeLcm("memq://"))
    diagram = builder.Build()
    for convert in (diagram.ToAutoDiffXd, diagram.ToSymbolic):
        with pytest.raises(RuntimeError, match=r"::roof of type .*Lidar does"):
            convert()


@pytest.mark.slow
@pytest.mark.skipif(not has_chromium(), reason="needs Chromium")
def test_meldis_draws_the_scans(tmp_path, monkeypatch):
    monkeypatch.setenv("LCM_DEFAULT_URL", "memq://")
    meldis = Meldis()
    builder, _ = make_site()
    lidar = ApplyLidarConfig(read_roof(), builder, lcm=meldis._lcm)
    simulator, _ = advance(builder, meldis._lcm, 0.1)
    meldis._invoke_subscriptions()
    page = tmp_path / "meldis.html"
    page.write_text(meldis.meshcat.StaticHtml())
    context = lidar.GetMyContextFromRoot(simulator.get_context())
    count = len(lidar.GetOutputPort("scan").Eval(context))
    software = ("--use-gl=angle", "--use-angle=swiftshader")
    with chromium(tmp_path / "profile", *software) as browser:
        browser.open(page.as_uri(), 800, 600)
        browser.wait_for('typeof viewer !== "undefined"')
        drawn = browser.evaluate("""(() => {
          const found = [];
          viewer.scene.traverse((one) => {
            if (one.isPoints) found.push(one);
          });
          return found.map((one) => {
            let shown = true;
            for (let k = one; k; k = k.parent) shown = shown && k.visible;
            return [one.geometry.attributes.position.count, shown];
          });
        })()""")
    assert drawn == [[count, True]]
