"""What differs between the supported releases of Drake, in one place."""

from typing import Any

from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses


def find_bus(
    builder: DiagramBuilder, lcm_buses: LcmBuses, caller: str, bus: str
) -> Any:
    """Returns the interface of an LCM bus, as `LcmBuses.Find` does.

    The bindings of 1.58 return an unusable system there: whatever uses it ends
    the process. The builder has the system itself.

    Raises:
        RuntimeError: there is no such bus; the caller is named.
    """
    found = lcm_buses.Find(caller, bus)
    name = f"LcmInterfaceSystem(bus_name={bus})"
    if builder.HasSubsystemNamed(name):
        return builder.GetSubsystemByName(name)
    return found
