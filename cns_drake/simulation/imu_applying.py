"""The IMU of a scenario in a Diagram."""

from __future__ import annotations

from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cns_drake.motion.trajectory import Trajectory
from cns_drake.motion.vehicle_imu import VehicleImu
from cns_drake.scenarios.imu_making import imu_rate, make_imu_noise
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.sensor_making import sensor_pose
from cns_drake.sensors.imu import add_imu
from cns_drake.sensors.imu_noise import ImuErrors


def apply_imu_config(
    scenario: Scenario,
    builder: DiagramBuilder,
    base: RigidBody,
    trajectory: Trajectory,
    motion: System,
) -> dict[str, OutputPort]:
    """Adds the IMU of a scenario to a Diagram.

    Args:
        scenario: with the IMU.
        builder: of the Diagram.
        base: the vehicle's body that carries it.
        trajectory: of that body.
        motion: the source of the bodies' motion.

    Returns:
        The ports `specific_force` and `angular_velocity`; and `imu_samples`
        of an IMU with a rate or errors of its own.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    X_BI = sensor_pose(scenario.imu)
    if scenario.imu.is_ideal:
        return add_imu(builder, base, X_BI, motion=motion).ports()
    rate = imu_rate(scenario)
    gravity = base.GetParentPlant().gravity_field().gravity_vector()
    errors = ImuErrors(make_imu_noise(scenario), rate)
    imu = builder.AddNamedSystem(
        "imu", VehicleImu(trajectory, X_BI, gravity, rate, errors.measure)
    )
    names = ("specific_force", "angular_velocity")
    ports = {name: imu.GetOutputPort(name) for name in names}
    return ports | {"imu_samples": imu.GetOutputPort("samples")}
