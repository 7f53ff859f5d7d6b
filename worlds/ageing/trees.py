"""Trees of an ageing city: they grow, are felled, and are planted again."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from worlds.ageing import kinds
from worlds.ageing.old_world import OldWorld
from worlds.ageing.standing_structures import StandingStructures
from worlds.ageing.yearly_draws import YearlyDraws
from worlds.imports import random_generator
from worlds.shapes import SPECIES, Structure, StructureGeometry, scaled_plant

# Least and greatest growth of a tree in a year [m].
_GROWTH = (0.3, 0.5)
# Least and greatest height of a tree when it is planted [m].
_PLANTED = (2.6, 3.6)
# After this number of years, a tree is old.
_YOUNG_YEARS = 10
# Lower plants are no trees [m].
_LEAST_TREE = 3.0
# Plants of unknown kind that are higher than this are trees [m].
_LEAST_UNKNOWN_TREE = 4.0
# Least and greatest height of an old tree of unknown species [m].
_USUAL_HEIGHTS = (8.0, 11.0)
# The same for young trees of the city generator [m].
_YOUNG_HEIGHTS = (7.0, 9.0)
# A tree grows about the origin of its frame, unless this is so much lower or
# higher than its foot [m].
_FOOT = 2.0
# A crown keeps this share of its reach away from walls.
_CROWN_PART = 0.8


@dataclass
class _Tree:
    """A tree that stands or was felled.

    Attributes:
        whole: the first tree at this place, with its name, at the height `full`
            [m].
        full: height of `whole` [m].
        height: present height [m]; 0 if the tree was felled.
        size: greatest height that the tree can reach [m].
        planted: year in which it was planted.
        replanted: year in which it is planted again after it was felled.
    """

    name: str
    whole: Structure
    full: float
    height: float
    size: float
    planted: int
    replanted: int = 0

    def structure(self) -> Structure:
        factor = round(self.height / self.full, 4)
        model = scaled_plant(self.whole.model, factor)
        return replace(self.whole, name=self.name, model=model)


class Trees:
    """The trees of an ageing city."""

    def __init__(
        self,
        world: OldWorld,
        standing: StandingStructures,
        draws: YearlyDraws,
        seed: int,
    ) -> None:
        """Begins with the trees of today."""
        self._standing = standing
        self._draws = draws
        self._trees = list(_trees_of_today(world, seed))

    def live(self) -> None:
        """Simulates one year of all trees."""
        for tree in self._trees:
            if tree.height == 0.0:
                if tree.replanted == self._standing.year:
                    self._plant(tree)
                continue
            is_young = self._standing.year - tree.planted < _YOUNG_YEARS
            event = "felled_young" if is_young else "felled"
            if self._draws.happens(event, tree.name):
                self._fell(tree)
            elif tree.height < tree.size - 0.05:
                self._grow(tree)

    def clear(self, name: str) -> None:
        """Marks a tree as felled for good, if there is one of this name."""
        for tree in self._trees:
            if tree.name == name:
                tree.height, tree.replanted = 0.0, 0

    def _plant(self, tree: _Tree) -> None:
        place = shapely.Point(tree.whole.xyz[:2]).buffer(0.4)
        if self._standing.near(place):
            return
        old, year = tree.name, self._standing.year
        tree.name = f"{tree.whole.name}_{year:03d}y"
        height = self._draws.generator("planted", old).uniform(*_PLANTED)
        tree.height = round(float(height), 2)
        tree.planted = year
        self._standing.put(tree.structure(), place)
        self._standing.record("planted", old, tree.name, f"{tree.height:g} m")

    def _fell(self, tree: _Tree) -> None:
        self._standing.remove(tree.name)
        self._standing.record("felled", tree.name)
        tree.height = 0.0
        rng = self._draws.generator("replanted", tree.name)
        tree.replanted = self._standing.year + int(rng.integers(1, 3))

    def _grow(self, tree: _Tree) -> None:
        by = self._draws.generator("grown", tree.name).uniform(*_GROWTH)
        tree.height = round(min(tree.height + by, tree.size), 2)
        self._standing.by_name[tree.name] = tree.structure()
        self._standing.record("grown", tree.name, detail=f"{tree.height:g} m")


def _trees_of_today(world: OldWorld, seed: int) -> Iterator[_Tree]:
    walls = [t.footprint for t in world.of_class("building")]
    tree = shapely.STRtree(walls)
    for one in world.of_class("vegetation"):
        height = one.top - one.bottom
        is_tree = one.kind == kinds.TREE or height > _LEAST_UNKNOWN_TREE
        if height < _LEAST_TREE or not is_tree:
            continue
        middle = one.footprint.centroid
        whole = _about_its_foot(world.structure(one.name), one)
        rng = random_generator(seed, "size", one.name)
        wall = float(middle.distance(walls[int(tree.nearest(middle))]))
        reach = _reach(world.triangles(one.name), middle)
        fits = wall / (_CROWN_PART * reach) * height
        size = min(float(rng.uniform(*_old_heights(whole))), fits)
        planted = -int(rng.integers(_YOUNG_YEARS, 60))
        if height < size - 1.0:  # It has not grown up yet.
            planted = -round((height - _PLANTED[0]) / np.mean(_GROWTH))
        yield _Tree(one.name, whole, height, height, max(size, height), planted)


def _about_its_foot(whole: Structure, seen: StructureGeometry) -> Structure:
    """Returns a tree with the origin of its frame near its foot.

    Args:
        seen: the geometry of the same tree in W.
    """
    *xy, z = whole.xyz
    is_below = seen.outline.covers(shapely.Point(xy))
    if is_below and abs(z - seen.bottom) <= _FOOT:
        return whole
    # The frame of a tree of CityJSON is W.
    middle = seen.footprint.centroid
    foot = (round(middle.x, 3), round(middle.y, 3), seen.bottom)
    return whole.with_origin(foot)


def _old_heights(tree: Structure) -> tuple[float, float]:
    """Returns least and greatest height of a tree that has grown up [m]."""
    meshes = [getattr(part.shape, "mesh", "") for part in tree.model.parts]
    species = [
        one
        for mesh in meshes
        for name, one in SPECIES.items()
        if mesh.startswith(name)
    ]
    if not species:
        return _USUAL_HEIGHTS
    if "young" in meshes[0]:
        return _YOUNG_HEIGHTS
    return species[0].height_range


def _reach(triangles: np.ndarray, middle: BaseGeometry) -> float:
    """Returns the distance of the farthest corner from a point, in plan [m]."""
    xy = triangles[:, :, :2].reshape(-1, 2) - middle.coords[0]
    return float(np.hypot(*xy.T).max(initial=0.5))
