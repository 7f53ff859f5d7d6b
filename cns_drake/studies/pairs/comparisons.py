"""Makes the pair of drives of each condition of an experiment."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
import re
from typing import Any

from cns_drake.scenarios import Scenario, in_made_city
from cns_drake.simulation import SimulationSource
from cns_drake.studies.drives.changed_drives import (
    DATABASE_FIELDS,
    DriveChanger,
    check_side,
    checked_maintainer,
    control_drive,
    with_fixed_driver,
)
from cns_drake.studies.drives.named_stages import MissingError, find_stage
from cns_drake.studies.drives.sampled_drives import Fleet
from cns_drake.studies.pairs.map_upkeep import with_upkept_maps
from evaluation.base import (
    InputError,
    Store,
    errors_at,
    fingerprint,
    merged,
    natural_key,
    validated,
)
from evaluation.map_update import NOT_MAINTAINED
from evaluation.recognition import KEEP_ALL, checked_keep
from evaluation.results import CAUSE, LEVEL, NO_CAUSE, OWN
from evaluation.study import (
    FLEET,
    SESSIONS,
    Changes,
    Condition,
    Pair,
    StudyDrive,
    condition_protocol,
    factors_in_words,
    protocol_from_fields,
)

# Fields of the protocol that change the scans of the queries at random.
QUERY_SCANS = ("turn_queries", "tilt_queries", "hide_sector")
# Greatest length of a value in the name of a drive, which names its folder.
_LONGEST_LABEL = 48


@dataclass
class PairMaker:
    """Changes two drives of a map as the conditions of an experiment say.

    Attributes:
        database: the drive that makes the database, without any change.
        query: the drive that makes the queries, without any change.
        same_route: whether the database drive follows the query's route.
        map_name: name of the map in tables.
        of_map: values of factors that only this map has.
        output: folder of the study, with the cities that are made.
        source: file of the experiment, for errors.
        on_note: is called with a note on everything that is left out.
    """

    database: Scenario
    query: Scenario
    same_route: bool
    map_name: str
    of_map: Changes
    output: Path
    source: str
    on_note: Callable[[str], object]

    def __post_init__(self) -> None:
        # The names of drives change, but not their drivers.
        self._unchanged = {
            "database": with_fixed_driver(self.database),
            "query": with_fixed_driver(self.query),
        }
        self._last_stage = max(
            (str(one.stage) for one in (self.database, self.query)),
            key=natural_key,
        )
        self._changer = DriveChanger(
            self.source, self._last_stage, self.on_note
        )
        self._names = {
            side: _UniqueNames(side, drive, with_controls=not self.same_route)
            for side, drive in self._unchanged.items()
        }

    def build(self, condition: Condition, seed: int) -> Pair:
        """Returns the pair of drives under a condition.

        Cities that must be made are not there yet.

        Args:
            condition: the changes to make to the two drives.
            seed: seed of the random choices of these changes.

        Raises:
            MissingError: the map lacks what the condition needs.
            InputError: a field is unknown or not usable.
        """
        try:
            return self._build(condition, seed)
        except InputError as error:
            raise InputError(
                _as_written(error, self.source, condition)
            ) from error

    def _build(self, condition: Condition, seed: int) -> Pair:
        fields = self._fields(condition)
        both = fields.get("both", {})
        database = merged(both, fields.get("database", {}))
        query = merged(both, fields.get("query", {}))
        sessions = _session_fields(database, _years(query), seed, self.source)
        if CAUSE not in condition.factors:
            # Years of cases may need the rates of all conditions.
            self._check_rates(fields, sessions, query)
        for place, changes in sessions.items():
            check_side(place, changes, self.source)
        if SESSIONS in database:
            check_side("database", database, self.source)
        check_side("query", query, self.source)
        drives = self._database_drives(sessions, query, condition, seed)
        changed = self._changer.changed(
            self._unchanged["query"], "query", query, seed
        )
        asked_drive = self._names["query"].named(
            changed, condition.factors, seed
        )
        stated = condition_protocol(condition, self.source)
        of_cause = self._query_scans(fields, condition, seed)
        protocol = protocol_from_fields(
            {**fields.get("protocol", {}), **of_cause}, self.source
        )
        where = f"{self.source}: database"
        keep = checked_keep(database.get("keep", KEEP_ALL), f"{where}.keep")
        maintainer = checked_maintainer(
            database.get("maintain", NOT_MAINTAINED),
            len(drives),
            f"{where}.maintain",
        )
        # Without a later year, the city of the query has not aged.
        ages = asked_drive.city.years > 0
        places = tuple(self._drive("database", one, ages) for one in drives)
        way = None
        if self.same_route:
            older = self._way_through_older_city(drives[0], asked_drive)
            way = self._drive("query", older, ages)
        distractors = database.get("distractors", 0)
        return Pair(
            map_name=self.map_name,
            names=(
                self.database.name.removesuffix("_database"),
                self.query.name,
            ),
            factors={**self.of_map, **condition.factors},
            seed=seed,
            baseline={**self.of_map, **condition.baseline},
            stated=stated,
            database=with_upkept_maps(
                places, maintainer, Store(self.output / "parts")
            ),
            query=self._drive("query", asked_drive, ages),
            protocol=protocol,
            num_distractors=distractors,
            keep=keep,
            way=way,
            may_repeat=bool(of_cause or distractors),
        )

    def _drive(self, side: str, drive: Scenario, ages: bool) -> StudyDrive:
        with errors_at(self.source):
            in_city = in_made_city(drive, self.output / "cities")
        return StudyDrive(
            drive.name,
            SimulationSource(in_city),
            self._names[side].title(drive),
            drive.city.years if ages else None,
        )

    def _way_through_older_city(
        self, database: Scenario, query: Scenario
    ) -> Scenario:
        """Returns the query's drive, but through the city of the database."""
        plain = self.query
        city = ("map", "stage", "without", "city", "transient")
        drive = query.replaced(
            **{name: getattr(database, name) for name in city}, name=plain.name
        )
        if drive.replaced(name=query.name) == query:
            return query
        if drive == plain:
            return plain
        content = fingerprint(drive.model_dump(mode="json"))[:8]
        return drive.replaced(name=f"{plain.name}_way_{content}")

    def _fields(self, condition: Condition) -> dict[str, Any]:
        """Returns the fields of a condition and of its causes, by section.

        Each cause has the first level that is possible on the map.

        Raises:
            MissingError: the condition has causes, and none is possible.
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
        fields: dict[str, Any] = {}
        for one in chosen:
            for section, values in one.items():
                fields[section] = merged(fields.get(section, {}), values)
        return fields

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
                    self._find_stage(side, "database", stage)
            except MissingError as error:
                missing = error
                del left["stage"]
            try:
                self._check_traffic(left.get("traffic"))
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

    def _find_stage(self, place: str, side: str, wanted: Any) -> str:
        """Returns the stage that a drive's field `stage` = `wanted` means."""
        with errors_at(f"{self.source}: {place}.stage", field="stage"):
            return find_stage(wanted, self._unchanged[side], self._last_stage)

    def _check_traffic(self, traffic: Any) -> None:
        """Checks that the map has what its traffic needs."""
        folder = self.query.folder
        if not isinstance(traffic, Mapping):
            return
        for needed, fields in (
            (folder.traffic, ("vehicles", "walkers")),
            (folder.roads, ("queues",)),
        ):
            if not needed.is_file() and any(map(traffic.get, fields)):
                raise MissingError(f"no {needed.name}: no traffic")

    def _check_rates(
        self,
        fields: Mapping[str, Changes],
        sessions: Mapping[str, Changes],
        query: Changes,
    ) -> None:
        """Checks that rates of change are given only where a city ages.

        Args:
            fields: the fields of a condition, by section.
            sessions: maps the path of each database drive in the experiment's
                file to the fields of the drive.
            query: fields of the query drive.
        """
        drives = {
            "both": [*sessions.values(), query],
            "database": [*sessions.values()],
            "query": [query],
        }
        for section, values in fields.items():
            if "rates" in _city(values) and not any(
                "years" in _city(one)
                for one in drives.get(section, drives["both"])
            ):
                raise InputError(
                    f"{self.source}: {section}.city.rates: those of no years"
                )

    def _database_drives(
        self,
        sessions: Mapping[str, Changes],
        query: Changes,
        condition: Condition,
        seed: int,
    ) -> list[Scenario]:
        """Returns the drives of a database, from older to newer.

        Args:
            sessions, query: see `_check_rates`.
        """
        stages = list(self.query.folder.stages())
        stage = self._find_stage("query", "query", query.get("stage", OWN))
        last = stages.index(stage) if stage in stages else len(stages)
        found: list[tuple[tuple[Any, ...], str, Scenario]] = []
        known: dict[str, str] = {}
        for place, changes in sessions.items():
            drive = self._names["database"].named(
                self._changer.changed(
                    self._unchanged["database"], place, changes, seed
                ),
                _session_factors(place, condition.factors),
                seed,
            )
            stage, years = str(drive.stage), drive.city.years
            is_later = stages.index(stage) > last if stage in stages else False
            if place != "database" and (years > _years(query) or is_later):
                raise InputError(
                    f"{self.source}: {place}: this drive is later than the"
                    " query"
                )
            before = known.setdefault(drive.name, place)
            if before != place:
                raise InputError(
                    f"{self.source}: {place}: the same drive as {before}"
                )
            found.append(((years, natural_key(stage)), place, drive))
        found.sort(key=lambda one: one[0])
        return [drive for *_, drive in found]

    def _query_scans(
        self, fields: Changes, condition: Condition, seed: int
    ) -> dict[str, Any]:
        """Returns the fields with which causes change the queries' scans.

        Their random numbers depend on the seed of the condition.
        """
        stated = condition.changes.get("protocol", {})
        protocol = fields.get("protocol", {})
        found = {
            name: protocol[name]
            for name in QUERY_SCANS
            if name in protocol and name not in stated
        }
        return {**found, "seed": seed} if found else {}


def _city(changes: Changes) -> Changes:
    """Returns the section `city` of a drive's fields, without a check."""
    city = changes.get("city")
    return city if isinstance(city, Mapping) else {}


def _years(changes: Changes) -> int:
    """Returns by how many years the city of a drive has aged, or 0."""
    years = _city(changes).get("years", 0)
    return years if type(years) is int else 0


# Fields that describe a database, not its drives.
_OF_DATABASE = ("keep", "maintain")
# Fields that put a drive into another frame of reference.
_FRAME_FIELDS = ("map", "world")


def _as_written(error: InputError, source: str, condition: Condition) -> str:
    """Returns a fault of a drive's field, with the section that sets the field.

    That can be `both` or a case, of which the drive's section knows nothing.
    """
    fault, field = str(error), error.field
    for side in ("database", "query", "protocol"):
        start = f"{source}: {side}"
        if field and fault.startswith(start):
            break
    else:
        return fault
    sections = {n: condition.changes.get(n, {}) for n in (side, "both")}
    case = f"cases.{condition.factors.get(CAUSE)}"
    for cause in condition.causes:
        for name in (side, "both"):
            changes = cause[0].get(name, {}) if cause else {}
            sections[f"{case}.{name}"] = {
                **sections.get(f"{case}.{name}", {}),
                **changes,
            }
    for section, fields in sections.items():
        if field in fields:
            return f"{source}: {section}{fault.removeprefix(start)}"
    return fault


def _session_fields(
    database: Changes, query_years: int, seed: int, source: str
) -> dict[str, dict[str, Any]]:
    """Returns the fields of each drive of a database.

    Each drive has the fields of the database. A field of the drive's own
    replaces the same field of the database.

    Args:
        database: fields of the database.
        seed: seed of a fleet that has no own seed.
        source: file of the experiment, for errors.

    Returns:
        The fields of each drive, by the path of the drive in the file, such as
        `database.sessions.2`.
    """
    shared = dict(database)
    for name in _OF_DATABASE:
        shared.pop(name, None)
    if FLEET in database:
        sessions: Any = _fleet_sessions(database, query_years, seed, source)
        del shared[FLEET]
    elif SESSIONS in database:
        sessions = shared.pop(SESSIONS)
    else:
        return {"database": shared}
    if isinstance(sessions, Mapping):
        # A factor of a drive makes the list a mapping of its numbers.
        numbers = [str(k) for k in range(1, len(sessions) + 1)]
        is_list = list(sessions) == numbers
        sessions = list(sessions.values()) if is_list else None
    if not (isinstance(sessions, list) and sessions):
        raise InputError(
            f"{source}: database.{SESSIONS}: not a list of one drive or more"
        )
    found = {}
    for number, own in enumerate(sessions, start=1):
        place = f"database.{SESSIONS}.{number}"
        _check_own_fields(own, f"{source}: {place}")
        found[place] = merged(shared, own)
    return found


def _fleet_sessions(
    database: Changes, query_years: int, seed: int, source: str
) -> list[dict[str, Any]]:
    where = f"{source}: database.{FLEET}"
    if SESSIONS in database:
        raise InputError(f"{where}: give it or {SESSIONS}")
    fleet = database[FLEET]
    if isinstance(fleet, Mapping):
        fleet = {"seed": seed, **fleet}
    found = validated(Fleet, fleet, where)
    if found.years > query_years:
        raise InputError(
            f"{where}.years: {found.years} years before a query whose city has"
            f" aged by {query_years}; give query: {{city: {{years:"
            f" {found.years}}}}}, or more"
        )
    return found.sessions(query_years)


def _check_own_fields(own: Any, where: str) -> None:
    if not isinstance(own, Mapping):
        raise InputError(f"{where}: {own!r} is no mapping of fields")
    for name in _FRAME_FIELDS:
        if name in own:
            raise InputError(
                f"{where}.{name}: another map has another frame of reference"
                " than the other drives"
            )
    for name in DATABASE_FIELDS:
        if name in own:
            raise InputError(
                f"{where}.{name}: all drives share it; it is a field of"
                " database"
            )


def _session_factors(place: str, factors: Changes) -> dict[str, Any]:
    """Returns the factors of a condition that concern a drive of a database.

    Factors of this drive are named as if it were the only drive. Factors of
    other drives, and factors of the whole database, are left out.

    Args:
        place: path of the drive in the file, such as `database.sessions.2`.
        factors: name -> value, for all factors of the condition.
    """
    several = tuple(f"database.{name}" for name in (SESSIONS, FLEET))
    shared = tuple(f"database.{name}" for name in _OF_DATABASE)
    found = {}
    for path, value in factors.items():
        if path.startswith(f"{place}."):
            path = f"database.{path.removeprefix(place)[1:]}"
        elif path.startswith(several) or path in shared:
            continue
        found[path] = value
    return found


class _UniqueNames:
    """The names of the drives of a database, or of the query drives.

    Equal drives have one name, however they came about.
    """

    def __init__(
        self, side: str, unchanged: Scenario, *, with_controls: bool
    ) -> None:
        """Begins without any changed drive.

        Args:
            side: `database` or `query`.
            unchanged: the drive without any change, which keeps its name.
            with_controls: whether a drive of which only the stage has changed
                is a control drive.
        """
        self._side = side
        self._unchanged = unchanged
        self._with_controls = with_controls
        # Content of a drive -> the drive with its name.
        self._known: dict[str, Scenario] = {}
        # Name of a drive -> the factors that changed it.
        self._factors: dict[str, list[tuple[str, Any]]] = {}

    def title(self, drive: Scenario) -> str:
        """Returns what a drive is, in words."""
        factors = self._factors.get(drive.name, ())
        return factors_in_words(self._unchanged.name, factors)

    def named(self, drive: Scenario, factors: Changes, seed: int) -> Scenario:
        """Returns a drive with a name that no other drive of this side has.

        Args:
            drive: the changed drive, with the name of the unchanged drive.
            factors: name of each factor that concerns the drive -> its value.
        """
        content = fingerprint(drive.replaced(name="").model_dump(mode="json"))
        if content not in self._known:
            own = _own_factors(self._side, factors)
            if drive != self._unchanged:
                drive = self._renamed(drive, own, seed)
            if drive.name in {one.name for one in self._known.values()}:
                drive = drive.replaced(name=f"{drive.name}_{content[:6]}")
            self._known[content] = drive
            self._factors[drive.name] = own
        return self._known[content]

    def _renamed(
        self,
        drive: Scenario,
        factors: Iterable[tuple[str, Any]],
        seed: int,
    ) -> Scenario:
        """Returns a drive with a name for its changes."""
        plain = self._unchanged
        if self._with_controls and drive == plain.replaced(stage=drive.stage):
            return control_drive(plain, str(drive.stage))
        labels = [f"{name}_{_value_label(v)}" for name, v in factors]
        name = "_".join([drive.name, *labels, str(seed)])
        return drive.replaced(name=name)


def _value_label(value: object) -> str:
    """Returns a short name for the value of a factor, such as `0p5`."""
    text = str(value).replace(".", "p").replace("-", "m")
    label = re.sub(r"[^A-Za-z0-9]+", "_", text)
    if len(label) <= _LONGEST_LABEL:
        return label
    return f"{label[:20]}_{fingerprint({'value': value})[:8]}"


def _own_factors(side: str, given: Changes) -> list[tuple[str, Any]]:
    """Returns the factors that change a drive of a side, by short names."""
    factors = dict(given)
    found = []
    cause, level = factors.pop(CAUSE, NO_CAUSE), factors.pop(LEVEL, 0)
    for path, value in factors.items():
        if path.partition(".")[0] in (side, "both"):
            found.append((path.rpartition(".")[2], value))
    if cause != NO_CAUSE:
        found.append((cause, level))
    return found
