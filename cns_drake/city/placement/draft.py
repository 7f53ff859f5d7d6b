"""A city in the making: the structures placed so far."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
import zlib

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from cns_drake.city.geometry import (
    MeshShape,
    Model,
    Occupancy,
    Structure,
    UpperSides,
    snap,
)
from cns_drake.city.ground.elevation import Ground, LevelGround
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plan.city_plan import CityPlan
from cns_drake.city.plants.vegetation import SPECIES
from cns_drake.roads.carriageway import Areas

# Objects of one class that share one word in everyday use.
_WORDS = {"car": "car", "truck": "truck", "traffic-sign": "sign"}


def name_stem(object_name: str) -> str:
    """Returns the stem of an object's name, e.g. `tree` for a `lime_tree`."""
    if object_name in SPECIES:
        return "tree"
    return _WORDS.get(OBJECTS[object_name].semantic_class, object_name)


# An object stands upright where the ground falls by at most this much below
# it, half of it sunk in on the upper side [m].
_STEEPEST = 0.5
# Numbers in names start anew at multiples of this.
_RANGE = 50


class Draft:
    """Collects structures, gives them names and keeps them apart.

    `streets` is all ground of the streets, sidewalks included. Buildings stand
    along the `frontage`. `base` is the height of sidewalks and of the ground
    between them, before buildings and relief change it. `ground` is the upper
    sides of the finished ground, which is set once the buildings stand. All
    these are in W. `source` is the name of the plan's file, for messages.
    """

    def __init__(
        self,
        areas: Areas,
        kerb_height: float,
        plan: CityPlan,
        source: str,
    ):
        self.areas, self.plan, self.source = areas, plan, source
        parts = [areas.carriageway, areas.sidewalks, areas.medians]
        self.streets: BaseGeometry = snap(unary_union(parts))
        self.frontage = self.streets
        self.base: Ground = LevelGround(kerb_height)
        self.structures: list[Structure] = []
        self.ground: UpperSides | None = None
        self._counts: Counter[str] = Counter()
        self._walls = Occupancy()
        self._occupancy = Occupancy()
        self._lanes = Occupancy()
        self._lanes.add(areas.lane_area)

    def rng(self, *words: str | int) -> np.random.Generator:
        """Returns the random generator of one task, by the task's name.

        Every task has its own, so that a change in one district does not change
        the draws of others.
        """
        key = "/".join(map(str, words)).encode()
        return np.random.default_rng([self.plan.seed, zlib.crc32(key)])

    def task(self, *words: str | int) -> np.random.Generator:
        """Starts a task: see `open_range` and `rng`."""
        self.open_range()
        return self.rng(*words)

    def open_range(self) -> None:
        """Starts a new range of numbers for names in the next task.

        In the same way, house numbers start anew with each street. Thus, an
        object more or less in one task does not rename the objects of later
        tasks, to which the lists of the stages refer.
        """
        for kind, count in self._counts.items():
            self._counts[kind] = -(-count // _RANGE) * _RANGE

    def next_name(self, kind: str) -> str:
        """Returns a new name, e.g. `tower_017` for the kind `tower`."""
        self._counts[kind] += 1
        return f"{kind}_{self._counts[kind]:03d}"

    def is_free(
        self,
        area: BaseGeometry,
        clearance: float = 0.0,
        ignore: BaseGeometry | None = None,
    ) -> bool:
        """Returns whether an area in W is off the lanes and not taken.

        The clearance is to taken ground, not to lanes [m]; a taken area to
        `ignore` may be closer, but not overlapped.
        """
        return self._lanes.is_free(area) and self._occupancy.is_free(
            area, clearance, ignore
        )

    def take(self, area: BaseGeometry) -> None:
        """Marks an area in W as taken, so that later objects avoid it."""
        self._occupancy.add(area)

    def add_building(self, structure: Structure) -> None:
        """Adds a building whose ground has been taken before."""
        self.structures.append(structure)
        self._walls.add(structure.footprint_W)

    def place(
        self,
        name: str,
        model: Model,
        xy: tuple[float, float],
        yaw: float,
        tags: Iterable[str],
        *,
        kind: str | None = None,
        clearance: float = 0.0,
        crown_part: float = 0.0,
        within: BaseGeometry | None = None,
    ) -> Structure | None:
        """Places an object on the finished ground, if there is room.

        It is one of `OBJECTS`. An object without room uses up a name as well,
        so that the names of others do not depend on whether it fits.

        Args:
            xy, yaw: position and heading in W [m, rad].
            kind: stem of the structure's name; the object's by default.
            clearance: least distance to all objects placed before [m].
            crown_part: how much of the reach of a tree's crown must be
                clear of buildings, from 0 to 1.
            within: where given, the footprint must lie in this area.
        """
        x, y = (round(float(value), 3) for value in xy)
        structure = Structure(
            self.next_name(kind or name_stem(name)),
            OBJECTS[name].semantic_class,
            model,
            (x, y, 0.0),
            float(yaw),
            tuple(tags),
        )
        footprint = structure.footprint_W
        crown = Point(x, y).buffer(crown_part * _reach(model))
        if (
            (within is not None and not within.contains(footprint))
            or not self.is_free(footprint, clearance)
            or (not crown.is_empty and not self._walls.is_free(crown))
        ):
            return None
        # How far the ground falls below it [m].
        corners = shapely.get_coordinates(footprint)
        fall = float(np.ptp(np.round(self.base(*corners.T), 3)))
        if fall > _STEEPEST:
            return None
        foot = self._foot(structure, fall)
        structure = replace(structure, xyz=(x, y, foot))
        self._occupancy.add(footprint)
        self.structures.append(structure)
        return structure

    def _foot(self, structure: Structure, fall: float) -> float:
        """Returns the height of an object on ground that falls below it [m]."""
        p_WFs = structure.p_WFs
        assert self.ground is not None, "the ground has no shape yet"
        z = self.ground.heights(np.vstack([structure.xyz, p_WFs])[:, :2])
        z[0] -= fall / 2
        z[1:] -= p_WFs[:, 2].min()
        # There is no ground in slits of a millimetre, and the water beside a
        # quay is below no foot.
        z = z[np.isfinite(z)]
        return round(float(z[z > z[0] - _STEEPEST].min()), 3)


def _reach(model: Model) -> float:
    """Returns how far a model's meshes reach from its middle [m]."""
    reaches = [0.0]
    for part in model.parts:
        if isinstance(part.shape, MeshShape):
            vertices = model.meshes[part.shape.mesh].vertices
            xy = (vertices * part.shape.scale)[:, :2]
            reaches.append(float(np.hypot(*xy.T).max()))
    return max(reaches)
