"""Fields of experiments: paths, factors with lists of values, and sides."""

from collections.abc import Iterable, Iterator, Mapping
import json
import math
from typing import Any

from evaluation.base import merged, repeated

# Name of a field -> its value, which can be a mapping of further fields.
Changes = Mapping[str, Any]
# Sections of an experiment with fields of both drives, or of one of them.
SIDES = ("both", "database", "query")
# Sections of an experiment, and of its cases, in which a list of values varies.
FACTORED = (*SIDES, "protocol")
# Field of the database with its drives, each with fields of its own.
SESSIONS = "sessions"
# Field of the database with drives that are sampled at random.
FLEET = "fleet"
# Field of a LiDAR with its data sheet: one value, whatever lists it contains.
_SHEET = "unit"
# The section -> the fields that a case sets there.
Case = dict[str, dict[str, Any]]


def set_field(fields: dict[str, Any], path: str, value: Any) -> None:
    """Sets the field at a path, in place: like `merged`, without a copy."""
    *above, name = path.split(".")
    for part in above:
        inner = fields.get(part)
        if not isinstance(inner, dict):
            inner = fields[part] = {}
        fields = inner
    fields[name] = merged(fields.get(name), value)


_SPREAD = {"from", "to", "count"}
_MOST_SPREAD = 10_000


def is_spread(value: object) -> bool:
    """Returns whether a value is {from, to, count}, a short form of a list."""
    return isinstance(value, Mapping) and set(value) == _SPREAD


def expand_spread(value: Any, *, whole: bool = False) -> Any:
    """Turns {from, to, count} into a list of evenly spaced numbers.

    Other values are returned unchanged. The numbers are rounded to four decimal
    places. The numbers have the type int if all numbers are whole and both ends
    are written as whole numbers.

    Args:
        value: any value of a field.
        whole: whether the numbers must be whole.

    Raises:
        ValueError: an end is no finite number, there are fewer than 2 or more
            than 10,000 numbers, or a number is not whole although `whole` is
            true.
    """
    if not is_spread(value):
        if whole and isinstance(value, Mapping) and _SPREAD & set(value):
            raise ValueError("a list needs from, to and count, nothing else")
        return value
    first, last, count = (value[name] for name in ("from", "to", "count"))
    are_numbers = all(
        isinstance(one, int | float)
        and not isinstance(one, bool)
        and math.isfinite(one)
        for one in (first, last)
    )
    if not (are_numbers and type(count) is int and 2 <= count <= _MOST_SPREAD):
        raise ValueError(
            f"from and to are numbers, count from 2 to {_MOST_SPREAD}"
        )
    if isinstance(first, int) and isinstance(last, int):
        step, rest = divmod(last - first, count - 1)
        if not rest:
            return [first + k * step for k in range(count)]
    if whole:
        raise ValueError(
            f"{count} numbers from {first} to {last} are not all whole"
        )
    width = (last - first) / (count - 1)
    return [round(first + k * width, 4) for k in range(count)]


# Fields with a list as a single value -> types of what the list contains.
_LISTS: Mapping[str, tuple[type, ...]] = {
    "without": (str,),
    "route": (dict,),
    "xyz": (int, float),
    "rpy_deg": (int, float),
    "hidden_deg": (int, float),
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
        if isinstance(value, dict) and value and name != _SHEET:
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


def _in_city(name: str) -> str:
    return f"city: {{{name}: ...}}"


def _in_protocol(name: str) -> str:
    return f"protocol: {{{name}: ...}}, outside of drives"


_EVERY_LIDAR = 'lidars: {{"*": {{{}: ...}}}}'
# Fields of drives in older releases -> what is written now.
_FORMER: Mapping[str, str] = {
    **{n: _in_city(n) for n in ("missing", "scattered", "towards", "redraw")},
    "rates": f"{_in_city('rates')} beside years",
    "viewpoint": "offset: {left: METRES, yaw_deg: DEGREES}",
    "lateral": (
        "offset: {left: METRES}, and protocol: {radius: METRES} if places are"
        " to match farther away"
    ),
    "returns": _EVERY_LIDAR.format("returns"),
    "lidar": f"{_EVERY_LIDAR.format('preset')}, or unit for a data sheet",
    **{
        n: _in_protocol(n)
        for n in ("turn_queries", "tilt_queries", "hide_sector")
    },
}
# Whose city had aged by the years of each side.
_AGED = {"database": "query", "query": "database"}


def check_words(fields: Changes, place: str) -> None:
    """Checks that no field of a drive has a name of older releases.

    Args:
        fields: the fields.
        place: the section that contains them; a drive of several has a path
            such as `database.sessions.2`.

    Raises:
        ValueError: a field has such a name; the error says what to write.
    """
    for name, value in fields.items():
        path = f"{place}.{name}"
        if name == SESSIONS and isinstance(value, list):
            for number, one in enumerate(value, start=1):
                for own in one if isinstance(one, list) else [one]:
                    if isinstance(own, Mapping):
                        check_words(own, f"{path}.{number}")
        if name == "years":
            side = place.rpartition(".")[2]
            if side in _AGED:
                raise ValueError(
                    f"{path}: the city of the {_AGED[side]} aged by them; write"
                    f" {_AGED[side]}: {{{_in_city(name)}}}"
                )
            raise ValueError(
                f"{path}: write {_in_city(name)}, the years by which the city"
                " of this drive has aged (query: {city: {years: ...}} is"
                " newest)"
            )
        if name in _FORMER:
            raise ValueError(f"{path}: write {_FORMER[name]}")
