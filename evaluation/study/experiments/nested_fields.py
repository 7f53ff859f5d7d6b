"""Nested fields of experiments, and paths to them, such as `query.lidar`."""

from collections.abc import Mapping
from typing import Any

from cns_drake.base import merged

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


def set_field(fields: dict[str, Any], path: str, value: Any) -> None:
    """Sets the field at a path, in place: like `merged`, without a copy."""
    *above, name = path.split(".")
    for part in above:
        inner = fields.get(part)
        if not isinstance(inner, dict):
            inner = fields[part] = {}
        fields = inner
    fields[name] = merged(fields.get(name), value)
