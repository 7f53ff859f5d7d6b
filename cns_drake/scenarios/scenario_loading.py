"""Reading scenarios."""

from __future__ import annotations

import os
from pathlib import Path
import re

from pydantic import ValidationError

from cns_drake.base.errors import InputError, describe_validation_error
from cns_drake.base.map_folder import drive_name
from cns_drake.base.yaml_files import read_yaml
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scenarios.shipped import shipped_drives, shipped_maps


def make_scenario(values: dict, source: object) -> Scenario:
    """Validates a scenario.

    Args:
        values: the fields.
        source: the file or argument that errors name.

    Raises:
        InputError: a field is missing, unknown or not usable.

    Example:
        from cns_drake import load_scenario, make_scenario

        values = load_scenario("metropolis_04").model_dump(exclude_none=True)
        short = make_scenario({**values, "frames": 20}, "short")
    """
    try:
        return Scenario.model_validate(values)
    except ValidationError as error:
        raise InputError(
            describe_validation_error(source, error, Scenario)
        ) from None


def load_scenario(name_or_file: str | Path) -> Scenario:
    """Loads a shipped drive by name, or a scenario file.

    Raises:
        InputError: there is no such drive or file, or the file is not a
            usable scenario.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("metropolis_04")
    """
    shipped = shipped_drives()
    path = shipped.get(str(name_or_file), Path(name_or_file))
    # Unlike pathlib, os.path accepts names that no file can have.
    if not os.path.isfile(path):
        if re.fullmatch(r"\w+", str(name_or_file)):
            raise InputError(
                f"unknown drive '{name_or_file}'; there are: "
                f"{', '.join(shipped)}; or give a scenario file"
            )
        raise InputError(f"{path}: no such scenario file")
    scenario = read_scenario_file(path)
    check_files(scenario)
    return scenario


def read_scenario_file(path: Path) -> Scenario:
    """Reads a scenario whose map, world and waypoints may be missing.

    Raises:
        InputError: the file is not a usable scenario.
    """
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of scenario fields")
    values.setdefault("name", drive_name(path))
    for field in ("map", "world", "waypoints"):
        place = values.get(field)
        if isinstance(place, str) and place not in shipped_maps():
            # Paths are relative to the file, not to the current folder.
            try:
                values[field] = str((path.parent / place).resolve())
            except ValueError as error:
                raise InputError(f"{path}: {field}: {error}") from error
    find_files(values, path)
    scenario = make_scenario(values, path)
    scenario._file = path
    return scenario


def find_files(values: dict, path: Path) -> None:
    """Makes the paths in sections absolute.

    Args:
        values: fields of a scenario or a family, to change.
        path: the file of these fields; paths are relative to it.
    """
    for section, field in (("imu", "kalibr"), ("traffic", "fcd")):
        fields = values.get(section)
        if isinstance(fields, dict) and isinstance(fields.get(field), str):
            place = str((path.parent / fields[field]).resolve())
            values[section] = {**fields, field: place}
