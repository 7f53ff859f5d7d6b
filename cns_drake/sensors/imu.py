"""An ideal IMU: Drake's accelerometer and gyroscope, wired."""

# No postponed hints: the reference resolves those of a NamedTuple nowhere.
from typing import NamedTuple

from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.sensors import Accelerometer, Gyroscope

from cns_drake.sensors.body_motion import body_and_pose, connect_motion


class Imu(NamedTuple):
    """The two systems of an IMU in frame I.

    Attributes:
        accelerometer: its `measurement` is the specific force in I, at rest
            +9.81 along the upward axis [m/s^2].
        gyroscope: its `measurement` is the angular velocity w_WI_I [rad/s].

    Example:
        from cns_drake import add_imu

        imu = add_imu(builder, body, X_BI)
        port = imu.gyroscope.get_measurement_output_port()
    """

    accelerometer: Accelerometer
    gyroscope: Gyroscope


def add_imu(
    builder: DiagramBuilder,
    body: RigidBody | Frame,
    X_PI: RigidTransform,
    *,
    motion: System | None = None,
    name: str = "imu",
) -> Imu:
    """Adds an IMU to a diagram and connects it to the motion of its body.

    Args:
        builder: of the diagram that holds the plant, or `motion`.
        body: P, the body that carries the IMU, or a frame fixed on it, of a
            finalized plant.
        X_PI: pose of the IMU in P.
        motion: the source of body poses, velocities and accelerations, if
            that is not the plant itself.
        name: the systems are named `<name>_accelerometer` and
            `<name>_gyroscope`.

    Example:
        from cns_drake import add_imu

        accelerometer, gyroscope = add_imu(builder, body, X_BI)
    """
    body, X_BI = body_and_pose(body, X_PI)
    # The accelerometer assumes no gravity unless it is told.
    gravity = body.GetParentPlant().gravity_field().gravity_vector()
    accelerometer = builder.AddNamedSystem(
        f"{name}_accelerometer", Accelerometer(body, X_BI, gravity)
    )
    gyroscope = builder.AddNamedSystem(
        f"{name}_gyroscope", Gyroscope(body, X_BI)
    )
    for sensor in (accelerometer, gyroscope):
        inputs = {
            "body_poses": sensor.get_body_poses_input_port(),
            "body_spatial_velocities": sensor.get_body_velocities_input_port(),
        }
        connect_motion(builder, motion, body, inputs)
    port = accelerometer.get_body_accelerations_input_port()
    inputs = {"body_spatial_accelerations": port}
    connect_motion(builder, motion, body, inputs)
    return Imu(accelerometer, gyroscope)
