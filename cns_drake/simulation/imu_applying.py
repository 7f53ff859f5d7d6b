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
from cns_drake.sensors.noisy_imu import NoisyImu


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
        The ports `specific_force` and `angular_velocity`; and `R_WI` of an
        IMU with a rate or errors of its own.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    X_BI = sensor_pose(scenario.imu)
    if scenario.imu.is_ideal:
        return add_imu(builder, base, X_BI, motion=motion).ports()
    rate = imu_rate(scenario)
    gravity = base.GetParentPlant().gravity_field().gravity_vector()
    imu = builder.AddNamedSystem(
        "imu", VehicleImu(trajectory, X_BI, gravity, rate)
    )
    noisy = builder.AddNamedSystem(
        "imu_noise", NoisyImu(make_imu_noise(scenario), rate)
    )
    ports = {"R_WI": imu.GetOutputPort("R_WI")}
    for name in ("specific_force", "angular_velocity"):
        builder.Connect(imu.GetOutputPort(name), noisy.GetInputPort(name))
        ports[name] = noisy.GetOutputPort(name)
    return ports
