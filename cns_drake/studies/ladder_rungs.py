"""The rungs of a ladder on a map: causes and levels."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.simulation.loaded_drive import load_ways
from cns_drake.studies.ladder_causes import (
    ALL,
    APART,
    CAUSES,
    NONE,
    RANDOM_CAUSES,
    STRENGTHS,
    STRONGEST,
    RungDrives,
    changed_drives,
    in_words,
    plain_drives,
)
from cns_drake.traffic.vehicles import room_for_vehicles

# Greatest share of the roads' room for traffic: the car needs some, too.
_MOST_ROOM = 0.5


@dataclass(frozen=True)
class Rung:
    """One cause at one level.

    Attributes:
        cause: one of `CAUSES`.
        level: from 1 to 4; 0 for `none`.
        seed: of random draws.
        strength: in words.
        drives: to simulate.
    """

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
            }
        )


@dataclass(frozen=True)
class Extent:
    """The measured part of the ladder.

    Attributes:
        causes: some of `CAUSES`, without `none`, which is always there.
        levels: from 1 to 4. A cause that lacks one gets its nearest lower
            level.
        seeds: of random draws.
        most_places: most places of other cities.
        strengths: cause -> level -> strength; construction's are the map's
            stages.
    """

    causes: Collection[str] = CAUSES[1:]
    levels: Sequence[int] = (1, 2, 3, 4)
    seeds: Sequence[int] = (1,)
    most_places: int = 10_000
    strengths: Mapping[str, Mapping[int, Any]] = field(
        default_factory=lambda: STRENGTHS
    )


def plan_rungs(
    scenario: Scenario, extent: Extent
) -> tuple[list[Rung], list[str]]:
    """Returns the rungs of a ladder, `none` first, and notes on missing ones.

    Args:
        scenario: of the query, through a stage of a map.
        extent: of the ladder.

    Raises:
        InputError: the map's roads cannot be used.
    """
    plain = plain_drives(scenario)
    known, notes = _known_strengths(scenario, extent)
    rungs = [Rung(NONE, 0, extent.seeds[0], "", plain)]
    for cause in CAUSES[1:]:
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
    ending = f"{cause}_{level}_{seed}"
    for role in ("database", "query"):
        drive = getattr(drives, role)
        if drive != getattr(plain, role):
            name = f"{drive.name}_{ending}"
            renamed = drive.model_copy(update={"name": name})
            drives = replace(drives, **{role: renamed})
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
            level: min(number, room)
            for level, number in known["traffic"].items()
        }
    else:
        del known["traffic"]
        notes.append("neither roads.yaml nor lanes.json: no traffic")
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
