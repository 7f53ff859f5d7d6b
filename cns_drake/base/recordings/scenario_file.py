"""The scenario file beside an exported drive."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import re

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.base.yaml_files import parse_yaml

# A drive's name also names files.
_NAME = re.compile(r"\w[\w.-]*")


def read_scenario(folder: Path) -> Mapping | None:
    """Returns the content of an exported drive's `scenario.yaml`, if any.

    Raises:
        InputError: if it is not a mapping in YAML.
    """
    path = folder / "scenario.yaml"
    if not path.is_file():
        return None
    try:
        scenario = parse_yaml(read_bytes(path))
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    if not isinstance(scenario, dict):
        raise InputError(f"{path}: not a mapping of a scenario's fields")
    name = scenario.get("name")
    if name is not None and not _NAME.fullmatch(str(name)):
        raise InputError(f"{path}: name: {name!r} is no name of a drive")
    return scenario
