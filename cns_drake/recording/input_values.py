"""Values of a recorder's input ports."""

from __future__ import annotations

from typing import Any

from pydrake.common.value import Value
from pydrake.systems.framework import Context, InputPort, LeafSystem


def declare_object(system: LeafSystem, name: str) -> InputPort:
    """Declares an abstract port that takes any Python object."""
    return system.DeclareAbstractInputPort(name, Value(object()))


def value_of(port: InputPort, context: Context) -> Any:
    """Returns the value of a port; None if it is not connected."""
    return port.Eval(context) if port.HasValue(context) else None
