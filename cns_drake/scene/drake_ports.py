"""Input ports of Drake systems that need not be connected."""

from typing import Any

from pydrake.systems.framework import Context, InputPort


def optional_value(port: InputPort, context: Context) -> Any:
    """Returns the value of a port; None if the port is not connected."""
    return port.Eval(context) if port.HasValue(context) else None
