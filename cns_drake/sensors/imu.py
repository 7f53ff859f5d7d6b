"""An ideal IMU: Drake's accelerometer and gyroscope, wired."""

from typing import NamedTuple

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.sensors import Accelerometer, Gyroscope


class Imu(NamedTuple):
    """The two systems of an IMU in frame I.

    Attributes:
        accelerometer: its `measurement` is the specific force in I, at rest
            +9.81 along the upward axis [m/s^2].
        gyroscope: its `measurement` is the angular velocity w_WI_I [rad/s].

    Example:
        from cns_drake import add_imu

        imu = add_imu(builder, plant, plant, body, X_BI)
        port = imu.gyroscope.get_measurement_output_port()
    """

    accelerometer: Accelerometer
    gyroscope: Gyroscope


def add_imu(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    motion: System,
    body: RigidBody,
    X_BI: RigidTransform,
    name: str = "imu",
) -> Imu:
    """Adds an IMU to a diagram and connects it to the vehicle's motion.

    Args:
        builder: of the diagram that holds `motion`.
        plant: gives the gravity.
        motion: the source of body poses, velocities and accelerations.
        body: the body that carries the IMU.
        X_BI: pose of the IMU on the body.
        name: the systems are named `<name>_accelerometer` and
            `<name>_gyroscope`.

    Example:
        from cns_drake import add_imu

        accelerometer, gyroscope = add_imu(builder, plant, plant, body, X_BI)
    """
    # The accelerometer assumes no gravity unless it is told.
    gravity = plant.gravity_field().gravity_vector()
    accelerometer = builder.AddNamedSystem(
        f"{name}_accelerometer", Accelerometer(body, X_BI, gravity)
    )
    gyroscope = builder.AddNamedSystem(
        f"{name}_gyroscope", Gyroscope(body, X_BI)
    )
    poses = motion.GetOutputPort("body_poses")
    velocities = motion.GetOutputPort("body_spatial_velocities")
    for sensor in (accelerometer, gyroscope):
        builder.Connect(poses, sensor.get_body_poses_input_port())
        builder.Connect(velocities, sensor.get_body_velocities_input_port())
    builder.Connect(
        motion.GetOutputPort("body_spatial_accelerations"),
        accelerometer.get_body_accelerations_input_port(),
    )
    return Imu(accelerometer, gyroscope)
