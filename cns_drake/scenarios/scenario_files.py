"""Scenario files, and the files that a scenario names."""

from collections.abc import Collection, Iterable, Iterator, Sequence
import os
from pathlib import Path
import re

import yaml

from cns_drake.scenarios.scenario import SUMO_INSTEAD, Scenario
from cns_drake.sensors import KALIBR_FILE
from evaluation.base import InputError as InputError
from evaluation.base import (
    check_writable,
    did_you_mean,
    listed,
    make_folder,
    parse_changes,
    read_bytes,
    read_yaml,
    validated,
    value_errors,
    write_text,
)


def make_scenario(values: dict, source: object) -> Scenario:
    """Returns a scenario made from its fields, after checking them.

    Raises:
        InputError: a field is missing, unknown or not usable.

    Example:
        from cns_drake import load_scenario, make_scenario

        values = load_scenario("metropolis_04").model_dump(exclude_none=True)
        short = make_scenario({**values, "frames": 20}, "short")
    """
    return validated(Scenario, values, source)


def load_scenario(name_or_file: str | Path) -> Scenario:
    """Returns the scenario of a shipped drive, or the scenario in a file.

    Raises:
        InputError: there is no such drive or file, or the file is not a
            usable scenario.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("metropolis_04")
    """
    path = _shipped_drive(name_or_file) or Path(name_or_file)
    # Unlike pathlib, os.path accepts names that no file can have.
    if not os.path.isfile(path):
        from worlds.maps import shipped_drives, shipped_maps

        shipped = shipped_drives()
        folder = shipped_maps().get(str(name_or_file), path)
        if os.path.isdir(folder):
            raise InputError(_not_a_drive(name_or_file, folder))
        if re.fullmatch(r"\w+", str(name_or_file)):
            raise InputError(
                f"unknown drive '{name_or_file}'; there are: "
                f"{', '.join(shipped)}; or give a scenario file"
                f"{did_you_mean(name_or_file, shipped)}"
            )
        raise InputError(f"{path}: no such scenario file")
    scenario = read_scenario_file(path)
    check_files(scenario)
    return scenario


def _shipped_drive(name: object) -> Path | None:
    """Returns the file of the shipped drive with a name, if there is one."""
    if not _is_name(name):
        return None
    from worlds.maps import shipped_drives

    return shipped_drives().get(str(name))


def _is_shipped_map(place: str) -> bool:
    if not _is_name(place):
        return False
    from worlds.maps import shipped_maps

    return place in shipped_maps()


def _is_name(place: object) -> bool:
    """Returns whether a shipped drive or map can have such a name."""
    return re.fullmatch(r"\w+", str(place)) is not None


def _not_a_drive(given: str | Path, folder: Path) -> str:
    """Returns the error for a folder that was given in place of a drive."""
    from worlds.maps import MapFolder, drive_name, shipped_drives

    files = MapFolder(folder).drives()
    if not files:
        return f"{given}: a folder without a drive (sequence_NN.yaml)"
    names = [
        drive_name(file)
        if shipped_drives().get(drive_name(file)) == file
        else str(Path(given) / file.name)
        for file in files
    ]
    return f"{given}: a map; use one of its drives: {', '.join(names)}"


def read_scenario_file(path: Path) -> Scenario:
    """Reads a scenario; its map, world and waypoints need not exist.

    Raises:
        InputError: the scenario in the file, or its `base`, is not usable.
    """
    files: dict[Path, dict] = {}
    file: Path | None = path
    while file is not None:
        values = files[file] = _read_fields(file)
        file = _find_base(values.pop("base", None), file, files)
    scenario = None
    for file, values in reversed(files.items()):
        if scenario is None:
            # As in a file with a base, null stands for the default.
            given = {k: one for k, one in values.items() if one is not None}
            scenario = make_scenario(given, file)
        else:
            scenario = scenario.with_fields(values, file)
        scenario._files = (file, *scenario.files)
    assert scenario is not None  # There is at least one file.
    return scenario


def _read_fields(file: Path) -> dict:
    """Returns the fields in a scenario file, with a name and absolute paths."""
    values = read_yaml(file)
    if not isinstance(values, dict):
        raise InputError(f"{file}: not a mapping of scenario fields")
    own_name = file.stem
    if own_name.startswith(("sequence_", "other_")):
        from worlds.maps import drive_name

        own_name = drive_name(file)
    name = values.setdefault("name", own_name)
    if name == own_name and not re.fullmatch(r"[A-Za-z0-9]\w*", name, re.ASCII):
        raise InputError(
            f"{file}: name: {name!r}, from its path, has more than letters,"
            " digits and underscores; give a name"
        )
    _check_own_map(values, file)
    make_paths_absolute(values, file)
    return values


def _check_own_map(values: dict, file: Path) -> None:
    """Checks that a drive in a map's folder goes through this map.

    The drives of a shipped map name it. Copied with its folder, such a drive
    would go through the shipped map, whatever was changed in the copy. A copy
    under the same name, such as a checkout of this project, is what is meant.

    Args:
        values: the fields, in which a map of the folder's name becomes `.`.
        file: the file that contains the fields.

    Raises:
        InputError: the drive goes through a shipped map, and its folder has
            another name and stages of its own.
    """
    name = values.get("map")
    if not isinstance(name, str):
        return
    from worlds.maps import MapFolder, shipped_maps

    folder = MapFolder(file.parent.resolve())
    if file.resolve() not in folder.drives():
        return
    shipped = shipped_maps().get(name)
    is_copy = shipped is not None and not shipped.samefile(folder.path)
    if not (is_copy and folder.stages()):
        return
    if name != folder.name:
        raise InputError(
            f"{file}: map: '{name}' is the shipped map, not this folder, which"
            " has stages of its own; write 'map: .'"
        )
    values["map"] = "."


def _find_base(
    base: object, path: Path, found: Collection[Path]
) -> Path | None:
    """Returns the file of a scenario's base; None if it has no base."""
    if base is None:
        return None
    # A value that is no text cannot be the name of a file.
    file = _shipped_drive(base) or path.parent / str(base)
    if not (isinstance(base, str) and os.path.isfile(file)):
        from worlds.maps import shipped_drives

        drives = shipped_drives()
        raise InputError(
            f"{path}: base: {base!r} is neither a file nor a shipped drive "
            f"({', '.join(drives)}){did_you_mean(base, drives)}"
        )
    if any(file.samefile(known) for known in found):
        raise InputError(f"{path}: base: '{base}' has this drive as its base")
    return file


def make_paths_absolute(values: dict, path: Path) -> None:
    """Makes the paths in a scenario's fields absolute, in place.

    Names of shipped maps stay unchanged.

    Args:
        values: the fields, which are changed.
        path: the file that contains the fields. Relative paths start at the
            folder of this file.

    Raises:
        InputError: a value cannot be a path.
    """

    def absolute(fields: dict, field: str) -> dict:
        place = fields.get(field)
        if not isinstance(place, str) or _is_shipped_map(place):
            return fields
        with value_errors(f"{path}: {field}"):
            return {**fields, field: str((path.parent / place).resolve())}

    for field in ("map", "world", "waypoints"):
        values |= absolute(values, field)
    if isinstance(values.get("model_paths"), (list, tuple)):
        values["model_paths"] = [
            absolute({"model_paths": place}, "model_paths")["model_paths"]
            for place in values["model_paths"]
        ]
    for section, field in (("imu", "kalibr"), ("traffic", "fcd")):
        if isinstance(values.get(section), dict):
            values[section] = absolute(values[section], field)
    if isinstance(lidars := values.get("lidars"), dict):
        values["lidars"] = {
            name: absolute(lidar, "unit") if isinstance(lidar, dict) else lidar
            for name, lidar in lidars.items()
        }


def set_fields(scenario: Scenario, texts: Iterable[str]) -> Scenario:
    """Returns a scenario with other values of fields, as --set gives them.

    Relative paths start at the working directory.

    Args:
        scenario: the scenario.
        texts: changes `FIELD=VALUE`; see `Scenario.with_fields`.

    Raises:
        InputError: a text has another form, a field is unknown, or its value is
            not usable.
    """
    changes = parse_changes(texts)
    make_paths_absolute(changes, Path("--set"))
    changed = scenario.with_fields(changes, "--set")
    check_files(changed, "--set")
    return changed


def check_files(scenario: Scenario, source: object = None) -> None:
    """Checks that all files that a scenario names exist.

    The files are the map, stage, world, waypoints, IMU file and SUMO trace.
    Traffic needs a map: queues need roads, and vehicles and pedestrians the
    map's recorded traffic.

    Args:
        scenario: the scenario.
        source: file or argument that error messages name; by default the file
            of the scenario.

    Raises:
        InputError: one of these files does not exist.
    """
    source = source or scenario.source
    for field, fault in _file_faults(scenario):
        raise InputError(f"{source}: {field}: {fault}", field.partition(".")[0])
    if scenario.imu.kalibr is not None:
        scenario.imu.sample_rate(scenario.fastest_rate)


def _file_faults(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yields each field with a file that is missing, and what is wrong."""
    for field, file in (
        ("world", scenario.world),
        ("waypoints", scenario.waypoints),
        ("imu.kalibr", scenario.imu.kalibr),
        ("traffic.fcd", scenario.traffic.fcd),
    ):
        if file is not None and not os.path.isfile(file):
            yield field, f"{file}: no such file"
    for folder_of_models in scenario.model_paths:
        if not os.path.isdir(folder_of_models):
            yield "model_paths", f"{folder_of_models}: no such folder"
    traffic, city = scenario.traffic, scenario.city
    if scenario.map is None:
        if not city.is_off:
            yield "city", "a world is no city; give a map and its stage"
        if not traffic.is_off:
            yield "traffic", "a world has no roads; give a map with some"
        return
    folder = scenario.folder
    if not os.path.isdir(folder.path):
        from worlds.maps import shipped_maps

        known = ", ".join(shipped_maps())
        yield (
            "map",
            f"'{scenario.map}' is neither a shipped map ({known}) nor a"
            f" folder{did_you_mean(scenario.map, shipped_maps())}",
        )
    stages = ", ".join(folder.stages()) or "none"
    if not os.path.isfile(scenario.world_file):
        yield (
            "stage",
            f"map '{scenario.map}' has no stage '{scenario.stage}'; it has:"
            f" {stages}",
        )
    if city.towards is not None and city.towards not in folder.stages():
        yield (
            "city.towards",
            f"map '{scenario.map}' has no stage '{city.towards}'; it has:"
            f" {stages}",
        )
    if traffic.queues and not folder.roads.is_file():
        yield (
            "traffic",
            f"queues: no {folder.roads.name} in {folder.path}: {SUMO_INSTEAD}",
        )
    if traffic.is_recorded and not folder.traffic.is_file():
        yield (
            "traffic",
            f"no recorded traffic, {folder.traffic.name}, in {folder.path}:"
            f" {SUMO_INSTEAD}",
        )


def describe_scenario(scenario: Scenario, folder: Path | None = None) -> dict:
    """Returns the fields that are set in a scenario, ready for JSON.

    The field `imu.kalibr` becomes `imu.yaml`: a recording contains the noise of
    its IMU in a file of this name. The name of a shipped map stays as it is.

    Args:
        scenario: the scenario.
        folder: folder to which the paths of map, world, waypoints and SUMO
            trace are made relative. None keeps only the names of these files.
    """
    values = scenario.model_dump(mode="json", exclude_none=True)

    def moved(path: str) -> str:
        if _is_shipped_map(path):
            return path
        if folder is None:
            return Path(path).name
        return os.path.relpath(path, folder.resolve())

    for field in ("map", "world", "waypoints"):
        if field in values:
            values[field] = moved(values[field])
    if "model_paths" in values:
        values["model_paths"] = [*map(moved, values["model_paths"])]
    traffic = values.get("traffic", {})
    if "fcd" in traffic:
        traffic["fcd"] = moved(traffic["fcd"])
    if scenario.imu.kalibr is not None:
        values["imu"]["kalibr"] = KALIBR_FILE
    return values


# What files of `write_scenarios` begin with.
_MARK = "# Written by cns-drake; another run replaces it.\n"


def check_written_scenarios(folder: Path) -> None:
    """Checks that all scenario files in a folder are from `write_scenarios`.

    Raises:
        InputError: another file is there, or the folder is no folder.
    """
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"{folder}: not a folder")
    for path in listed(folder, "*.yaml"):
        check_writable(path)
        if not read_bytes(path).startswith(_MARK.encode()):
            raise InputError(
                f"{path}: no earlier run wrote it; give another folder"
            )


def write_scenarios(scenarios: Sequence[Scenario], folder: Path) -> list[Path]:
    """Writes scenarios as `<folder>/<name>.yaml`.

    If a map lies next to `folder`, its path is written as a relative path, so
    that map and folder can be moved together.

    Raises:
        InputError: if a file cannot be written, or the folder is refused by
            `check_written_scenarios`.
    """
    check_written_scenarios(folder)
    make_folder(folder)
    here = folder.resolve()
    paths = []
    for scenario in scenarios:
        path = folder / f"{scenario.name}.yaml"
        values = scenario.model_dump(mode="json", exclude_none=True)
        if Path(values.get("map", "")).is_relative_to(here.parent):
            values["map"] = os.path.relpath(values["map"], here)
        text = yaml.safe_dump(values, sort_keys=False)
        write_text(path, _MARK + text)
        paths.append(path)
    return paths
