"""Nested fields of experiments, and paths to them, such as `query.lidar`."""

from collections.abc import Mapping
from typing import Any

# Name of a field -> its value, which can be a mapping of further fields.
Changes = Mapping[str, Any]
# Sections of an experiment with fields of both drives, or of one of them.
SIDES = ("both", "database", "query")
# Field of the database with its drives, each with fields of its own.
SESSIONS = "sessions"
# Field of the database with drives that are sampled at random.
FLEET = "fleet"
# The section of each drive -> the fields that a case sets there.
Case = dict[str, dict[str, Any]]


def merged(values: Any, changes: Any) -> Any:
    """Returns settings with changes applied.

    Mappings, also nested ones, are changed field by field. All other values are
    replaced as a whole.
    """
    if not (isinstance(values, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {
        **values,
        **{n: merged(values.get(n), one) for n, one in changes.items()},
    }


def nested(path: str, value: Any) -> Any:
    """Returns nested fields that contain one value, at a path."""
    for part in reversed(path.split(".")):
        value = {part: value}
    return value


def set_field(fields: dict[str, Any], path: str, value: Any) -> None:
    """Sets the field at a path, in place: like `merged`, without a copy."""
    *above, name = path.split(".")
    for part in above:
        inner = fields.get(part)
        if not isinstance(inner, dict):
            inner = fields[part] = {}
        fields = inner
    fields[name] = merged(fields.get(name), value)
