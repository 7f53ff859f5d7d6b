"""The structures of a city at each of its stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import zlib

import numpy as np

from cns_drake.city.geometry.structures import Structure
from cns_drake.city.growth.building_sites import building_site
from cns_drake.city.growth.lot_uses import lot_objects, use_by_size
from cns_drake.city.growth.lowering import lowered
from cns_drake.city.growth.young_plants import younger
from cns_drake.city.plan.stages import Stages


class GrowingCity:
    """A city and its stages.

    Attributes:
        structures: of the whole city, then those on lots before they are built
            on; a structure's instance id is its place in this order, counted
            from 1, and the same at all stages.
    """

    def __init__(
        self,
        structures: Sequence[Structure],
        stages: Stages,
        cars: Mapping[str, float],
    ):
        """Fills the lots.

        Args:
            structures: of the whole city, the last stage.
            stages: the structures that the others lack or have lower.
            cars: object -> weight of cars that are parked on lots.
        """
        self._stages = stages
        self._permanent = list(structures)
        uses = {
            name: use for use, names in stages.lots.items() for name in names
        }
        absent: set[str] = set()
        for stage in stages.stages:
            absent |= stages.absent(stage)
        self._lots = {
            s.name: list(
                lot_objects(
                    s,
                    uses.get(s.name) or use_by_size(s),
                    cars,
                    np.random.default_rng(_seed(s.name)),
                )
            )
            for s in structures
            if s.name in absent and s.semantic_class == "building"
        }
        self.structures = [
            *structures,
            *(thing for lot in self._lots.values() for thing in lot),
        ]

    def at(self, stage: str) -> list[Structure]:
        """Returns the structures of a stage, in the order of instance ids.

        Raises:
            KeyError: if there is no such stage.
            ValueError: if a structure cannot be lower, or under construction,
                as asked.
        """
        absent = self._stages.absent(stage)
        heights = self._stages.heights(stage)
        sites = self._stages.sites(stage)
        standing = []
        for structure in self._permanent:
            name = structure.name
            if name in sites:
                if structure.semantic_class != "building":
                    raise ValueError(f"sites: {name} is no building")
                model = building_site(
                    structure.model, sites[name], name, _seed(name)
                )
                standing.append(replace(structure, model=model))
            elif name in absent:
                continue
            elif name in heights:
                standing.append(_at_height(structure, heights[name]))
            else:
                standing.append(structure)
        for name, lot in self._lots.items():
            if name in absent and name not in sites:
                standing += lot
        return standing


def _at_height(structure: Structure, height: float) -> Structure:
    """Returns a structure that has not grown any higher yet."""
    name, model = structure.name, structure.model
    if structure.semantic_class == "vegetation":
        return replace(structure, model=younger(model, height))
    if structure.semantic_class == "building":
        model = lowered(model, height, name, _seed(name))
        return replace(structure, model=model)
    raise ValueError(f"lower: {name} is neither a building nor a plant")


def _seed(name: str) -> int:
    """Returns a seed of a structure's own."""
    return zlib.crc32(name.encode())
