"""Sensors configured in YAML, in the same way as Drake's cameras.

For each kind of sensor there is a config class that `pydrake.common.yaml` reads
and writes, and a function that adds the configured sensor to a diagram and
publishes its measurements on LCM. The sections of scenarios define which values
the fields can have.
"""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
import copy
from dataclasses import dataclass, field
import math
import numbers
import os
import types
import typing
from typing import Any, TypeAlias, TypeVar

from drake import lcmt_drake_signal, lcmt_point_cloud
import numpy as np
from pydantic import ValidationError
from pydrake.common.schema import Transform
from pydrake.common.value import AbstractValue, Value
from pydrake.common.yaml import yaml_dump_typed
from pydrake.geometry import GeometryId, Role, SceneGraph
from pydrake.lcm import DrakeLcm, DrakeLcmInterface
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.perception import PointCloud, PointCloudToLcm
from pydrake.systems import framework
from pydrake.systems import lcm as drake_lcm
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.lcm import LcmBuses, LcmInterfaceSystem

from cns_drake.base import Section, describe_validation_error, one_line
from cns_drake.scene import find_bus
from cns_drake.sensors import odometry
from cns_drake.sensors.imu.config import ImuDescription, ImuSection
from cns_drake.sensors.imu.imu import Imu, add_imu
from cns_drake.sensors.lidar.beams import period_of_rate
from cns_drake.sensors.lidar.lidar import Lidar, sample_times
from cns_drake.sensors.lidar_adding import add_lidar
from cns_drake.sensors.lidar_config import (
    LidarDescription,
    LidarSection,
    make_lidar_model,
)
from cns_drake.sensors.noise_draws import check_seed
from cns_drake.sensors.sheet_patterns import revolution_at_rate
from cns_drake.sensors.system_names import check_unused_names
from cns_drake.units import DEFAULT_PRESET, LONGEST_PERIOD

# Fields of a section that a config does not have, as `X_PB` replaces the mount
# and only recordings have a layout, or that differ from the config's.
_LEFT_OUT = ("xyz", "rpy_deg", "layout", "rate")
# Messages per second of an IMU or odometry that names no rate.
_RATE = 20
_ROLES = {
    "perception": Role.kPerception,
    "illustration": Role.kIllustration,
    "proximity": Role.kProximity,
}
_KINDS = {
    bool: "true or false",
    float: "a number",
    int: "a whole number",
    str: "a text",
}
_Struct = TypeVar("_Struct")


def _names_of_fields_in_errors(struct: type[_Struct]) -> type[_Struct]:
    """Makes a dataclass refuse values of a wrong type by the field's name.

    Drake's reader of YAML itself refuses `rate: fast` without the name of the
    field. It accepts any scalar where the type of a field admits any; then the
    dataclass refuses the value, also in Python.
    """
    fields: dict[str, Any] = struct.__dataclass_fields__  # type: ignore[attr-defined]  # A dataclass.
    # Without the limits, which a section of a scenario checks.
    types = typing.get_type_hints(struct)
    hints = {name: types[name] for name in fields}
    for name, hint in hints.items():
        # A copy: base classes share the field.
        fields[name] = copy.copy(fields[name])
        fields[name].type = typing.Union[(hint, *_KINDS)]

    def set_field(self: _Struct, name: str, value: Any) -> None:
        if name in hints:
            value = _of_type(value, hints[name], f"{struct.__name__}.{name}")
        object.__setattr__(self, name, value)

    struct.__setattr__ = set_field  # type: ignore[method-assign, assignment]  # Of this class.
    return struct


def _of_type(value: Any, hint: Any, name: str) -> Any:
    """Returns a value as the type of a field; converts as Drake's reader does.

    Raises:
        ValueError: the value is of another type; the message begins with
            `name`.
    """
    options = [hint]
    if isinstance(hint, types.UnionType):
        options = list(typing.get_args(hint))
    if value is None and type(None) in options:
        return None
    kind = options[0]
    fault = f"{name}: {value!r} is not {_KINDS.get(kind, 'a pose')}"
    if typing.get_origin(kind) is list:
        if isinstance(value, str) or not (
            isinstance(value, Collection)
            and all(isinstance(one, str) for one in value)
        ):
            raise ValueError(f"{name}: {value!r} is not a list of names")
        return list(value)
    if kind is bool:
        if value in ("true", "false"):  # Quoted in YAML.
            return value == "true"
    elif kind is str and isinstance(value, os.PathLike):
        return os.fspath(value)
    elif kind in (int, float) and not isinstance(value, bool):
        if isinstance(value, str):
            try:
                value = float(value)
            except ValueError:
                raise ValueError(fault) from None
        if isinstance(value, numbers.Real) and (
            kind is float or float(value).is_integer()
        ):
            return kind(value)
        raise ValueError(fault)
    if not isinstance(value, kind) or (
        kind in (int, float) and isinstance(value, bool)
    ):
        raise ValueError(fault)
    return value


@dataclass(eq=False)
class PublishedSensor:
    """The place of a sensor and of its messages, of whatever kind it is.

    Two configs of a kind are equal if their fields are.

    Attributes:
        name: name of the system, and part of the channel's name.
        X_PB: pose of the sensor's body B in a frame P of the plant. The field
            `base_frame` of this pose names P; by default P is the world frame.
        lcm_bus: name of the bus on which the measurements are published.
    """

    name: str
    X_PB: Transform = field(default_factory=Transform)
    lcm_bus: str = "default"

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        # Drake's Transform has no equality.
        return yaml_dump_typed(self) == yaml_dump_typed(other)

    __hash__ = None  # type: ignore[assignment]  # As any dataclass that changes.

    def ValidateOrThrow(self) -> None:
        """Checks all that can be checked without a Diagram, as Drake's configs.

        Raises:
            InputError: a file that the config names cannot be used.
            ValueError: a field is out of range; the message names it.
        """
        with _errors_of(self):
            if not self.name:
                raise ValueError("name: it is empty")
            X_PB = self.X_PB.GetDeterministicValue()
            if not np.isfinite(X_PB.GetAsMatrix34()).all():
                raise ValueError("X_PB: not finite")
            self._validate()

    def _validate(self) -> None:
        """Checks the fields that only this kind of sensor has."""


@_names_of_fields_in_errors
@dataclass(eq=False)
class LidarConfig(LidarDescription, PublishedSensor):
    """The configuration of a LiDAR, for YAML and `ApplyLidarConfig`.

    The fields are those of a `LidarDescription`, of all sensors (`name`, `X_PB`
    and `lcm_bus`), and the following. Unlike in a scenario, coordinates are not
    rounded by default. A relative path `unit` starts at the working directory.

    Attributes:
        rate: scans per second, from 0.25 to 1000. With a rate, the LiDAR is
            discrete: it computes a scan once per period and holds it. By
            default, the LiDAR is continuous, and publishes at the rate of the
            data sheet. A revolution takes as long as the data sheet states, or
            1 / `rate` if that is shorter.
        causal: whether a scan covers the revolution that ends at its time, so
            that a controller can use it at once.
        capture_offset: time of a discrete LiDAR's first periodic scan [s].
            With different offsets, several LiDARs can take turns.
        output_delay: time from a discrete LiDAR's scan to its appearance on the
            ports and its publication [s], less than 1 / `rate`. The message
            has the time of the scan.
        seed: seed of the noise.
        role: role of the geometry that the LiDAR sees: `perception`,
            `illustration` or `proximity`.
        unseen: names of bodies, frames on bodies, and geometries that the LiDAR
            does not see, such as `robot::arm`. A geometry has the name that the
            SceneGraph's inspector gives; a name stands for all geometries that
            have it. By default, the LiDAR's body and all bodies that are welded
            to it; `[]` if the LiDAR sees all bodies.
        num_threads: number of threads that share the LiDAR's rays.

    Example:
        from pydrake.common.yaml import yaml_load_typed

        from cns_drake import LidarConfig

        text = "{preset: os1-64, rate: 12.5}"
        config = yaml_load_typed(schema=LidarConfig, data=text)
    """

    name: str = "lidar"
    rate: float | None = None
    causal: bool = False
    capture_offset: float = 0.0
    output_delay: float = 0.0
    seed: int = 0
    role: str = "perception"
    unseen: list[str] | None = None
    num_threads: int = 1

    def _validate(self) -> None:
        self._section()
        if self.rate is not None:
            period_of_rate(self.rate, LONGEST_PERIOD)
        sample_times(self.rate, self.capture_offset, self.output_delay)
        if self.role not in _ROLES:
            raise ValueError(
                f"role: {self.role!r} is not one of {', '.join(_ROLES)}"
            )
        check_seed(self.seed)
        if self.num_threads < 1:
            raise ValueError(f"num_threads: {self.num_threads} is less than 1")

    def _section(self) -> LidarSection:
        """Returns the section of a scenario with the same fields."""
        given = _given(self, LidarSection)
        if self.unit is not None and self.preset == DEFAULT_PRESET:
            given["preset"] = None  # Nobody has given it.
        return _checked(given, LidarSection)


@_names_of_fields_in_errors
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
        if not self.sample_rate() > 0.0 or math.isinf(self.sample_rate()):
            raise ValueError(
                f"rate: {self.rate!r} is not a positive number of samples a "
                "second"
            )

    def _section(self) -> ImuSection:
        """Returns the section of a scenario with the same fields."""
        return _checked(_given(self, ImuSection), ImuSection)

    def sample_rate(self) -> float:
        """Returns the number of samples per second.

        Raises:
            InputError: Kalibr's file cannot be used.
            ValueError: a field is out of range.
        """
        if self.rate is not None:
            return self.rate
        return self._section().sample_rate(_RATE)


@_names_of_fields_in_errors
@dataclass(eq=False)
class OdometryConfig(PublishedSensor):
    """The configuration of exact odometry, for YAML and `ApplyOdometryConfig`.

    The fields are those of all sensors (`name`, `X_PB` and `lcm_bus`), and the
    following. B is the observed frame.

    Attributes:
        rate: messages per second; by default 20.

    Example:
        from cns_drake import OdometryConfig

        config = OdometryConfig(name="odometry", rate=100)
    """

    name: str = "odometry"
    rate: int | None = None

    def _validate(self) -> None:
        period_of_rate(self.message_rate())

    def message_rate(self) -> int:
        """Returns the number of messages per second."""
        return _RATE if self.rate is None else self.rate


Config: TypeAlias = LidarConfig | ImuConfig | OdometryConfig

# The kind of sensor in the name of a channel.
_CHANNELS = {
    LidarConfig: "POINT_CLOUD",
    ImuConfig: "IMU",
    OdometryConfig: "ODOMETRY",
}

# An interface on which messages are published.
_Interface: TypeAlias = DrakeLcmInterface | LcmInterfaceSystem
# Endings of the names of the systems that publish a sensor's messages.
_PARTS = ("to_lcm", "publisher")


@contextmanager
def _errors_of(config: PublishedSensor) -> Iterator[None]:
    """Names a configured sensor in the errors of its values."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{_caller(config)}: {error}") from None


def _find_interface(
    config: Config,
    builder: DiagramBuilder,
    lcm_buses: LcmBuses | None,
    lcm: _Interface | None,
) -> _Interface | None:
    """Returns the interface on which a configured sensor publishes.

    Returns:
        The interface; None for one to the default URL, which is still to be
        added to the diagram.

    Raises:
        RuntimeError: there is no such bus.
        ValueError: the diagram already has a system with the name of one that
            publishes the sensor's messages.
    """
    name = config.name
    check_unused_names(builder, *(f"{name}_{part}" for part in _PARTS))
    if lcm is not None:
        return lcm
    if lcm_buses is not None:
        return find_bus(builder, lcm_buses, _caller(config), config.lcm_bus)
    if config.lcm_bus != "default":
        raise RuntimeError(
            f"{_caller(config)}: lcm_bus: there is no bus '{config.lcm_bus}' "
            "without lcm_buses"
        )
    return None


def _publish_measurements(
    config: Config,
    builder: DiagramBuilder,
    lcm: _Interface | None,
    ports: list[OutputPort],
    to_lcm: framework.System,
    *,
    period: float,
    offset: float = 0.0,
) -> None:
    """Adds systems that convert measurements to LCM messages and publish them.

    Nothing is added for the interface of a null bus, such as in `lcm_buses:
    {default: null}`. Drake's cameras behave in the same way.

    Args:
        config: description of the sensor.
        builder: builder of a diagram with the sensor.
        lcm: what `_find_interface` returned.
        ports: output ports of the sensor.
        to_lcm: system that converts the ports' values to a message: a
            `_ScanToLcm` or a `_SignalToLcm`.
        period: time between two messages [s].
        offset: time of the first message [s].
    """
    if lcm is None:
        lcm = builder.AddSystem(LcmInterfaceSystem(lcm=DrakeLcm()))
    if lcm.get_lcm_url() == LcmBuses.kLcmUrlMemqNull:
        return
    is_cloud = isinstance(to_lcm, _ScanToLcm)
    publisher = drake_lcm.LcmPublisherSystem.Make(
        f"DRAKE_{_CHANNELS[type(config)]}_{config.name}",
        lcmt_point_cloud if is_cloud else lcmt_drake_signal,
        lcm,
        publish_period=period,
        publish_offset=offset,
        use_cpp_serializer=is_cloud,
    )
    for part, system in zip(_PARTS, (to_lcm, publisher), strict=True):
        builder.AddNamedSystem(f"{config.name}_{part}", system)
    for index, port in enumerate(ports):
        builder.Connect(port, to_lcm.get_input_port(index))
    builder.Connect(to_lcm.get_output_port(), publisher.get_input_port())


class _ScanToLcm(framework.LeafSystem):
    """Converts a scan to an `lcmt_point_cloud`, as Drake's `PointCloudToLcm`.

    The message has the time of the scan, which can be earlier than that of the
    Context.
    """

    def __init__(self) -> None:
        """Declares the ports."""
        super().__init__()
        self._convert = PointCloudToLcm("world")
        self._cloud = self.DeclareAbstractInputPort(
            "point_cloud_W", Value(PointCloud(0))
        )
        self._time = self.DeclareVectorInputPort("scan_time", 1)
        self.DeclareAbstractOutputPort(
            "lcmt_point_cloud",
            self._convert.get_output_port().Allocate,
            self._calc_message,
        )

    def _calc_message(self, context: Context, output: AbstractValue) -> None:
        own = self._convert.CreateDefaultContext()
        (time,) = np.nan_to_num(self._time.Eval(context))
        # Drake cuts off what is below a microsecond.
        own.SetTime((round(time * 1e6) + 0.5) / 1e6)
        self._convert.get_input_port().FixValue(
            own, self._cloud.EvalAbstract(context)
        )
        output.SetFrom(self._convert.get_output_port().EvalAbstract(own))


class _SignalToLcm(framework.LeafSystem):
    """Converts the values of ports to an `lcmt_drake_signal`."""

    def __init__(
        self,
        ports: list[OutputPort],
        names: list[str],
        values: Callable[..., np.ndarray],
    ):
        """Declares an input for each port.

        Args:
            ports: the output ports whose values are converted.
            names: name of each number in a message.
            values: function that takes the values of the ports, and returns the
                numbers of a message.
        """
        super().__init__()
        self._names = names
        self._values = values
        for index, port in enumerate(ports):
            if port.get_data_type() == framework.PortDataType.kVectorValued:
                self.DeclareVectorInputPort(f"u{index}", port.size())
            else:
                self.DeclareAbstractInputPort(f"u{index}", port.Allocate())
        self.DeclareAbstractOutputPort(
            "lcmt_drake_signal",
            lambda: Value(lcmt_drake_signal()),
            self._calc_message,
        )

    def _calc_message(self, context: Context, output: AbstractValue) -> None:
        inputs = [
            self.get_input_port(index).Eval(context)
            for index in range(self.num_input_ports())
        ]
        message = lcmt_drake_signal()
        message.val = self._values(*inputs).tolist()
        message.dim = len(message.val)
        message.coord = self._names
        message.timestamp = round(context.get_time() * 1e6)
        output.set_value(message)


def ApplyLidarConfig(
    config: LidarConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: _Interface | None = None,
) -> Lidar:
    """Adds a LiDAR to a diagram and publishes its scans on LCM.

    The messages are `lcmt_point_cloud` on the channel
    `DRAKE_POINT_CLOUD_<name>`, one per revolution, with points expressed in the
    world. Meldis shows them. The field `rgb` contains the intensities as greys,
    as in the port `point_cloud_W` of a `Lidar`.

    Args:
        config: description of the LiDAR.
        builder: builder of the diagram, with plant and SceneGraph.
        plant: finalized plant; by default the system named `plant`.
        scene_graph: SceneGraph to scan; by default the system named
            `scene_graph`.
        lcm_buses: the available buses; `config.lcm_bus` names one of them.
        lcm: interface to publish on, instead of a bus. If both `lcm_buses` and
            `lcm` are None, an interface to the default URL is added.

    Returns:
        The LiDAR system that was added.

    Raises:
        RuntimeError: there is no such plant, SceneGraph, frame or bus, or the
            plant is not finalized.
        ValueError: a field of the config is out of range.

    Example:
        from cns_drake import ApplyLidarConfig, LidarConfig

        ApplyLidarConfig(LidarConfig(name="roof", rate=10), builder)
    """
    config.ValidateOrThrow()
    section = config._section()
    period = revolution_at_rate(section.sheet, config.rate, section.columns)
    interface = _find_interface(config, builder, lcm_buses, lcm)
    scene_graph = scene_graph or builder.GetSubsystemByName("scene_graph")
    plant = plant or builder.GetSubsystemByName("plant")
    with _errors_of(config):
        lidar = add_lidar(
            builder,
            scene_graph,
            *_carrier_frame(config, builder, plant),
            name=config.name,
            **make_lidar_model(
                section, config.name, config.seed, period=period
            )._asdict(),
            motion_distortion=section.motion_distortion,
            causal=config.causal,
            rate=config.rate,
            capture_offset=config.capture_offset,
            output_delay=config.output_delay,
            role=_ROLES[config.role],
            unseen=_unseen(config, plant, scene_graph),
            num_threads=config.num_threads,
        )
    offset = 0.0
    if lidar.samples is not None:
        period, offset = lidar.samples.output_events()
    _publish_measurements(
        config,
        builder,
        interface,
        [lidar.point_cloud_W_output_port(), lidar.scan_time_output_port()],
        _ScanToLcm(),
        period=period,
        offset=offset,
    )
    return lidar


def ApplyImuConfig(
    config: ImuConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: _Interface | None = None,
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
    config.ValidateOrThrow()
    section, rate = config._section(), config.sample_rate()
    interface = _find_interface(config, builder, lcm_buses, lcm)
    with _errors_of(config):
        imu = add_imu(
            builder,
            *_carrier_frame(config, builder, plant),
            rate=rate,
            noise=None if section.is_ideal else section.noise(config.seed),
            name=config.name,
        )
    measured = imu.ports()
    ports = list(measured.values())
    axes = [f"{name}_{axis}" for name in measured for axis in "xyz"]
    _publish_measurements(
        config,
        builder,
        interface,
        ports,
        _SignalToLcm(ports, axes, lambda *values: np.hstack(values)),
        period=1.0 / rate,
    )
    return imu


def ApplyOdometryConfig(
    config: OdometryConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: _Interface | None = None,
) -> odometry.OdometrySensor:
    """Adds exact odometry of a frame B to a diagram, published on LCM.

    The messages are `lcmt_drake_signal` on the channel `DRAKE_ODOMETRY_<name>`:
    the quaternion of R_WB (w first), p_WB [m], then angular and linear velocity
    in the world, expressed in B [rad/s, m/s].

    Args:
        config: description of the odometry.
        scene_graph: ignored, so that the function has the arguments of Drake's
            `ApplyCameraConfig`.

    The other arguments are those of `ApplyLidarConfig`.

    Raises:
        RuntimeError: there is no such plant, frame or bus, or the plant is not
            finalized.

    Example:
        from cns_drake import ApplyOdometryConfig, OdometryConfig

        ApplyOdometryConfig(OdometryConfig(rate=100), builder)
    """
    config.ValidateOrThrow()
    interface = _find_interface(config, builder, lcm_buses, lcm)
    with _errors_of(config):
        frame, X_PB = _carrier_frame(config, builder, plant)
        sensor = odometry.add_odometry(
            builder, frame, X_PB=X_PB, name=config.name
        )
    axes = ["qw", "qx", "qy", "qz", "x", "y", "z"]
    axes += ["wx", "wy", "wz", "vx", "vy", "vz"]
    ports = [sensor.GetOutputPort("odometry")]
    _publish_measurements(
        config,
        builder,
        interface,
        ports,
        _SignalToLcm(ports, axes, _odometry_numbers),
        period=1.0 / config.message_rate(),
    )
    return sensor


def _given(config: PublishedSensor, kind: type[Section]) -> dict[str, Any]:
    """Returns the values of a config for the fields of a scenario's section."""
    names = kind.model_fields.keys() - _LEFT_OUT
    return {name: getattr(config, name) for name in names}


_Section = TypeVar("_Section", bound=Section)


def _checked(given: dict[str, Any], kind: type[_Section]) -> _Section:
    """Returns the section of a scenario with some values.

    Raises:
        ValueError: a field is out of range.
    """
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        # The text begins with the source, which the caller names.
        text = describe_validation_error("", error, kind)
        raise ValueError(text.removeprefix(": ")) from None


def _unseen(
    config: LidarConfig, plant: MultibodyPlant, scene_graph: SceneGraph
) -> list[Frame | GeometryId] | None:
    """Returns what a LiDAR does not see; None for its own body.

    Raises:
        ValueError: nothing has one of the names.
    """
    if config.unseen is None:
        return None
    inspector = scene_graph.model_inspector()
    geometries: dict[str, list[GeometryId]] = {}
    for geometry_id in inspector.GetAllGeometryIds(_ROLES[config.role]):
        name = inspector.GetName(geometry_id)
        geometries.setdefault(name, []).append(geometry_id)
    unseen: list[Frame | GeometryId] = []
    for name in config.unseen:
        found: list[Frame | GeometryId] = [*geometries.get(name, ())]
        # Drake says of a frame that is missing or ambiguous which there are.
        try:
            found.append(GetScopedFrameByName(plant, name))
        except RuntimeError as error:
            if not found:
                raise ValueError(
                    f"unseen: no body, frame or geometry {name!r}: "
                    f"{one_line(error)}"
                ) from None
        unseen += found
    return unseen


def _carrier_frame(
    config: Config, builder: DiagramBuilder, plant: MultibodyPlant | None
) -> tuple[Frame, RigidTransform]:
    """Returns the frame P that carries a sensor, and the pose X_PB."""
    plant = plant or builder.GetSubsystemByName("plant")
    frame = plant.world_frame()
    if config.X_PB.base_frame is not None:
        frame = GetScopedFrameByName(plant, config.X_PB.base_frame)
    return frame, config.X_PB.GetDeterministicValue()


def _caller(config: PublishedSensor) -> str:
    """Returns the text with which errors of a configured sensor begin."""
    return f"{type(config).__name__} {config.name}"


def _odometry_numbers(value: odometry.Odometry) -> np.ndarray:
    """Returns the numbers (13,) of a message, see `ApplyOdometryConfig`."""
    X_WB, V_WB_B = value.X_WB, value.V_WB_B
    return np.hstack(
        [
            X_WB.rotation().ToQuaternion().wxyz(),
            X_WB.translation(),
            V_WB_B.rotational(),
            V_WB_B.translational(),
        ]
    )
