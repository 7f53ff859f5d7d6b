"""Small objects along streets: those in the file, and random ones."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, MultiPoint, Point
from shapely.geometry.base import BaseGeometry

from cns_drake.base.round_shapes import revolved
from cns_drake.base.yaml_files import parse_yaml
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry import (
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
from cns_drake.city.placement.draft import name_stem
from cns_drake.city.placement.frontage import station_at
from cns_drake.city.placement.objects import OBJECTS, pick_key
from cns_drake.imports.dressing.paving import HALF_STREET
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.faces import joined
from cns_drake.imports.foreign_city import (
    Imported,
    Street,
    Thing,
    random_generator,
)
from cns_drake.imports.ground import Ground

_TABLES = parse_yaml(Path(__file__).with_name("streets.yaml").read_bytes())
# Objects on a carriageway are moved to this distance beside its edge [m].
FROM_EDGE = 0.6


def beside_street(
    xy: np.ndarray, streets: Sequence[Street], courses: Sequence[LineString]
) -> tuple[np.ndarray, float]:
    """Returns a place beside the nearest street, and a heading to the street.

    A place on or close to the carriageway is moved to 0.6 m from the edge of
    the carriageway. Any other place stays. The heading is from the place to the
    middle of the street [rad].

    Args:
        xy: (2,) the place in W [m].
        streets: the streets.
        courses: middle line of each street [m].
    """
    point = Point(xy)
    distances = shapely.distance(courses, point)
    nearest = int(np.argmin(distances))
    line = courses[nearest]
    half = streets[nearest].width / 2.0
    station = station_at(line, line.project(point))
    foot = np.array([station.x, station.y])
    offset = xy - foot
    distance = float(np.hypot(*offset))
    if distance < 0.05:
        # On the right of the street, where signs stand.
        offset = np.array([np.sin(station.yaw), -np.cos(station.yaw)])
        distance = 1.0
    outwards = offset / distance
    if distances[nearest] < half + FROM_EDGE:
        xy = foot + outwards * (half + FROM_EDGE)
    return xy, float(np.arctan2(-outwards[1], -outwards[0]))


def place_along(
    line: LineString, s: float, side: float, offset: float
) -> tuple[tuple[float, float], float]:
    """Returns a place beside a line, and the heading of the line [rad].

    Args:
        line: the line in W [m].
        s: distance along the line [m].
        side: 1 for the right side, -1 for the left.
        offset: distance from the line [m].
    """
    at = station_at(line, s)
    x = at.x + side * offset * float(np.sin(at.yaw))
    y = at.y - side * offset * float(np.cos(at.yaw))
    return (x, y), at.yaw


# Number of sides of posts and balls.
_SIDES = 8
# Number of sides of discs. Discs such as signs must not look like octagons.
_SIDES_OF_DISC = 20
# Names of the meshes.
_POST = "round_post"
_DISC = "round_disc"
_BALL = "round_ball"


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
            low = np.sqrt(0.5)
            meshes[_BALL] = _revolved([0.0, low, 1.0], [1.0, low, 0.0], _SIDES)
        parts.append(part)
    return replace(model, parts=tuple(parts), meshes=meshes)


def _revolved(radius: list[float], z: list[float], sides: int) -> Mesh:
    """Returns a solid of revolution with polygons of the circles' areas."""
    step = 2.0 * np.pi / sides
    wide = np.sqrt(step / np.sin(step)) * np.array(radius)
    vertices, triangles = revolved(wide, np.array(z), sides)
    return Mesh(vertices, tuple(map(tuple, triangles.tolist())))


# Least distance of objects from the middle of a drive [m].
_FROM_DRIVE = 1.7
# Least distance of objects from walls [m].
_FROM_WALL = 0.25
# Least distance between two objects [m].
_BETWEEN = 0.2
# Nothing stands where the ground below it falls by more than this [m].
_MOST_FALL = 0.5
# A street this far above the guessed ground is a bridge or a roof, and no
# object stands on it [m].
_BRIDGE_HEIGHT = 1.0
# Radius around the middle of a trunk that no other object takes [m].
_TRUNK = 0.4
# Classes of structures that nothing may touch.
_SOLID = ("building", "fence", "other-structure")


@dataclass
class StreetThings:
    """The small objects that were placed along streets, and their counts.

    Attributes:
        structures: the objects.
        from_file: names of the structures that come from the file.
        moved: original -> moved tree, for trees of the file that stood on a
            carriageway.
        sources: ids, in the file, of the objects that were placed.
        by_file: kind of object -> number of objects from the file.
        at_random: kind of object -> number of random objects.
        no_room: number of objects of the file that are left out, because they
            would block a drive or stand in a wall or another object.
    """

    structures: list[Imported] = field(default_factory=list)
    from_file: set[str] = field(default_factory=set)
    moved: dict[Imported, Imported] = field(default_factory=dict)
    sources: set[str] = field(default_factory=set)
    by_file: Counter[str] = field(default_factory=Counter)
    at_random: Counter[str] = field(default_factory=Counter)
    no_room: int = 0


class StreetRoom:
    """Places small objects in a city where there is room.

    The objects are added to `found` (a `StreetThings`). `lamps` lists the
    positions (x, y) of the street lamps among these objects [m].
    """

    def __init__(
        self,
        structures: Sequence[Imported],
        drives: Sequence[WaypointRoute],
        ground: Ground,
        bottom: Sequence[Structure],
        found: StreetThings,
    ):
        """Takes the ground of everything that stands already.

        Args:
            structures: structures of the city.
            drives: the drives, which are kept free.
            ground: the ground on which objects stand.
            bottom: structures of a guessed ground; none if the file has
                terrain.
            found: gets the objects that are placed.
        """
        self.found = found
        self._ground = ground
        self.paths = MultiLineString([drive.path for drive in drives])
        shapely.prepare(self.paths)

        def triangles(is_wanted: Callable[[Imported], bool]) -> np.ndarray:
            return joined(o.triangles for o in structures if is_wanted(o))

        solids = triangles(lambda o: o.structure.semantic_class in _SOLID)
        self._solids = UpperSides(solids)
        roads = triangles(lambda o: o.kind == "Road")
        self._roads = UpperSides(turned_up(roads))
        paved = triangles(lambda o: o.is_ground or o.kind == "Sidewalk")
        laid = joined([paved, ground_triangles(bottom)])
        self._laid = UpperSides(turned_up(laid))
        self._taken = Occupancy()
        self._names = {one.structure.name for one in structures}
        self.lamps: list[tuple[float, float]] = []

    def is_near(self, line: np.ndarray, distance: float) -> bool:
        """Returns whether a line (N, 2) is within a distance of a drive [m]."""
        return bool(shapely.dwithin(LineString(line), self.paths, distance))

    def keep_tree(self, tree: Imported) -> None:
        """Marks the place of a tree's trunk as occupied."""
        x, y, _ = tree.structure.xyz
        self._taken.add(Point(x, y).buffer(_TRUNK, 4))

    def has_tree_pit(self, xy: np.ndarray) -> bool:
        """Returns whether a tree could stand at a place.

        There is no room for a trunk on a road, in a structure, or close to the
        path of one of the map's drives. `xy` (2,) is the place in W [m].
        """
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
        """Places an object if there is room; returns whether there was room.

        The object stands at the height of the lowest ground below it. Only cars
        are placed on carriageways.

        Args:
            name: name of the new structure.
            kind: kind of object, a key of
                `cns_drake.city.placement.objects.OBJECTS`.
            xy: position of the object's centre in W [m].
            yaw: heading of the object in W [rad].
            rng: random generator for the object's variant and colours.
        """
        builder = OBJECTS[kind]
        at = np.array([xy])
        is_car = kind in PARKED_CARS
        if not is_car and np.isfinite(self._roads.heights(at)[0]):
            return False
        model = without_curves(builder.build(rng))
        x, y = round(xy[0], 3), round(xy[1], 3)
        structure = Structure(
            name,
            builder.semantic_class,
            model,
            (x, y, 0.0),
            round(yaw, 4),
            kind=name_stem(kind),
        )
        feet = structure.p_WFs[:, :2]
        heights, guessed = self._laid.heights(feet), self._ground.height(feet)
        # A street far above the guessed ground is a bridge or a roof.
        is_laid = np.isfinite(heights) & (heights < guessed + _BRIDGE_HEIGHT)
        heights = np.where(is_laid, heights, guessed)
        z = round(float(heights.min()), 3)
        footprint = placed(model.footprint, xy, yaw)
        if (
            np.ptp(heights) > _MOST_FALL
            or self.paths.distance(footprint) < _FROM_DRIVE
            or not self._taken.is_free(footprint, _BETWEEN)
            or self._is_built(footprint)
        ):
            return False
        self._taken.add(footprint)
        while name in self._names:
            name += "_"
        self._names.add(name)
        structure = replace(structure, name=name, xyz=(x, y, z))
        self.found.structures.append(
            Imported(
                structure,
                title_of(kind),
                None,
                _bounding_triangles(footprint, z),
            )
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


def _bounding_triangles(footprint: BaseGeometry, z: float) -> np.ndarray:
    """Returns the bounding box of a footprint as triangles (2, 3, 3) [m]."""
    x0, y0, x1, y1 = footprint.bounds
    a, b, c, d = ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))
    return np.array([(a, b, c), (a, c, d)])


# Cars farther than this from all drives are left out [m].
ROWS_WITHIN = 70.0
# Least and greatest distance between cars that are parked along a street [m].
_CAR_EVERY = (5.8, 7.2)
# Share of the places that are taken.
_TAKEN_SHARE = 0.6
# Distance of the cars' middle from the kerb [m].
_FROM_KERB = 1.05
# Distance of the cars from other streets [m].
_FROM_CROSSING = 5.0
# Length of a place along the row of a car park that is too narrow for bays [m].
_ROW_PITCH = 6.2
# Width of a bay [m].
_BAY_WIDTH = 2.6
# Length of a bay, across the row [m].
_BAY_LENGTH = 5.0
# Width of the aisle between two rows of bays [m].
_AISLE = 5.5


def may_park_on(side: str, street: Street) -> bool:
    """Returns whether the tags of a street allow parking on one of its sides.

    `side` is `left` or `right`. Tags:
    https://wiki.openstreetmap.org/wiki/Street_parking
    """
    if street.tags.get("highway", "") in _TABLES["streets without parked cars"]:
        return False
    values = {
        street.tags.get(key.format(which))
        for which in (side, "both")
        for key in _TABLES["parking keys"]
    }
    return not values & set(_TABLES["no parking"])


class Row(NamedTuple):
    """A street along which cars may park.

    Attributes:
        name: name of the street.
        line: middle line of the street [m].
        half: half the width of the carriageway [m].
        may_park: whether cars may park on the right, and on the left.
    """

    name: str
    line: LineString
    half: float
    may_park: tuple[bool, bool]


def park_along(
    placing: StreetRoom, row: Row, lines: BaseGeometry, rng: np.random.Generator
) -> None:
    """Parks cars at random on the sides of a street that allow parking.

    Args:
        placing: places the cars.
        row: the street.
        lines: middle lines of all streets, near whose crossings no car parks.
        rng: random generator for places and kinds of cars.
    """
    line = row.line
    others = lines.difference(line.buffer(0.5))
    for side, is_allowed in zip((1.0, -1.0), row.may_park, strict=True):
        if not is_allowed:
            continue
        s = float(rng.uniform(4.0, 9.0))
        while s < line.length - 4.0:
            xy, yaw = place_along(line, s, side, row.half - _FROM_KERB)
            yaw += 0.0 if side > 0 else np.pi
            is_taken = rng.random() < _TAKEN_SHARE
            yaw += float(rng.uniform(-0.02, 0.02))
            form = pick_key(_TABLES["vehicles"], rng)
            # Without other streets, the distance is NaN.
            is_clear = not others.distance(Point(xy)) <= _FROM_CROSSING
            if is_taken and is_clear:
                kind = f"car_{row.name}_{int(s)}_{'lr'[side > 0]}"
                if placing.place(kind, form, xy, yaw, rng):
                    placing.found.at_random["Parked vehicles"] += 1
            s += float(rng.uniform(*_CAR_EVERY))


def fill_car_park(placing: StreetRoom, one: Imported, seed: int) -> None:
    """Parks cars at random along the longer sides of a car park.

    Args:
        placing: places the cars.
        one: the car park.
        seed: seed of the random draws.
    """
    outline = MultiPoint(one.triangles.reshape(-1, 3)[:, :2])
    box = np.array(outline.minimum_rotated_rectangle.boundary.coords)
    if len(box) != 5 or not placing.is_near(box, ROWS_WITHIN):
        return
    sides = np.diff(box, axis=0)[:2]
    length, width = sorted(np.hypot(*sides.T).tolist(), reverse=True)
    first = int(np.hypot(*sides[0]) < np.hypot(*sides[1]))
    along = sides[first] / length
    across = np.array([-along[1], along[0]])
    middle = box[:4].mean(axis=0)
    is_row = width < _BAY_LENGTH
    pitch = _ROW_PITCH if is_row else _BAY_WIDTH
    offsets = [0.0] if is_row else [width / 2.0 - _BAY_LENGTH / 2.0 - 0.2]
    if width > 2.0 * _BAY_LENGTH + _AISLE:
        offsets.append(-offsets[0])
    heading = float(np.arctan2(along[1], along[0]))
    heading += 0.0 if is_row else np.pi / 2.0
    area = shapely.union_all(shapely.polygons(one.triangles[:, :, :2]))
    name = one.structure.name
    rng = random_generator(seed, "car park", name)
    count = int((length - 0.5) / pitch)
    for row, offset in enumerate(offsets):
        for k in range(count):
            x = (k - (count - 1) / 2.0) * pitch + float(rng.uniform(-0.2, 0.2))
            place = middle + x * along + offset * across
            yaw = heading + float(rng.uniform(-0.02, 0.02))
            form = pick_key(_TABLES["vehicles"], rng)
            if rng.random() > _TAKEN_SHARE or not area.contains(Point(place)):
                continue
            xy = (float(place[0]), float(place[1]))
            if placing.place(f"car_{name}_{row}_{k}", form, xy, yaw, rng):
                placing.found.at_random["Parked vehicles"] += 1


# Objects farther than this from all drives are left out [m].
_THINGS_WITHIN = 100.0
# Distance between random lamps, and from them to those of the file [m].
_LAMP_EVERY = 27.0
# Mean distance between random small objects [m].
_SMALL_EVERY = 22.0


def dress_streets(
    structures: Sequence[Imported],
    things: Sequence[Thing],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
    ground: Ground,
    bottom: Sequence[Structure],
    seed: int,
) -> StreetThings:
    """Places small objects along the streets of a city, and returns them.

    Objects from the imported file are placed first, and then random objects.
    Objects are placed near the paths of the drives, but not on the paths.
    Without drives nothing is placed.

    Args:
        structures: structures that already exist.
        things: small objects from the imported file.
        streets: the streets along which objects are added.
        drives: the drives of the map.
        ground: heights of the ground on which objects stand.
        bottom: ground that was made for a file without a terrain, as
            structures; empty if the file has a terrain.
        seed: seed of all random draws.
    """
    found = StreetThings()
    if not drives:
        return found
    placing = StreetRoom(structures, drives, ground, bottom, found)
    near = [s for s in streets if placing.is_near(s.line, _THINGS_WITHIN)]
    courses = [LineString(street.line) for street in near]
    lines = MultiLineString(courses)
    for one in structures:
        if one.kind == "Tree":
            placing.keep_tree(_off_carriageway(placing, one, near, courses))
    for number, thing in enumerate(things):
        if placing.is_near(np.array([thing.xy] * 2), _THINGS_WITHIN):
            _place_thing(placing, thing, number, near, courses, seed)
    for one in structures:
        if one.kind == "Parking":
            fill_car_park(placing, one, seed)
    for row in _streets_to_dress(near, drives):
        if placing.is_near(np.array(row.line.coords), ROWS_WITHIN):
            rng = random_generator(seed, "row", row.name)
            park_along(placing, row, lines, rng)
            _place_lamps(placing, row, rng)
            if not things:
                _place_small_objects(placing, row, rng)
    return found


def _streets_to_dress(
    streets: Sequence[Street], drives: Sequence[WaypointRoute]
) -> Iterator[Row]:
    """Yields the streets; without streets, drives as middles of streets."""
    for street in streets:
        may_park = (may_park_on("right", street), may_park_on("left", street))
        half = street.width / 2.0
        yield Row(street.name, LineString(street.line), half, may_park)
    if not streets:
        for number, drive in enumerate(drives):
            line = LineString(drive.path)
            yield Row(f"drive_{number}", line, HALF_STREET, (True, True))


def _off_carriageway(
    placing: StreetRoom,
    tree: Imported,
    streets: Sequence[Street],
    courses: Sequence[LineString],
) -> Imported:
    """Returns a tree, moved off the carriageway and its kerb if necessary."""
    structure = tree.structure
    xy = np.array(structure.xyz[:2])
    if not streets or not placing.is_near(np.array([xy] * 2), _THINGS_WITHIN):
        return tree
    beside, _ = beside_street(xy, streets, courses)
    if np.array_equal(beside, xy) or not placing.has_tree_pit(beside):
        return tree
    x, y = np.round(beside, 3).tolist()
    z = structure.xyz[2]
    moved = replace(
        tree,
        structure=replace(structure, xyz=(x, y, z)),
        triangles=tree.triangles + np.array([x - xy[0], y - xy[1], 0.0]),
    )
    placing.found.moved[tree] = moved
    return moved


def _place_thing(
    placing: StreetRoom,
    thing: Thing,
    number: int,
    streets: Sequence[Street],
    courses: Sequence[LineString],
    seed: int,
) -> None:
    name = f"{thing.kind}_{thing.source}"
    if thing.source.startswith("w"):
        name += f"_{number}"
    xy, yaw = np.array(thing.xy), thing.yaw
    if streets:
        xy, towards = beside_street(xy, streets, courses)
        yaw = towards if yaw is None else yaw
    rng = random_generator(seed, "thing", name)
    at = (float(xy[0]), float(xy[1]))
    if placing.place(name, thing.kind, at, yaw or 0.0, rng):
        placed_last = placing.found.structures[-1].structure.name
        placing.found.from_file.add(placed_last)
        placing.found.sources.add(thing.source)
        placing.found.by_file[title_of(thing.kind)] += 1
    else:
        placing.found.no_room += 1


def _place_lamps(
    placing: StreetRoom, row: Row, rng: np.random.Generator
) -> None:
    """Places lamps along a street where the file has none."""
    s = float(rng.uniform(3.0, 12.0))
    side = 1.0
    while s < row.line.length:
        for offset in (row.half + FROM_EDGE, row.half - 0.4, 2.3):
            xy, yaw = place_along(row.line, s, side, offset)
            if any(
                np.hypot(x - xy[0], y - xy[1]) < _LAMP_EVERY
                for x, y in placing.lamps
            ):
                break
            # The lamp's arm extends over the street.
            yaw += side * np.pi / 2.0
            lamp = f"lamp_post_{row.name}_{int(s)}"
            if placing.place(lamp, "lamp_post", xy, yaw, rng):
                placing.found.at_random["Lamp post"] += 1
                break
        s += _LAMP_EVERY
        side = -side


def _place_small_objects(
    placing: StreetRoom, row: Row, rng: np.random.Generator
) -> None:
    """Places small objects along a street if the file has none at all."""
    s = float(rng.uniform(3.0, 12.0))
    while s < row.line.length:
        side = 1.0 if rng.random() < 0.5 else -1.0
        kind = pick_key(_TABLES["small things"], rng)
        xy, yaw = place_along(row.line, s, side, row.half + FROM_EDGE)
        yaw += side * np.pi / 2.0
        if placing.place(f"{kind}_{row.name}_{int(s)}", kind, xy, yaw, rng):
            placing.found.at_random[title_of(kind)] += 1
        s += float(rng.uniform(0.6, 1.4)) * _SMALL_EVERY
