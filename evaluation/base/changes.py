"""Changes of nested fields, such as `query.weather.rain=20`."""

from collections.abc import Iterable, Mapping
import re
from typing import Any

from evaluation.base.errors import InputError, value_errors
from evaluation.base.yaml_files import parse_yaml


def parse_changes(texts: Iterable[str]) -> dict[str, Any]:
    """Returns texts `FIELD=VALUE` of the option --set as nested fields.

    Dots separate nested fields, and VALUE is YAML. A number with a leading
    zero, such as 01, is the name of a stage, and stays a text.

    Raises:
        InputError: a text has another form, or VALUE is not YAML.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise InputError(f"--set: {text!r} is not FIELD=VALUE")
        with value_errors(f"--set: {name}"):
            is_name = re.fullmatch(r"0\d+", value)
            parsed = value if is_name else parse_yaml(value)
        changes = merged(changes, nested(name, parsed))
    return changes


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
