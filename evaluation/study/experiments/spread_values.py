"""Evenly spaced values, which experiments write as {from, to, count}."""

from collections.abc import Mapping
import math
from typing import Any

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
