"""Drives of a map with the changes that a condition of an experiment makes."""

from collections.abc import Callable, Mapping, Set
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from cns_drake.scenarios import (
    Scenario,
    check_files,
    count_frames,
    load_scenario_world,
    make_paths_absolute,
    plan_drive,
)
from cns_drake.scene import structures_in
from cns_drake.sensors import WeatherConfig
from cns_drake.simulation import recorded_traffic
from cns_drake.studies.drives.named_stages import find_stage
from cns_drake.studies.drives.sampled_drives import DrawnRoute
from cns_drake.studies.drives.viewpoints import (
    checked_viewpoint,
    with_lidars_beside,
    with_lidars_moved,
)
from evaluation.base import (
    InputError,
    Section,
    did_you_mean,
    errors_at,
    no_such,
    poses,
    read_records,
    validated,
    value_errors,
)
from evaluation.lidar_sheets import check_preset, is_sheet_file
from evaluation.map_update import MAINTAINERS, NOT_MAINTAINED
from evaluation.results import LAST, OWN
from evaluation.study import FLEET, SESSIONS, Changes
from worlds.ageing import LAST_YEAR
from worlds.roads import RoadNetwork, Route, draw_route, load_road_network

# Fields that only the query can have: they change its scans.
QUERY_FIELDS = ("turn_queries", "tilt_queries", "hide_sector")
# Fields that only the database can have.
DATABASE_FIELDS = (
    FLEET,
    "distractors",
    "lateral",
    SESSIONS,
    "keep",
    "maintain",
)
# Fields that no scenario has.
_OF_STUDIES = (
    *QUERY_FIELDS,
    *DATABASE_FIELDS,
    "missing",
    "rates",
    "redraw",
    "returns",
    "scattered",
    "towards",
    "viewpoint",
    "years",
)
# Field -> type or types of its value, and the greatest value.
_LIMITS: Mapping[str, tuple[tuple[type, ...], int]] = {
    "distractors": ((int,), 100_000),
    "lateral": ((int, float), 100),
    "years": ((int,), LAST_YEAR),
}
# Fields of a drive that do not change the drive itself.
_UNUSED_FIELDS = (*QUERY_FIELDS, "distractors", "years", "rates")
# Sections whose random numbers depend on the seed of the condition.
_SEEDED = ("transient", "traffic", "ride", "driver")
_RETURNS = ("ideal", "calibrated")

# A function that takes a drive, years, rates of change and a seed. It returns
# folder and stage of the drive's map, aged by these years.
Age = Callable[[Scenario, int, Any, int], tuple[str, str]]
# A function that takes a drive and the number of a redraw. It returns folder
# and stage of a map with another city along the same streets.
Redraw = Callable[[Scenario, int], tuple[str, str]]


class Ageing(NamedTuple):
    """How the city of a drive ages: number of years, and rates of change."""

    years: int
    rates: Any


def check_side(place: str, changes: Changes, source: str) -> None:
    """Checks the fields of a drive that no scenario has.

    Args:
        place: path of the drive in the file: `database`, `query` or, for one of
            several drives, a path such as `database.sessions.2`.
        changes: fields of the drive.
        source: file of the experiment, for errors.

    Raises:
        InputError: a field belongs elsewhere, or is out of range.
    """
    if isinstance(changes.get("redraw"), Mapping):
        raise InputError(
            f"{source}: {place}.redraw: give a number, or frozen: it is a field"
            " of both, and of no case"
        )
    is_query = place == "query"
    right = "database" if is_query else "query"
    for name in DATABASE_FIELDS if is_query else QUERY_FIELDS:
        if name in changes:
            raise InputError(
                f"{source}: {place}.{name}: it is a field of {right}"
            )
    for name, (kinds, most) in _LIMITS.items():
        value = changes.get(name, 0)
        if type(value) not in kinds or not 0 <= value <= most:
            raise InputError(
                f"{source}: {place}.{name}: {value!r} is not from 0 to {most}"
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
    """Changes the drives of a map.

    The fields of a drive are the fields of its scenario, and further fields
    such as `viewpoint` or `missing`. This class turns the further fields into
    fields of a scenario.
    """

    def __init__(
        self,
        source: str,
        last_stage: str,
        *,
        same_route: bool,
        age: Age,
        redraw: Redraw,
        on_note: Callable[[str], None],
    ) -> None:
        """Prepares changes.

        Args:
            source: file of the experiment, for errors.
            last_stage: the stage that ages, and that the word `last` means.
            same_route: whether the drives of the database follow the query's
                route, with LiDARs beside the LiDARs of the query.
            age: function that returns an aged map.
            redraw: function that returns a redrawn map.
            on_note: is called with a note on everything that is left out.
        """
        self._source = source
        self._last_stage = last_stage
        self._same_route = same_route
        self._age = age
        self._redraw = redraw
        self._on_note = on_note
        # Worlds, with what they lack, that were loaded without an error.
        self._loaded: set[tuple[Path, tuple[str, ...]]] = set()
        # File of roads, length [m], seed -> a route that its map can drive;
        # many drives of a fleet share one.
        self._drawn: dict[tuple[Path, float, int], Route] = {}
        self._networks: dict[Path, RoadNetwork] = {}

    def changed(
        self,
        unchanged: Scenario,
        place: str,
        changes: Changes,
        ageing: Ageing,
        seed: int,
    ) -> Scenario:
        """Returns a drive with changes.

        Args:
            unchanged: the drive.
            place: path of the drive in the experiment's file: `query`,
                `database` or, for one of several drives, a path such as
                `database.sessions.2`.
            changes: fields of the drive.
            ageing: how the city of the drive ages.
            seed: seed of the random choices.

        Raises:
            MissingError: the map lacks a stage.
            InputError: a field is unknown or not usable.
        """
        left = {n: one for n, one in changes.items() if n not in _UNUSED_FIELDS}
        # Each step takes its own fields out of `left`.
        drive = self._with_sensors(unchanged, place, left, seed)
        drive = self._at_viewpoint(drive, place, left)
        drive = self._at_stage(drive, place, left)
        drive = self._in_aged_city(drive, place, left, ageing, seed)
        drive = self._in_redrawn_city(drive, place, left)
        drive = self._without_lost(drive, place, left, seed)
        drive = self._on_drawn_route(drive, place, left)
        for name in _SEEDED:
            if isinstance(left.get(name), dict):
                left[name] = {"seed": seed, **left[name]}
        driver = left.get("driver")
        if (
            drive.waypoints
            and isinstance(driver, Mapping)
            and driver.get("lane_changes")
        ):
            self._on_note("waypoints have no lanes to change")
            left["driver"] = {**driver, "lane_changes": 0.0}
        return self._with_scenario_fields(drive, place, left)

    def _with_sensors(
        self, drive: Scenario, place: str, left: dict[str, Any], seed: int
    ) -> Scenario:
        """Returns a drive with another LiDAR, or another model of returns."""
        if "lidar" in left:
            unit = left.pop("lidar")
            folder = Path(self._source).parent
            where = f"{self._source}: {place}.lidar"
            if not isinstance(unit, str | Path):
                raise InputError(
                    f"{where}: neither a preset nor the file of a data sheet;"
                    " fields of a LiDAR belong in lidars"
                )
            with value_errors(where), errors_at(where, "unit: "):
                if is_sheet_file(unit, folder):
                    unit = folder / unit
                else:
                    # A file of the working folder is not meant.
                    check_preset(str(unit))
                drive = drive.with_lidar(unit)
        if "returns" not in left:
            return drive
        returns, weather = left.pop("returns"), left.pop("weather", None)
        if returns not in _RETURNS:
            raise InputError(
                f"{self._source}: {place}.returns: {returns!r} is neither"
                f" {' nor '.join(_RETURNS)}"
            )
        if weather is not None:
            where = f"{self._source}: {place}.weather"
            weather = validated(WeatherConfig, weather, where)
            if returns != "calibrated" and weather != WeatherConfig():
                raise InputError(f"{where}: no effect on {returns} returns")
        left.setdefault("seed", seed)
        return drive.with_returns(returns, weather)

    def _at_viewpoint(
        self, drive: Scenario, place: str, left: dict[str, Any]
    ) -> Scenario:
        lateral = left.pop("lateral", 0.0)
        viewpoint = left.pop("viewpoint", None)
        if lateral and viewpoint is not None:
            raise InputError(
                f"{self._source}: {place}.lateral: give it or a viewpoint"
            )
        if lateral:
            viewpoint = (lateral, 0.0)
        is_beside = place != "query" and self._same_route
        if viewpoint is None:
            if not is_beside:
                return drive
            viewpoint = "near"
        offset = checked_viewpoint(
            viewpoint, f"{self._source}: {place}.viewpoint"
        )
        if is_beside:
            return with_lidars_beside(drive, *offset)
        return with_lidars_moved(drive, 0.0, *offset)

    def _at_stage(
        self, drive: Scenario, place: str, left: dict[str, Any]
    ) -> Scenario:
        with errors_at(f"{self._source}: {place}.stage"):
            stage = find_stage(left.pop("stage", OWN), drive, self._last_stage)
        return drive if stage == drive.stage else drive.replaced(stage=stage)

    def _in_aged_city(
        self,
        drive: Scenario,
        place: str,
        left: Changes,
        ageing: Ageing,
        seed: int,
    ) -> Scenario:
        if not ageing.years:
            return drive
        if drive.stage != self._last_stage:
            raise InputError(
                f"{self._source}: years: stage {LAST} ages, not the stage"
                f" {drive.stage} of the {place}"
            )
        older = "database" if place == "query" else "query"
        if "redraw" in left:
            raise InputError(
                f"{self._source}: {place}.redraw: a city drawn anew does not"
                f" age by {older}.years; give one of them"
            )
        return self._moved(older, drive, self._age, *ageing, seed)

    def _in_redrawn_city(
        self, drive: Scenario, place: str, left: dict[str, Any]
    ) -> Scenario:
        if "redraw" not in left:
            return drive
        return self._moved(place, drive, self._redraw, left.pop("redraw"))

    def _moved(
        self,
        place: str,
        drive: Scenario,
        make: Callable[..., tuple[str, str]],
        *arguments: Any,
    ) -> Scenario:
        """Returns a drive moved to the map and stage that `make` returns."""
        try:
            folder, stage = make(drive, *arguments)
        except InputError as error:
            # The error begins with a field.
            raise InputError(f"{self._source}: {place}.{error}") from None
        return drive.replaced(map=folder, stage=stage)

    def _without_lost(
        self, drive: Scenario, place: str, left: dict[str, Any], seed: int
    ) -> Scenario:
        """Returns a drive through a city that has lost structures."""
        lost = {n: left.pop(n) for n in Losses.model_fields if n in left}
        if not lost:
            return drive
        where = f"{self._source}: {place}"
        losses = validated(Losses, lost, where)
        names = lost_structures(drive, losses, seed, where)
        return drive.replaced(without=names)

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
        known = (*Scenario.model_fields, *_OF_STUDIES)
        for name in left:
            if name not in known and (near := did_you_mean(name, known)):
                raise InputError(
                    f"{self._source}: {place}: {name}: no such field{near}"
                )
        if left:
            self._check_lidars(place, drive, left.get("lidars"))
            drive = drive.with_fields(left, f"{self._source}: {place}")
            self._check_map(place, drive, left)
        for name in set(_SEEDED) & set(left):
            # Sections without random numbers get no seed, so that equal ones
            # stay equal.
            plain = type(getattr(drive, name))()
            if getattr(drive, name).replaced(seed=plain.seed) == plain:
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
            if name not in drive.lidars and kept:
                raise InputError(
                    f"{self._source}: {place}.lidars: the drive has no LiDAR"
                    f" {name!r} (it has: {', '.join(drive.lidars)})"
                    f"{did_you_mean(str(name), drive.lidars)}; for a new one in"
                    f" its place, set {kept[0]}: null"
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
        world = drive.world_file, drive.without
        if "without" in given and world not in self._loaded:
            with errors_at(f"{where}.without", f"{drive.source}: without: "):
                load_scenario_world(drive)
            self._loaded.add(world)


# Classes of structures that can be missing; streets, ground and street
# furniture always stay.
_REMOVABLE = ("building", "vegetation")
# The key of `scattered` that is no class.
_SEED = "seed"

_Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Losses(Section):
    """What is missing from the city of a drive.

    Attributes:
        missing: share of the buildings and plants to remove, from 0 to 1. The
            seed of the condition selects a place, and the structures nearest to
            this place are removed.
        scattered: structures to remove at random all over the map, in addition
            to the share `missing`: for each class that you name, the share of
            its structures to remove, such as `{pole: 0.3}`. The key `seed`
            replaces the seed of the condition, so that the two drives can lack
            different structures.
        towards: another stage of the map, usually an earlier stage. Only
            structures that do not exist in that stage are removed. A structure
            that exists in that stage does not change, even if it has another
            height in that stage.
    """

    missing: _Share = 0.0
    scattered: dict[str, float] = Field(default_factory=dict)
    towards: str | None = None


def lost_structures(
    drive: Scenario, losses: Losses, seed: int, source: str
) -> tuple[str, ...]:
    """Returns the names of the structures that a drive's city loses, sorted.

    Args:
        drive: a drive through a stage of a map.
        losses: what is missing.
        seed: seed of the random samples.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the drive has no map, a stage or class does not exist, a
            share is not from 0 to 1, or the map's table of structures cannot be
            used.
    """
    if drive.map is None:
        raise InputError(
            f"{source}: missing: {drive.name} has no map with structures"
        )
    scattered = dict(losses.scattered)
    own_seed = scattered.pop(_SEED, seed)
    if own_seed < 0 or own_seed != int(own_seed):
        raise InputError(
            f"{source}: scattered.seed: {own_seed} is no whole number from 0"
        )
    for kind, share in scattered.items():
        if not 0.0 <= share <= 1.0:
            raise InputError(
                f"{source}: scattered.{kind}: {share} is not from 0 to 1"
            )
    removable = None
    if losses.towards is not None:
        stage = str(drive.stage)
        removable = _lacking_in(drive, stage, losses.towards, source)
    table = drive.folder.structures
    lost = _scattered_losses(table, scattered, int(own_seed), source)
    if losses.missing > 0.0:
        order = _removal_order(table, seed, removable)
        lost |= set(order[: round(losses.missing * len(order))])
    return tuple(sorted(lost))


def _lacking_in(
    base: Scenario, stage: str, other: str, source: str
) -> frozenset[str]:
    """Returns the structures of a stage that another stage lacks.

    Args:
        base: a drive through any stage of the map.
        stage: the stage with the structures.
        other: the other stage.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: a stage does not exist, or the other stage lacks nothing.
    """
    with errors_at(f"{source}: towards", f"{source}: "):
        there = _structures_of(base, other, source)
    difference = _structures_of(base, stage, source) - there
    if not difference:
        raise InputError(
            f"{source}: towards: stage {other} lacks nothing of stage {stage}"
        )
    return frozenset(difference)


def _structures_of(base: Scenario, stage: str, source: str) -> set[str]:
    """Returns the names of the structures in a stage.

    Args:
        base: a drive through any stage of the map.
        stage: the stage.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the stage does not exist.
    """
    scenario = base.replaced(stage=stage, without=())
    check_files(scenario, source)
    return structures_in(load_scenario_world(scenario))


def _removal_order(
    table: Path, seed: int, removable: Set[str] | None
) -> list[str]:
    """Returns structures that can be missing, in the order of removal.

    Structures nearest to a random place are removed first.

    Args:
        table: the map's table of structures.
        seed: seed of the random place.
        removable: the structures that can be missing; None for all buildings
            and plants except those that wait on a lot for a building.

    Raises:
        InputError: no structure can be missing, or a place in the table is not
            a number.
    """
    rows = [
        row
        for _, row in read_records(table, ("name", "class"))
        if (
            row["class"] in _REMOVABLE and not _is_on_a_lot(row)
            if removable is None
            else row["name"] in removable
        )
    ]
    if not rows:
        raise InputError(f"{table}: none of its structures can be missing")
    try:
        xy = np.array([(float(row["x"]), float(row["y"])) for row in rows])
        if not (np.abs(xy) <= poses.FARTHEST).all():  # NaN fails, too.
            raise ValueError
    except (KeyError, ValueError):
        raise InputError(
            f"{table}: x, y: every structure needs finite numbers"
        ) from None
    rng = np.random.default_rng(seed)
    low, high = xy.min(axis=0), xy.max(axis=0)
    distance = np.linalg.norm(xy - rng.uniform(low, high), axis=1)
    return [rows[k]["name"] for k in np.argsort(distance, kind="stable")]


def _is_on_a_lot(row: Mapping[str, str]) -> bool:
    """Returns whether a structure occupies a lot only until it is built on."""
    tags = (row.get("tags") or "").split()
    return "_lot_" in row["name"] and "lot" in tags


def _scattered_losses(
    table: Path, shares: Mapping[str, float], seed: int, source: str
) -> frozenset[str]:
    """Returns a random share of the structures of each class.

    A greater share contains all structures of a smaller share.

    Args:
        table: the map's table of structures.
        shares: class -> share of its structures, from 0 to 1.
        seed: seed of the random choice.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the table has no structure of a class.
    """
    records = [row for _, row in read_records(table, ("name", "class"))]
    rows = [row for row in records if not _is_on_a_lot(row)]
    missing: set[str] = set()
    for kind, share in shares.items():
        names = sorted(row["name"] for row in rows if row["class"] == kind)
        if not names:
            raise InputError(f"{source}: scattered: no {kind!r} in {table}")
        rng = np.random.default_rng([seed, *kind.encode()])
        order = rng.permutation(len(names))
        missing.update(names[k] for k in order[: round(share * len(names))])
    return frozenset(missing)


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
