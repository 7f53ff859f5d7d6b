"""Redraws a map's city: the same streets, but all other structures are new.

Roads and plan stay the same, and only the seed of the plan changes. Buildings,
plants, cars and furniture are therefore sampled anew. Each such city is a map
folder.

Frozen redraws are redraws of the shipped maps that were not used to develop any
method. Frozen redraws also have the map's stages, and the map's drives with
realistic drivers. Some frozen redraws are rotated as a whole, so that their
streets are not parallel to the axes of the world. `worlds/redraws.csv` contains
the seeds and rotations, which were chosen at random before any method ran.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
import math
import os
from pathlib import Path
from typing import Any

import yaml

from cns_drake.base import complete_files, files
from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError, errors_at
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.version import __version__
from cns_drake.base.yaml_files import read_yaml
from cns_drake.city.generation.city_structures import make_city
from cns_drake.city.generation.generate import generate_city
from cns_drake.city.plan.city_plan import load_plan
from cns_drake.scenarios.shipped import shipped_maps, worlds_folder
from cns_drake.scene.map_folder import STAGES_NAME, MapFolder
from cns_drake.studies.map_step import MakeMap, make_maps
from evaluation.results.keys import FROZEN_REDRAW

# Start of the first line of each input that is written here.
_MARK = "# Of a city drawn anew by cns-drake"
# Fields of inputs that hold a place, and lists of places.
_PLACES = frozenset({"position", "at", "block", "start", "end"})
_LISTS_OF_PLACES = frozenset({"via", "area", "line", "within", "points"})
_COLUMNS = ("map", "number", "seed", "turn_deg")
# The driver, frozen with the seeds.
_DRIVER = {"wander": 0.35, "lane_changes": 6.0, "follows": True}


def redraw_cities(
    map_folder: Path,
    stage: str,
    seeds: Sequence[int],
    output: Path,
    cluster: Cluster,
) -> dict[int, Path]:
    """Generates the city of a map anew with several seeds.

    A city that exists is kept if its inputs and the program have not changed.

    Args:
        map_folder: folder of the map, with `roads.yaml` and `city.yaml`.
        stage: name of the only stage of each new map.
        seeds: a seed for each city.
        output: folder for the cities.
        cluster: runs the jobs.

    Raises:
        InputError: the map cannot be used, another file or folder has the name
            of a city, or cities could not be generated; the error names all of
            these cities.
    """
    map_folder, output = map_folder.resolve(), output.resolve()
    folders = {seed: output / f"{map_folder.name}_c{seed}" for seed in seeds}
    # Quick checks come before all slow work.
    load_plan(MapFolder(map_folder).plan)
    steps = [
        RedrawCity(folder, map_folder, stage, seed)
        for seed, folder in folders.items()
    ]
    make_maps(steps, output, cluster)
    return folders


@dataclass(frozen=True)
class RedrawCity(MakeMap):
    """A job step that makes a map with another city along a map's streets.

    The new map has one stage, which contains the whole city.

    Attributes:
        map_folder: folder of the map with the streets.
        stage: name of the new map's stage.
        seed: seed of the new city.
    """

    map_folder: Path
    stage: str
    seed: int

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        with complete_files.draft_folder(self.folder) as draft:
            for name, content in self.inputs().items():
                (draft / name).write_bytes(content)
            place = f"{self.map_folder}: seed {self.seed}"
            with errors_at(place, f"{draft}{os.sep}"):
                self.finish_inputs(draft)
                generate_city(draft)
            finish(draft)

    def inputs(self) -> dict[str, bytes]:
        """Returns name -> content of the files from which the city is made."""
        return redrawn_inputs(self.map_folder, self.stage, self.seed)

    def finish_inputs(self, draft: Path) -> None:
        """Writes further input files, such as `stages.yaml`; by default none.

        Override this function for files that contain names of structures,
        because these names follow from the other input files. To find the
        names, call `cns_drake.city.generation.city_structures.make_city` with
        `draft`.

        Args:
            draft: folder of the map, before it gets its final name. The folder
                already contains the files of `inputs`, but not the generated
                city.
        """

    def sources(self) -> dict[str, object]:
        """Returns everything on which the city depends, ready for JSON."""
        return {
            **{
                name: content.decode()
                for name, content in self.inputs().items()
            },
            "code": code_digest("cns_drake.city.*"),
        }


def redrawn_inputs(map_folder: Path, stage: str, seed: int) -> dict[str, bytes]:
    """Returns name -> content of the input files of a map's new city.

    The files are the map's own `roads.yaml`, a `city.yaml` with the new seed,
    and a `stages.yaml` with one stage that contains the whole city.

    Args:
        map_folder: folder of the map.
        stage: name of the stage.
        seed: seed of the new city.

    Raises:
        InputError: a file of the map cannot be read, or is no plan.
    """
    source = MapFolder(map_folder)
    roads, plan = source.roads, source.plan
    load_plan(plan)
    with files.user_errors(roads):
        network = roads.read_bytes()
    stages = {stage: {"story": f"The whole city, as seed {seed} draws it."}}
    return {
        roads.name: network,
        plan.name: marked_yaml(
            "the map's plan with another seed", read_yaml(plan) | {"seed": seed}
        ),
        STAGES_NAME: marked_yaml("its only stage", {"stages": stages}),
    }


def marked_yaml(title: str, values: dict) -> bytes:
    """Returns a YAML file with a title in its first comment.

    Args:
        title: the title.
        values: the content.
    """
    text = yaml.safe_dump(
        values, sort_keys=False, default_flow_style=None, width=79
    )
    return f"{_MARK} {__version__}: {title}.\n\n{text}".encode()


@dataclass(frozen=True)
class FrozenRedraw:
    """A redraw of a shipped map that stays the same in all releases.

    Attributes:
        map_name: name of the shipped map.
        number: number of the redraw, from 1.
        seed: seed of the redraw's city.
        turn_deg: angle by which the city is rotated about the world's origin
            [deg].
    """

    map_name: str
    number: int
    seed: int
    turn_deg: float


def frozen_redraws() -> list[FrozenRedraw]:
    """Returns the frozen redraws of shipped maps in `worlds/redraws.csv`."""
    rows = read_records(worlds_folder() / "redraws.csv", _COLUMNS)
    return [
        FrozenRedraw(
            row["map"],
            int(row["number"]),
            int(row["seed"]),
            float(row["turn_deg"]),
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
    for what, given, known in (
        ("map", maps, [one.map_name for one in redraws]),
        (FROZEN_REDRAW, numbers, [one.number for one in redraws]),
    ):
        for one in given:
            if one not in known:
                there = ", ".join(map(str, dict.fromkeys(known)))
                raise InputError(
                    f"{source}: {what}: no frozen redraw {one!r} (there are:"
                    f" {there})"
                )
    steps = [
        RedrawFrozen(
            output.resolve() / f"{one.map_name}_f{one.number:02d}",
            shipped_maps()[one.map_name],
            max(MapFolder(shipped_maps()[one.map_name]).stages()),
            one.seed,
            one.turn_deg,
        )
        for one in redraws
        if (not maps or one.map_name in maps)
        and (not numbers or one.number in numbers)
    ]
    make_maps(steps, output, cluster)
    return [step.folder for step in steps]


@dataclass(frozen=True)
class RedrawFrozen(RedrawCity):
    """A job step that makes a frozen redraw of a map, with its drives."""

    turn_deg: float = 0.0

    def inputs(self) -> dict[str, bytes]:
        """Returns the new city's input files, without `stages.yaml`.

        The result maps file names to contents. The scenarios of the map's
        drives are included; in these scenarios, a realistic driver replaces the
        original driver.
        """
        source = MapFolder(self.map_folder)
        texts = redrawn_inputs(self.map_folder, self.stage, self.seed)
        del texts[source.stage_plan.name]
        plan = read_yaml(source.plan) | {"seed": self.seed}
        if self.turn_deg:
            roads = turned_content(read_yaml(source.roads), self.turn_deg)
            texts[source.roads.name] = marked_yaml(
                "the map's roads, turned", roads
            )
            plan = turned_content(plan, self.turn_deg)
            plan["bounds"] = _turned_bounds(plan["bounds"], self.turn_deg)
            texts[source.plan.name] = marked_yaml(
                "the map's plan, turned", plan
            )
        for path in source.drives():
            values = read_yaml(path) | {"map": ".", "driver": _DRIVER}
            texts[path.name] = marked_yaml(
                "the map's drive, by another", values
            )
        return texts

    def finish_inputs(self, draft: Path) -> None:
        source = MapFolder(self.map_folder)
        names = [one.name for one in make_city(draft).structures]
        stages = kept_names(read_yaml(source.stage_plan), names)
        text = marked_yaml("the map's stages", stages)
        (draft / source.stage_plan.name).write_bytes(text)

    def sources(self) -> dict[str, object]:
        stages = MapFolder(self.map_folder).stage_plan
        return {**super().sources(), "stages": stages.read_text("utf-8")}


def turned_content(values: Any, turn_deg: float) -> Any:
    """Returns the content of `roads.yaml` or `city.yaml` for a rotated city.

    Args:
        values: the content of the file.
        turn_deg: angle by which all positions and headings are rotated
            anticlockwise about the world's origin [deg].
    """
    if isinstance(values, list):
        return [turned_content(one, turn_deg) for one in values]
    if not isinstance(values, Mapping):
        return values
    result: dict[str, Any] = {}
    for name, value in values.items():
        if name in _PLACES and isinstance(value, list):
            result[name] = _turned_place(value, turn_deg)
        elif name in _LISTS_OF_PLACES and isinstance(value, list):
            result[name] = [_turned_place(one, turn_deg) for one in value]
        else:
            result[name] = turned_content(value, turn_deg)
    if "at" in values:
        result["yaw_deg"] = values.get("yaw_deg", 0.0) + turn_deg
    return result


def _turned_place(place: Sequence[float], turn_deg: float) -> list[float]:
    """Returns a place whose first two coordinates, x and y, are turned."""
    x, y, *others = place
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    return [round(c * x - s * y, 6), round(s * x + c * y, 6), *others]


def _turned_bounds(bounds: Sequence[float], turn_deg: float) -> list[float]:
    """Returns the axis-aligned bounding box of a rotated box."""
    x0, y0, x1, y1 = bounds
    corners = [
        _turned_place((x, y), turn_deg) for x in (x0, x1) for y in (y0, y1)
    ]
    return [*map(min, *corners), *map(max, *corners)]


def kept_names(stages: Any, names: Sequence[str]) -> Any:
    """Returns `stages.yaml` with only the structures that a new city has.

    The file was written for the original city. Rows of a redrawn city can
    consist of fewer houses. Groups that lose all their structures are left out.

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
