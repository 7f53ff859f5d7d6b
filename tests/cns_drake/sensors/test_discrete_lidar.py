"""A LiDAR with a rate: computes a scan once per period, and holds it."""

from drake import lcmt_point_cloud
import numpy as np
from pydrake.common import RandomGenerator
from pydrake.geometry import Box
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem, PortDataType
import pytest

from cns_drake import (
    ApplyLidarConfig,
    LidarConfig,
    add_lidar,
    add_mcap_recorder,
    make_flash_pattern,
)
from cns_drake.ray_casting import RayCastingScene

# A beam ahead, many times.
AHEAD = make_flash_pattern(
    3, 3, (2.0, 2.0), min_range=0.1, max_range=90.0, period=0.1
)
PORTS = ("scan", "point_cloud_S", "point_cloud_W", "positions_W", "X_WS")
SPEED = 2.0


class Reader(LeafSystem):
    """Evaluates ports at every step, and keeps what `read` makes of them."""

    def __init__(self, ports, read):
        super().__init__()
        self.seen = []
        for k, port in enumerate(ports):
            if port.get_data_type() == PortDataType.kVectorValued:
                self.DeclareVectorInputPort(f"u{k}", port.size())
            else:
                self.DeclareAbstractInputPort(f"u{k}", port.Allocate())

        def publish(context):
            values = [
                self.get_input_port(k).Eval(context) for k in range(len(ports))
            ]
            self.seen.append((context.get_time(), read(*values)))

        self.DeclarePerStepPublishEvent(publish)


class Site:
    """A LiDAR on a cart that drives towards a wall at x = 50 m."""

    def __init__(self, time_step=0.001, ports=("scan",), read=None, **options):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, time_step
        )
        plant = self.plant
        plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
        plant.RegisterVisualGeometry(
            plant.world_body(),
            RigidTransform([50.5, 0, 0]),
            Box(1, 90, 90),
            "wall",
            np.ones(4),
        )
        inertia = SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0)
        self.cart = plant.AddRigidBody("cart", inertia)
        joint = plant.AddJoint(
            PrismaticJoint(
                "rail", plant.world_frame(), self.cart.body_frame(), [1, 0, 0]
            )
        )
        plant.Finalize()
        plant.get_mutable_joint(joint.index()).set_default_translation(0.0)
        self.joint = joint
        options = {"rate": 10.0, **options}
        pattern = options.pop("pattern", AHEAD)
        self.lidar = add_lidar(
            self.builder,
            self.scene_graph,
            self.cart,
            RigidTransform(),
            pattern,
            **options,
        )
        self.reader = None
        if read is not None:
            outputs = [self.lidar.GetOutputPort(name) for name in ports]
            self.reader = self.builder.AddSystem(Reader(outputs, read))
            for k, port in enumerate(outputs):
                self.builder.Connect(port, self.reader.get_input_port(k))

    def simulator(self):
        self.diagram = self.builder.Build()
        simulator = Simulator(self.diagram)
        self.start(simulator.get_mutable_context())
        return simulator

    def start(self, context, x=0.0):
        own = self.plant.GetMyMutableContextFromRoot(context)
        self.joint.set_translation(own, x)
        self.joint.set_translation_rate(own, SPEED)

    def eval(self, context, port="scan"):
        own = self.lidar.GetMyContextFromRoot(context)
        return self.lidar.GetOutputPort(port).Eval(own)


def distance(scan):
    return float(scan["x"].mean())


@pytest.fixture
def casts(monkeypatch):
    """The number of times that rays are cast, in a list of one."""
    count = [0]
    cast = RayCastingScene.cast_rays

    def counted(*args, **kwargs):
        count[0] += 1
        return cast(*args, **kwargs)

    monkeypatch.setattr(RayCastingScene, "cast_rays", counted)
    return count


@pytest.mark.parametrize("time_step", [0.001, 0.0])
@pytest.mark.parametrize(("ports", "duration"), [(("scan",), 6), (PORTS, 1)])
def test_a_scan_is_computed_once_per_period(casts, time_step, ports, duration):
    site = Site(time_step, ports, lambda *values: None)
    simulator = site.simulator()
    if not time_step:
        simulator.get_mutable_integrator().set_maximum_step_size(0.001)
    simulator.AdvanceTo(duration)
    assert len(site.reader.seen) > 1000 * duration
    assert casts[0] in (10 * duration, 10 * duration + 1)


def test_a_continuous_lidar_is_the_choice_without_a_rate(casts):
    site = Site(0.01, read=distance, rate=None)
    site.simulator().AdvanceTo(0.5)
    assert casts[0] == len(site.reader.seen) == 51
    for time, seen in site.reader.seen:
        assert seen == pytest.approx(50.0 - SPEED * time, abs=1e-4)


@pytest.mark.parametrize(
    ("rate", "offset", "time_step"),
    [(10.0, 0.0, 0.004), (10.0, 0.05, 0.004), (7.0, 0.3, 0.003), (3, 0, 0.1)],
)
def test_scans_are_held_until_the_next_capture(rate, offset, time_step):
    """Whether or not the rate divides the step of the plant."""
    site = Site(
        time_step,
        ("scan", "X_WS", "point_cloud_W"),
        lambda scan, X_WS, cloud: (
            distance(scan),
            X_WS.translation()[0],
            cloud.xyzs()[0].mean(),
        ),
        rate=rate,
        capture_offset=offset,
    )
    site.simulator().AdvanceTo(2.0)
    assert len({seen for _, seen in site.reader.seen}) >= 2 * rate - 1
    for time, (ahead, x, wall) in site.reader.seen:
        # Times of steps and of captures are rounded.
        captured = [
            offset + np.floor((time - offset) * rate + rounding) / rate
            for rounding in (-1e-9, 1e-9)
        ]
        if time < offset:
            captured = [0.0]  # The scan of the start.
        # A discrete plant moves at its steps only.
        off = ahead - (50.0 - SPEED * np.array(captured))
        assert np.abs(off).min() < SPEED * time_step + 1e-4
        assert x == pytest.approx(50.0 - ahead, abs=1e-4)
        assert wall == pytest.approx(50.0, abs=1e-4)


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("offset", [0.0, 0.0625])
def test_captures_are_the_scans_of_a_continuous_lidar(noise, offset):
    options = {"range_noise": noise, "seed": 4}
    seen = {}
    for rate in (None, 8.0):
        site = Site(
            2.0**-6,
            read=lambda scan: scan.copy(),
            rate=rate,
            capture_offset=offset if rate else 0.0,
            **options,
        )
        site.simulator().AdvanceTo(1.0)
        seen[rate] = dict(site.reader.seen)
    kept = [offset + k / 8.0 for k in range(8)]
    for time in kept:
        np.testing.assert_array_equal(seen[None][time], seen[8.0][time])
    assert len({seen[8.0][time].tobytes() for time in kept}) == 8


def is_empty(site, context):
    own = site.lidar.GetMyContextFromRoot(context)
    assert site.eval(context, "point_cloud_W").size() == 0
    assert site.eval(context, "X_WS").IsExactlyIdentity()
    assert site.lidar.EvalGeometryIds(own) == []
    assert site.lidar.EvalInstances(own) == {}
    return len(site.eval(context)) == 0 and np.isnan(
        site.eval(context, "scan_time")
    )


def test_nothing_is_shown_before_the_first_scan(casts):
    """As by RgbdSensorAsync: ports depend on the state alone."""
    site = Site()
    diagram = site.builder.Build()
    context = diagram.CreateDefaultContext()
    for time, x in ((0.0, 1.0), (0.03, 2.0)):
        context.SetTime(time)
        site.start(context, x)
        assert is_empty(site, context)
    assert casts[0] == 0
    diagram.ExecuteInitializationEvents(context)
    assert distance(site.eval(context)) == pytest.approx(48.0)
    assert site.eval(context, "scan_time") == [0.03]
    for name in (*PORTS, "scan_time"):
        port = site.lidar.GetOutputPort(name).get_index()
        for k in range(site.lidar.num_input_ports()):
            assert not site.lidar.HasDirectFeedthrough(k, port)


@pytest.mark.parametrize("time_step", [0.0, 0.001, 0.004, 0.0625])
def test_ports_show_a_scan_after_its_delay(time_step):
    """At its time, an event that reads finds it."""
    site = Site(
        time_step,
        ("scan", "scan_time"),
        lambda scan, time: (distance(scan) if len(scan) else None, time[0]),
        capture_offset=0.02,
        output_delay=0.06,
    )
    site.simulator().AdvanceTo(1.1)
    seen, late = dict(site.reader.seen), []
    assert len({scan for scan, _ in seen.values()}) == 12
    for now, (ahead, taken) in seen.items():
        if abs(np.remainder(now + 0.02 + 0.05, 0.1) - 0.05) < 1e-12:
            # The event of the output, or a step that ends at its time.
            late.append(ahead is None or now - taken > 0.1)
            continue
        if now < 0.08:
            assert ahead is None
            assert np.isnan(taken)
            continue
        number = np.floor((now - 0.08) * 10.0 + 1e-9)
        assert taken == pytest.approx(0.02 + 0.1 * number, abs=1e-12)
        x = 50.0 - ahead
        assert SPEED * taken - 1e-4 < x < SPEED * (taken + time_step) + 1e-4
    # The new scan is there after the event alone; a step of the plant that
    # ends at this time, if there is one, is after it.
    assert late == [True, False][: 1 + (time_step in (0.001, 0.004))] * 11


@pytest.mark.parametrize("start", [0.0, 0.3, 5.0, 1e6, 5.02])
@pytest.mark.parametrize("delay", [0.0, 0.04])
def test_a_start_at_the_time_of_a_scan_takes_it(start, delay):
    """As RgbdSensorAsync; one between two scans is not a capture's."""
    site = Site(0.01, output_delay=delay)
    simulator = site.simulator()
    simulator.get_mutable_context().SetTime(start)
    simulator.Initialize()
    simulator.AdvanceTo(start + 0.06)
    (found,) = site.eval(simulator.get_context(), "scan_time")
    assert found == start or (start == 5.02 and delay and np.isnan(found))


def publishing(delay):
    """A simulator, and the times [us] of the messages that it publishes."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.01)
    wall = RigidTransform([5, 0, 0])
    plant.RegisterVisualGeometry(
        plant.world_body(), wall, Box(1, 9, 9), "wall", np.ones(4)
    )
    plant.Finalize()
    lcm, seen = DrakeLcm("memq://"), []
    config = LidarConfig(rate=10, output_delay=delay, rings=4, columns=32)
    ApplyLidarConfig(config, builder, lcm=lcm)

    def keep(message):
        cloud = lcmt_point_cloud.decode(message)
        assert cloud.width > 0
        seen.append(cloud.utime)

    lcm.Subscribe("DRAKE_POINT_CLOUD_lidar", keep)
    simulator = Simulator(builder.Build())

    def advance(end):
        simulator.AdvanceTo(end)
        lcm.HandleSubscriptions(0)

    return simulator, advance, seen


@pytest.mark.parametrize("start", [0.0, 0.3, 5.0, 5.02])
@pytest.mark.parametrize("delay", [0.0, 0.04])
def test_messages_begin_with_the_scan_of_the_start(start, delay):
    """And none is published before there is a scan to show."""
    simulator, advance, seen = publishing(delay)
    simulator.get_mutable_context().SetTime(start)
    for step in range(26):
        advance(start + 0.01 * step)
    first = 5.1 if start == 5.02 else start
    number = 2 if start == 5.02 else 3
    assert seen == [round((first + 0.1 * k) * 1e6) for k in range(number)]


def test_no_message_of_a_scan_that_was_forgotten():
    """Initialize comes between a scan and its appearance."""
    simulator, advance, seen = publishing(0.04)
    for end in (0.12, 0.3):
        simulator.Initialize()
        advance(end)
    assert seen == [0, 200_000]


def test_drake_leaves_out_no_scan(casts):
    """Of its own ZeroOrderHold, it leaves out the update at 0.33 s."""
    site = Site(
        0.001, ("scan_time",), lambda time: time[0], capture_offset=0.03
    )
    site.simulator().AdvanceTo(1.0)
    found = sorted({time for _, time in site.reader.seen})
    assert found == pytest.approx([0.0, *(0.03 + 0.1 * np.arange(10))])
    assert casts[0] == 11


def test_times_are_exact_after_days():
    site = Site(0.01)
    simulator = site.simulator()
    start = 1_000_000.0
    simulator.get_mutable_context().SetTime(start)
    simulator.Initialize()
    for number in range(1, 20):
        simulator.AdvanceTo(start + 0.1 * number + 0.05)
        (time,) = site.eval(simulator.get_context(), "scan_time")
        assert time == start + round(0.1 * number, 1)


def test_a_scan_steers_without_an_algebraic_loop():
    """A LiDAR with a rate has no direct feedthrough, as RgbdSensorDiscrete."""
    site = Site(0.0)
    brake = site.builder.AddSystem(Brake(site))
    site.builder.Connect(
        site.lidar.scan_output_port(), brake.GetInputPort("scan")
    )
    site.builder.Connect(
        brake.GetOutputPort("force"),
        site.plant.get_applied_generalized_force_input_port(),
    )
    simulator = site.simulator()
    simulator.AdvanceTo(3.0)
    # -1 N on 1 kg from 0.6 s on, where the scan is the first within 48.9 m.
    own = site.plant.GetMyContextFromRoot(simulator.get_context())
    assert site.joint.get_translation_rate(own) == pytest.approx(-0.4)


class Brake(LeafSystem):
    """Pushes back with 1 N as soon as the wall is within 48.9 m."""

    def __init__(self, site):
        super().__init__()
        scan = self.DeclareAbstractInputPort(
            "scan", site.lidar.scan_output_port().Allocate()
        )

        def calc(context, output):
            seen = scan.Eval(context)
            output[0] = -1.0 if len(seen) and distance(seen) < 48.9 else 0.0

        self.DeclareVectorOutputPort("force", 1, calc)


def test_contexts_hold_scans_of_their_own(casts):
    site = Site(0.01, range_noise=0.01)
    simulator = site.simulator()
    simulator.AdvanceTo(0.25)
    context = simulator.get_mutable_context()
    held = site.eval(context)
    clone = context.Clone()
    before = casts[0]
    np.testing.assert_array_equal(site.eval(clone), held)
    # A change between two captures is not seen, but rays see it.
    site.start(context, 20.0)
    assert site.eval(context) is held
    assert site.eval(context, "scan_time") == [0.2]
    own = site.lidar.GetMyContextFromRoot(context)
    ids = site.lidar.EvalGeometryIds(own)
    assert len(ids) == len(held)
    assert site.lidar.EvalInstances(own) == {1: (ids[0],)}
    assert casts[0] == before
    hits = site.lidar.CastRays(own, np.array([20.0, 0, 0]), np.eye(3)[:1])
    assert hits.ranges[0] == pytest.approx(30.0)
    simulator.AdvanceTo(0.31)
    assert distance(site.eval(context)) == pytest.approx(30.0, abs=0.2)
    np.testing.assert_array_equal(site.eval(clone), held)
    # No scan is left after a reset, whatever randomness does.
    diagram = site.diagram
    for reset in (
        diagram.SetDefaultContext,
        lambda one: diagram.SetRandomContext(one, RandomGenerator(3)),
    ):
        reset(clone)
        assert is_empty(site, clone)


def test_initializing_again_forgets_the_scan():
    site = Site(0.01)
    simulator = site.simulator()
    simulator.AdvanceTo(0.05)
    context = simulator.get_mutable_context()
    for time, x in ((0.0, 5.0), (0.05, 7.0), (0.02, 9.0), (0.1, 11.0)):
        context.SetTime(time)
        site.start(context, x)
        simulator.Initialize()
        found = distance(site.eval(context))
        assert found == pytest.approx(50.0 - x, abs=1e-4)
        # Held from the start, even if the start is between two captures.
        simulator.AdvanceTo(time + 0.03)
        assert distance(site.eval(context)) == found


def test_advancing_in_pieces_changes_nothing(casts):
    found = []
    for pieces in ([1.0], [0.1, 0.25, 0.25, 0.3, 0.7, 1.0]):
        casts[0] = 0
        site = Site(0.001, range_noise=0.02)
        simulator = site.simulator()
        for end in pieces:
            simulator.AdvanceTo(end)
        found.append(site.eval(simulator.get_context()).copy())
        # The scan of the start, and 11 periodic ones.
        assert casts[0] == 12
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"rate": 0}, "rate: 0 is not a positive"),
        ({"rate": -1.0}, "rate: "),
        ({"rate": np.nan}, "rate: "),
        ({"rate": True}, "rate: True is not a number"),
        ({"rate": 20}, "rate: 20 scans per second, but a revolution takes 0.1"),
        ({"output_delay": 0.1}, "output_delay: 0.1 is not .* below 0.1 s"),
        ({"output_delay": np.nan}, "output_delay: nan"),
        ({"rate": None, "output_delay": 0.1}, "output_delay: only"),
        ({"capture_offset": -0.1}, "capture_offset: -0.1"),
        ({"capture_offset": np.inf}, "capture_offset: inf"),
        ({"rate": None, "capture_offset": 0.1}, "capture_offset: only"),
        ({"rate": "10"}, "rate: '10' is not a number"),
        ({"output_delay": "0"}, "output_delay: '0' is not a number"),
    ],
)
def test_rates_that_cannot_be(options, fault):
    error = TypeError if "not a number" in fault else ValueError
    with pytest.raises(error, match=f"^{fault}"):
        Site(**options)


def test_a_rate_changes_the_beams_of_a_preset_with_a_word_alone():
    usual = Site(pattern="mid-70", rate=None).lidar.pattern
    assert usual.period == 0.1
    for rate in (0.5, 3, 7.5, 10.0):
        assert Site(pattern="mid-70", rate=rate).lidar.pattern == usual
    with pytest.warns(UserWarning, match="has 2500 beams, not 0.1 s and 10000"):
        site = Site(pattern="mid-70", rate=40)
    assert site.lidar.pattern.period == 1.0 / 40
    with pytest.raises(ValueError, match=r"^rate: 0 is not a positive"):
        Site(pattern="vlp-16", rate=0)


def test_a_recording_has_every_scan(tmp_path):
    site = Site()
    fault = "^rates: lidar: the LiDAR takes 10 scans per second, and is"
    with pytest.raises(ValueError, match=fault):
        add_mcap_recorder(
            site.builder,
            tmp_path / "drive",
            lidars=[site.lidar],
            rates={"lidar": 20},
        )


def test_a_recording_has_each_scan_at_its_time(tmp_path):
    """As that of a continuous LiDAR, byte for byte."""
    recorded = []
    for rate in (10.0, None):
        site = Site(0.01, rate=rate)
        folder = tmp_path / str(rate) / "drive"
        bag = add_mcap_recorder(site.builder, folder, lidars=[site.lidar])
        simulator = site.simulator()
        with bag:
            simulator.AdvanceTo(0.5)
        (file,) = folder.glob("*.mcap")
        recorded.append(file.read_bytes())
    assert recorded[0] == recorded[1]
