"""An IMU: Drake's accelerometer and gyroscope, with optional errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
import math

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)
from pydrake.systems.sensors import Accelerometer, Gyroscope

from cns_drake.motion.trajectory import Trajectory
from cns_drake.motion.vehicle_imu import VehicleImu
from cns_drake.sensors import carriers
from cns_drake.sensors.imu.config import ImuSection
from cns_drake.sensors.imu.noise import ImuErrors, ImuNoise

# Rounding error of a sample's time, in periods.
_SAMPLE_TOLERANCE = 1e-6
_NAMES = ("specific_force", "angular_velocity")


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
        if self.noisy is not None:
            return {name: self.noisy.GetOutputPort(name) for name in _NAMES}
        ideal = [one.get_measurement_output_port() for one in self]
        return dict(zip(_NAMES, ideal, strict=True))


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
        builder: holds the plant, or `motion`.
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
        RuntimeError: the plant is not finalized.
        TypeError: the body is of another type.
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
    body, X_BI = carriers.body_and_pose(body, X_PI)
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
        carriers.connect_motion(builder, motion, body, inputs)
    port = accelerometer.get_body_accelerations_input_port()
    inputs = {"body_spatial_accelerations": port}
    carriers.connect_motion(builder, motion, body, inputs)
    imu = Imu(accelerometer, gyroscope, rate, noise)
    if noise is None or rate is None:
        return imu
    noisy = builder.AddNamedSystem(f"{name}_noise", NoisyImu(noise, rate))
    for port_name, port in imu.ports().items():
        builder.Connect(port, noisy.GetInputPort(port_name))
    return replace(imu, noisy=noisy)


def add_described_imu(
    config: ImuSection,
    builder: DiagramBuilder,
    body: RigidBody,
    *,
    trajectory: Trajectory,
    motion: System,
    scan_rate: int,
    seed: int,
) -> dict[str, OutputPort]:
    """Adds the IMU that a description describes to a diagram.

    Returns:
        The ports `specific_force` and `angular_velocity`; and `imu_samples`
        of an IMU with a rate or errors of its own.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    X_BI = carriers.sensor_pose(config)
    if config.is_ideal:
        return add_imu(builder, body, X_BI, motion=motion).ports()
    rate = config.sample_rate(scan_rate)
    gravity = body.GetParentPlant().gravity_field().gravity_vector()
    errors = ImuErrors(config.noise(seed), rate)
    imu = builder.AddNamedSystem(
        "imu", VehicleImu(trajectory, X_BI, gravity, rate, errors.measure)
    )
    ports = {name: imu.GetOutputPort(name) for name in _NAMES}
    return ports | {"imu_samples": imu.GetOutputPort("samples")}


class NoisyImu(LeafSystem):
    """Adds noise to specific force and angular velocity.

    .. pydrake_system::

        name: NoisyImu
        input_ports:
        - specific_force
        - angular_velocity
        output_ports:
        - specific_force
        - angular_velocity

    All ports are vectors of size 3, expressed in the IMU's frame [m/s^2,
    rad/s]. Sample k is at k / rate; between samples the error of the last one
    holds.
    """

    def __init__(self, noise: ImuNoise, rate: float):
        """Declares the ports."""
        super().__init__()
        self._errors = ImuErrors(noise, rate)
        self._rate = rate
        self._inputs = [self.DeclareVectorInputPort(name, 3) for name in _NAMES]
        for column, name in ((0, _NAMES[0]), (3, _NAMES[1])):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, column=column: output.SetFromVector(
                    self._measure(context)[column : column + 3]
                ),
            )

    def _measure(self, context: Context) -> np.ndarray:
        """Returns the present sample; the last block of errors is kept."""
        sample = math.floor(context.get_time() * self._rate + _SAMPLE_TOLERANCE)
        exact = [
            port.Eval(context) if port.HasValue(context) else np.zeros(3)
            for port in self._inputs
        ]
        return self._errors.measure(sample, np.hstack(exact)[None])[0]
