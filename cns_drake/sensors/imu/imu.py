"""An IMU: Drake's accelerometer and gyroscope, with optional errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
import math

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)
from pydrake.systems.sensors import Accelerometer, Gyroscope
from scipy.spatial.transform import Rotation

from cns_drake.base.drives.drive import ImuSamples
from cns_drake.base.drives.sensor_names import IMU_FRAME
from cns_drake.base.elementary import product, rotated
from cns_drake.motion.trajectory import Trajectory
from cns_drake.sensors import carriers, system_names
from cns_drake.sensors.imu.config import ImuSection
from cns_drake.sensors.imu.noise import ImuErrors, ImuNoise

# Tolerance for the rounding of a sample's time, in periods.
_TOLERANCE = 1e-6
# Samples that `VehicleImu` computes at a time.
_BLOCK = 512
# Samples on its port: enough for one frame at 1,000 samples and 5 frames a
# second.
_REMEMBERED = 256
_NAMES = ("specific_force", "angular_velocity")


@dataclass(frozen=True)
class Imu:
    """The systems in a diagram that together form an IMU with the frame I.

    Attributes:
        accelerometer: system whose `measurement` is the exact specific force in
            I [m/s^2]; at rest it is +9.81 along the upward axis.
        gyroscope: system whose `measurement` is the exact angular velocity
            w_WI_I [rad/s].
        rate: samples per second; None for one sample per frame (scan) of the
            recording.
        noise: errors of the IMU; None if it is ideal.
        noisy: system that adds the errors; None if it is ideal.

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

    def ports(self) -> dict[str, OutputPort]:
        """Returns the output ports `specific_force` and `angular_velocity`."""
        if self.noisy is not None:
            return {name: self.noisy.GetOutputPort(name) for name in _NAMES}
        ideal = self.accelerometer, self.gyroscope
        ports = (one.get_measurement_output_port() for one in ideal)
        return dict(zip(_NAMES, ports, strict=True))


def add_imu(
    builder: DiagramBuilder,
    body: RigidBody | Frame,
    X_PB: RigidTransform,
    *,
    rate: float | None = None,
    noise: ImuNoise | None = None,
    motion: System | None = None,
    name: str = "imu",
) -> Imu:
    """Adds an IMU to a diagram and connects it to the motion of its body.

    Args:
        builder: builder of a diagram with the plant, or with `motion`.
        body: the carrier P of the IMU: a body of a finalized plant, or a frame
            that is fixed on such a body.
        X_PB: pose of the IMU in P, as in Drake's RgbdSensor.
        rate: samples per second; None for one sample per frame (scan) of a
            recorder.
        noise: errors of the IMU, which need a rate; by default none. The random
            numbers depend on the name of the IMU, unless the noise has a
            `sensor_name`.
        motion: system with the poses, velocities and accelerations of the
            plant's bodies; by default the plant.
        name: the systems are named `<name>_accelerometer`, `<name>_gyroscope`
            and `<name>_noise`.

    Returns:
        The systems of the IMU, with the method `ports`.

    Raises:
        RuntimeError: the plant is not finalized.
        TypeError: `body` is neither a body nor a frame.
        ValueError: there is noise without a rate, the rate is not positive, or
            the name is taken, reserved or cannot be a part of a ROS 2 topic.

    Example:
        from cns_drake import add_imu

        imu = add_imu(builder, body, X_BI)
        builder.ExportOutput(imu.ports()["specific_force"], "specific_force")
    """
    if rate is not None and not 0.0 < rate < math.inf:
        raise ValueError(
            f"rate: {rate} is not a positive number of samples a second"
        )
    if noise is not None and rate is None:
        raise ValueError("noise: it needs a rate; give rate as well")
    if noise is not None and noise.sensor_name == ImuNoise.sensor_name:
        noise = replace(noise, sensor_name=name)
    parts = system_names.IMU_PARTS
    system_names.check_new_sensor(builder, name, own=IMU_FRAME, parts=parts)
    systems = [f"{name}_{part}" for part in parts]
    body, X_BI = carriers.body_and_pose(body, X_PB)
    # The accelerometer's default is no gravity.
    gravity = body.GetParentPlant().gravity_field().gravity_vector()
    accelerometer = builder.AddNamedSystem(
        systems[0], Accelerometer(body, X_BI, gravity)
    )
    gyroscope = builder.AddNamedSystem(systems[1], Gyroscope(body, X_BI))
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
    noisy = builder.AddNamedSystem(systems[2], NoisyImu(noise, rate))
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
    """Adds an IMU to a diagram, given its description in a scenario.

    Args:
        config: the description, a section of a scenario.
        builder: builder of the diagram.
        body: body that carries the IMU.
        trajectory: motion of that body as a function of time.
        motion: system with the kinematic output ports of the body's plant.
        scan_rate: scans per second; also the rate of the IMU if the description
            has no rate.
        seed: seed of the IMU's errors.

    Returns:
        Name -> output port: `specific_force` [m/s^2] and `angular_velocity`
        [rad/s], both in the frame of the IMU. If the IMU has errors, or a rate
        of its own, there is also `imu_samples`, of type `ImuSamples`.

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
    """Adds the errors of an IMU to exact specific force and angular velocity.

    .. pydrake_system::

        name: NoisyImu
        input_ports:
        - specific_force
        - angular_velocity
        output_ports:
        - specific_force
        - angular_velocity

    All ports are vectors of size 3, expressed in the IMU's frame [m/s^2,
    rad/s]. Sample k is at time k / rate. Between two samples, the error of the
    earlier sample is added.
    """

    def __init__(self, noise: ImuNoise, rate: float):
        """Declares the ports.

        Args:
            noise: errors of the IMU.
            rate: samples per second.
        """
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
        """Returns the present sample."""
        sample = math.floor(context.get_time() * self._rate + _TOLERANCE)
        exact = [port.Eval(context) for port in self._inputs]
        return self._errors.measure(sample, np.hstack(exact)[None])[0]


class VehicleImu(LeafSystem):
    """Measures like an accelerometer and a gyroscope on a vehicle.

    Up to rounding and added errors, the values are those of Drake's
    `Accelerometer` and `Gyroscope`. This system is much faster, because it
    computes many samples at once from a known trajectory.

    .. pydrake_system::

        name: VehicleImu
        output_ports:
        - specific_force
        - angular_velocity
        - samples

    `specific_force` [m/s^2] and `angular_velocity` w_WI [rad/s] are vectors of
    size 3, expressed in the IMU's frame I. At a time between two samples, both
    outputs are the exact values plus the error of the earlier sample. `samples`
    is abstract, of type `ImuSamples`: the last 256 samples up to the time of
    the context. All outputs depend only on time.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        X_BI: RigidTransform,
        gravity_W: np.ndarray,
        rate: float,
        measure: Callable[[int, np.ndarray], np.ndarray] | None = None,
    ):
        """Declares the ports.

        Args:
            trajectory: motion of the body B.
            X_BI: pose of the IMU.
            gravity_W: acceleration of free fall [m/s^2].
            rate: samples per second.
            measure: adds errors: takes the number of the first sample and (N,
                6) exact specific forces and angular velocities, and returns the
                measured ones. By default there are no errors.
        """
        super().__init__()
        self._trajectory = trajectory
        self._X_BI = RigidTransform(X_BI)
        self._gravity_W = np.array(gravity_W)
        self._rate = rate
        self._add_errors = measure or (lambda first, exact: exact)
        # Threads may share the system.
        self._block = lru_cache(maxsize=4)(self._calc_block)
        for name in ("specific_force", "angular_velocity"):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, name=name: self._calc_vector(
                    name, context, output
                ),
                {self.time_ticket()},
            )
        self.DeclareAbstractOutputPort(
            "samples",
            lambda: Value(object()),
            self._calc_samples,
            {self.time_ticket()},
        )

    def _calc_vector(
        self, name: str, context: Context, output: BasicVector
    ) -> None:
        time = context.get_time()
        number = self._last_sample(time)
        if abs(time * self._rate - number) > _TOLERANCE:
            sample = self._measure(number, np.array([time]))
        else:
            sample = self._samples_between(number, number + 1)
        output.SetFromVector(getattr(sample, name)[0])

    def _calc_samples(self, context: Context, output: AbstractValue) -> None:
        end = self._last_sample(context.get_time()) + 1
        output.set_value(self._samples_between(end - _REMEMBERED, end))

    def _last_sample(self, time: float) -> int:
        return math.floor(time * self._rate + _TOLERANCE)

    def _samples_between(self, first: int, end: int) -> ImuSamples:
        """Returns the samples with numbers `first` to `end` - 1."""
        parts = []
        for number in range(first // _BLOCK, (end - 1) // _BLOCK + 1):
            start = number * _BLOCK
            rows = slice(max(first - start, 0), end - start)
            parts.append([one[rows] for one in self._block(number)[1:]])
        return ImuSamples(first, *map(np.concatenate, zip(*parts, strict=True)))

    def _calc_block(self, number: int) -> ImuSamples:
        start = number * _BLOCK
        return self._measure(start, (start + np.arange(_BLOCK)) / self._rate)

    def _measure(self, first: int, times: np.ndarray) -> ImuSamples:
        """Returns samples number `first` onwards, taken at (N,) times [s]."""
        # Before the start the vehicle rests, as after the end.
        motion = self._trajectory.body_motion(np.maximum(times, 0.0))
        R_WI = product(motion.R, self._X_BI.rotation().matrix())
        R_IW = R_WI.transpose(0, 2, 1)
        a_WI = motion.acceleration_at(self._X_BI.translation())
        force = rotated(R_IW, a_WI - self._gravity_W)
        turn = rotated(R_IW, motion.w)
        measured = self._add_errors(first, np.hstack([force, turn]))
        return ImuSamples(
            first,
            Rotation.from_matrix(R_WI).as_quat(canonical=True),
            measured[:, 3:],
            measured[:, :3],
        )
