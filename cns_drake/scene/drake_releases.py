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

    The bindings of Drake 1.58 return an unusable system from `Find`: any use of
    it ends the process. This function takes the system from the builder.

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

    Up to Drake 1.53 it takes them for linear ones. A Drake that is not
    installed as a package counts as newer.
    """
    version = installed_versions(["drake"]).get("drake", "1.54")
    return tuple(map(int, re.findall(r"\d+", version)[:2])) >= (1, 54)
