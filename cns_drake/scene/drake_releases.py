"""Handles all differences between the supported releases of Drake."""

import re
from typing import Any

from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses

from cns_drake.base.version import installed_versions


def find_bus(
    builder: DiagramBuilder, lcm_buses: LcmBuses, caller: str, bus: str
) -> Any:
    """Returns the LCM interface of a bus; replaces `LcmBuses.Find`.

    In Python with Drake 1.58, `Find` returns an unusable system: any use of
    this system crashes the process. This function takes the system from the
    builder instead.

    Raises:
        RuntimeError: there is no such bus; the message names the caller.
    """
    found = lcm_buses.Find(caller, bus)
    name = f"LcmInterfaceSystem(bus_name={bus})"
    if builder.HasSubsystemNamed(name):
        return builder.GetSubsystemByName(name)
    return found


def takes_screen_colours() -> bool:
    """Returns whether Drake's renderer reads vertex colours as sRGB.

    Up to Drake 1.53 the renderer reads them as linear colours. If Drake was not
    installed as a Python package, its version is assumed to be newer.
    """
    version = installed_versions(["drake"]).get("drake", "1.54")
    return tuple(map(int, re.findall(r"\d+", version)[:2])) >= (1, 54)
