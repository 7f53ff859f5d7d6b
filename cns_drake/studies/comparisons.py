"""Makes the two drives of each condition of an experiment."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
import math
from pathlib import Path
import re
from typing import Any

import numpy as np
from pydantic import Field

from cns_drake.ageing.years import LAST_YEAR
from cns_drake.base.errors import InputError, errors_at, validated
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.listing import natural_key
from cns_drake.roads.network import RoadNetwork, load_road_network
from cns_drake.roads.route import Route, draw_route
from cns_drake.scenarios.losses import Losses, lost_structures
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scene.world import load_world
from cns_drake.sensors.lidar.config import WeatherConfig
from cns_drake.sensors.sensor_config import Section
from cns_drake.simulation.loaded_drive import load_ways
from cns_drake.studies.experiment import (
    CAUSE,
    FLEET,
    LEVEL,
    NO_CAUSE,
    SESSIONS,
    Changes,
    Condition,
    base_protocol,
    merged,
)
from cns_drake.traffic.vehicles import room_for_vehicles
from evaluation.map_update.upkeep import MAINTAINERS, NOT_MAINTAINED
from evaluation.recognition.keeping import KEEP_ALL, checked_keep
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import LAST, OWN
from evaluation.study.tasks.task import USUAL_LENGTH

# Fields of a side (`both`, `database`, `query`) that no scenario has.
LOSS_FIELDS = tuple(Losses.model_fields)
# Fields that only the database, or only the query, can have.
_QUERY_FIELDS = ("turn_queries", "tilt_queries", "hide_sector")
_DATABASE_FIELDS = (
    FLEET,
    "distractors",
    "lateral",
    SESSIONS,
    "keep",
    "maintain",
)
# Fields that all drives of a database share.
_SHARED_FIELDS = (*_DATABASE_FIELDS, "rates")
# Fields that put a drive into another frame of reference.
_PLACE_FIELDS = ("map", "world")
# Sections whose random numbers depend on the seed of the condition.
_SEEDED = ("transient", "traffic", "ride", "driver")
_RETURNS = ("ideal", "calibrated")
# Name of a map's first stage.
FIRST = "first"
# The beginning of the names of a map's earlier stages, such as `earlier 1`.
EARLIER = "earlier "
# Number of names for earlier stages: `earlier 1` to `earlier 4`.
_STEPS = 4
# The LiDAR of the database is this far ahead of the query's [m], because no two
# drives stop at exactly the same places.
_AHEAD = 1.25
# Named viewpoints of the database: offset to the left [m] and heading [deg].
VIEWPOINTS: Mapping[str, tuple[float, float]] = {
    "near": (0.5, 0.0),
    "lane": (5.0, 0.0),
    "reversed": (5.0, 180.0),
}
# Greatest share of the roads' room for traffic: the car needs some, too.
_MOST_ROOM = 0.5
# The same for a car that follows others, because then all wait for each other.
_FOLLOWED_ROOM = 0.25


class DrawnRoute(Section):
    """A route that is sampled at random.

    Attributes:
        length: smallest length of the route [m].
        seed: seed of the random route.
    """

    length: float = Field(gt=0.0, le=100_000.0)
    seed: int = Field(default=0, ge=0)


class Fleet(Section):
    """Cars that drive through a city year by year, and make a database.

    Each drive has a route that is sampled at random, one of the viewpoints
    `near`, `lane` and `reversed`, and trees with or without leaves. The random
    choices for a car in a year do not depend on the numbers of cars and of
    years, so a larger fleet contains the drives of a smaller fleet.

    Attributes:
        cars: number of drives per year.
        years: number of years. The first drives take place this number of years
            before the query, and the last drives one year before the query.
        length: smallest length of a route [m].
        seed: seed of the random choices.
    """

    cars: int = Field(ge=1, le=1000, strict=True)
    years: int = Field(ge=1, le=LAST_YEAR, strict=True)
    length: float = Field(gt=0.0, le=100_000.0)
    seed: int = Field(ge=0)

    def sessions(self) -> list[dict[str, Any]]:
        """Returns the fields of each drive, from older to newer."""
        found = []
        for years in range(self.years, 0, -1):
            for car in range(self.cars):
                rng = np.random.default_rng([self.seed, years, car])
                number = int(rng.integers(2**31))
                found.append(
                    {
                        "years": years,
                        "route": {"length": self.length, "seed": number},
                        "viewpoint": str(rng.choice(list(VIEWPOINTS))),
                        "transient": {
                            "leaves": float(rng.integers(2)),
                            "seed": number,
                        },
                    }
                )
        return found


class MissingError(Exception):
    """Raised if a map lacks what a condition needs; the message says what."""


@dataclass(frozen=True)
class Compared:
    """The drives of the database and the query drive of one condition.

    Attributes:
        database: the drive of the database; the oldest drive if there are
            several.
        query: the drive of the queries.
        protocol: protocol of the queries.
        distractors: number of places of other cities that are added to the
            database, to make recognition harder.
        asked: field -> value, for the fields of the protocol with which the
            condition gives the queries a random yaw, a tilt or an occluded
            sector.
        beside: further drives of the database, from older to newer.
        keep: which places of the database are kept, see
            `evaluation.recognition.keeping.kept_places`.
        maintain: what updates the maps of older drives by newer drives, see
            `evaluation.map_update.upkeep`.
        ages: the years by which the city has aged at the time of each of
            `drives`; empty if the city does not age.
        lengths: approximate length of each of `drives` [m].
    """

    database: Scenario
    query: Scenario
    protocol: RetrievalProtocol
    distractors: int = 0
    asked: Changes = field(default_factory=dict)
    beside: tuple[Scenario, ...] = ()
    keep: str | int = KEEP_ALL
    maintain: str = NOT_MAINTAINED
    ages: tuple[int, ...] = ()
    lengths: tuple[float, ...] = ()

    @property
    def drives(self) -> tuple[Scenario, ...]:
        """The drives of the database, from older to newer, and the query."""
        return self.database, *self.beside, self.query

    def fingerprint(self) -> str:
        """Returns a hash of the drives of the database and the query drive.

        Drives that differ only in their names have different hashes.
        """
        several = {
            "beside": [one.model_dump(mode="json") for one in self.beside],
            "keep": self.keep,
            "maintain": self.maintain,
        }
        is_one = not self.beside and self.keep == KEEP_ALL
        return fingerprint(
            {
                "database": self.database.model_dump(mode="json"),
                "query": self.query.model_dump(mode="json"),
                "distractors": self.distractors,
                **({} if is_one else several),
                **self.asked,
            }
        )


# A function that takes a drive, years, rates of change and a seed. It returns
# folder and stage of the drive's map, aged by these years.
Age = Callable[[Scenario, int, Any, int], tuple[str, str]]
# A function that takes a drive and a seed. It returns folder and stage of the
# drive's map, drawn anew.
Redraw = Callable[[Scenario, int], tuple[str, str]]


@dataclass
class PairMaker:
    """Changes two drives of a map as the conditions of an experiment say.

    Attributes:
        database: the drive that makes the database, without any change.
        query: the drive that makes the queries, without any change.
        same_route: whether the database drive follows the query's route, with
            its LiDAR at another viewpoint.
        source: file of the experiment, for errors.
        age: function of a drive, a number of years, the rates of change and a
            seed. The function returns the folder and the stage of the drive's
            map, aged by these years.
        redraw: function of a drive and a seed. The function returns the folder
            and the stage of a map with another city along the same streets.
        on_note: is called with a note on everything that is left out.
    """

    database: Scenario
    query: Scenario
    same_route: bool
    source: str
    age: Age
    redraw: Redraw
    on_note: Callable[[str], None]

    def __post_init__(self) -> None:
        self._unchanged = {"database": self.database, "query": self.query}
        for side, drive in self._unchanged.items():
            # Drives have their draws by their names, which change.
            if drive.driver.departs and drive.driver.seed is None:
                driver = drive.driver.replaced(seed=drive.name)
                self._unchanged[side] = drive.replaced(driver=driver)
        self._last_stage = max(
            (str(one.stage) for one in (self.database, self.query)),
            key=natural_key,
        )
        self._plain = dict(self._unchanged)
        if self.same_route:
            self._plain["database"] = with_lidars_beside(
                self._unchanged["database"]
            )
        # Side -> content of a drive -> the drive; equal drives share a name.
        self._known: dict[str, dict[str, Scenario]] = {
            "database": {},
            "query": {},
        }
        # Worlds, with what they lack, that were loaded without an error.
        self._loaded: set[tuple[Path, tuple[str, ...]]] = set()
        # File of roads, length [m], seed -> a route that its map can drive;
        # many drives of a fleet share one.
        self._drawn: dict[tuple[Path, float, int], Route] = {}
        self._networks: dict[Path, RoadNetwork] = {}

    def build(self, condition: Condition, seed: int) -> Compared:
        """Returns the database drive and the query drive under a condition.

        Args:
            condition: the changes to make to the two drives.
            seed: seed of the random choices of these changes.

        Raises:
            MissingError: the map lacks what the condition needs.
            InputError: a field is unknown or not usable.
        """
        chosen: list[Mapping[str, Changes]] = [condition.changes]
        missing = None
        for levels in condition.causes:
            for at_level in levels:
                try:
                    chosen.append(self._possible_fields(at_level))
                    break
                except MissingError as error:
                    fault = error
            else:
                missing = fault
        if missing and len(chosen) == 1:
            raise missing
        if missing:
            self.on_note(str(missing))
        fields: Any = {}
        for one in chosen:
            for side, values in one.items():
                fields[side] = merged(fields.get(side, {}), values)
        sides = {
            side: merged(fields.get("both", {}), fields.get(side, {}))
            for side in ("database", "query")
        }
        sessions = self._session_changes(sides["database"], seed)
        # Years of cases may need the rates of all conditions.
        alone = {} if CAUSE in condition.factors else fields
        for side, values in alone.items():
            ages = [*sessions.values(), sides["query"]]
            if side in sides:
                ages = ages[:-1] if side == "database" else ages[-1:]
            if "rates" in values and not any("years" in one for one in ages):
                raise InputError(
                    f"{self.source}: {side}.rates: those of no years"
                )
        for place, changes in sessions.items():
            self._check_side(place, changes)
        if SESSIONS in sides["database"]:
            self._check_side("database", sides["database"])
        self._check_side("query", sides["query"])
        dated = self._database_drives(sessions, sides, condition, seed)
        database = [drive for _, _, drive in dated]
        years = _years_aged(sides["database"], sessions)
        age = years, sides["database"].get("rates", 1.0)
        drive = self._with_changes("query", sides["query"], age, seed)
        query = self._with_unique_name("query", drive, condition.factors, seed)
        changed = {
            name: sides["query"][name]
            for name in _QUERY_FIELDS
            if name in sides["query"]
        }
        if changed:
            changed["seed"] = seed
            base_protocol(changed, self.source, "query")
        protocol = base_protocol(
            {**fields.get("protocol", {}), **changed}, self.source
        )
        if lateral := sides["database"].get("lateral"):
            # On a straight road, the number of matches does not depend on the
            # offset.
            radius = math.hypot(protocol.radius, lateral)
            protocol = replace(protocol, radius=radius)
        number = sides["database"].get("distractors", 0)
        keep = checked_keep(
            sides["database"].get("keep", KEEP_ALL),
            f"{self.source}: database.keep",
        )
        return Compared(
            database[0],
            query,
            protocol,
            number,
            changed,
            tuple(database[1:]),
            keep,
            self._map_updates(sides["database"], len(database)),
            (*(when for when, _, _ in dated), years) if years else (),
            (
                *(length for _, length, _ in dated),
                _drive_length(sides["query"]),
            ),
        )

    def _map_updates(self, database: Changes, number: int) -> str:
        """Returns what updates the maps of a database of some drives.

        Raises:
            InputError: it is unknown, or there is nothing to update.
        """
        value = database.get("maintain", NOT_MAINTAINED)
        where = f"{self.source}: database.maintain"
        if value not in (NOT_MAINTAINED, *MAINTAINERS):
            known = ", ".join((NOT_MAINTAINED, *MAINTAINERS))
            raise InputError(f"{where}: {value!r} is none of {known}")
        if value != NOT_MAINTAINED and number == 1:
            raise InputError(
                f"{where}: {value}: no later drive updates the map of a single"
                " one; give several sessions"
            )
        if value == "m3c2" and find_spec("py4dgeo") is None:
            raise InputError(
                f"{where}: m3c2 needs the extra map-update (pip install"
                " 'cns-drake[map-update]')"
            )
        return str(value)

    def _session_changes(
        self, database: Changes, seed: int
    ) -> dict[str, dict[str, Any]]:
        """Returns place in the file -> changes, for each drive of a database.

        Each drive has the fields of the database; its own ones replace them.
        """
        shared = dict(database)
        if FLEET in database:
            where = f"{self.source}: database.{FLEET}"
            fleet = shared.pop(FLEET)
            if SESSIONS in database:
                raise InputError(f"{where}: give it or {SESSIONS}")
            if isinstance(fleet, Mapping):
                fleet = {"seed": seed, **fleet}
            drives = validated(Fleet, fleet, where).sessions()
            return self._session_changes({**shared, SESSIONS: drives}, seed)
        given = shared.pop(SESSIONS, None)
        for name in ("keep", "maintain"):
            shared.pop(name, None)
        if SESSIONS not in database:
            return {"database": shared}
        where = f"{self.source}: database.{SESSIONS}"
        if isinstance(given, Mapping):
            numbers = [str(k) for k in range(1, len(given) + 1)]
            given = [*given.values()] if list(given) == numbers else None
        if not (isinstance(given, list) and given):
            raise InputError(f"{where}: not a list of one drive or more")
        found = {}
        for number, own in enumerate(given, start=1):
            place = f"database.{SESSIONS}.{number}"
            if not isinstance(own, Mapping):
                raise InputError(
                    f"{self.source}: {place}: {own!r} is no mapping of fields"
                )
            for name in _PLACE_FIELDS:
                if name in own:
                    raise InputError(
                        f"{self.source}: {place}.{name}: another map has"
                        " another frame of reference than the other drives"
                    )
            for name in _SHARED_FIELDS:
                if name in own:
                    raise InputError(
                        f"{self.source}: {place}.{name}: all drives share it;"
                        " it is a field of database"
                    )
            found[place] = merged(shared, own)
        return found

    def _database_drives(
        self,
        sessions: Mapping[str, Changes],
        sides: Mapping[str, Changes],
        condition: Condition,
        seed: int,
    ) -> list[tuple[int, float, Scenario]]:
        """Returns the drives of a database, from older to newer.

        Each has the years by which its city has aged, and its `_drive_length`.

        `years` says how much older a drive is than another one, through whose
        city these years have passed. So the city of the oldest drive is aged by
        the years of the query, which are 0 in most experiments; the city of
        each other drive by its distance from the oldest one as well; and the
        city of the query by the years of the oldest drive. The years of the
        database itself count as those of a drive, so that databases of other
        drives have the same query.

        Args:
            sessions: place in the file -> changes of each drive.
            sides: changes of the database and of the query.
            condition: the condition.
            seed: seed of the random choices.
        """
        query = sides["query"]
        since = query.get("years", 0)
        oldest = _years_aged(sides["database"], sessions)
        rates = query.get("rates", 1.0)
        if any(one.get("years", 0) != oldest for one in sessions.values()):
            rates = sides["database"].get("rates", rates)
        stages = list(self.query.folder.stages())
        asked = self._unchanged["query"]
        stage = self._resolve_stage("query", asked, query.get("stage", OWN))
        last = stages.index(stage) if stage in stages else len(stages)
        found: list[tuple[tuple, str, Scenario]] = []
        for place, changes in sessions.items():
            age = since + oldest - changes.get("years", 0)
            drive = self._unchanged["database"]
            stage = self._resolve_stage(place, drive, changes.get("stage", OWN))
            is_later = stages.index(stage) > last if stage in stages else False
            if place != "database" and (age > oldest or is_later):
                raise InputError(
                    f"{self.source}: {place}: this drive is later than the"
                    " query"
                )
            drive = self._with_changes(place, changes, (age, rates), seed)
            factors = _factors_of(place, condition.factors)
            drive = self._with_unique_name("database", drive, factors, seed)
            found.append(((age, natural_key(stage)), place, drive))
        # While maps are only requested, drives of all ages and redraws are in
        # one map.
        known: dict[object, str] = {}
        for time, place, drive in found:
            city = time, sessions[place].get("redraw")
            before = known.setdefault((city, drive.name), place)
            if before != place:
                raise InputError(
                    f"{self.source}: {place}: the same drive as {before}"
                )
        found.sort(key=lambda one: one[0])
        return [
            (time[0], _drive_length(sessions[place]), drive)
            for time, place, drive in found
        ]

    def _possible_fields(
        self, fields: Mapping[str, Changes]
    ) -> dict[str, Changes]:
        """Returns those fields of a case that are possible on the map.

        Raises:
            MissingError: none of the fields is possible.
        """
        missing: MissingError | None = None
        found: dict[str, Changes] = {}
        for side, changes in fields.items():
            left = dict(changes)
            try:
                if (stage := left.get("stage")) is not None:
                    self._resolve_stage(
                        side, self._unchanged["database"], stage
                    )
            except MissingError as error:
                missing = error
                del left["stage"]
            try:
                self._check_roads(left.get("traffic"))
            except MissingError as error:
                missing = error
                del left["traffic"]
            if left:
                found[side] = left
        if missing and not found:
            raise missing
        if missing:
            self.on_note(str(missing))
        return found

    def _check_roads(self, traffic: Any) -> None:
        folder = self.query.folder
        has_roads = folder.roads.is_file() or folder.lanes.is_file()
        if has_roads or not isinstance(traffic, Mapping):
            return
        if any(traffic.get(n) for n in ("vehicles", "walkers", "queues")):
            raise MissingError(
                f"neither {folder.roads.name} nor {folder.lanes.name}: no"
                " traffic"
            )

    def _check_side(self, side: str, changes: Changes) -> None:
        if isinstance(changes.get("redraw"), Mapping):
            raise InputError(
                f"{self.source}: {side}.redraw: give a number, or frozen: it is"
                " a field of both, and of no case"
            )
        if "version" in changes:
            raise InputError(
                f"{self.source}: {side}.version: this field is now `redraw`"
            )
        is_query = side == "query"
        others = _DATABASE_FIELDS if is_query else _QUERY_FIELDS
        for name in others:
            if name in changes:
                right = "database" if is_query else "query"
                raise InputError(
                    f"{self.source}: {side}.{name}: it is a field of {right}"
                )
        for name, most in (
            ("distractors", 100_000),
            ("lateral", 100),
            ("years", LAST_YEAR),
        ):
            value = changes.get(name, 0)
            kinds = (int, float) if name == "lateral" else (int,)
            if type(value) not in kinds or not 0 <= value <= most:
                raise InputError(
                    f"{self.source}: {side}.{name}: {value!r} is not from 0 to"
                    f" {most}"
                )

    def _with_changes(
        self, side: str, changes: Changes, age: tuple[Any, Any], seed: int
    ) -> Scenario:
        """Returns a drive with the changes of a condition.

        `side` is `query`, `database` or the place of one of its drives in the
        file. `age` contains the years by which the drive's city is aged, and
        the rates of change.
        """
        is_query = side == "query"
        drive = self._unchanged["query" if is_query else "database"]
        left = dict(changes)
        for name in (*_QUERY_FIELDS, "distractors", "years", "rates"):
            left.pop(name, None)
        if "lidar" in left:
            with errors_at(f"{self.source}: {side}.lidar", "--lidar: "):
                drive = drive.with_lidar_preset(left.pop("lidar"))
        if "returns" in left:
            returns, weather = left.pop("returns"), left.pop("weather", None)
            if returns not in _RETURNS:
                raise InputError(
                    f"{self.source}: {side}.returns: {returns!r} is neither"
                    f" {' nor '.join(_RETURNS)}"
                )
            if weather is not None:
                where = f"{self.source}: {side}.weather"
                weather = validated(WeatherConfig, weather, where)
                if returns != "calibrated" and weather != WeatherConfig():
                    raise InputError(f"{where}: no effect on {returns} returns")
            drive = drive.with_returns(returns, weather)
            left.setdefault("seed", seed)
        lateral = left.pop("lateral", 0.0)
        viewpoint = left.pop("viewpoint", None)
        if lateral and viewpoint is not None:
            raise InputError(
                f"{self.source}: {side}.lateral: give it or a viewpoint"
            )
        if lateral:
            viewpoint = (lateral, 0.0)
        if not is_query and self.same_route:
            place = self._viewpoint(
                side, "near" if viewpoint is None else viewpoint
            )
            drive = with_lidars_moved(drive, _AHEAD, *place)
        elif viewpoint is not None:
            drive = with_lidars_moved(
                drive, 0.0, *self._viewpoint(side, viewpoint)
            )
        stage = self._resolve_stage(side, drive, left.pop("stage", OWN))
        if stage != drive.stage:
            drive = drive.replaced(stage=stage)
        if age[0]:
            if drive.stage != self._last_stage:
                raise InputError(
                    f"{self.source}: years: stage {LAST} ages, not the stage"
                    f" {drive.stage} of the {side}"
                )
            older = "database" if is_query else "query"
            if "redraw" in left:
                raise InputError(
                    f"{self.source}: {side}.redraw: a city drawn anew does not"
                    f" age by {older}.years; give one of them"
                )
            drive = self._moved_to(older, drive, self.age, *age, seed)
        if "redraw" in left:
            wanted = left.pop("redraw")
            drive = self._moved_to(side, drive, self.redraw, wanted)
        lost = {n: left.pop(n) for n in LOSS_FIELDS if n in left}
        if lost:
            where = f"{self.source}: {side}"
            losses = validated(Losses, lost, where)
            names = lost_structures(drive, losses, seed, where)
            drive = drive.replaced(without=names)
        if isinstance(left.get("route"), Mapping):
            where = f"{self.source}: {side}.route"
            drawn = validated(DrawnRoute, left.pop("route"), where)
            wanted = drive.folder.roads, drawn.length, drawn.seed
            known = self._drawn.get(wanted)
            route = known or self._draw(*wanted)
            drive = drive.replaced(route=route, waypoints=None)
            if known is None:
                self._check_map(side, drive, {"route": route})
                self._drawn[wanted] = route
        for name in _SEEDED:
            if isinstance(left.get(name), dict):
                left[name] = {"seed": seed, **left[name]}
        self._fit_traffic(drive, left)
        if left:
            drive = drive.with_fields(left, f"{self.source}: {side}")
            self._check_map(side, drive, left)
        for name in set(_SEEDED) & set(left):
            # Sections without random numbers get no seed, so that equal ones
            # stay equal.
            plain = type(getattr(drive, name))()
            if getattr(drive, name).replaced(seed=plain.seed) == plain:
                drive = drive.replaced(**{name: plain})
        return drive

    def _draw(self, file: Path, length: float, seed: int) -> Route:
        if file not in self._networks:
            self._networks[file] = load_road_network(file)
        rng = np.random.default_rng(seed)
        return draw_route(self._networks[file], length, rng)

    def _moved_to(
        self,
        side: str,
        drive: Scenario,
        make: Callable[..., tuple[str, str]],
        *arguments: Any,
    ) -> Scenario:
        """Returns a drive moved to the map and stage that `make` returns."""
        try:
            folder, stage = make(drive, *arguments)
        except InputError as error:
            raise InputError(f"{self.source}: {side}.{error}") from None
        return drive.replaced(map=folder, stage=stage)

    def _viewpoint(self, side: str, viewpoint: Any) -> tuple[float, float]:
        """Returns offset to the left [m] and heading [deg] of a viewpoint."""
        if isinstance(viewpoint, str) and viewpoint in VIEWPOINTS:
            return VIEWPOINTS[viewpoint]
        try:
            left, heading_deg = viewpoint
            if abs(left) <= 100 and abs(heading_deg) <= 360:
                return float(left), float(heading_deg)
        except (TypeError, ValueError):
            pass
        raise InputError(
            f"{self.source}: {side}.viewpoint: {viewpoint!r} is neither"
            f" {', '.join(VIEWPOINTS)} nor [metres to the left, heading in deg]"
        )

    def _resolve_stage(self, side: str, drive: Scenario, wanted: Any) -> str:
        """Returns the stage for a stage's name or for a word such as `last`."""
        own = str(drive.stage)
        last = self._last_stage
        stages = list(drive.folder.stages())
        if wanted in (OWN, LAST, FIRST):
            return {OWN: own, LAST: last, FIRST: next(iter(stages), own)}[
                wanted
            ]
        if isinstance(wanted, str) and wanted.startswith(EARLIER):
            before = [
                one for one in stages if natural_key(one) < natural_key(last)
            ]
            number = min(_STEPS, len(before))
            step = wanted.removeprefix(EARLIER)
            back = _STEPS - int(step) if step in ("1", "2", "3", "4") else -1
            if back >= 0:
                if not before:
                    raise MissingError(f"no stage before {last}")
                if back >= number:
                    raise MissingError(
                        f"stages before {last}: {len(before)}, so none for"
                        f" '{wanted}'"
                    )
                return before[back * (len(before) - 1) // max(1, number - 1)]
        if wanted in stages:
            return str(wanted)
        raise InputError(
            f"{self.source}: {side}.stage: {wanted!r}:"
            f" {drive.folder.name} has {', '.join(stages)}; or give"
            f" {OWN}, {LAST}, {FIRST} or '{EARLIER}1' to '{EARLIER}{_STEPS}'"
        )

    def _fit_traffic(self, drive: Scenario, fields: dict[str, Any]) -> None:
        """Reduces traffic to what roads hold; drops impossible lane changes."""
        driver, traffic = (
            one if isinstance(one := fields.get(name), Mapping) else {}
            for name in ("driver", "traffic")
        )
        if driver.get("lane_changes") and drive.waypoints:
            self.on_note("waypoints have no lanes to change")
            fields["driver"] = {**driver, "lane_changes": 0.0}
        if not traffic:
            return
        follows = driver.get("follows")
        share = _FOLLOWED_ROOM if follows else _MOST_ROOM
        graph = load_ways(self.query.folder).graph
        most = int(share * room_for_vehicles(graph))
        for name in ("vehicles", "walkers"):
            if isinstance(given := traffic.get(name), int) and given > most:
                self.on_note(
                    f"{given} {name} do not fit the roads; {most} move"
                )
                traffic = fields["traffic"] = {**traffic, name: most}

    def _check_map(self, side: str, drive: Scenario, given: Changes) -> None:
        """Checks that the given fields of a drive fit its map."""
        where = f"{self.source}: {side}"
        with errors_at(where, f"{drive.source}: "):
            check_files(drive)
            # Other sections seldom fail, and a plan takes time.
            if set(given) - {*_SEEDED, "seed"}:
                count_frames(drive, plan_drive(drive))
        world = drive.world_file, drive.without
        if "without" in given and world not in self._loaded:
            with errors_at(f"{where}.without"):
                load_world(world[0], without=drive.without)
            self._loaded.add(world)

    def _with_unique_name(
        self, side: str, drive: Scenario, factors: Changes, seed: int
    ) -> Scenario:
        """Returns a drive with a name that no other drive has.

        A drive that was built before keeps its name.
        """
        content = fingerprint(drive.replaced(name="").model_dump(mode="json"))
        known = self._known[side]
        if content not in known:
            name = drive.name
            plain = self._plain[side]
            if not self.same_route and drive == plain.replaced(
                stage=drive.stage
            ):
                if drive != plain:
                    drive = control_drive(plain, str(drive.stage))
                    name = drive.name
            elif drive != plain:
                name += f"_{_name_suffix(side, factors, seed)}"
            if name in {one.name for one in known.values()}:
                name += f"_{content[:6]}"
            known[content] = drive.replaced(name=name)
        return known[content]


def control_drive(drive: Scenario, stage: str) -> Scenario:
    """Returns a copy of a drive that goes through another stage of the map.

    Route and driver stay the same. The copy and the usual drive of the other
    stage go through the same city, so a comparison of these two drives shows
    only the effect of the route.

    Args:
        drive: the drive.
        stage: the other stage of its map.
    """
    driver = drive.driver
    if driver.departs and driver.seed is None:
        driver = driver.replaced(seed=drive.name)
    return drive.replaced(
        name=f"{drive.name}_stage_{stage}",
        stage=stage,
        title=f"Control: the route of {drive.name} in stage {stage}",
        driver=driver,
    )


def _years_aged(database: Changes, sessions: Mapping[str, Changes]) -> int:
    """Returns by how many years the city of the query is aged."""
    return max(one.get("years", 0) for one in (database, *sessions.values()))


def _drive_length(changes: Changes) -> float:
    """Returns about how long a drive is with these changes [m]."""
    route = changes.get("route")
    if isinstance(route, Mapping):
        return float(route["length"])
    return USUAL_LENGTH


def _factors_of(place: str, factors: Changes) -> dict[str, Any]:
    """Returns the factors of a condition that concern a drive of a database.

    Its own ones are named as if it were the only drive. Those of other drives,
    and what all drives share, are left out.
    """
    several = tuple(f"database.{name}" for name in (SESSIONS, FLEET))
    found = {}
    for path, value in factors.items():
        if path.startswith(f"{place}."):
            path = f"database.{path.removeprefix(place)[1:]}"
        elif path.startswith(several) or path in (
            "database.keep",
            "database.maintain",
        ):
            continue
        found[path] = value
    return found


def _name_suffix(side: str, given: Changes, seed: int) -> str:
    """Returns the suffix of the name of a changed drive."""
    factors = dict(given)
    labels = []
    cause, level = factors.pop(CAUSE, NO_CAUSE), factors.pop(LEVEL, 0)
    for path, value in factors.items():
        name = path.rpartition(".")[2]
        is_own = path.partition(".")[0] in (side, "both")
        if is_own != (name in ("years", "rates")) or path.startswith("both."):
            text = str(value).replace(".", "p").replace("-", "m")
            labels.append(f"{name}_{re.sub(r'[^A-Za-z0-9]+', '_', text)}")
    if cause != NO_CAUSE:
        labels.append(f"{cause}_{level}")
    return "_".join([*labels, str(seed)])


def with_lidars_beside(drive: Scenario) -> Scenario:
    """Returns a drive with its LiDARs moved 1.25 m ahead and 0.5 m to the left.

    This is the default viewpoint of a database on the same route as the
    queries, so that the two drives do not coincide.
    """
    return with_lidars_moved(drive, _AHEAD, *VIEWPOINTS["near"])


def with_lidars_moved(
    drive: Scenario, ahead: float, left: float, heading_deg: float
) -> Scenario:
    """Returns a drive whose LiDARs are mounted elsewhere on the vehicle.

    Args:
        drive: the drive.
        ahead: how far the LiDARs are moved forwards [m].
        left: how far the LiDARs are moved to the left [m].
        heading_deg: angle by which the LiDARs are rotated to the left [deg].
    """
    lidars = {}
    for name, config in drive.lidars.items():
        (x, y, z), (roll, pitch, yaw) = config.xyz, config.rpy_deg
        lidars[name] = config.replaced(
            xyz=(x + ahead, y + left, z),
            rpy_deg=(roll, pitch, yaw + heading_deg),
        )
    return drive.replaced(lidars=lidars)
