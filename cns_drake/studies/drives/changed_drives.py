"""Drives of a map with the changes that a condition of an experiment makes."""

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.scenarios import (
    Scenario,
    check_files,
    count_frames,
    load_scenario_world,
    lost_structures,
    make_paths_absolute,
    plan_drive,
)
from cns_drake.simulation import recorded_traffic
from cns_drake.studies.drives.named_stages import find_stage
from cns_drake.studies.drives.sampled_drives import DrawnRoute
from evaluation.base import (
    InputError,
    did_you_mean,
    errors_at,
    no_such,
    validated,
)
from evaluation.map_update import MAINTAINERS, NOT_MAINTAINED
from evaluation.results import OWN
from evaluation.study import FLEET, SESSIONS, Changes
from worlds.roads import RoadNetwork, draw_route, load_road_network
from worlds.shapes import Route

# Fields of the database that no drive has.
DATABASE_FIELDS = (FLEET, "distractors", SESSIONS, "keep", "maintain")
_MOST_DISTRACTORS = 100_000
# Sections whose random numbers depend on the seed of the condition.
_SEEDED = ("city", "transient", "traffic", "ride", "driver")


def check_side(place: str, changes: Changes, source: str) -> None:
    """Checks the fields of the database that no scenario has.

    Args:
        place: path of the drive in the file: `database`, `query` or, for one of
            several drives, a path such as `database.sessions.2`.
        changes: fields of the drive.
        source: file of the experiment, for errors.

    Raises:
        InputError: a field belongs elsewhere, or is out of range.
    """
    city = changes.get("city")
    if isinstance(city, Mapping) and isinstance(city.get("redraw"), Mapping):
        raise InputError(
            f"{source}: {place}.city.redraw: give a number, or frozen: it is a"
            " field of both, and of no case",
            "city",
        )
    for name in DATABASE_FIELDS if place == "query" else ():
        if name in changes:
            raise InputError(
                f"{source}: {place}.{name}: it is a field of database", name
            )
    number = changes.get("distractors", 0)
    if type(number) is not int or not 0 <= number <= _MOST_DISTRACTORS:
        raise InputError(
            f"{source}: {place}.distractors: {number!r} is not from 0 to"
            f" {_MOST_DISTRACTORS}",
            "distractors",
        )


def checked_maintainer(value: Any, num_drives: int, where: str) -> str:
    """Returns what updates the maps of a database: its field `maintain`.

    Args:
        value: one of `NOT_MAINTAINED` and `MAINTAINERS`.
        num_drives: number of drives of the database.
        where: file and field, for errors.

    Raises:
        InputError: the value is anything else, there is nothing to update, or a
            package is missing.
    """
    known = (NOT_MAINTAINED, *MAINTAINERS)
    if value not in known:
        raise InputError(f"{where}: {no_such('maintainer', value, known)}")
    if value != NOT_MAINTAINED and num_drives == 1:
        raise InputError(
            f"{where}: {value}: no later drive updates the map of a single"
            " one; give several sessions"
        )
    if value == "m3c2" and find_spec("py4dgeo") is None:
        raise InputError(
            f"{where}: m3c2 needs the extra map-update (pip install"
            " 'cns-eval[map-update]')"
        )
    return str(value)


class DriveChanger:
    """Changes the drives of a map: gives their scenarios other fields.

    Beside the fields of a scenario, a drive can have words for stages (see
    `find_stage`), and a `route` that is sampled at random.
    """

    def __init__(
        self,
        source: str,
        last_stage: str,
        on_note: Callable[[str], object],
    ) -> None:
        """Prepares changes.

        Args:
            source: file of the experiment, for errors.
            last_stage: the stage that the word `last` means.
            on_note: is called with a note on everything that is left out.
        """
        self._source = source
        self._last_stage = last_stage
        self._on_note = on_note
        # Worlds, with what they lack, that were loaded without an error.
        self._loaded: set[tuple[Path, tuple[str, ...], str]] = set()
        # File of roads, length [m], seed -> a route that its map can drive;
        # many drives of a fleet share one.
        self._drawn: dict[tuple[Path, float, int], Route] = {}
        self._networks: dict[Path, RoadNetwork] = {}

    def changed(
        self, unchanged: Scenario, place: str, changes: Changes, seed: int
    ) -> Scenario:
        """Returns a drive with changes.

        Args:
            unchanged: the drive.
            place: path of the drive in the experiment's file: `query`,
                `database` or, for one of several drives, a path such as
                `database.sessions.2`.
            changes: fields of the drive.
            seed: seed of the random choices that have no own seed.

        Raises:
            MissingError: the map lacks a stage.
            InputError: a field is unknown or not usable.
        """
        left = {n: one for n, one in changes.items() if n != "distractors"}
        with errors_at(f"{self._source}: {place}.stage", field="stage"):
            stage = find_stage(
                left.pop("stage", OWN), unchanged, self._last_stage
            )
        drive = unchanged
        if stage != drive.stage:
            drive = drive.replaced(stage=stage)
        drive = self._on_drawn_route(drive, place, left)
        for name in _SEEDED:
            if isinstance(left.get(name), dict):
                left[name] = {"seed": seed, **left[name]}
        if _sets_returns(left.get("lidars")):
            left.setdefault("seed", seed)
        driver = left.get("driver")
        if (
            drive.waypoints
            and isinstance(driver, Mapping)
            and driver.get("lane_changes")
        ):
            self._on_note("waypoints have no lanes to change")
            left["driver"] = {**driver, "lane_changes": 0.0}
        return self._with_scenario_fields(drive, place, left)

    def _on_drawn_route(
        self, drive: Scenario, place: str, left: dict[str, Any]
    ) -> Scenario:
        if not isinstance(left.get("route"), Mapping):
            return drive
        where = f"{self._source}: {place}.route"
        drawn = validated(DrawnRoute, left.pop("route"), where)
        wanted = drive.folder.roads, drawn.length, drawn.seed
        known = self._drawn.get(wanted)
        route = known or self._draw_route(*wanted)
        drive = drive.replaced(route=route, waypoints=None)
        if known is None:
            self._check_map(place, drive, {"route": route})
            self._drawn[wanted] = route
        return drive

    def _draw_route(self, roads: Path, length: float, seed: int) -> Route:
        rng = np.random.default_rng(seed)
        return draw_route(self._network(roads), length, rng)

    def _network(self, roads: Path) -> RoadNetwork:
        if roads not in self._networks:
            self._networks[roads] = load_road_network(roads)
        return self._networks[roads]

    def _with_scenario_fields(
        self, drive: Scenario, place: str, left: Changes
    ) -> Scenario:
        if "lidars" in left:
            # Data sheets lie beside the experiment.
            lidars = {"lidars": left["lidars"]}
            make_paths_absolute(lidars, Path(self._source))
            left = {**left, **lidars}
        known = (*Scenario.model_fields, *DATABASE_FIELDS)
        for name in left:
            if name not in known and (near := did_you_mean(name, known)):
                raise InputError(
                    f"{self._source}: {place}: {name}: no such field{near}",
                    name,
                )
        if left:
            self._check_lidars(place, drive, left.get("lidars"))
            drive = drive.with_fields(left, f"{self._source}: {place}")
            self._check_map(place, drive, left)
        # Sections without random numbers get no seed, so that equal ones stay
        # equal.
        for name in set(_SEEDED) & set(left):
            section = getattr(drive, name)
            plain = type(section)()
            if name == "city" and not (section.is_off or section.is_random):
                section = section.replaced(seed=plain.seed)
                drive = drive.replaced(city=section)
            elif section.replaced(seed=plain.seed) == plain or (
                name == "city" and section.is_off
            ):
                drive = drive.replaced(**{name: plain})
        return drive

    def _check_lidars(self, place: str, drive: Scenario, given: object) -> None:
        """Checks that a study changes LiDARs that the drive has.

        A further LiDAR would be recorded, and read by no method. Another LiDAR
        can replace those of the drive, whose values are then null.
        """
        if not isinstance(given, Mapping):
            return
        kept = [
            name for name in drive.lidars if given.get(name, "") is not None
        ]
        for name in given:
            if name not in (*drive.lidars, "*") and kept:
                raise InputError(
                    f"{self._source}: {place}.lidars: the drive has no LiDAR"
                    f" {name!r} (it has: {', '.join(drive.lidars)})"
                    f"{did_you_mean(str(name), drive.lidars)}; for a new one in"
                    f" its place, set {kept[0]}: null",
                    "lidars",
                )

    def _check_map(self, place: str, drive: Scenario, given: Changes) -> None:
        """Checks that the given fields of a drive fit its map."""
        where = f"{self._source}: {place}"
        with errors_at(where, f"{drive.source}: "):
            check_files(drive)
            if "traffic" in given and drive.traffic.is_recorded:
                recorded_traffic(drive)
            # Other sections seldom fail, and a plan takes time.
            if set(given) - {*_SEEDED, "seed"}:
                count_frames(drive, plan_drive(drive))
        # The names in a city that is still to be made are unknown.
        names_structures = {"city", "without"} & {*given}
        if not names_structures or drive.lacks_city:
            return
        world = drive.world_file, drive.without, drive.city.model_dump_json()
        if "without" in given and world not in self._loaded:
            with errors_at(
                f"{where}.without", f"{drive.source}: without: ", "without"
            ):
                load_scenario_world(drive)
            self._loaded.add(world)
        with errors_at(where, f"{drive.source}: "):
            lost_structures(drive)


def _sets_returns(lidars: Any) -> bool:
    """Returns whether fields of LiDARs set the model of the returns."""
    return isinstance(lidars, Mapping) and any(
        isinstance(one, Mapping) and "returns" in one for one in lidars.values()
    )


def control_drive(drive: Scenario, stage: str) -> Scenario:
    """Returns a copy of a drive that goes through another stage of the map.

    Route and driver stay the same. The copy and the usual drive of the other
    stage go through the same city, so a comparison of these two drives shows
    only the effect of the route.

    Args:
        drive: the drive.
        stage: the other stage of its map.
    """
    return with_fixed_driver(drive).replaced(
        name=f"{drive.name}_stage_{stage}",
        stage=stage,
        title=f"Control: the route of {drive.name} in stage {stage}",
    )


def with_fixed_driver(drive: Scenario) -> Scenario:
    """Returns a drive whose driver stays the same if the drive is renamed.

    A driver without a seed is sampled by the name of the drive.
    """
    driver = drive.driver
    if driver.departs and driver.seed is None:
        return drive.replaced(driver=driver.replaced(seed=drive.name))
    return drive
