"""The structures of a city in each of its stages.

In earlier stages, plants are younger than in the last stage. Some buildings are
lower or under construction. Others are absent, and their lots have another use.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
import math
from pathlib import Path
import zlib

import numpy as np
from shapely.geometry import box
from shapely.geometry.base import BaseGeometry

from evaluation.base import parse_yaml
from worlds.city.buildings import ARCHETYPES, sample
from worlds.city.stages import LotUse, Stages
from worlds.shapes import (
    OBJECTS,
    Model,
    Occupancy,
    Part,
    Structure,
    largest_rectangle,
    lowered,
    pick_key,
    younger_plant,
)

# Distance of objects from the edges of the lot, where the neighbours stand [m].
_MARGIN = 0.8
# A smaller lot is a gap between houses, and stays empty [m^2].
_SMALLEST = 40.0
# Use of a lot -> the objects on the lot, the distances between their places,
# and the share of the places that have an object.
_LAYOUTS = parse_yaml(Path(__file__).with_name("lot_uses.yaml").read_bytes())


# Archetype of the frame.
_FRAME = "unfinished_tower"
# Room for a crane beside the frame [m].
_CRANE_ROOM = 7.0
# The jib is this far above the frame [m].
_CRANE_RISE = 14.0
# The jib is this long [m].
_CRANE_REACH = 30.0


class GrowingCity:
    """A city in all of its stages.

    The lot of a building is the ground below it. Until the building exists, the
    lot has another use, such as a car park, whose objects stand in the
    building's place.

    The attribute `structures` lists the structures of the whole city, and then
    the objects on lots whose buildings are absent in some stage. The instance
    id of a structure is its number in this list, counted from 1, and is the
    same in all stages.
    """

    def __init__(
        self,
        structures: Sequence[Structure],
        stages: Stages,
        cars: Mapping[str, float],
    ):
        """Adds the objects on lots to the structures of the whole city.

        The whole city is the city in the last stage. `cars` maps parked cars to
        their weights in the random choice.
        """
        self._stages = stages
        self._permanent = list(structures)
        uses = {name: u for u, names in stages.lots.items() for name in names}
        absent = set[str]().union(*map(stages.absent, stages.stages))
        # Name of a building that is absent in some stage -> the objects on its
        # lot, which replace the building in these stages.
        self._lots: dict[str, list[Structure]] = {}
        for s in structures:
            if s.name in absent and s.semantic_class == "building":
                use = uses.get(s.name) or use_by_size(s)
                rng = np.random.default_rng(_seed(s.name))
                self._lots[s.name] = list(lot_objects(s, use, cars, rng))
        self.structures = [*structures, *chain(*self._lots.values())]

    def at(self, stage: str) -> list[Structure]:
        """Returns the structures of a stage, in the order of instance ids.

        Raises:
            KeyError: if there is no such stage.
            ValueError: the stage demands that a structure is lower or under
                construction, but the structure cannot be.
        """
        absent = self._stages.absent(stage)
        heights = self._stages.heights(stage)
        sites = self._stages.sites(stage)
        # A building under construction takes its lot, even if it is listed as
        # absent as well.
        missing = absent - sites.keys()
        standing = [
            _in_stage(structure, heights, sites)
            for structure in self._permanent
            if structure.name not in missing
        ]
        for name, lot in self._lots.items():
            if name in missing:
                standing += lot
        return standing


def _in_stage(
    structure: Structure,
    heights: Mapping[str, float],
    sites: Mapping[str, float],
) -> Structure:
    """Returns the version of a structure in a stage in which it is not absent.

    Args:
        structure: the structure in the last stage.
        heights: names of lower structures -> their heights [m].
        sites: names of buildings under construction -> the heights of their
            frames [m].

    Raises:
        ValueError: the structure cannot be lower or under construction.
    """
    name = structure.name
    if name in sites:
        if structure.semantic_class != "building":
            raise ValueError(f"sites: {name} is no building")
        model = building_site(structure.model, sites[name], name, _seed(name))
        return replace(structure, model=model)
    if name in heights:
        return _at_height(structure, heights[name])
    return structure


def _at_height(structure: Structure, height: float) -> Structure:
    """Returns an earlier version of a structure, with a lower height [m].

    A plant is younger; a building lacks upper storeys.

    Raises:
        ValueError: the structure is neither a plant nor a building.
    """
    name, model = structure.name, structure.model
    if structure.semantic_class == "vegetation":
        return replace(structure, model=younger_plant(model, height))
    if structure.semantic_class == "building":
        model = lowered(model, height, name, _seed(name))
        return replace(structure, model=model)
    raise ValueError(f"lower: {name} is neither a building nor a plant")


def _seed(name: str) -> int:
    """Returns a seed from the name of a structure."""
    return zlib.crc32(name.encode())


def building_site(model: Model, height: float, name: str, seed: int) -> Model:
    """Returns a building under construction: a frame, and a crane if it fits.

    Frame and crane stand within the footprint of the building; the jib of the
    crane reaches beyond it.

    Args:
        model: the finished building.
        height: height of the frame [m], which is limited to the range of
            heights of the archetype `unfinished_tower`.
        name: name of the building.
        seed: seed of the random parameters.

    Raises:
        ValueError: the footprint has no room for a frame.
    """
    lot = largest_rectangle(model.footprint)
    x0, y0, x1, y1 = lot.bounds
    low, high = ARCHETYPES[_FRAME].widths
    rng = np.random.default_rng(seed)
    crane_xy = None
    if x1 - x0 > low + _CRANE_ROOM:
        crane_xy = (x1 - _CRANE_ROOM / 2, (y0 + y1) / 2)
        x1 -= _CRANE_ROOM
    x1, y1 = min(x1, x0 + high), min(y1, y0 + high)
    if min(x1 - x0, y1 - y0) < low:
        raise ValueError(
            f"sites: {name}: its lot is too small for a site, which takes "
            f"{low} m by {low} m"
        )
    lowest, highest = ARCHETYPES[_FRAME].heights
    height = float(np.clip(height, lowest, highest))
    frame = sample(_FRAME, box(x0, y0, x1, y1), height, rng, f"{name}_site")
    if crane_xy is None:
        return Model(frame.parts, frame.meshes, model.footprint)
    crane = OBJECTS["tower_crane"].build(
        rng, height=height + _CRANE_RISE, reach=_CRANE_REACH
    )
    return Model(
        (*frame.parts, *(_beside(part, crane_xy) for part in crane.parts)),
        {**frame.meshes, **crane.meshes},
        model.footprint,
    )


def _beside(part: Part, xy: tuple[float, float]) -> Part:
    x, y, z = part.xyz
    at = (round(x + xy[0], 3), round(y + xy[1], 3), z)
    return replace(part, name=f"crane_{part.name}", xyz=at)


def use_by_size(structure: Structure) -> LotUse:
    """Returns the default use of a lot before its building is built.

    The use depends on the area of the lot: from small to large, it is a garden,
    a yard, a market or a car park. `structure` is the building that stands on
    the lot in other stages.
    """
    area = structure.model.footprint.area
    if area > 900:
        return "car_park"
    if area > 450:
        return "market"
    return "yard" if area > 250 else "garden"


def lot_objects(
    structure: Structure,
    use: LotUse,
    cars: Mapping[str, float],
    rng: np.random.Generator,
) -> Iterator[Structure]:
    """Yields the structures on a lot before its building is built.

    `structure` is the building, and `use` the earlier use of its lot. The names
    of the yielded structures begin with the name of the building. `cars` maps
    kinds of parked cars to their weights in the random choice.
    """
    footprint = structure.model.footprint
    if use == "empty" or footprint.area < _SMALLEST:
        return
    weights = _LAYOUTS[use].get("objects", cars)
    taken = Occupancy()
    count = 0
    for x, y, yaw in _object_places(footprint, use, rng):
        kind = pick_key(weights, rng)
        builder = OBJECTS[kind]
        model = builder.build(rng)
        xyz = structure.p_WP((x, y, 0.0))
        thing = Structure(
            f"{structure.name}_lot_{count + 1:02d}_{kind}",
            builder.semantic_class,
            model,
            (round(xyz[0], 3), round(xyz[1], 3), round(xyz[2], 3)),
            structure.yaw + yaw,
            (*structure.tags, "lot"),
        )
        area = thing.footprint_W
        if structure.footprint_W.contains(area) and taken.is_free(area):
            taken.add(area)
            count += 1
            yield thing


def _object_places(
    footprint: BaseGeometry, use: LotUse, rng: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    """Yields x, y [m] and heading [rad] of the objects on a lot, in S."""
    x0, y0, x1, y1 = largest_rectangle(footprint).bounds
    along, across = _LAYOUTS[use]["pitch"]
    columns = max(1, math.floor((x1 - x0 - 2 * _MARGIN) / along))
    rows = max(1, math.floor((y1 - y0 - 2 * _MARGIN) / across))
    for row in range(rows):
        y = (y0 + y1) / 2 + (row - (rows - 1) / 2) * across
        for column in range(columns):
            x = (x0 + x1) / 2 + (column - (columns - 1) / 2) * along
            taken = rng.random() < _LAYOUTS[use]["fill"]
            jitter = rng.uniform(-0.3, 0.3, 2)
            turn = int(rng.integers(2)) * math.pi
            if not taken:
                continue
            if use == "car_park":
                yield x, y + float(jitter[1]), math.pi / 2 + turn
            elif use == "market":
                yield x, y, math.pi / 2 + turn
            else:
                yield x + float(jitter[0]), y + float(jitter[1]), turn
