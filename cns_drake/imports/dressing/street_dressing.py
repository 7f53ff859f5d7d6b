"""Small things along streets: those of the file, and others by lot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, MultiPoint, Point
from shapely.geometry.base import BaseGeometry

from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry.occupancy import Occupancy
from cns_drake.city.geometry.polygons import placed
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.placement.frontage import station_at
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plan.weighted import pick
from cns_drake.imports.dressing.round_parts import without_curves
from cns_drake.imports.dressing.upper_sides import UpperSides, turned_up
from cns_drake.imports.foreign_city import Imported, Thing
from cns_drake.imports.import_ground import Ground
from cns_drake.imports.lots import lot_generator
from cns_drake.imports.street_lanes import Street
from cns_drake.imports.waypoint_drives import Drive

# Least distance of all objects from the middle of a drive [m].
_FROM_DRIVE = 1.7
# Things and cars farther from all drives are left out [m].
_THINGS_WITHIN, _ROWS_WITHIN = 100.0, 70.0
# A thing on a carriageway is moved beside it, to this distance from its edge
# [m].
_BESIDE = 0.6
_FROM_WALL, _BETWEEN = 0.25, 0.2
# Cars: distances in a row, part of the places that are taken, distance of
# their middle from the edge, and of rows from other streets [m].
_CAR_EVERY, _CARS, _FROM_KERB, _FROM_CROSSING = (5.8, 7.2), 0.6, 1.05, 5.0
# A car along a row; a bay across one, its width and length; between bays [m].
_ROW_PITCH, _BAY, _AISLE = 6.2, (2.6, 5.0), 5.5
# Weights of parked vehicles.
_FORMS = {
    "city_car": 3.0,
    "hatchback": 4.0,
    "saloon": 3.0,
    "estate": 4.0,
    "suv": 2.0,
    "van": 2.0,
    "box_truck": 0.3,
}
# Lamps by lot: their distance, and the range in which a lamp of the file
# replaces one [m].
_LAMP_EVERY, _LAMP_NEAR = 27.0, 35.0
_SMALL_EVERY = 22.0
_SMALL = {
    "litter_bin": 3.0,
    "bench": 2.0,
    "bicycle_rack": 2.0,
    "bollard": 2.0,
    "cabinet": 1.0,
    "post_box": 0.5,
    "hydrant": 1.0,
    "sign_round": 2.0,
    "sign_rectangular": 1.0,
}
# Half of the width of a street of unknown width [m].
_HALF_STREET = 3.9
_NO_PARKING = (
    "no",
    "no_parking",
    "no_stopping",
    "separate",
    "drawn_separately",
    "street_side",
    "lay_by",
)
_PARKING_KEYS = (
    "parking:{}",
    "parking:{}:restriction",
    "parking:lane:{}",
    "parking:condition:{}",
)
_WITHOUT_CARS = ("service", "track", "motorway", "trunk", "living_street")


@dataclass
class StreetThings:
    """The placed things.

    Attributes:
        structures: in the world.
        from_file: names of structures from the file.
        sources: sources of the file's things that were placed.
        by_file, by_lot: kind -> how many.
        no_room: how many of the file's things would stand in the way of a
            drive, in a wall or in each other.
    """

    structures: list[Imported] = field(default_factory=list)
    from_file: set[str] = field(default_factory=set)
    sources: set[str] = field(default_factory=set)
    by_file: Counter[str] = field(default_factory=Counter)
    by_lot: Counter[str] = field(default_factory=Counter)
    no_room: int = 0


def dress_streets(
    structures: Sequence[Imported],
    things: Sequence[Thing],
    streets: Sequence[Street],
    drives: Sequence[Drive],
    ground: Ground,
    seed: int,
) -> StreetThings:
    """Returns the small things along the streets of a city.

    Args:
        structures: those of all stages.
        things: of the file.
        streets: of the file.
        drives: kept free of things; without any nothing is placed.
        ground: below the city.
        seed: of the random draws.
    """
    found = StreetThings()
    if not drives:
        return found
    placing = _Placing(structures, drives, ground, found)
    near = [s for s in streets if placing.is_near(s.line, _THINGS_WITHIN)]
    courses = [LineString(street.line) for street in near]
    lines = MultiLineString(courses)
    for number, thing in enumerate(things):
        if placing.is_near(np.array([thing.xy] * 2), _THINGS_WITHIN):
            _place_thing(placing, thing, number, near, courses, seed)
    for one in structures:
        if one.kind == "Parking":
            _fill_car_park(placing, one, seed)
    rows = list(_rows(near, drives))
    for name, line, half, may_park in rows:
        if placing.is_near(np.array(line.coords), _ROWS_WITHIN):
            rng = lot_generator(seed, "row", name)
            _park(placing, name, line, half, may_park, lines, rng)
            _light(placing, name, line, half, rng)
            if not things:
                _furnish(placing, name, line, half, rng)
    return found


def _rows(
    streets: Sequence[Street], drives: Sequence[Drive]
) -> Iterator[tuple[str, LineString, float, tuple[bool, bool]]]:
    """Yields name, middle, half width, and whether cars park, of streets.

    Cars may park on the right, and on the left.
    """
    for street in streets:
        may_park = (may_park_on("right", street), may_park_on("left", street))
        half = street.width / 2.0
        yield street.name, LineString(street.line), half, may_park
    if not streets:
        for number, drive in enumerate(drives):
            line = LineString(drive.path)
            yield f"drive_{number}", line, _HALF_STREET, (True, True)


def may_park_on(side: str, street: Street) -> bool:
    """Returns whether cars may park on the `left` or `right` of a street.

    https://wiki.openstreetmap.org/wiki/Street_parking
    """
    if street.tags.get("highway", "") in _WITHOUT_CARS:
        return False
    values = {
        street.tags.get(key.format(which))
        for which in (side, "both")
        for key in _PARKING_KEYS
    }
    return not values & set(_NO_PARKING)


class _Placing:
    """The room for things: what is taken, and by what."""

    def __init__(
        self,
        structures: Sequence[Imported],
        drives: Sequence[Drive],
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
        for one in structures:
            if one.kind == "Tree":
                x, y, _ = one.structure.xyz
                self._taken.add(Point(x, y).buffer(0.4, 4))
        self._names = {one.structure.name for one in structures}
        self.lamps: list[tuple[float, float]] = []

    def is_near(self, line: np.ndarray, distance: float) -> bool:
        """Returns whether a line (N, 2) is near a drive."""
        return bool(shapely.dwithin(LineString(line), self.paths, distance))

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
            Imported(structure, _title(kind), None, _footing(footprint, z))
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


def _title(kind: str) -> str:
    return kind.replace("_", " ").capitalize()


def _footing(footprint: BaseGeometry, z: float) -> np.ndarray:
    """Returns the bounds of a footprint as triangles (2, 3, 3) [m]."""
    x0, y0, x1, y1 = footprint.bounds
    a, b, c, d = ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))
    return np.array([(a, b, c), (a, c, d)])


def _place_thing(
    placing: _Placing,
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
        xy, towards = _beside(xy, streets, courses)
        yaw = towards if yaw is None else yaw
    rng = lot_generator(seed, "thing", name)
    at = (float(xy[0]), float(xy[1]))
    if placing.place(name, thing.kind, at, yaw or 0.0, rng):
        placed_last = placing.found.structures[-1].structure.name
        placing.found.from_file.add(placed_last)
        placing.found.sources.add(thing.source)
        placing.found.by_file[_title(thing.kind)] += 1
    else:
        placing.found.no_room += 1


def _beside(
    xy: np.ndarray, streets: Sequence[Street], courses: Sequence[LineString]
) -> tuple[np.ndarray, float]:
    """Returns a place off the carriageway, and the heading to the street."""
    point = Point(xy)
    distances = shapely.distance(courses, point)
    nearest = int(np.argmin(distances))
    line, half = courses[nearest], streets[nearest].width / 2.0
    station = station_at(line, line.project(point))
    foot = np.array([station.x, station.y])
    offset = xy - foot
    distance = float(np.hypot(*offset))
    if distance < 0.05:
        # On the right of the street, as signs are.
        offset = np.array([np.sin(station.yaw), -np.cos(station.yaw)])
        distance = 1.0
    outwards = offset / distance
    if distances[nearest] < half + _BESIDE:
        xy = foot + outwards * (half + _BESIDE)
    return xy, float(np.arctan2(-outwards[1], -outwards[0]))


def _along(
    line: LineString, s: float, side: float, offset: float
) -> tuple[tuple[float, float], float]:
    """Returns a place beside a line, right for side 1, and its heading."""
    at = station_at(line, s)
    x = at.x + side * offset * float(np.sin(at.yaw))
    y = at.y - side * offset * float(np.cos(at.yaw))
    return (x, y), at.yaw


def _park(
    placing: _Placing,
    name: str,
    line: LineString,
    half: float,
    may_park: tuple[bool, bool],
    lines: BaseGeometry,
    rng: np.random.Generator,
) -> None:
    """Parks cars along the right and the left of a street."""
    others = lines.difference(line.buffer(0.5)) if not lines.is_empty else lines
    for side, is_allowed in zip((1.0, -1.0), may_park, strict=True):
        if not is_allowed:
            continue
        s = float(rng.uniform(4.0, 9.0))
        while s < line.length - 4.0:
            xy, yaw = _along(line, s, side, half - _FROM_KERB)
            yaw += 0.0 if side > 0 else np.pi
            is_taken = rng.random() < _CARS
            yaw += float(rng.uniform(-0.02, 0.02))
            form = pick(_FORMS, rng)
            is_clear = (
                others.is_empty or others.distance(Point(xy)) > _FROM_CROSSING
            )
            if is_taken and is_clear:
                kind = f"car_{name}_{int(s)}_{'lr'[side > 0]}"
                if placing.place(kind, form, xy, yaw, rng):
                    placing.found.by_lot["Parked vehicles"] += 1
            s += float(rng.uniform(*_CAR_EVERY))


def _fill_car_park(placing: _Placing, one: Imported, seed: int) -> None:
    """Parks cars along the longer sides of an area."""
    outline = MultiPoint(one.triangles.reshape(-1, 3)[:, :2])
    box = np.array(outline.minimum_rotated_rectangle.boundary.coords)
    if len(box) != 5 or not placing.is_near(box, _ROWS_WITHIN):
        return
    sides = np.diff(box, axis=0)[:2]
    length, width = sorted(np.hypot(*sides.T).tolist(), reverse=True)
    first = int(np.hypot(*sides[0]) < np.hypot(*sides[1]))
    along = sides[first] / length
    across = np.array([-along[1], along[0]])
    middle = box[:4].mean(axis=0)
    is_row = width < _BAY[1]
    pitch = _ROW_PITCH if is_row else _BAY[0]
    offsets = [0.0] if is_row else [width / 2.0 - _BAY[1] / 2.0 - 0.2]
    if width > 2.0 * _BAY[1] + _AISLE:
        offsets.append(-offsets[0])
    heading = float(np.arctan2(along[1], along[0]))
    heading += 0.0 if is_row else np.pi / 2.0
    area = shapely.union_all(shapely.polygons(one.triangles[:, :, :2]))
    name = one.structure.name
    rng = lot_generator(seed, "car park", name)
    count = int((length - 0.5) / pitch)
    for row, offset in enumerate(offsets):
        for k in range(count):
            x = (k - (count - 1) / 2.0) * pitch + float(rng.uniform(-0.2, 0.2))
            place = middle + x * along + offset * across
            yaw = heading + float(rng.uniform(-0.02, 0.02))
            form = pick(_FORMS, rng)
            if rng.random() > _CARS or not area.contains(Point(place)):
                continue
            xy = (float(place[0]), float(place[1]))
            if placing.place(f"car_{name}_{row}_{k}", form, xy, yaw, rng):
                placing.found.by_lot["Parked vehicles"] += 1


def _light(
    placing: _Placing,
    name: str,
    line: LineString,
    half: float,
    rng: np.random.Generator,
) -> None:
    """Sets lamps along a street where the file has none."""
    s, side = float(rng.uniform(3.0, 12.0)), 1.0
    while s < line.length:
        for offset in (half + _BESIDE, half - 0.4, 2.3):
            xy, yaw = _along(line, s, side, offset)
            if any(
                np.hypot(x - xy[0], y - xy[1]) < min(_LAMP_NEAR, _LAMP_EVERY)
                for x, y in placing.lamps
            ):
                break
            # The lamp's arm reaches over the street.
            yaw += side * np.pi / 2.0
            lamp = f"lamp_post_{name}_{int(s)}"
            if placing.place(lamp, "lamp_post", xy, yaw, rng):
                placing.found.by_lot["Lamp post"] += 1
                break
        s, side = s + _LAMP_EVERY, -side


def _furnish(
    placing: _Placing,
    name: str,
    line: LineString,
    half: float,
    rng: np.random.Generator,
) -> None:
    """Sets small things along a street if the file has none at all."""
    s = float(rng.uniform(3.0, 12.0))
    while s < line.length:
        side = 1.0 if rng.random() < 0.5 else -1.0
        kind = pick(_SMALL, rng)
        xy, yaw = _along(line, s, side, half + _BESIDE)
        yaw += side * np.pi / 2.0
        if placing.place(f"{kind}_{name}_{int(s)}", kind, xy, yaw, rng):
            placing.found.by_lot[_title(kind)] += 1
        s += float(rng.uniform(0.6, 1.4)) * _SMALL_EVERY
