"""Writes first input files for a city whose roads already exist.

A user who has written `roads.yaml` gets a plan with districts, two stages and
two drives, as files to edit.
"""

from collections import defaultdict
from collections.abc import Callable
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import box
from shapely.ops import unary_union
import yaml

from evaluation.base import parse_yaml, write_text
from worlds.city.city_plan import CityPlan, load_plan
from worlds.city.generation.city_structures import City, lay_out
from worlds.maps import STAGES_NAME, MapFolder
from worlds.roads import Areas, RoadNetwork, draw_route, load_road_network
from worlds.shapes import polygons_of, snap

# The generated world extends this far beyond the roads [m].
_MARGIN = 45.0
# A block with less ground than this becomes a square [m^2].
_SQUARE = 900.0
# Smaller pieces of ground between carriageways belong to the outskirts [m^2].
_LEAST_BLOCK = 60.0
# Default share of the buildings that the first stage lacks.
_MISSING = 0.35
_ROUTE_LENGTH = 1200.0
_SPEEDS = {
    "cruise": 12.0,
    "longitudinal_acceleration": 2.5,
    "lateral_acceleration": 3.0,
}


def start_city(
    world: Path,
    seed: int = 0,
    progress: Callable[[str], None] = lambda line: None,
) -> list[Path]:
    """Writes the missing inputs of a city in a folder with `roads.yaml`.

    `city.yaml` gets a district for each block between the roads. `stages.yaml`
    gets a stage 01 without the buildings and trees in the east, and a stage 02
    with all structures. Each stage gets a drive on a random route. `progress`
    is called with a line for each file that is written or kept.

    Returns:
        The files that were written. Existing files are not changed.

    Raises:
        InputError: if the roads cannot be used, or a file cannot be written.
    """
    network = load_road_network(MapFolder(world).roads)
    written = []

    def write(name: str, comment: str, values: Callable[[], dict]) -> None:
        path = world / name
        if path.exists():
            progress(f"kept: {path}; delete it to have it written again")
            return
        progress(f"writing {path}")
        text = yaml.safe_dump(
            values(), sort_keys=False, default_flow_style=None, width=79
        )
        write_text(path, f"# {comment}\n\n{text}")
        written.append(path)

    plan_file = MapFolder(world).plan
    write(
        plan_file.name,
        "The districts: the blocks between the roads.",
        lambda: starter_plan(network.areas, seed),
    )

    def stages() -> dict:
        plan: CityPlan = load_plan(plan_file)
        return starter_stages(lay_out(network, plan, str(plan_file)))

    write(STAGES_NAME, "The structures that each stage lacks, by name.", stages)
    for k, stage in enumerate(("01", "02")):
        rng = np.random.default_rng([seed, k])
        write(
            MapFolder(world).drive(stage).name,
            f"A drive through stage {stage}, on a route sampled at random.",
            partial(_drive_scenario, network, stage, rng),
        )
    return written


def _drive_scenario(
    network: RoadNetwork, stage: str, rng: np.random.Generator
) -> dict:
    """Returns a scenario of a drive through one stage, as YAML data."""
    route = draw_route(network, _ROUTE_LENGTH, rng)
    return {
        "map": ".",
        "stage": stage,
        "route": route.model_dump(mode="json", exclude_none=True),
        "speeds": _SPEEDS,
    }


def starter_plan(areas: Areas, seed: int) -> dict:
    """Returns a plan with a kind of district for each block between roads.

    Districts such as an old town or offices are assigned at random. The result
    has the fields of `worlds.city.city_plan.CityPlan`.

    Args:
        areas: areas of the streets, in W [m].
        seed: seed of the random choice.
    """
    folder = resources.files("worlds.city.generation")
    text = folder.joinpath("characters.yaml").read_text(encoding="utf-8")
    templates = parse_yaml(text)
    parts = [areas.carriageway, areas.sidewalks, areas.medians]
    streets = unary_union(parts)
    x0, y0, x1, y1 = streets.bounds
    bounds = (
        int(np.floor(x0 - _MARGIN)),
        int(np.floor(y0 - _MARGIN)),
        int(np.ceil(x1 + _MARGIN)),
        int(np.ceil(y1 + _MARGIN)),
    )
    rng = np.random.default_rng(seed)
    characters: list[str] = []
    districts: list[dict] = []
    for piece in polygons_of(snap(box(*bounds).difference(streets))):
        is_outside = piece.intersects(box(*bounds).exterior)
        if is_outside or piece.area < _LEAST_BLOCK:
            continue
        if not characters:
            # Every character is used once before any is used again.
            characters = list(rng.permutation(list(templates["blocks"])))
        district = templates["square"]
        if piece.area >= _SQUARE:
            district = templates["blocks"][characters.pop()]
        inside = shapely.point_on_surface(piece)
        place = [round(inside.x, 2), round(inside.y, 2)]
        name = f"block_{len(districts) + 1:02d}"
        districts.append({"name": name, "block": place, **district})
    districts.append({"name": "outskirts", **templates["outskirts"]})
    return {
        "seed": seed,
        "bounds": list(bounds),
        "cars": templates["cars"],
        "street": templates["street"],
        "districts": districts,
    }


def starter_stages(city: City, missing: float = _MISSING) -> dict:
    """Returns two stages; the first lacks buildings and trees in the east.

    The result has the fields of `worlds.city.stages.Stages`.

    Args:
        city: the whole city.
        missing: share of the buildings that the first stage lacks; these are
            the buildings farthest to the east. The first stage also lacks all
            trees that are as far to the east.
    """
    kinds = "building", "vegetation"
    standing = [s for s in city.structures if s.semantic_class in kinds]
    buildings = [s for s in standing if s.semantic_class == "building"]
    x = [structure.xyz[0] for structure in buildings or standing]
    absent = defaultdict(list)
    if x:
        limit = float(np.quantile(x, 1.0 - missing))
        for structure in standing:
            if structure.xyz[0] > limit:
                absent[" ".join(structure.tags[:1])].append(structure.name)
        story = f"The part east of x = {limit:.0f} m is not there yet."
    else:
        story = "There is nothing that could be missing."
    return {
        "stages": {
            "01": {"story": story, "absent": dict(absent)},
            "02": {"story": "The whole city."},
        }
    }
