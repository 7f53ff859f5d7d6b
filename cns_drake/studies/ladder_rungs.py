"""The rungs of a ladder on a map: causes of change, and their strengths.

Each cause changes one of the two drives. The city at the time of mapping, the
ride and the place of the mapping LiDAR change the drive of the database.
Conditions and sensor of the later visit change the drive of the query, but
never its route. Turned, tilted and partly hidden sensors see the same drive.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
import itertools
import math
from pathlib import Path
from typing import Any

from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.yaml_files import read_yaml
from cns_drake.scenarios.scenario import (
    REAL_DRIVER,
    DriverConfig,
    RideConfig,
    Scenario,
    TrafficConfig,
)
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.sensors.lidar.config import WeatherConfig
from cns_drake.simulation.loaded_drive import load_ways
from cns_drake.traffic.vehicles import room_for_vehicles
from evaluation.recognition.protocol import RetrievalProtocol

# The unchanged world, and all causes together.
NONE = "none"
ALL = "all"
# The strongest level; that of `none` is 0.
STRONGEST = 4
# Switches of the section `transient` of a scenario.
_TRANSIENT = (
    "parked_cars",
    "leaves",
    "snow",
    "scaffolds",
    "works",
    "furniture",
)
# Cause -> the option of the protocol that changes the sensor of each query.
_QUERY_CHANGES = {
    "hidden": "hide_sector",
    "turn": "turn_queries",
    "tilt": "tilt_queries",
}
CAUSES = (
    NONE,
    "construction",
    *_TRANSIENT,
    "traffic",
    "weather",
    "returns",
    "ride",
    "sensor",
    *_QUERY_CHANGES,
    "driver",
    "viewpoint",
    "lateral",
    "size",
    ALL,
)
# Only on request: a unit that looks ahead alone is a question of its own.
EXTRAS = ("narrow_sensor",)
# The order in which causes change drives: returns depend on the sensor.
_ORDER = (
    *("sensor", "narrow_sensor", "returns", "weather", *_TRANSIENT, "traffic"),
    *("construction", "ride", *_QUERY_CHANGES, "driver", "viewpoint"),
    *("lateral", "size"),
)
# Stands between the names of two causes at once.
PAIRED = "+"
# Causes that take no part in `all`, nor in pairs.
APART = frozenset({"driver", "lateral", *EXTRAS})
# Causes that another seed draws anew.
RANDOM_CAUSES = frozenset(
    {*_TRANSIENT, *_QUERY_CHANGES, "traffic", "weather", "returns", "ride"}
    | {"driver", ALL}
)

# Greatest share of the roads' room for traffic: the car needs some, too.
_MOST_ROOM = 0.5
# Likewise for a car that follows others, since all wait for each other.
_FOLLOWED_ROOM = 0.25
# No driver keeps exactly to a line: the LiDAR of the database is this far ahead
# of the query's [m].
_AHEAD = 1.25
# Where it is on all rungs: its offset to the left [m], and its heading [deg].
VIEWPOINTS: Mapping[str, tuple[float, float]] = {
    "near": (0.5, 0.0),
    "lane": (5.0, 0.0),
    "reversed": (5.0, 180.0),
}
NEAR = "near"
# A strength of traffic: vehicles stand in all lanes.
QUEUES = "queues"
# Vehicles in the streets of a driver who follows others.
_FOLLOWED = 24

_CAUSES = read_yaml(Path(__file__).with_name("causes.yaml"))
# Cause -> level -> strength. The levels of construction are the map's stages.
STRENGTHS: Mapping[str, Mapping[int, Any]] = {
    cause: one["strengths"]
    for cause, one in _CAUSES.items()
    if "strengths" in one
}
# Likewise of all causes together: at the strengths above nothing would be left
# to measure. From level to level they grow by little.
LEVEL_STRENGTHS: Mapping[str, Mapping[int, Any]] = {
    cause: one["levels"] for cause, one in _CAUSES.items() if "levels" in one
}


@dataclass(frozen=True)
class RungDrives:
    """The drives of a rung of a ladder.

    Attributes:
        lateral: distance between the two ways that a match has to bridge [m].
        query_changes: option of the protocol -> what it does to the sensor of
            each query.
    """

    database: Scenario
    query: Scenario
    num_distractors: int = 0
    lateral: float = 0.0
    query_changes: Mapping[str, Any] = field(default_factory=dict)

    def protocol(self, common: RetrievalProtocol) -> RetrievalProtocol:
        """Returns the protocol of the rung."""
        return replace(
            common, radius=self.radius(common.radius), **self.query_changes
        )

    def radius(self, along: float) -> float:
        """Returns the radius of a match from its reach along the way [m].

        On a straight road, as many places match at any lateral distance.
        """
        return math.hypot(along, self.lateral)


def plain_drives(scenario: Scenario, viewpoint: str = NEAR) -> RungDrives:
    """Returns the drives without a change: one route, one city."""
    name = f"{scenario.name}_database"
    if viewpoint != NEAR:
        name += f"_{viewpoint}"
    database = scenario.replaced(name=name)
    left, heading_deg = VIEWPOINTS[viewpoint]
    moved = mapped_from(database, _AHEAD, left, heading_deg)
    return RungDrives(moved, scenario)


def changed_drives(
    plain: RungDrives, strengths: Mapping[str, Any], seed: int
) -> RungDrives:
    """Returns drives with causes of change between them."""
    drives = plain
    for cause in _ORDER:
        if cause in strengths:
            drives = _changed(drives, cause, strengths[cause], seed)
    return drives


def in_words(cause: str, strength: Any) -> str:
    """Returns a strength as text."""
    if strength == QUEUES:
        return "queues in all lanes"
    return _CAUSES[cause]["words"].format(strength)


def _changed(
    drives: RungDrives, cause: str, strength: Any, seed: int
) -> RungDrives:
    """Returns drives with one more cause of change between them."""
    query, database = drives.query, drives.database
    if cause in ("sensor", "narrow_sensor"):
        query = query.with_lidar_preset(strength)
    elif cause in ("returns", "weather"):
        weather = None
        if cause == "weather":
            weather = WeatherConfig(visibility=strength)
        query = query.with_returns("calibrated", weather)
        query = query.replaced(seed=seed)
    elif cause in _TRANSIENT:
        query = query.with_transient(**{cause: strength, "seed": seed})
    elif cause == "traffic":
        traffic = TrafficConfig(queues=True, seed=seed)
        if strength != QUEUES:
            traffic = _vehicles(int(strength), seed)
        query = query.replaced(traffic=traffic)
    elif cause == "construction":
        database = database.replaced(stage=strength)
    elif cause == "ride":
        ride = RideConfig(roughness=strength, seed=seed)
        database = database.replaced(ride=ride)
    elif cause == "driver":
        database = _driven(database, strength, seed)
    elif cause == "viewpoint":
        database = _seen_from(database, *strength)
    elif cause == "lateral":
        database = _seen_from(database, strength, 0.0)
        return replace(drives, database=database, lateral=strength)
    elif cause == "size":
        return replace(drives, num_distractors=strength)
    else:
        option = {_QUERY_CHANGES[cause]: strength, "seed": seed}
        return replace(drives, query_changes={**drives.query_changes, **option})
    return replace(drives, query=query, database=database)


def _vehicles(number: int, seed: int) -> TrafficConfig:
    return TrafficConfig(vehicles=number, walkers=number, seed=seed)


def _driven(drive: Scenario, strength: str, seed: int) -> Scenario:
    """Returns a drive by another driver."""
    driver: dict[str, Any] = {
        "wander": REAL_DRIVER.wander,
        "wander_length": REAL_DRIVER.wander_length,
        "seed": seed,
    }
    update: dict[str, Any] = {}
    if strength != "wander" and drive.waypoints is None:
        driver["lane_changes"] = REAL_DRIVER.lane_changes
    if strength in ("all", "reversed"):
        room = room_for_vehicles(load_ways(map_folder(drive)).graph)
        number = min(_FOLLOWED, int(_FOLLOWED_ROOM * room))
        update["traffic"] = _vehicles(number, seed)
        driver["follows"] = True
    update["driver"] = DriverConfig(**driver)
    changed = drive.replaced(**update)
    if strength == "reversed":
        return _seen_from(changed, *VIEWPOINTS["reversed"])
    return changed


def _seen_from(drive: Scenario, left: float, heading_deg: float) -> Scenario:
    """Returns a drive with its LiDARs moved from where plain drives have it."""
    return mapped_from(drive, 0.0, left - VIEWPOINTS[NEAR][0], heading_deg)


def mapped_from(
    scenario: Scenario, ahead: float, left: float, heading_deg: float
) -> Scenario:
    """Returns a scenario with LiDARs moved [m] and turned to the left [deg]."""
    lidars = {}
    for name, config in scenario.lidars.items():
        (x, y, z), (roll, pitch, yaw) = config.xyz, config.rpy_deg
        update = {
            "xyz": (x + ahead, y + left, z),
            "rpy_deg": (roll, pitch, yaw + heading_deg),
        }
        lidars[name] = config.replaced(**update)
    return scenario.replaced(lidars=lidars)


@dataclass(frozen=True)
class Rung:
    """One of `CAUSES` at a level from 1 to 4; `none` has level 0."""

    cause: str
    level: int
    seed: int
    strength: str
    drives: RungDrives

    def fingerprint(self) -> str:
        """Returns a fingerprint of the drives."""
        return fingerprint(
            {
                "database": self.drives.database.model_dump(mode="json"),
                "query": self.drives.query.model_dump(mode="json"),
                "distractors": self.drives.num_distractors,
                **self.drives.query_changes,
            }
        )


@dataclass(frozen=True)
class Extent:
    """The measured part of the ladder.

    Attributes:
        causes: some of `CAUSES`, without `none`, which is always there.
        levels: from 1 to 4. A cause that lacks one gets its nearest lower
            level.
        strengths: cause -> level -> strength; construction's are the map's
            stages.
        viewpoint: one of `VIEWPOINTS`; of the database on all rungs.
    """

    causes: Collection[str] = CAUSES[1:]
    levels: Sequence[int] = (1, 2, 3, 4)
    seeds: Sequence[int] = (1,)
    most_places: int = 10_000
    strengths: Mapping[str, Mapping[int, Any]] = field(
        default_factory=lambda: STRENGTHS
    )
    viewpoint: str = NEAR


def plan_pairs(
    scenario: Scenario, causes: Sequence[str], extent: Extent
) -> list[Rung]:
    """Returns the rungs of each two causes at once, at their strongest."""
    plain = plain_drives(scenario, extent.viewpoint)
    known, _ = _known_strengths(scenario, extent)
    rungs = []
    for one, other in itertools.combinations(causes, 2):
        if one not in known or other not in known:
            continue
        strengths = {
            name: known[name][max(known[name])] for name in (one, other)
        }
        text = "; ".join(in_words(*item) for item in strengths.items())
        seeds = extent.seeds
        if not RANDOM_CAUSES.intersection(strengths):
            seeds = seeds[:1]
        rungs += [
            _rung(
                f"{one}{PAIRED}{other}", STRONGEST, seed, text, plain, strengths
            )
            for seed in seeds
        ]
    return rungs


def plan_rungs(
    scenario: Scenario, extent: Extent
) -> tuple[list[Rung], list[str]]:
    """Returns the rungs of a ladder, `none` first, and notes on missing ones.

    Raises:
        InputError: the map's roads cannot be used.
    """
    plain = plain_drives(scenario, extent.viewpoint)
    known, notes = _known_strengths(scenario, extent)
    rungs = [Rung(NONE, 0, extent.seeds[0], "", plain)]
    for cause in (*CAUSES[1:], *EXTRAS):
        if cause not in extent.causes or cause not in (*known, ALL):
            continue
        members = set(known) - APART if cause == ALL else {cause}
        found = {
            level: _strengths_at(
                {one: known[one] for one in known if one in members}, level
            )
            for level in _levels(known.get(cause), extent.levels)
        }
        seeds = extent.seeds if cause in RANDOM_CAUSES else extent.seeds[:1]
        for level, strengths in found.items():
            text = "" if cause == ALL else in_words(cause, strengths[cause])
            rungs += [
                _rung(cause, level, seed, text, plain, strengths)
                for seed in seeds
            ]
    return rungs, notes


def _rung(
    cause: str,
    level: int,
    seed: int,
    text: str,
    plain: RungDrives,
    strengths: Mapping[str, Any],
) -> Rung:
    drives = changed_drives(plain, strengths, seed)
    # A drive that differs from the plain one needs another name.
    ending = f"{cause.replace(PAIRED, '_')}_{level}_{seed}"
    for role in ("database", "query"):
        drive = getattr(drives, role)
        if drive != getattr(plain, role):
            name = f"{drive.name}_{ending}"
            drives = replace(drives, **{role: drive.replaced(name=name)})
    return Rung(cause, level, seed, text, drives)


def _known_strengths(
    scenario: Scenario, extent: Extent
) -> tuple[dict[str, dict[int, Any]], list[str]]:
    """Returns the strengths that a map allows, and notes on the others."""
    folder = map_folder(scenario)
    known = {cause: dict(levels) for cause, levels in extent.strengths.items()}
    notes = []
    before = [s for s in folder.stages() if s < str(scenario.stage)]
    known["construction"] = _stage_levels(before)
    if not before:
        notes.append(f"no stage before {scenario.stage}: no construction")
    if folder.roads.is_file() or folder.lanes.is_file():
        room = int(_MOST_ROOM * room_for_vehicles(load_ways(folder).graph))
        known["traffic"] = {
            level: number if number == QUEUES else min(number, room)
            for level, number in known["traffic"].items()
        }
    else:
        known["traffic"] = {}
        drivers = ("wander", "lanes")
        known["driver"] = {
            level: driver
            for level, driver in known.get("driver", {}).items()
            if driver in drivers
        }
        notes.append("neither roads.yaml nor lanes.json: no traffic")
    if extent.viewpoint != NEAR:
        # They say themselves where the LiDAR is.
        for cause in ("viewpoint", "lateral"):
            known.pop(cause, None)
        known.get("driver", {}).pop(STRONGEST, None)
        notes.append(
            f"--viewpoint {extent.viewpoint}: no viewpoint, lateral and "
            "reversed driver"
        )
    known["size"] = {
        level: number
        for level, number in known["size"].items()
        if number <= extent.most_places
    }
    return {cause: levels for cause, levels in known.items() if levels}, notes


def _stage_levels(stages: Sequence[str]) -> dict[int, Any]:
    """Returns level -> stage, evenly chosen; the strongest is the first."""
    number = min(STRONGEST, len(stages))
    return {
        STRONGEST - k: stages[k * (len(stages) - 1) // max(1, number - 1)]
        for k in range(number)
    }


def _levels(
    known: Mapping[int, Any] | None, wanted: Sequence[int]
) -> list[int]:
    """Returns levels in order; all of them for None."""
    if known is None:
        return sorted(wanted)
    nearest = {max((k for k in known if k <= w), default=0) for w in wanted}
    return sorted(nearest - {0})


def _strengths_at(
    known: Mapping[str, Mapping[int, Any]], level: int
) -> dict[str, Any]:
    """Returns cause -> its strength at a level, or the nearest lower one."""
    return {
        cause: levels[max(lower)]
        for cause, levels in known.items()
        if (lower := [k for k in levels if k <= level])
    }
