"""The room for things along streets: what is taken, and by what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, Point
from shapely.geometry.base import BaseGeometry

from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry.occupancy import Occupancy
from cns_drake.city.geometry.polygons import placed
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.imports.dressing.round_parts import without_curves
from cns_drake.imports.dressing.upper_sides import UpperSides, turned_up
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.ground import Ground

# Least distance of all objects from the middle of a drive [m].
_FROM_DRIVE = 1.7
_FROM_WALL, _BETWEEN = 0.25, 0.2
# Radius about the middle of a trunk that nothing else takes [m].
_TRUNK = 0.4


@dataclass
class StreetThings:
    """The placed things.

    Attributes:
        structures: in the world.
        from_file: names of structures from the file.
        moved: name of a tree of the file -> the same beside the carriageway.
        sources: sources of the file's things that were placed.
        by_file, by_lot: kind -> how many.
        no_room: how many of the file's things would stand in the way of a
            drive, in a wall or in each other.
    """

    structures: list[Imported] = field(default_factory=list)
    from_file: set[str] = field(default_factory=set)
    moved: dict[str, Imported] = field(default_factory=dict)
    sources: set[str] = field(default_factory=set)
    by_file: Counter[str] = field(default_factory=Counter)
    by_lot: Counter[str] = field(default_factory=Counter)
    no_room: int = 0


class StreetRoom:
    """The room for things: what is taken, and by what."""

    def __init__(
        self,
        structures: Sequence[Imported],
        drives: Sequence[WaypointDrive],
        ground: Ground,
        found: StreetThings,
    ):
        self.found = found
        self._ground = ground
        self.paths = MultiLineString([drive.path for drive in drives])
        shapely.prepare(self.paths)
        solids = [
            one.triangles
            for one in structures
            if one.structure.semantic_class
            in ("building", "fence", "other-structure")
        ]
        paved = [
            one.triangles
            for one in structures
            if one.is_ground or one.kind == "Sidewalk"
        ]
        empty = np.zeros((0, 3, 3))
        self._solids = UpperSides(np.concatenate([empty, *solids]))
        roads = [one.triangles for one in structures if one.kind == "Road"]
        self._roads = UpperSides(turned_up(np.concatenate([empty, *roads])))
        self._paved = UpperSides(turned_up(np.concatenate([empty, *paved])))
        self._taken = Occupancy()
        self._names = {one.structure.name for one in structures}
        self.lamps: list[tuple[float, float]] = []

    def is_near(self, line: np.ndarray, distance: float) -> bool:
        """Returns whether a line (N, 2) is near a drive."""
        return bool(shapely.dwithin(LineString(line), self.paths, distance))

    def keep_tree(self, tree: Imported) -> None:
        """Keeps the place of a tree's trunk free."""
        x, y, _ = tree.structure.xyz
        self._taken.add(Point(x, y).buffer(_TRUNK, 4))

    def has_tree_pit(self, xy: np.ndarray) -> bool:
        """Returns whether a trunk at (2,) is off roads, walls and drives."""
        pit = Point(xy).buffer(_TRUNK, 2)
        around = shapely.get_coordinates(pit)
        return not (
            np.isfinite(self._roads.heights(around)).any()
            or self.paths.distance(pit) < _FROM_DRIVE
            or self._is_built(pit)
        )

    def place(
        self,
        name: str,
        kind: str,
        xy: tuple[float, float],
        yaw: float,
        rng: np.random.Generator,
    ) -> bool:
        """Places an object, if there is room for it.

        Only cars stand on carriageways.
        """
        builder = OBJECTS[kind]
        at = np.array([xy])
        is_car = kind in PARKED_CARS
        if not is_car and np.isfinite(self._roads.heights(at)[0]):
            return False
        model = without_curves(builder.build(rng))
        footprint = placed(model.footprint, xy, yaw)
        if (
            self.paths.distance(footprint) < _FROM_DRIVE
            or not self._taken.is_free(footprint, _BETWEEN)
            or self._is_built(footprint)
        ):
            return False
        self._taken.add(footprint)
        while name in self._names:
            name += "_"
        self._names.add(name)
        x, y = round(xy[0], 3), round(xy[1], 3)
        at = np.array([[x, y]])
        z = float(self._ground.height(at)[0])
        paved = float(self._paved.heights(at)[0])
        # A street far above the guessed ground is a bridge, or a roof.
        z = round(paved if abs(paved - z) < 1.0 else z, 3)
        structure = Structure(
            name, builder.semantic_class, model, (x, y, z), round(yaw, 4)
        )
        self.found.structures.append(
            Imported(structure, title_of(kind), None, _footing(footprint, z))
        )
        if kind == "lamp_post":
            self.lamps.append((x, y))
        return True

    def _is_built(self, footprint: BaseGeometry) -> bool:
        around = footprint.buffer(_FROM_WALL, quad_segs=1)
        xy = shapely.get_coordinates(around.exterior)
        xy = np.concatenate([xy, shapely.get_coordinates(footprint.centroid)])
        z = self._ground.height(xy)
        return bool(self._solids.hides(np.column_stack([xy, z + 0.5])).any())


def title_of(kind: str) -> str:
    return kind.replace("_", " ").capitalize()


def _footing(footprint: BaseGeometry, z: float) -> np.ndarray:
    """Returns the bounds of a footprint as triangles (2, 3, 3) [m]."""
    x0, y0, x1, y1 = footprint.bounds
    a, b, c, d = ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))
    return np.array([(a, b, c), (a, c, d)])
