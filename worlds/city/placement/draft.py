"""A city being built: the structures placed so far, and their names."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
import zlib

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from worlds.city.city_plan import CityPlan
from worlds.city.ground.elevation import Ground, LevelGround
from worlds.roads import Areas
from worlds.shapes import (
    OBJECTS,
    SPECIES,
    MeshShape,
    Model,
    Occupancy,
    Structure,
    UpperSides,
    snap,
)

# An object stands upright if the ground below it falls by at most this much;
# half of the fall is how deep it stands in the ground on the upper side [m].
_STEEPEST = 0.5


class Draft:
    """A city under construction: places structures, and keeps them apart.

    All areas and heights are in W [m].

    Attributes:
        areas: carriageways, sidewalks and medians.
        plan: plan of the city.
        structures: the structures placed so far.
        names: names of the structures, with their numbers.
        streets: area of the streets, including sidewalks.
        frontage: area along whose outline buildings stand: the streets, and any
            margins beside them.
        base: height of sidewalks and of the ground between them, before
            buildings and relief change this ground.
        ground: upper sides of the finished ground; None until all buildings are
            placed.
        source: file of the plan, named in error messages.
    """

    def __init__(
        self,
        areas: Areas,
        kerb_height: float,
        plan: CityPlan,
        source: str,
    ):
        self.areas = areas
        self.plan = plan
        self.source = source
        parts = [areas.carriageway, areas.sidewalks, areas.medians]
        self.streets: BaseGeometry = snap(unary_union(parts))
        self.frontage = self.streets
        self.base: Ground = LevelGround(kerb_height)
        self.structures: list[Structure] = []
        self.names = NameCounter()
        self.ground: UpperSides | None = None
        self._walls = Occupancy()
        self._occupancy = Occupancy()
        self._lanes = Occupancy()
        self._lanes.add(areas.lane_area)

    def rng(self, *words: str | int) -> np.random.Generator:
        """Returns the random generator of a task, such as placing trees.

        Each task has its own generator, so that a change in one district does
        not change the random numbers in other districts. `words` are the name
        of the task.
        """
        key = "/".join(map(str, words)).encode()
        return np.random.default_rng([self.plan.seed, zlib.crc32(key)])

    def task(self, *words: str | int) -> np.random.Generator:
        """Starts a task, such as placing trees; returns its random generator.

        `words` are the name of the task, on which the generator depends. The
        numbers in the names of the structures that the task places begin in a
        new range, see `NameCounter.open_range`.
        """
        self.names.open_range()
        return self.rng(*words)

    def is_free(
        self,
        area: BaseGeometry,
        clearance: float = 0.0,
        ignore: BaseGeometry | None = None,
    ) -> bool:
        """Returns whether an area in W is off the lanes and not occupied.

        Args:
            area: the area.
            clearance: least distance from occupied ground [m]; this distance
                does not apply to lanes.
            ignore: an occupied area that may be closer than `clearance`, but
                must not be overlapped.
        """
        return self._lanes.is_free(area) and self._occupancy.is_free(
            area, clearance, ignore
        )

    def take(self, area: BaseGeometry) -> None:
        """Marks an area in W as occupied: no later object is placed there."""
        self._occupancy.add(area)

    def add_building(self, structure: Structure) -> None:
        """Adds a building; `take` must have marked its ground as occupied."""
        self.structures.append(structure)
        self._walls.add(structure.footprint_W)

    def place(
        self,
        object_kind: str,
        model: Model,
        xy: tuple[float, float],
        yaw: float,
        tags: Iterable[str],
        *,
        stem: str | None = None,
        clearance: float = 0.0,
        crown_part: float = 0.0,
        within: BaseGeometry | None = None,
    ) -> Structure | None:
        """Places an object on the finished ground, if there is room.

        Returns the new structure, or None if there is no room or the ground is
        too steep. A number is used for the name even if the result is None, so
        the names of later objects do not depend on whether this object fits.

        Args:
            object_kind: kind of object, a key of `OBJECTS`.
            model: the object.
            xy: position of the object in W [m].
            yaw: heading of the object in W [rad].
            tags: tags of the structure.
            stem: first part of the structure's name, such as `tree`; by default
                the word that `name_stem` returns.
            clearance: least distance from all objects placed before [m].
            crown_part: share of the reach of a tree's crown that must be clear
                of buildings, from 0 to 1.
            within: area in which the footprint must lie; None for any.
        """
        x, y = (round(float(value), 3) for value in xy)
        structure = Structure(
            self.names.next_name(stem or name_stem(object_kind)),
            OBJECTS[object_kind].semantic_class,
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
        # How much the ground falls below the object [m].
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
        """Returns an object's z on ground that falls by `fall` below it [m]."""
        p_WFs = structure.p_WFs
        assert self.ground is not None, "the ground has no shape yet"
        z = self.ground.heights(np.vstack([structure.xyz, p_WFs])[:, :2])
        z[0] -= fall / 2
        z[1:] -= p_WFs[:, 2].min()
        # The ground has no height in gaps of a millimetre. Next to a quay, no
        # foot stands on the water.
        z = z[np.isfinite(z)]
        return round(float(z[z > z[0] - _STEEPEST].min()), 3)


def _reach(model: Model) -> float:
    """Returns the greatest distance of a model's meshes from its axis [m]."""
    reaches = [0.0]
    for part in model.parts:
        if isinstance(part.shape, MeshShape):
            vertices = model.meshes[part.shape.mesh].vertices
            xy = (vertices * part.shape.scale)[:, :2]
            reaches.append(float(np.hypot(*xy.T).max()))
    return max(reaches)


# Semantic class -> the everyday word for its objects, as the stem of their
# names.
_WORDS = {"car": "car", "truck": "truck", "traffic-sign": "sign"}
# Ranges of numbers in names begin at multiples of this.
_RANGE = 50


def name_stem(object_kind: str) -> str:
    """Returns the everyday word for an object, with which its name begins.

    For example, the word for `lime_tree` is `tree`. `object_kind` is a key of
    `worlds.shapes.OBJECTS`.
    """
    if object_kind in SPECIES:
        return "tree"
    return _WORDS.get(OBJECTS[object_kind].semantic_class, object_kind)


class NameCounter:
    """Numbers the names of structures, separately for each stem."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def next_name(self, stem: str) -> str:
        """Returns a new name, e.g. `tower_017` for the stem `tower`."""
        self._counts[stem] += 1
        return f"{stem}_{self._counts[stem]:03d}"

    def open_range(self) -> None:
        """Makes the numbers in new names begin after the next multiple of 50.

        Call this function before each task, such as placing a row of trees. If
        a task then places a few structures more or fewer, the names of
        structures in later tasks stay the same. `stages.yaml` refers to such
        names.
        """
        for stem, count in self._counts.items():
            self._counts[stem] = -(-count // _RANGE) * _RANGE
