"""Fresh cities: versions of the shipped maps that no method's making saw.

A version has the map's streets and plan, other buildings, plants, cars and
furniture, the map's stages, and its drives by real drivers. Some versions are
turned as a whole, so that their streets lie off the axes of the world.
`worlds/fresh.csv` holds the seeds and turns, drawn before any method ran.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
import math
from pathlib import Path
from typing import Any

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.map_folder import MapFolder
from cns_drake.base.yaml_files import read_yaml
from cns_drake.city.generation.city_structures import make_city
from cns_drake.scenarios.shipped import shipped_maps, worlds_folder
from cns_drake.studies.redrawing import RedrawCity, redrawn_inputs, to_yaml

# Fields of inputs that hold a place, and lists of places.
_PLACES = frozenset({"position", "at", "block", "start", "end"})
_LISTS_OF_PLACES = frozenset({"via", "area", "line", "within", "points"})
_COLUMNS = ("map", "version", "seed", "turn_deg")
# The driver, frozen with the seeds.
_DRIVER = {"wander": 0.35, "lane_changes": 6.0, "follows": True}


@dataclass(frozen=True)
class Version:
    """A version of a shipped map.

    Attributes:
        number: from 1 on.
        turn_deg: turn of the whole city about the world's origin [deg].
    """

    map_name: str
    number: int
    seed: int
    turn_deg: float


def fresh_versions() -> list[Version]:
    """Returns the versions as they were frozen."""
    rows = read_records(worlds_folder() / "fresh.csv", _COLUMNS)
    return [
        Version(
            row["map"],
            int(row["version"]),
            int(row["seed"]),
            float(row["turn_deg"]),
        )
        for _, row in rows
    ]


def draw_fresh_cities(
    maps: Sequence[str], numbers: Sequence[int], output: Path, cluster: Cluster
) -> list[Path]:
    """Draws fresh cities; returns their map folders, `<output>/<map>_fNN`.

    Raises:
        InputError: there is no such version, or it could not be drawn.
    """
    versions = fresh_versions()
    for what, given, known in (
        ("map", maps, dict.fromkeys(one.map_name for one in versions)),
        ("--number", numbers, dict.fromkeys(one.number for one in versions)),
    ):
        for one in given:
            if one not in known:
                there = ", ".join(map(str, known))
                raise InputError(
                    f"{what}: no fresh version {one!r} (there are: {there})"
                )
    steps = [
        DrawFreshCity(
            shipped_maps()[one.map_name],
            max(MapFolder(shipped_maps()[one.map_name]).stages()),
            one.seed,
            output.resolve() / f"{one.map_name}_f{one.number:02d}",
            one.turn_deg,
        )
        for one in versions
        if (not maps or one.map_name in maps)
        and (not numbers or one.number in numbers)
    ]
    make_folder(output)
    run_jobs([Job(f"city {step.folder.name}", step) for step in steps], cluster)
    return [step.folder for step in steps]


@dataclass(frozen=True)
class DrawFreshCity(RedrawCity):
    """Draws a version of a map, with its stages and drives.

    Attributes:
        turn_deg: turn of the whole city about the world's origin [deg].
    """

    turn_deg: float = 0.0

    def inputs(self) -> dict[str, bytes]:
        """Returns the inputs of the city, but for its stages.

        Each drive has a driver like a real one.
        """
        source = MapFolder(self.map_folder)
        texts = redrawn_inputs(self.map_folder, self.stage, self.seed)
        del texts[source.stage_plan.name]
        plan = read_yaml(source.plan) | {"seed": self.seed}
        if self.turn_deg:
            roads = turned(read_yaml(source.roads), self.turn_deg)
            texts[source.roads.name] = to_yaml("the map's roads, turned", roads)
            plan = turned(plan, self.turn_deg)
            plan["bounds"] = _turned_bounds(plan["bounds"], self.turn_deg)
            texts[source.plan.name] = to_yaml("the map's plan, turned", plan)
        for path in source.drives():
            values = read_yaml(path) | {"map": ".", "driver": _DRIVER}
            texts[path.name] = to_yaml("the map's drive, by another", values)
        return texts

    def finish_inputs(self, draft: Path) -> None:
        source = MapFolder(self.map_folder)
        names = [one.name for one in make_city(draft).structures]
        stages = kept_names(read_yaml(source.stage_plan), names)
        text = to_yaml("the map's stages", stages)
        (draft / source.stage_plan.name).write_bytes(text)

    def sources(self) -> dict[str, object]:
        stages = MapFolder(self.map_folder).stage_plan
        return {**super().sources(), "stages": stages.read_text("utf-8")}


def turned(values: Any, turn_deg: float) -> Any:
    """Returns roads or a plan, turned about the world's origin.

    Args:
        values: content of `roads.yaml` or `city.yaml`.
        turn_deg: anticlockwise [deg].
    """
    if isinstance(values, list):
        return [turned(one, turn_deg) for one in values]
    if not isinstance(values, Mapping):
        return values
    result: dict[str, Any] = {}
    for name, value in values.items():
        if name in _PLACES and isinstance(value, list):
            result[name] = _turned_place(value, turn_deg)
        elif name in _LISTS_OF_PLACES and isinstance(value, list):
            result[name] = [_turned_place(one, turn_deg) for one in value]
        else:
            result[name] = turned(value, turn_deg)
    if "at" in values:
        result["yaw_deg"] = values.get("yaw_deg", 0.0) + turn_deg
    return result


def _turned_place(place: Sequence[float], turn_deg: float) -> list[float]:
    """Returns a place whose first two coordinates, x and y, are turned."""
    x, y, *others = place
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    return [round(c * x - s * y, 6), round(s * x + c * y, 6), *others]


def _turned_bounds(bounds: Sequence[float], turn_deg: float) -> list[float]:
    """Returns the box, along the axes, about a turned one."""
    x0, y0, x1, y1 = bounds
    corners = [
        _turned_place((x, y), turn_deg) for x in (x0, x1) for y in (y0, y1)
    ]
    return [*map(min, *corners), *map(max, *corners)]


def kept_names(stages: Any, names: Sequence[str]) -> Any:
    """Returns stages without the structures that a city lacks.

    A draw has another number of houses in a row. Groups without any structure
    are left out.

    Args:
        stages: content of `stages.yaml`.
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
