"""The types of the fields of dataclasses that a user fills from Python."""

from collections.abc import Iterable
import dataclasses
import numbers
import os
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from evaluation.base.errors import check_type

# Type of a field -> the types of a value that becomes it, and what they are.
_TAKEN: dict[type, tuple[Any, str]] = {
    bool: (bool, "not true or false"),
    float: (numbers.Real, "not a number"),
    int: (numbers.Real, "not a whole number"),
    str: (str | os.PathLike, "not a text"),
}


def types_of_fields(struct: type) -> dict[str, Any]:
    """Returns the types of a dataclass's fields by name, without limits."""
    hints = get_type_hints(struct)
    return {one.name: hints[one.name] for one in dataclasses.fields(struct)}


def check_fields(struct: Any) -> None:
    """Checks a new dataclass, whose fields then have the types they declare.

    Raises:
        TypeError: a value is of another type; the message names the field.
        ValueError: see `of_type`.
    """
    for name, kind in types_of_fields(type(struct)).items():
        value = of_type(getattr(struct, name), kind, name)
        object.__setattr__(struct, name, value)


def of_type(value: Any, kind: Any, name: str) -> Any:
    """Returns a value as the type of a field.

    NumPy's numbers are numbers, True and "1" are not.

    Args:
        value: the value.
        kind: `bool`, `int`, `float`, `str` or a class; or the type of a tuple
            or list of these, or of either such a type or None.
        name: name of the field, with which the message begins.

    Raises:
        TypeError: the value is of another type.
        ValueError: a number is not whole, or a tuple has another length.
    """
    shown = " ".join(repr(value).split())
    if get_origin(kind) in (UnionType, Union):
        kinds = get_args(kind)
        if value is None and NoneType in kinds:
            return None
        kind = kinds[0]
    sequence = get_origin(kind)
    if sequence in (list, tuple):
        one, *rest = get_args(kind)
        count = 1 + len(rest)
        if isinstance(value, str | bytes) or not isinstance(value, Iterable):
            raise TypeError(f"{name}: {shown} is no {sequence.__name__}")
        taken = sequence(of_type(item, one, name) for item in value)
        if rest not in ([], [...]) and len(taken) != count:
            raise ValueError(f"{name}: {shown} is not of length {count}")
        return taken
    if kind not in _TAKEN:
        check_type(name, value, kind)
        return value
    types, what = _TAKEN[kind]
    fault = f"{name}: {shown} is {what}"
    if not isinstance(value, types) or (
        isinstance(value, bool) and kind is not bool
    ):
        raise TypeError(fault)
    if kind is int and value % 1 != 0:
        raise ValueError(fault)
    return os.fspath(value) if kind is str else kind(value)
