"""Publication of sensors' measurements on LCM, as Drake publishes images."""

from collections.abc import Callable
from typing import TypeAlias

from drake import lcmt_drake_signal, lcmt_point_cloud
import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.lcm import DrakeLcm, DrakeLcmInterface
from pydrake.perception import PointCloudToLcm
from pydrake.systems import framework
from pydrake.systems import lcm as drake_lcm
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.lcm import LcmBuses, LcmInterfaceSystem
from pydrake.systems.primitives import ZeroOrderHold

from cns_drake.scene import find_bus
from cns_drake.sensors.system_names import check_unused_names

# An interface on which messages are published.
Interface: TypeAlias = DrakeLcmInterface | LcmInterfaceSystem
# Endings of the names of the systems that publish a sensor's messages.
_PARTS = ("to_lcm", "publisher", "delay")


def check_publisher_names(builder: DiagramBuilder, name: str) -> None:
    """Checks that a diagram has no systems that publish a sensor's messages.

    Args:
        builder: builder of the diagram.
        name: name of the sensor.

    Raises:
        ValueError: the diagram already has a system with one of the names that
            these systems have.
    """
    check_unused_names(builder, *(f"{name}_{part}" for part in _PARTS))


def find_interface(
    builder: DiagramBuilder,
    bus: str,
    lcm_buses: LcmBuses | None,
    lcm: Interface | None,
    caller: str,
) -> Interface:
    """Returns the interface on which a sensor publishes.

    Args:
        builder: builder of a diagram. If both `lcm_buses` and `lcm` are None,
            an interface to the default URL is added to the diagram.
        bus: name of the sensor's bus.
        lcm_buses: the available buses.
        lcm: the interface, instead of a bus.
        caller: text with which an error message begins.

    Raises:
        RuntimeError: there is no such bus.
    """
    if lcm is not None:
        return lcm
    if lcm_buses is not None:
        return find_bus(builder, lcm_buses, caller, bus)
    if bus != "default":
        raise RuntimeError(
            f"{caller}: lcm_bus: there is no bus '{bus}' without lcm_buses"
        )
    return builder.AddSystem(LcmInterfaceSystem(lcm=DrakeLcm()))


def publish_measurements(
    builder: DiagramBuilder,
    name: str,
    channel: str,
    ports: list[OutputPort],
    to_lcm: framework.System,
    lcm: Interface,
    *,
    period: float,
    offset: float = 0.0,
    delay: float = 0.0,
) -> None:
    """Adds systems that convert measurements to LCM messages and publish them.

    Nothing is added for the interface of a null bus, such as in `lcm_buses:
    {default: null}`. Drake's cameras behave in the same way.

    Args:
        builder: builder of a diagram with the sensor.
        name: name of the sensor.
        channel: name of the LCM channel.
        ports: output ports of the sensor.
        to_lcm: system that converts the ports' values to a message: a
            `PointCloudToLcm` or a `SignalToLcm`.
        lcm: interface on which the messages are published.
        period: time between two messages [s].
        offset: time of the first conversion [s].
        delay: time from a conversion to the publication [s].
    """
    if lcm.get_lcm_url() == LcmBuses.kLcmUrlMemqNull:
        return
    is_cloud = isinstance(to_lcm, PointCloudToLcm)
    publisher = drake_lcm.LcmPublisherSystem.Make(
        channel,
        lcmt_point_cloud if is_cloud else lcmt_drake_signal,
        lcm,
        publish_period=period,
        publish_offset=offset + delay,
        use_cpp_serializer=is_cloud,
    )
    converter_name, publisher_name, delay_name = (
        f"{name}_{part}" for part in _PARTS
    )
    builder.AddNamedSystem(converter_name, to_lcm)
    for index, port in enumerate(ports):
        builder.Connect(port, to_lcm.get_input_port(index))
    builder.AddNamedSystem(publisher_name, publisher)
    message = to_lcm.get_output_port()
    if delay:
        hold = builder.AddNamedSystem(
            delay_name, ZeroOrderHold(period, message.Allocate(), offset)
        )
        builder.Connect(message, hold.get_input_port())
        message = hold.get_output_port()
    builder.Connect(message, publisher.get_input_port())


class SignalToLcm(framework.LeafSystem):
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
