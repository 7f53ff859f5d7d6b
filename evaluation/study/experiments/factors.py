"""Factors: the fields of an experiment that have a list of values."""

from collections.abc import Iterable, Iterator, Mapping
import json
from typing import Any

from cns_drake.base import repeated
from evaluation.study.experiments.nested_fields import (
    SESSIONS,
    Changes,
)
from evaluation.study.experiments.spread_values import (
    expand_spread,
    is_spread,
)

# Fields with a list as a single value -> types of what the list contains.
_LISTS: Mapping[str, tuple[type, ...]] = {
    "viewpoint": (int, float),
    "without": (str,),
    "route": (dict,),
    "xyz": (int, float),
    "rpy_deg": (int, float),
}


class FactorValues(list):
    """The values of a factor; a list of another type is a single value."""


def split_values(
    fields: Changes, above: tuple[str, ...]
) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Returns fixed fields' values, and factors' lists of values, both by path.

    Args:
        fields: nested fields.
        above: names of the fields that contain these, for their paths.

    Raises:
        ValueError: a path, or a value of a factor, occurs twice; or a field is
            wrong, see `leaves`.
    """
    single: dict[str, Any] = {}
    varied: dict[str, list[Any]] = {}
    for path, value in leaves(fields, above):
        if path in single or path in varied:
            raise ValueError(f"{path}: it is there twice")
        if isinstance(value, FactorValues):
            try:
                check_once(value)
                # Nor may two values have one cell in a table.
                check_once(str(table_value(one)) for one in value)
            except ValueError as error:
                raise ValueError(f"{path}: {error}") from None
            varied[path] = list(value)
        else:
            single[path] = value
    return single, varied


def leaves(
    fields: Mapping[Any, Any], above: tuple[str, ...]
) -> Iterator[tuple[str, Any]]:
    """Yields path and value of each nested field that contains no other field.

    The value of a factor has the type `FactorValues`.

    Args:
        fields: nested fields.
        above: names of the fields that contain these, for their paths.

    Raises:
        ValueError: a factor has no values, or a number is not finite.
    """
    for name, value in fields.items():
        place = (*above, str(name))
        path = ".".join(place)
        if is_spread(value):
            try:
                yield path, FactorValues(expand_spread(value))
            except ValueError as error:
                raise ValueError(f"{path}: {error}") from None
            continue
        if name == SESSIONS and _is_list_of(dict, value):
            # Each drive's fields can be factors, named by its number.
            value = {str(k): one for k, one in enumerate(value, start=1)}
        if isinstance(value, dict) and value:
            yield from leaves(value, place)
            continue
        try:
            json.dumps(value, allow_nan=False, default=str)
        except ValueError:
            raise ValueError(f"{path}: {value} is not finite") from None
        if isinstance(value, list) and not _is_single(name, value):
            if not value:
                raise ValueError(f"{path}: a list without a value")
            yield path, FactorValues(value)
        else:
            yield path, value


def _is_single(name: str, value: list[Any]) -> bool:
    """Returns whether a list is a single value of the field `name`."""
    if name == SESSIONS and _is_list_of(str, value):
        return True  # Recordings.
    kinds = _LISTS.get(name)
    return kinds is not None and all(isinstance(v, kinds) for v in value)


def _is_list_of(kind: type, value: Any) -> bool:
    """Returns whether a value is a list, not empty, of members of one type."""
    return (
        isinstance(value, list)
        and len(value) > 0
        and all(isinstance(one, kind) for one in value)
    )


def table_value(value: Any) -> Any:
    """Returns a factor's value as a table contains it: a number or text."""
    if value is None:
        return "none"
    if isinstance(value, dict | list):
        text = json.dumps(value, separators=(",", ": ")).replace('"', "")
        return text.strip("{}") or "none"
    return value


def check_once(values: Iterable[object]) -> None:
    """Checks that all values differ.

    Raises:
        ValueError: a value occurs twice.
    """
    for value in repeated(values):
        raise ValueError(f"{value!r} is there twice")
