"""An IMU: Drake's accelerometer and gyroscope, with optional errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
import math

from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.sensors import Accelerometer, Gyroscope

from cns_drake.sensors.body_motion import body_and_pose, connect_motion
from cns_drake.sensors.imu_noise import ImuNoise
from cns_drake.sensors.noisy_imu import NoisyImu


@dataclass(frozen=True)
class Imu:
    """The systems of an IMU in frame I.

    It unpacks into accelerometer and gyroscope.

    Attributes:
        accelerometer: its `measurement` is the specific force in I, at rest
            +9.81 along the upward axis [m/s^2], without errors.
        gyroscope: its `measurement` is the angular velocity w_WI_I [rad/s],
            without errors.
        rate: samples per second; None without its own rate.
        noise: its errors, None if it is ideal.
        noisy: the system that adds them, None if it is ideal.

    Example:
        from cns_drake import add_imu

        imu = add_imu(builder, body, X_BI)
        port = imu.ports()["angular_velocity"]
    """

    accelerometer: Accelerometer
    gyroscope: Gyroscope
    rate: float | None = None
    noise: ImuNoise | None = None
    noisy: NoisyImu | None = None

    def __iter__(self) -> Iterator[System]:
        yield self.accelerometer
        yield self.gyroscope

    def ports(self) -> dict[str, OutputPort]:
        """Returns the measured `specific_force` and `angular_velocity`."""
        names = ("specific_force", "angular_velocity")
        if self.noisy is not None:
            return {name: self.noisy.GetOutputPort(name) for name in names}
        ideal = [one.get_measurement_output_port() for one in self]
        return dict(zip(names, ideal, strict=True))


def add_imu(
    builder: DiagramBuilder,
    body: RigidBody | Frame,
    X_PI: RigidTransform,
    *,
    rate: float | None = None,
    noise: ImuNoise | None = None,
    motion: System | None = None,
    name: str = "imu",
) -> Imu:
    """Adds an IMU to a diagram and connects it to the motion of its body.

    Args:
        builder: of the diagram that holds the plant, or `motion`.
        body: P, the body that carries the IMU, or a frame fixed on it, of a
            finalized plant.
        X_PI: pose of the IMU in P.
        rate: samples per second of a recorder; by default its rate of frames
            [1/s].
        noise: its errors, which need a rate.
        motion: the source of body poses, velocities and accelerations, if not
            the plant itself.
        name: the systems are named `<name>_accelerometer`,
            `<name>_gyroscope` and `<name>_noise`.

    Raises:
        ValueError: there is noise without a rate, or the rate is not positive.

    Example:
        from cns_drake import add_imu

        accelerometer, gyroscope = add_imu(builder, body, X_BI)
    """
    if rate is not None and not 0.0 < rate < math.inf:
        raise ValueError(
            f"rate: {rate} is not a positive number of samples a second"
        )
    if noise is not None and rate is None:
        raise ValueError("noise: it needs a rate; give rate as well")
    body, X_BI = body_and_pose(body, X_PI)
    # The accelerometer's default is no gravity.
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
    imu = Imu(accelerometer, gyroscope, rate, noise)
    if noise is None or rate is None:
        return imu
    noisy = builder.AddNamedSystem(f"{name}_noise", NoisyImu(noise, rate))
    for port_name, port in imu.ports().items():
        builder.Connect(port, noisy.GetInputPort(port_name))
    return replace(imu, noisy=noisy)
