"""Frozen redraws: redrawn cities that stay the same in all releases.

A frozen redraw is a redraw of a shipped map. No method was developed with the
help of a frozen redraw. A frozen redraw also has the map's stages, and the
map's drives with realistic drivers. Some frozen redraws are rotated as a whole,
so that their streets are not parallel to the axes of the world.
`worlds/redraws.csv` contains the seeds and rotations, which were chosen at
random before any method ran.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from cns_drake.scenarios import (
    RedrawCity,
    make_maps,
    marked_yaml,
    redrawn_inputs,
)
from cns_drake.studies.maps.turned_inputs import turned_bounds, turned_content
from evaluation.base import Cluster, InputError, read_records, read_yaml
from evaluation.results import FROZEN_REDRAW
from worlds.city import make_city
from worlds.maps import MapFolder, shipped_maps, worlds_folder

_COLUMNS = ("map", "number", "seed", "turn_deg", "stages")
# The driver, frozen with the seeds.
_DRIVER = {"wander": 0.35, "lane_changes": 6.0}


@dataclass(frozen=True)
class FrozenRedraw:
    """A redraw of a shipped map that stays the same in all releases.

    Attributes:
        map_name: name of the shipped map.
        number: number of the redraw, from 1.
        seed: seed of the redraw's city.
        turn_deg: angle by which the city is rotated about the world's origin
            [deg].
        stages: name of the shipped map whose stages the redraw has, with the
            same streets and structures. Five redraws of Metropolis are older
            than its present stages, and keep those of Metropolis cleared.
    """

    map_name: str
    number: int
    seed: int
    turn_deg: float
    stages: str


def frozen_redraws() -> list[FrozenRedraw]:
    """Returns the frozen redraws of shipped maps in `worlds/redraws.csv`."""
    rows = read_records(worlds_folder() / "redraws.csv", _COLUMNS)
    return [
        FrozenRedraw(
            row["map"],
            int(row["number"]),
            int(row["seed"]),
            float(row["turn_deg"]),
            row["stages"],
        )
        for _, row in rows
    ]


def redraw_frozen(
    maps: Sequence[str],
    numbers: Sequence[int],
    output: Path,
    cluster: Cluster,
    source: object,
) -> list[Path]:
    """Generates frozen redraws of shipped maps; returns their map folders.

    A redraw has the streets of the map, in some cases rotated, but other
    buildings, plants and objects.

    Args:
        maps: names of shipped maps; all shipped maps if empty.
        numbers: numbers of the redraws; all redraws if empty.
        output: folder for the maps, which are named `<map>_f<number>`.
        cluster: runs the jobs.
        source: file of the experiment, for errors.

    Returns:
        The folders, sorted by map, then by number.

    Raises:
        InputError: a redraw is unknown or could not be generated.
    """
    redraws = frozen_redraws()
    all_maps = dict.fromkeys(one.map_name for one in redraws)
    checks: list[tuple[str, Sequence[object], Collection[object]]] = [
        ("map", maps, all_maps)
    ]
    for name in maps or all_maps:
        known = [one.number for one in redraws if one.map_name == name]
        checks.append((f"{FROZEN_REDRAW} of {name}", numbers, known))
    for what, given, there in checks:
        for one in given:
            if one not in there:
                raise InputError(
                    f"{source}: {what}: no frozen redraw {one!r} (there are:"
                    f" {', '.join(map(str, there))})"
                )
    steps = [
        RedrawFrozen(
            output.resolve() / f"{one.map_name}_f{one.number:02d}",
            shipped_maps()[one.map_name],
            max(MapFolder(shipped_maps()[one.map_name]).stages()),
            one.seed,
            one.turn_deg,
            shipped_maps()[one.stages],
        )
        for one in redraws
        if (not maps or one.map_name in maps)
        and (not numbers or one.number in numbers)
    ]
    make_maps(steps, output, cluster)
    return [step.folder for step in steps]


@dataclass(frozen=True)
class RedrawFrozen(RedrawCity):
    """A job step that makes a frozen redraw of a map, with its drives.

    Attributes:
        turn_deg: angle by which the city is rotated about the world's origin
            [deg].
        stages_folder: folder of the map whose stages the redraw has.
    """

    turn_deg: float
    stages_folder: Path

    def inputs(self) -> dict[str, bytes]:
        """Returns the new city's input files, without `stages.yaml`.

        The result maps file names to contents. The scenarios of the map's
        drives are included; in these scenarios, a realistic driver replaces the
        original driver.
        """
        source = MapFolder(self.map_folder)
        contents = redrawn_inputs(self.map_folder, self.stage, self.seed)
        del contents[source.stage_plan.name]
        plan = read_yaml(source.plan) | {"seed": self.seed}
        if self.turn_deg:
            roads = turned_content(read_yaml(source.roads), self.turn_deg)
            contents[source.roads.name] = marked_yaml(
                "the map's roads, turned", roads
            )
            plan = turned_content(plan, self.turn_deg)
            plan["bounds"] = turned_bounds(plan["bounds"], self.turn_deg)
            contents[source.plan.name] = marked_yaml(
                "the map's plan, turned", plan
            )
        for path in source.drives():
            values = read_yaml(path) | {"map": ".", "driver": _DRIVER}
            contents[path.name] = marked_yaml(
                "the map's drive, by another driver", values
            )
        return contents

    def finish_inputs(self, draft: Path) -> None:
        source = MapFolder(self.stages_folder)
        names = [one.name for one in make_city(draft).structures]
        stages = kept_names(read_yaml(source.stage_plan), names)
        text = marked_yaml("the map's stages", stages)
        (draft / source.stage_plan.name).write_bytes(text)

    def sources(self) -> dict[str, object]:
        stages = MapFolder(self.stages_folder).stage_plan
        return {**super().sources(), "stages": stages.read_text("utf-8")}


def kept_names(stages: Any, names: Sequence[str]) -> Any:
    """Returns `stages.yaml` with only the structures that a new city has.

    The file was written for the original city. A row of houses can have fewer
    houses in a redrawn city than in the original city. Groups that lose all
    their structures are left out.

    Args:
        stages: the content of the file.
        names: names of the structures of the new city.
    """
    if isinstance(stages, list):
        return [
            one
            for one in stages
            if any(fnmatchcase(name, one) for name in names)
        ]
    if not isinstance(stages, Mapping):
        return stages
    kept = {name: kept_names(one, names) for name, one in stages.items()}
    return {
        name: one
        for name, one in kept.items()
        if one != [] and not (isinstance(one, dict) and _is_empty(one))
    }


def _is_empty(group: Mapping[str, Any]) -> bool:
    """Returns whether a group with a height has lost all its structures."""
    return "height" in group and "structures" not in group
