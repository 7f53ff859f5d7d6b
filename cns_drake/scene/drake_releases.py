"""What differs between the supported releases of Drake, in one place."""

import re
from typing import Any

from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses

from cns_drake.base.version import installed_versions


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


def takes_screen_colours() -> bool:
    """Returns whether the renderer takes colours of vertices for a screen's.

    Up to 1.53 it takes them for linear. A Drake that is no package is newer.
    """
    version = installed_versions(["drake"]).get("drake", "1.54")
    return tuple(map(int, re.findall(r"\d+", version)[:2])) >= (1, 54)
