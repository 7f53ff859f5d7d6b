"""Room for small objects in a city, and the objects that are placed."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import math

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, Point
from shapely.geometry.base import BaseGeometry

from evaluation.base import revolved
from worlds.city import name_stem
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import joined_triangles
from worlds.imports.ground import Ground
from worlds.imports.imported_objects import ImportedObject
from worlds.shapes import (
    OBJECTS,
    PARKED_CARS,
    CylinderShape,
    Mesh,
    MeshShape,
    Model,
    Occupancy,
    SphereShape,
    Structure,
    UpperSides,
    ground_triangles,
    placed,
    turned_up,
)

# Objects farther than this from all drives are left out [m].
_OBJECTS_WITHIN = 100.0
# Least distance of objects from the middle of a drive [m].
_FROM_DRIVE = 1.7
# Least distance of objects from walls [m].
_FROM_WALL = 0.25
# Least distance between two objects [m].
_BETWEEN_OBJECTS = 0.2
# Nothing stands where the ground below it falls by more than this [m].
_MOST_FALL = 0.5
# Walls are looked for at this height above the ground [m].
_WALL_PROBE = 0.5
# Radius around the middle of a trunk that no other object takes [m].
_TRUNK_RADIUS = 0.4
# Classes of structures that nothing may touch.
_SOLID_CLASSES = ("building", "fence", "other-structure")
# Number of sides of posts and balls.
_SIDES = 8
# Number of sides of discs. Discs such as signs must not look like octagons.
_SIDES_OF_DISC = 20
# Names of the meshes.
_POST = "round_post"
_DISC = "round_disc"
_BALL = "round_ball"


@dataclass
class PlacedObjects:
    """The small objects that were placed along streets, and their counts.

    Attributes:
        objects: the objects.
        from_file: names of the structures that come from the file.
        moved: original -> moved tree, for trees of the file that stood on a
            carriageway.
        sources: ids, in the file, of the objects that were placed.
        by_file: kind of object -> number of objects from the file.
        at_random: kind of object -> number of random objects.
        no_room: number of objects of the file that are left out, because they
            would block a drive or stand in a wall or another object.
    """

    objects: list[ImportedObject] = field(default_factory=list)
    from_file: set[str] = field(default_factory=set)
    moved: dict[ImportedObject, ImportedObject] = field(default_factory=dict)
    sources: set[str] = field(default_factory=set)
    by_file: Counter[str] = field(default_factory=Counter)
    at_random: Counter[str] = field(default_factory=Counter)
    no_room: int = 0


class StreetRoom:
    """Places small objects in a city where there is room.

    Attributes:
        placed: the objects that are placed.
        paths: paths of the drives [m].
        lamps: positions (x, y) of the street lamps among the objects [m].
    """

    def __init__(
        self,
        objects: Sequence[ImportedObject],
        drives: Sequence[WaypointRoute],
        ground: Ground,
        guessed_ground: Sequence[Structure],
    ):
        """Takes what already stands, and the drives whose paths stay free.

        Args:
            objects: objects of the city.
            drives: the drives, which are kept free.
            ground: the ground on which objects stand.
            guessed_ground: structures of the ground that was guessed; none if
                the file has terrain.
        """
        self.placed = PlacedObjects()
        self._ground = ground
        self.paths = MultiLineString([drive.path for drive in drives])
        shapely.prepare(self.paths)

        def triangles(
            is_wanted: Callable[[ImportedObject], bool],
        ) -> np.ndarray:
            return joined_triangles(
                o.triangles for o in objects if is_wanted(o)
            )

        solids = triangles(
            lambda o: o.structure.semantic_class in _SOLID_CLASSES
        )
        self._solids = UpperSides(solids)
        roads = triangles(lambda o: o.is_ground and o.object_type == "Road")
        self._roads = UpperSides(turned_up(roads))
        paved = triangles(lambda o: o.is_paving)
        laid = joined_triangles([paved, ground_triangles(guessed_ground)])
        self._laid = UpperSides(turned_up(laid))
        self._taken = Occupancy()
        self._names = {one.structure.name for one in objects}
        self.lamps: list[tuple[float, float]] = []

    def is_near(
        self, line: np.ndarray, distance: float = _OBJECTS_WITHIN
    ) -> bool:
        """Returns whether a line (N, 2) is within a distance of a drive [m]."""
        return bool(shapely.dwithin(LineString(line), self.paths, distance))

    def keep_tree(self, tree: ImportedObject) -> None:
        """Marks the place of a tree's trunk as occupied."""
        x, y, _ = tree.structure.xyz
        self._taken.add(Point(x, y).buffer(_TRUNK_RADIUS, quad_segs=4))

    def has_tree_pit(self, xy: np.ndarray) -> bool:
        """Returns whether a tree could stand at a place.

        There is no room for a trunk on a road, in a structure, or close to the
        path of one of the map's drives. `xy` (2,) is the place in W [m].
        """
        pit = Point(xy).buffer(_TRUNK_RADIUS, quad_segs=2)
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
        height: float | None = None,
    ) -> bool:
        """Places an object if there is room; returns whether there was room.

        The object stands at the height of the lowest ground below it. Only cars
        are placed on carriageways, and nothing far from all drives.

        Args:
            name: name of the new structure.
            kind: kind of object, a key of
                `worlds.shapes.OBJECTS`.
            xy: position of the object's centre in W [m].
            yaw: heading of the object in W [rad].
            rng: random generator for the object's variant and colours.
            height: height of a tree [m]; None for a random one, and for other
                objects.
        """
        builder = OBJECTS[kind]
        at = np.array([xy])
        is_car = kind in PARKED_CARS
        if not self.is_near(np.repeat(at, 2, axis=0)) or (
            not is_car and np.isfinite(self._roads.heights(at)[0])
        ):
            return False
        given = {} if height is None else {"height": height}
        model = without_curves(builder.build(rng, **given))
        x, y = round(xy[0], 3), round(xy[1], 3)
        structure = Structure(
            name,
            builder.semantic_class,
            model,
            (x, y, 0.0),
            round(yaw, 4),
            kind=name_stem(kind),
        )
        heights = self._standing_heights(structure.p_WFs[:, :2])
        z = round(float(heights.min()), 3)
        footprint = placed(model.footprint, xy, yaw)
        if (
            np.ptp(heights) > _MOST_FALL
            or self.paths.distance(footprint) < _FROM_DRIVE
            or not self._taken.is_free(footprint, _BETWEEN_OBJECTS)
            or self._is_built(footprint)
        ):
            return False
        self._taken.add(footprint)
        while name in self._names:
            name += "_"
        self._names.add(name)
        structure = replace(structure, name=name, xyz=(x, y, z))
        triangles = _bounding_triangles(footprint, z)
        self.placed.objects.append(
            ImportedObject(structure, title_of(kind), None, triangles)
        )
        if kind == "lamp_post":
            self.lamps.append((x, y))
        return True

    def _standing_heights(self, feet: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) on which feet (N, 2) stand [m].

        Feet stand on the streets and other ground in the file or, where the
        file has no ground, on the guessed ground.
        """
        heights, guessed = self._laid.heights(feet), self._ground.height(feet)
        return np.where(np.isfinite(heights), heights, guessed)

    def _is_built(self, footprint: BaseGeometry) -> bool:
        """Returns whether a wall stands on a footprint, or close to it."""
        around = footprint.buffer(_FROM_WALL, quad_segs=1)
        xy = shapely.get_coordinates(around.exterior)
        xy = np.concatenate([xy, shapely.get_coordinates(footprint.centroid)])
        z = self._ground.height(xy)
        return bool(
            self._solids.hides(np.column_stack([xy, z + _WALL_PROBE])).any()
        )


def title_of(kind: str) -> str:
    """Returns a kind of object as a title, such as `Lamp post`."""
    return kind.replace("_", " ").capitalize()


def _bounding_triangles(footprint: BaseGeometry, z: float) -> np.ndarray:
    """Returns the bounding box of a footprint as triangles (2, 3, 3) [m]."""
    x0, y0, x1, y1 = footprint.bounds
    a, b, c, d = ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))
    return np.array([(a, b, c), (a, c, d)])


def without_curves(model: Model) -> Model:
    """Returns a model with polyhedra in place of cylinders and spheres.

    A polyhedron has the same cross-section area as the shape that it replaces.
    """
    parts = []
    meshes = dict(model.meshes)
    for part in model.parts:
        shape = part.shape
        if isinstance(shape, CylinderShape):
            r = shape.radius
            is_disc = shape.length < shape.radius
            name = _DISC if is_disc else _POST
            sides = _SIDES_OF_DISC if is_disc else _SIDES
            scaled = MeshShape(name, (r, r, shape.length))
            part = replace(part, shape=scaled)
            meshes[name] = _revolved([1.0], [0.5], sides)
        elif isinstance(shape, SphereShape):
            r = shape.radius
            part = replace(part, shape=MeshShape(_BALL, (r, r, r)))
            # The circles are at latitudes of 90, 45 and 0 deg.
            half = np.sqrt(0.5)
            meshes[_BALL] = _revolved(
                [0.0, half, 1.0], [1.0, half, 0.0], _SIDES
            )
        parts.append(part)
    return replace(model, parts=tuple(parts), meshes=meshes)


def _revolved(radius: list[float], z: list[float], sides: int) -> Mesh:
    """Returns a solid of revolution with polygons of the circles' areas.

    `z` is as for `revolved`, and `radius` contains the radii of the circles.
    """
    step = 2.0 * np.pi / sides
    wide = np.sqrt(step / math.sin(step)) * np.array(radius)
    vertices, triangles = revolved(wide, np.array(z), sides)
    return Mesh(vertices, tuple(map(tuple, triangles.tolist())))
