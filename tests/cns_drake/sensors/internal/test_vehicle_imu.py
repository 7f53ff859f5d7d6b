"""An IMU on a prescribed motion against Drake's sensors on the same."""

from functools import cache

from helpers.drives import CAREFUL, lane_path, wavy_points
from helpers.imu_integration import integrate_imu
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.motion import (
    RoadProfile,
    Suspension,
    Trajectory,
    VehicleMotion,
    load_car_masses,
    load_suspension_rates,
    ride_on_springs,
    vehicle_file,
)
from cns_drake.sensors import ImuErrors, ImuNoise, add_imu
from cns_drake.sensors.imu.imu import NoisyImu
from cns_drake.sensors.imu.vehicle_imu import VehicleImu

X_BI = RigidTransform(RollPitchYaw(0.3, -0.2, 1.1), [-1.0, 0.4, 1.6])
GRAVITY_W = np.array([0.0, 0.0, -9.81])
NAMES = ("specific_force", "angular_velocity")


@cache
def drive(riding):
    trajectory = Trajectory(lane_path(wavy_points(2)), CAREFUL)
    if not riding:
        return trajectory
    car = Suspension(
        load_car_masses(vehicle_file()),
        load_suspension_rates(vehicle_file().with_name("suspension.yaml")),
    )
    return ride_on_springs(trajectory, car, RoadProfile("C", 5))


class Measured:
    """Readings of a system's ports at any time."""

    def __init__(self, trajectory, rate, noise=None):
        errors = ImuErrors(noise or ImuNoise(), rate)
        self._system = VehicleImu(
            trajectory, X_BI, GRAVITY_W, rate, errors.measure
        )
        self._context = self._system.CreateDefaultContext()

    def read(self, time, name):
        self._context.SetTime(time)
        return self._system.GetOutputPort(name).Eval(self._context)


@pytest.mark.parametrize("riding", [False, True])
def test_it_measures_as_drakes_sensors_do(riding):
    trajectory = drive(riding)
    plant = MultibodyPlant(time_step=0.0)
    vehicle = Parser(plant).AddModels(str(vehicle_file()))[0]
    plant.Finalize()
    base = plant.GetBodyByName("base_link")
    builder = DiagramBuilder()
    motion = builder.AddSystem(VehicleMotion(plant, vehicle, trajectory))
    ports = add_imu(builder, base, X_BI, motion=motion).ports()
    for name, port in ports.items():
        builder.ExportOutput(port, name)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    ours = Measured(trajectory, 400.0)
    # This holds between samples and after the end, too.
    for time in [*np.linspace(0.0, trajectory.duration, 23), 1e3]:
        context.SetTime(time)
        for name in NAMES:
            np.testing.assert_allclose(
                ours.read(time, name),
                diagram.GetOutputPort(name).Eval(context),
                rtol=0,
                atol=1e-9,
            )


def error_of_integration(trajectory, rate):
    """Returns the greatest error of dead reckoning within 20 s [m]."""
    ours = Measured(trajectory, rate)
    times = np.arange(20 * rate + 1) / rate
    force, turn = (
        np.array([ours.read(time, name) for time in times]) for name in NAMES
    )
    places = integrate_imu(force, turn, 1 / rate, trajectory.pose(0.0) @ X_BI)
    R_WB, p_WB = trajectory.poses(times)
    exact = p_WB + R_WB @ X_BI.translation()
    return np.linalg.norm(places - exact, axis=1).max()


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("riding", [False, True])
def test_integration_is_ten_times_better_with_many_samples(riding):
    few = error_of_integration(drive(riding), 20)
    many = error_of_integration(drive(riding), 400)
    assert many < few / 10.0
    assert many < 0.02


def test_errors_need_a_connected_imu():
    system = NoisyImu(ImuNoise(), 100)
    context = system.CreateDefaultContext()
    with pytest.raises(RuntimeError, match=r"specific_force.* not connected"):
        system.GetOutputPort("specific_force").Eval(context)
