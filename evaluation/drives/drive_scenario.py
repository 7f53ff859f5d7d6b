"""The scenario of a recorded drive: its file, and the path it describes."""

from collections.abc import Mapping
from pathlib import Path
import re

from evaluation.base import (
    InputError,
    errors_at,
    is_there,
    read_yaml,
    value_errors,
)
from evaluation.lidar_sheets import (
    MOST_RINGS,
    check_one_unit,
    check_preset,
    make_sheet,
    read_sheet,
)

# Name of the file with the scenario, in the folder of an exported drive.
SCENARIO = "scenario.yaml"
# Fields of a scenario that give the vehicle's path.
_PATH_FIELDS = ("route", "waypoints")
# Fields that shift the vehicle to the side of its path, or turn the vehicle
# round.
_SHIFT_FIELDS = ("aside", "u_turns")
# Pattern of a drive's name, which is also a part of file names.
_NAME = re.compile(r"\w[\w.-]*")


def driven_way(scenario: Mapping | None) -> dict | None:
    """Returns the fields of a scenario that determine the vehicle's path.

    Two drives for which these fields are equal follow the same path. The drives
    may differ in their surroundings and their sensors.

    Args:
        scenario: the fields of a scenario; None if a drive has no scenario.

    Returns:
        Field -> value, without fields that are empty or zero. None if there is
        no scenario, or if the scenario has neither a route nor waypoints.
    """
    if scenario is None or not any(scenario.get(name) for name in _PATH_FIELDS):
        return None
    return {
        name: scenario[name]
        for name in _PATH_FIELDS + _SHIFT_FIELDS
        if scenario.get(name)
    }


def read_scenario(folder: Path) -> Mapping | None:
    """Returns the content of `scenario.yaml` in an exported drive's folder.

    The result is None if there is no such file. A LiDAR's field `unit` that
    names a data sheet is replaced by the fields of the data sheet.

    Raises:
        InputError: the file is not a mapping in YAML, its field `name` is not a
            valid name of a drive, `columns` is no number of columns, or the
            data sheet or the number of rings of a LiDAR cannot be used.
    """
    path = folder / SCENARIO
    if not is_there(path):
        return None
    scenario = read_yaml(path)
    if not isinstance(scenario, dict):
        raise InputError(f"{path}: not a mapping of a scenario's fields")
    name = scenario.get("name")
    if name is not None and not _NAME.fullmatch(str(name)):
        raise InputError(f"{path}: name: {name!r} is no name of a drive")
    columns = scenario.get("columns")
    if columns is not None and (type(columns) is not int or columns < 3):
        raise InputError(
            f"{path}: columns: {columns!r} is no whole number from 3 on"
        )
    lidars = scenario.get("lidars") or {}
    if not isinstance(lidars, dict):
        raise InputError(f"{path}: lidars: not a mapping of names to fields")
    for name, section in lidars.items():
        if not isinstance(section, dict):
            continue
        with errors_at(f"{path}: lidars.{name}"):
            if (preset := section.get("preset")) is not None:
                with value_errors("preset"):
                    check_preset(str(preset))
            rings = section.get("rings")
            if rings is not None and (
                type(rings) is not int or not 2 <= rings <= MOST_RINGS
            ):
                raise InputError(
                    f"rings: {rings!r} is no whole number from 2 to "
                    f"{MOST_RINGS}"
                )
            if section.get("unit") is None:
                continue
            unit = section["unit"]
            with value_errors("unit"):
                check_one_unit(section.get("preset"), unit)
            if isinstance(unit, str):
                sheet = read_sheet(folder / unit)
            else:
                sheet = make_sheet(unit, "unit")
        section["unit"] = sheet.to_fields()
    return scenario
