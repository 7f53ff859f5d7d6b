"""The files that a scenario names."""

from __future__ import annotations

import os
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.imu_making import KALIBR_FILE, imu_rate
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.shipped import shipped_maps


def map_folder(scenario: Scenario) -> MapFolder:
    """Returns the folder of a scenario's map.

    For a scenario of a world it is the folder of the world's file.
    """
    if scenario.world is not None:
        return MapFolder(Path(scenario.world).parent)
    assert scenario.map is not None  # One of both is given.
    return MapFolder(shipped_maps().get(scenario.map, Path(scenario.map)))


def world_file(scenario: Scenario) -> Path:
    """Returns the SDF file of a scenario's stage, or its world itself."""
    if scenario.world is not None:
        return Path(scenario.world)
    return map_folder(scenario).stage(str(scenario.stage))


def check_files(scenario: Scenario, source: object = None) -> None:
    """Checks that the map and its stage, or the other files, exist.

    With traffic the map needs roads.

    Args:
        scenario: it names the files.
        source: the file at the beginning of errors; by default the scenario's.

    Raises:
        InputError: one of them does not exist.
    """
    source = source or scenario.source
    for field in ("world", "waypoints"):
        file = getattr(scenario, field)
        if file is not None and not os.path.isfile(file):
            raise InputError(f"{source}: {field}: {file}: no such file")
    if scenario.imu.kalibr is not None:
        if not os.path.isfile(scenario.imu.kalibr):
            raise InputError(
                f"{source}: imu.kalibr: {scenario.imu.kalibr}: no such file"
            )
        imu_rate(scenario)
    fcd = scenario.traffic.fcd
    if fcd is not None and not os.path.isfile(fcd):
        raise InputError(f"{source}: traffic.fcd: {fcd}: no such file")
    has_traffic = not scenario.traffic.is_off
    if scenario.map is None:
        if has_traffic:
            raise InputError(
                f"{source}: traffic: a world has no roads; give a map with some"
            )
        return
    folder = map_folder(scenario)
    if not os.path.isdir(folder.path):
        known = ", ".join(shipped_maps())
        raise InputError(
            f"{source}: map: '{scenario.map}' is neither a shipped map "
            f"({known}) nor a folder"
        )
    if not os.path.isfile(world_file(scenario)):
        stages = ", ".join(folder.stages()) or "none"
        raise InputError(
            f"{source}: stage: map '{scenario.map}' has no stage "
            f"'{scenario.stage}'; it has: {stages}"
        )
    if has_traffic and not (folder.roads.is_file() or folder.lanes.is_file()):
        raise InputError(
            f"{source}: traffic: the map has no roads: neither "
            f"{folder.roads.name} nor {folder.lanes.name} in {folder.path}"
        )


def describe_scenario(scenario: Scenario, folder: Path | None = None) -> dict:
    """Returns the fields of a scenario that are given, ready for JSON.

    The folders of map, world and waypoints are no part of the drive; their
    content has a digest (see `provenance`). The noise of an IMU is in a file of
    a fixed name beside the scenario.

    Args:
        scenario: the scenario to describe.
        folder: paths of files are relative to it; without it, they are file
            names only.
    """
    values = scenario.model_dump(mode="json", exclude_none=True)
    for field in ("map", "world", "waypoints"):
        place = values.get(field)
        if place is None or place in shipped_maps():
            continue
        values[field] = Path(place).name
        if folder is not None:
            values[field] = os.path.relpath(place, folder.resolve())
    if scenario.imu.kalibr is not None:
        values["imu"]["kalibr"] = KALIBR_FILE
    fcd = scenario.traffic.fcd
    if fcd is not None:
        values["traffic"]["fcd"] = Path(fcd).name
        if folder is not None:
            place = os.path.relpath(fcd, folder.resolve())
            values["traffic"]["fcd"] = place
    return values
