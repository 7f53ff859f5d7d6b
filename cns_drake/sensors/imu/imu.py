"""An IMU: Drake's accelerometer and gyroscope, with optional errors."""

from dataclasses import dataclass, replace
from types import NoneType

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)
from pydrake.systems.lcm import LcmBuses
from pydrake.systems.sensors import Accelerometer, Gyroscope

from cns_drake.sensors import carriers
from cns_drake.sensors.imu.config import ImuDescription, ImuSection
from cns_drake.sensors.imu.noise import (
    MEASUREMENTS,
    ImuErrors,
    ImuNoise,
    last_sample,
)
from cns_drake.sensors.noise_draws import check_seed
from cns_drake.sensors.published_sensor import (
    USUAL_RATE,
    Interface,
    PublishedSensor,
    carrier_frame,
    errors_of,
    find_interface,
    make_signal,
    names_of_fields_in_errors,
    publish_measurements,
    section_of,
)
from evaluation.base import check_type, of_type

# Beyond, events hardly advance the time of a long simulation [1/s].
_HIGHEST_SAMPLE_RATE = 1e6


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
        self._inputs = [
            self.DeclareVectorInputPort(name, 3) for name in MEASUREMENTS
        ]
        for column, name in ((0, MEASUREMENTS[0]), (3, MEASUREMENTS[1])):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, column=column: output.SetFromVector(
                    self._calc_sample(context)[column : column + 3]
                ),
            )

    def _calc_sample(self, context: Context) -> np.ndarray:
        """Returns the sample (6,) at the time of the Context."""
        sample = last_sample(context.get_time(), self._rate)
        exact = [port.Eval(context) for port in self._inputs]
        return self._errors.measure(sample, np.hstack(exact)[None])[0]


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

        imu = add_imu(builder, body, X_PB)
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
            return {
                name: self.noisy.GetOutputPort(name) for name in MEASUREMENTS
            }
        ideal = self.accelerometer, self.gyroscope
        ports = (sensor.get_measurement_output_port() for sensor in ideal)
        return dict(zip(MEASUREMENTS, ports, strict=True))


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
        TypeError: an argument is of another type.
        ValueError: there is noise without a rate, the rate is not positive or
            above 1e6, the pose is not finite, or the name is taken or empty.

    Example:
        from cns_drake import add_imu

        imu = add_imu(builder, body, X_PB)
        builder.ExportOutput(imu.ports()["specific_force"], "specific_force")
    """
    check_type("noise", noise, ImuNoise, NoneType)
    rate = of_type(rate, float | None, "rate")
    if rate is not None:
        _check_sample_rate(rate)
    if noise is not None and rate is None:
        raise ValueError("noise: it needs a rate; give rate as well")
    if noise is not None and noise.sensor_name == ImuNoise.sensor_name:
        noise = replace(noise, sensor_name=name)
    parts = carriers.IMU_PARTS
    carriers.check_new_sensor(builder, name, parts)
    systems = [f"{name}_{part}" for part in parts]
    body, X_BI = carriers.body_and_pose(body, X_PB)
    poses, velocities, accelerations = carriers.find_motion(
        builder,
        motion,
        body,
        "body_poses",
        "body_spatial_velocities",
        "body_spatial_accelerations",
    )
    # The accelerometer's default is no gravity.
    gravity = body.GetParentPlant().gravity_field().gravity_vector()
    accelerometer = builder.AddNamedSystem(
        systems[0], Accelerometer(body, X_BI, gravity)
    )
    gyroscope = builder.AddNamedSystem(systems[1], Gyroscope(body, X_BI))
    for sensor in (accelerometer, gyroscope):
        builder.Connect(poses, sensor.get_body_poses_input_port())
        builder.Connect(velocities, sensor.get_body_velocities_input_port())
    builder.Connect(
        accelerations, accelerometer.get_body_accelerations_input_port()
    )
    imu = Imu(accelerometer, gyroscope, rate, noise)
    if noise is None or rate is None:
        return imu
    noisy = builder.AddNamedSystem(systems[2], NoisyImu(noise, rate))
    for port_name, port in imu.ports().items():
        builder.Connect(port, noisy.GetInputPort(port_name))
    return replace(imu, noisy=noisy)


def _check_sample_rate(rate: float) -> None:
    if not 0.0 < rate <= _HIGHEST_SAMPLE_RATE:
        raise ValueError(
            f"rate: {rate!r} is not a positive number of samples a second, up "
            f"to {_HIGHEST_SAMPLE_RATE:g}"
        )


@names_of_fields_in_errors
@dataclass(eq=False)
class ImuConfig(ImuDescription, PublishedSensor):
    """The configuration of an IMU, for YAML and `ApplyImuConfig`.

    The fields are those of an `ImuDescription`, of all sensors (`name`, `X_PB`
    and `lcm_bus`), and the following.

    Attributes:
        rate: samples per second; any number is possible, as for `add_imu`. By
            default the rate in the file `kalibr`, or 20 if no file states a
            rate.
        seed: seed of the errors.

    Example:
        from cns_drake import ImuConfig

        config = ImuConfig(name="imu", rate=200)
    """

    name: str = "imu"
    seed: int = 0

    def _validate(self) -> None:
        check_seed(self.seed)
        _check_sample_rate(self.sample_rate())

    def _section(self) -> ImuSection:
        """Returns the section of a scenario with the same fields."""
        return section_of(self, ImuSection)

    def sample_rate(self) -> float:
        """Returns the number of samples per second.

        Raises:
            InputError: Kalibr's file cannot be used.
            ValueError: a field is out of range.
        """
        if self.rate is not None:
            return self.rate
        return self._section().sample_rate(USUAL_RATE)


def ApplyImuConfig(
    config: ImuConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: Interface | None = None,
) -> Imu:
    """Adds an IMU to a diagram and publishes its samples on LCM.

    The messages are `lcmt_drake_signal` on the channel `DRAKE_IMU_<name>`:
    specific force [m/s^2] and angular velocity [rad/s], expressed in the IMU's
    frame.

    Args:
        config: description of the IMU.
        scene_graph: ignored, so that the function has the arguments of Drake's
            `ApplyCameraConfig`.

    The other arguments are those of `ApplyLidarConfig`.

    Raises:
        InputError: Kalibr's file cannot be used.

    Example:
        from cns_drake import ApplyImuConfig, ImuConfig

        ApplyImuConfig(ImuConfig(rate=200), builder)
    """
    check_type("config", config, ImuConfig)
    config.ValidateOrThrow()
    section, rate = config._section(), config.sample_rate()
    interface = find_interface(config, builder, lcm_buses, lcm)
    with errors_of(config):
        imu = add_imu(
            builder,
            *carrier_frame(config, builder, plant),
            rate=rate,
            noise=None if section.is_ideal else section.noise(config.seed),
            name=config.name,
        )
    measured = imu.ports()
    ports = list(measured.values())
    axes = [f"{name}_{axis}" for name in measured for axis in "xyz"]
    publish_measurements(
        config,
        "IMU",
        builder,
        interface,
        ports,
        lambda time, *values: make_signal(time, axes, np.hstack(values)),
        period=1.0 / rate,
    )
    return imu
