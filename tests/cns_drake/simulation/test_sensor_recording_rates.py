"""Sensors of any diagram, recorded at rates of their own."""

import math

from helpers.allan import allan_deviation
import numpy as np
from pydrake.geometry import HalfSpace
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.sensors import (
    ImuErrors,
    ImuNoise,
    add_imu,
    add_lidar,
    add_odometry,
    make_beam_pattern,
)
from cns_drake.simulation import add_mcap_recorder
from evaluation.drives import McapDrive

NOISE = ImuNoise(
    accelerometer_noise_density=0.02, gyroscope_random_walk=1e-3, seed=5
)


class Falling:
    """A body that falls freely, and sensors on it."""

    def __init__(self):
        self.builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(self.builder, 0.0)
        inertia = SpatialInertia.SolidBoxWithDensity(1.0, 1.0, 1.0, 1.0)
        self.body = plant.AddRigidBody("stone", inertia)
        far_below = RigidTransform([0.0, 0.0, -100.0])
        plant.RegisterVisualGeometry(
            plant.world_body(), far_below, HalfSpace(), "ground", np.ones(4)
        )
        plant.Finalize()
        self.lidars = [
            add_lidar(
                self.builder,
                scene_graph,
                self.body,
                RigidTransform(),
                make_beam_pattern("vlp-16", period, num_columns=4),
                name=name,
            )
            for name, period in (("slow", 0.2), ("fast", 0.05))
        ]

    def add_imu(self, **options):
        return add_imu(self.builder, self.body, RigidTransform(), **options)

    def record(self, folder, seconds, **options):
        bag = add_mcap_recorder(
            self.builder,
            folder,
            lidars=self.lidars,
            odometry=add_odometry(self.builder, self.body),
            **options,
        )
        simulator = Simulator(self.builder.Build())
        with bag:
            simulator.AdvanceTo(seconds)


def stamps(folder, lidar):
    return (McapDrive(folder, lidar).stamps_ns / 1e9).tolist()


def test_every_sensor_has_its_rate(tmp_path):
    falling = Falling()
    imu = falling.add_imu(rate=200)
    rates = {"odometry": 40}
    falling.record(tmp_path / "fall", 0.4, imu=imu, rates=rates)
    assert stamps(tmp_path / "fall", "slow") == [0.0, 0.2, 0.4]
    assert stamps(tmp_path / "fall", "fast") == pytest.approx(
        0.05 * np.arange(9)
    )
    drive = McapDrive(tmp_path / "fall", "fast")
    assert drive.imu["stamp_ns"].tolist() == list(
        range(0, 400_000_001, 5_000_000)
    )
    times = drive.odometry["stamp_ns"] / 1e9
    np.testing.assert_allclose(times, 0.025 * np.arange(17))
    # It falls by g t^2 / 2 and feels nothing.
    np.testing.assert_allclose(
        drive.odometry["position"][:, 2], -0.5 * 9.81 * times**2, atol=1e-3
    )
    np.testing.assert_allclose(drive.imu["specific_force"], 0.0, atol=1e-9)


def test_a_period_is_of_all_that_have_no_rate(tmp_path):
    falling = Falling()
    imu = falling.add_imu(rate=50)
    rates = {"slow": 5}
    falling.record(tmp_path / "fall", 0.4, period=0.1, imu=imu, rates=rates)
    assert stamps(tmp_path / "fall", "slow") == [0.0, 0.2, 0.4]
    assert stamps(tmp_path / "fall", "fast") == pytest.approx(
        [0.0, 0.1, 0.2, 0.3, 0.4]
    )
    assert len(McapDrive(tmp_path / "fall", "fast").imu) == 21


def test_noise_is_that_of_its_model(tmp_path):
    falling = Falling()
    imu = falling.add_imu(rate=100, noise=NOISE)
    falling.record(tmp_path / "fall", 3.0, period=0.2, imu=imu)
    found = McapDrive(tmp_path / "fall", "slow").imu
    errors = ImuErrors(NOISE, 100)
    expected = errors.measure(0, np.zeros((301, 6)))
    np.testing.assert_allclose(
        np.hstack([found["specific_force"], found["angular_velocity"]]),
        expected,
        rtol=0,
        atol=1e-9,
    )
    deviation = allan_deviation(found["specific_force"], 100, 0.1)
    # 29 intervals: three standard errors are 40 %.
    np.testing.assert_allclose(deviation, 0.02 / np.sqrt(0.1), rtol=0.4)


def test_between_samples_an_error_holds():
    falling = Falling()
    imu = falling.add_imu(rate=100, noise=NOISE)
    port = imu.ports()["specific_force"]
    falling.builder.ExportOutput(port, "specific_force")
    diagram = falling.builder.Build()
    context = diagram.CreateDefaultContext()
    read = {}
    for time in (-0.01, 0.5, 0.5049, 0.51):
        context.SetTime(time)
        read[time] = diagram.GetOutputPort("specific_force").Eval(context)
    np.testing.assert_array_equal(read[0.5], read[0.5049])
    assert len({tuple(values) for values in read.values()}) == 3


def test_what_makes_no_sense_is_refused(tmp_path):
    falling = Falling()
    with pytest.raises(ValueError, match="needs a rate"):
        falling.add_imu(noise=NOISE)
    with pytest.raises(ValueError, match="is not a positive number of samples"):
        falling.add_imu(rate=0)
    with pytest.raises(ValueError, match=r"no sensor 'gps'; .*slow, fast, imu"):
        falling.record(tmp_path / "one", 0.1, rates={"gps": 1.0})
    for rate in (-1, 0.0, math.nan, 1000.1):
        with pytest.raises(ValueError, match=f"fast: {rate} is not a positive"):
            Falling().record(tmp_path / "two", 0.1, rates={"fast": rate})
    for period in (-1.0, 0.0, math.nan, math.inf, 0.0009):
        with pytest.raises(ValueError, match=f"period: {period} is not a num"):
            add_mcap_recorder(DiagramBuilder(), tmp_path / "two", period=period)
    for start_ns in (-5, 1.5, 2**31 * 10**9):
        with pytest.raises(ValueError, match=f"start_ns: {start_ns} is not"):
            add_mcap_recorder(
                DiagramBuilder(), tmp_path / "two", start_ns=start_ns
            )
    for name, value in (
        ("accelerometer_noise_density", -1.0),
        ("accelerometer_noise_density", math.inf),
        ("gyroscope_range", -1.0),
        ("seed", -1),
    ):
        with pytest.raises(ValueError, match=f"{name}: {value} is not a"):
            ImuNoise(**{name: value})
    with pytest.raises(ValueError, match="needs one"):
        add_mcap_recorder(DiagramBuilder(), tmp_path / "three")
    causal = Falling()
    causal.lidars[1].causal = True
    with pytest.raises(ValueError, match="lidars: 'fast' is causal"):
        causal.record(tmp_path / "four", 0.1)
