"""Sensors configured in YAML, in the same way as Drake's cameras.

Each kind of sensor has a config class that `pydrake.common.yaml` reads and
writes, and a function beside it that adds the configured sensor to a diagram
and publishes its measurements on LCM. The sections of scenarios define which
values the fields can have.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import copy
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar

from drake import lcmt_drake_signal, lcmt_point_cloud
import numpy as np
from pydantic import ValidationError
from pydrake.common.schema import Transform
from pydrake.common.value import AbstractValue, Value
from pydrake.common.yaml import yaml_dump_typed
from pydrake.lcm import DrakeLcm, DrakeLcmInterface
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems import framework
from pydrake.systems import lcm as drake_lcm
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.lcm import LcmBuses, LcmInterfaceSystem

from cns_drake.scene import find_bus, shortly_before, starts_late
from cns_drake.sensors.carriers import check_unused_names
from evaluation.base import (
    Section,
    describe_validation_error,
    is_number,
    no_such,
    of_type,
    types_of_fields,
)

# Messages per second of an IMU or odometry that names no rate.
USUAL_RATE = 20
# Fields of a section that a config does not have, as `X_PB` replaces the mount
# and only recordings have a layout, or that differ from the config's.
_LEFT_OUT = ("xyz", "rpy_deg", "layout", "rate")
_NUMBERS = (float, int, float | None, int | None)
_Struct = TypeVar("_Struct")


def names_of_fields_in_errors(struct: type[_Struct]) -> type[_Struct]:
    """Makes Drake's reader of YAML leave wrong scalars to a config's class.

    The reader sets attributes of a new config. It refuses `rate: fast` without
    the name of the field; but it sets any scalar where the type of a field
    admits any, and the class then names the field.
    """
    fields: dict[str, Any] = struct.__dataclass_fields__  # type: ignore[attr-defined]  # A dataclass.
    # Without the limits, which a section of a scenario checks.
    for name, kind in types_of_fields(struct).items():
        # A copy: base classes share the field.
        fields[name] = copy.copy(fields[name])
        fields[name].type = kind | bool | float | int | str
    return struct


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

    def __setattr__(self, name: str, value: Any) -> None:
        """Sets a field, of which a wrong type is refused by name.

        Arguments of the constructor are taken as they are. A text that is set
        later, as Drake's reader does, may spell a number or a bool: PyYAML
        takes `1e-3` for a text.

        Raises:
            AttributeError: there is no such field.
            TypeError: the value is of another type.
        """
        kinds, struct = types_of_fields(type(self)), type(self).__name__
        if name not in kinds:
            raise AttributeError(f"{struct}: {no_such('field', name, kinds)}")
        kind = kinds[name]
        if name in vars(self) and isinstance(value, str):
            if kind is bool:
                value = {"true": True, "false": False}.get(value, value)
            elif kind in _NUMBERS and is_number(value):
                value = float(value)
        value = of_type(value, kind, f"{struct}.{name}")
        object.__setattr__(self, name, value)

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
        with errors_of(self):
            if not self.name:
                raise ValueError("name: it is empty")
            X_PB = self.X_PB.GetDeterministicValue()
            if not np.isfinite(X_PB.GetAsMatrix34()).all():
                raise ValueError("X_PB: not finite")
            self._validate()

    def _validate(self) -> None:
        """Checks the fields that only this kind of sensor has."""


_Section = TypeVar("_Section", bound=Section)
# An interface on which messages are published.
Interface: TypeAlias = DrakeLcmInterface | LcmInterfaceSystem
# Ending of the name of the system that publishes a sensor's messages.
_PUBLISHER = "publisher"


@contextmanager
def errors_of(config: PublishedSensor) -> Iterator[None]:
    """Names a configured sensor in the errors of its values."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{_caller(config)}: {error}") from None


def find_interface(
    config: PublishedSensor,
    builder: DiagramBuilder,
    lcm_buses: LcmBuses | None,
    lcm: Interface | None,
) -> Interface | None:
    """Returns the interface on which a configured sensor publishes.

    Returns:
        The interface; None for one to the default URL, which is still to be
        added to the diagram.

    Raises:
        RuntimeError: there is no such bus.
        ValueError: the diagram already has a system with the name of one that
            publishes the sensor's messages.
    """
    check_unused_names(builder, f"{config.name}_{_PUBLISHER}")
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


def publish_measurements(
    config: PublishedSensor,
    kind: str,
    builder: DiagramBuilder,
    lcm: Interface | None,
    ports: list[OutputPort],
    make_message: Callable[..., AbstractValue | None],
    *,
    period: float,
    offset: float = 0.0,
    is_cloud: bool = False,
) -> None:
    """Adds a system that publishes measurements as LCM messages.

    Nothing is added for the interface of a null bus, such as in `lcm_buses:
    {default: null}`. Drake's cameras behave in the same way.

    Args:
        config: description of the sensor.
        kind: kind of the sensor in the name of the channel.
        builder: builder of a diagram with the sensor.
        lcm: what `find_interface` returned.
        ports: output ports of the sensor.
        make_message: function that returns a message, given the time [s] and
            the values of the ports; None if there is nothing to publish.
        period: time between two messages [s].
        offset: time of the first message [s].
        is_cloud: whether messages are `lcmt_point_cloud`, and not
            `lcmt_drake_signal`.
    """
    if lcm is None:
        lcm = builder.AddSystem(LcmInterfaceSystem(lcm=DrakeLcm()))
    if lcm.get_lcm_url() == LcmBuses.kLcmUrlMemqNull:
        return
    publisher = drake_lcm.LcmPublisherSystem.Make(
        channel=f"DRAKE_{kind}_{config.name}",
        lcm_type=lcmt_point_cloud if is_cloud else lcmt_drake_signal,
        lcm=lcm,
        publish_triggers={framework.TriggerType.kForced},
        use_cpp_serializer=is_cloud,
    )
    system = builder.AddNamedSystem(
        f"{config.name}_{_PUBLISHER}",
        _Publisher(ports, make_message, publisher, period, offset),
    )
    for index, port in enumerate(ports):
        builder.Connect(port, system.get_input_port(index))


class _Publisher(framework.LeafSystem):
    """Publishes a message in each period, also at the start of a simulation.

    An LcmPublisherSystem would leave out the message of a start that is not at
    time zero, as its event comes shortly before.
    """

    def __init__(
        self,
        ports: list[OutputPort],
        make_message: Callable[..., AbstractValue | None],
        publisher: drake_lcm.LcmPublisherSystem,
        period: float,
        offset: float,
    ):
        """Declares an input for each port, and the events."""
        super().__init__()
        self._make_message = make_message
        self._publisher = publisher
        for index, port in enumerate(ports):
            if port.get_data_type() == framework.PortDataType.kVectorValued:
                self.DeclareVectorInputPort(f"u{index}", port.size())
            else:
                self.DeclareAbstractInputPort(f"u{index}", port.Allocate())
        # With the state of a plant's step, and the scan, of this time.
        self.DeclarePeriodicPublishEvent(
            shortly_before(period), shortly_before(offset), self._publish
        )

        def start(context: Context) -> None:
            if starts_late(context.get_time(), period, offset):
                self._publish(context)

        self.DeclareInitializationPublishEvent(start)

    def _publish(self, context: Context) -> None:
        values = [
            self.get_input_port(index).Eval(context)
            for index in range(self.num_input_ports())
        ]
        message = self._make_message(context.get_time(), *values)
        if message is None:
            return
        own = self._publisher.CreateDefaultContext()
        own.SetTime(context.get_time())
        self._publisher.get_input_port().FixValue(own, message)
        self._publisher.ForcedPublish(own)


def make_signal(
    time: float, names: list[str], numbers: np.ndarray
) -> AbstractValue:
    """Returns an `lcmt_drake_signal`, whose time stamp is in milliseconds."""
    message = lcmt_drake_signal()
    message.val = numbers.tolist()
    message.dim = len(message.val)
    message.coord = names
    message.timestamp = round(time * 1e3)
    return Value(message)


def section_of(
    config: PublishedSensor, kind: type[_Section], **changes: Any
) -> _Section:
    """Returns the section of a scenario with the fields of a config.

    Raises:
        ValueError: a field is out of range.
    """
    names = kind.model_fields.keys() - _LEFT_OUT
    given = {name: getattr(config, name) for name in names}
    try:
        return kind.model_validate(given | changes)
    except ValidationError as error:
        # The text begins with the source, which the caller names.
        text = describe_validation_error("", error, kind)
        raise ValueError(text.removeprefix(": ")) from None


def carrier_frame(
    config: PublishedSensor,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None,
) -> tuple[Frame, RigidTransform]:
    """Returns the frame P that carries a sensor, and the pose X_PB."""
    plant = plant or builder.GetSubsystemByName("plant")
    frame = plant.world_frame()
    if config.X_PB.base_frame is not None:
        frame = GetScopedFrameByName(plant, config.X_PB.base_frame)
    return frame, config.X_PB.GetDeterministicValue()


def _caller(config: PublishedSensor) -> str:
    """Returns the text with which errors of a configured sensor begin."""
    return f"{type(config).__name__} {config.name}".rstrip()
