"""Systems that threads share, each thread with a Context of its own."""

from functools import cache
import itertools
import sys

from helpers.drives import CAREFUL, lane_path, wavy_points
import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from cns_drake.motion import Trajectory, VehicleMotion, vehicle_file
from cns_drake.sensors import ImuErrors, ImuNoise
from cns_drake.sensors.imu.imu import NoisyImu
from cns_drake.sensors.imu.vehicle_imu import VehicleImu

FILES = ("/vehicle_motion.py", "/imu.py", "/noise.py")
NOISE = ImuNoise(gyroscope_noise_density=0.01, gyroscope_random_walk=0.001)


@cache
def drive():
    return Trajectory(lane_path(wavy_points(3)), CAREFUL)


def vehicle_motion(period):
    plant = MultibodyPlant(time_step=0.0)
    (vehicle,) = Parser(plant).AddModels(str(vehicle_file()))
    plant.Finalize()
    return VehicleMotion(plant, vehicle, drive(), period=period)


def vehicle_imu():
    measure = ImuErrors(NOISE, 400).measure
    return VehicleImu(drive(), RigidTransform(), np.zeros(3), 400, measure)


class Reader:
    """Reads a port in a Context of its own."""

    def __init__(self, system, port):
        self._port = system.GetOutputPort(port)
        self._context = system.CreateDefaultContext()
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            port.FixValue(self._context, np.zeros(port.size()))

    def at(self, time):
        self._context.SetTime(time)
        value = self._port.Eval(self._context)
        if isinstance(value, list):
            return [X_WB.GetAsMatrix34() for X_WB in value]
        return value.copy()


@pytest.mark.parametrize(
    ("make", "port"),
    [
        (lambda: vehicle_motion(0.05), "body_poses"),
        (lambda: vehicle_motion(None), "body_poses"),
        (vehicle_imu, "angular_velocity"),
        (lambda: NoisyImu(NOISE, 400), "angular_velocity"),
    ],
)
def test_a_thread_may_interrupt_another_at_any_line(make, port):
    expected = Reader(make(), port).at(1.0)
    system = make()
    other = Reader(system, port)
    times = itertools.cycle([6.0, 12.0, 18.0])
    lines = set()

    def interrupt(frame, *_):
        line = frame.f_code.co_filename, frame.f_lineno
        if line[0].endswith(FILES) and line not in lines:
            lines.add(line)
            other.at(next(times))
        return interrupt

    reader = Reader(system, port)
    before = sys.gettrace()
    sys.settrace(interrupt)
    try:
        found = reader.at(1.0)
    finally:
        sys.settrace(before)
    assert len(lines) > 10
    np.testing.assert_array_equal(found, expected)
    assert not np.array_equal(expected, other.at(6.0))
