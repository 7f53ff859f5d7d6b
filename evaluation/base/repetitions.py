"""Values that a list contains more than once."""

from collections.abc import Hashable, Iterable
import json
from typing import TypeVar

_T = TypeVar("_T")


def repeated(values: Iterable[_T]) -> list[_T]:
    """Returns each value that equals an earlier one, in order."""
    seen: dict[Hashable, _T] = {}
    found = []
    for value in values:
        key: Hashable = value
        if isinstance(value, dict | list):
            key = json.dumps(value, sort_keys=True, default=str)
        if key in seen:
            found.append(seen[key])
        seen.setdefault(key, value)
    return found
