"""The structures of a city in each of its stages.

In earlier stages, plants are younger than in the last stage. Some buildings are
lower or under construction. Others are absent, and their lots have another use.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
import zlib

import numpy as np

from cns_drake.city.geometry import Structure
from cns_drake.city.growth.building_sites import building_site
from cns_drake.city.growth.lot_uses import lot_objects, use_by_size
from cns_drake.city.growth.lowering import lowered
from cns_drake.city.plants import younger_plant
from cns_drake.city.stages import Stages


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
