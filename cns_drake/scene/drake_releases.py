"""Code that depends on the release of Drake."""

import re
from typing import Any

from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses

from evaluation.base import installed_versions


def find_bus(
    builder: DiagramBuilder, lcm_buses: LcmBuses, caller: str, bus: str
) -> Any:
    """Returns the LCM interface of a bus, like Drake's `LcmBuses.Find`.

    Use this function instead of `LcmBuses.Find`: in Python with Drake 1.58, any
    use of the result of `LcmBuses.Find` crashes the process.

    Args:
        builder: builder of the diagram with the interface.
        lcm_buses: the available buses.
        caller: text with which an error message begins.
        bus: name of the bus.

    Raises:
        RuntimeError: there is no such bus; the message names the caller.
    """
    found = lcm_buses.Find(caller, bus)
    name = f"LcmInterfaceSystem(bus_name={bus})"
    if builder.HasSubsystemNamed(name):
        return builder.GetSubsystemByName(name)
    # A caller of `LcmBuses.Add` may own the interface, outside the diagram.
    return found


def reads_vertex_colours_as_srgb() -> bool:
    """Returns whether Drake's renderer reads vertex colours as sRGB.

    Up to Drake 1.53, the renderer reads vertex colours as linear. If the
    version of Drake is unknown, because Drake was not installed as a Python
    package, the result is True.
    """
    version = installed_versions(["drake"]).get("drake", "1.54")
    return tuple(map(int, re.findall(r"\d+", version)[:2])) >= (1, 54)
