"""Small objects along streets: those in the file, and random ones."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, MultiPoint, Point
from shapely.geometry.base import BaseGeometry

from evaluation.base import parse_yaml
from worlds.city import station_at
from worlds.imports.dressing.guessed_streets import HALF_STREET
from worlds.imports.dressing.street_room import (
    PlacedObjects,
    StreetRoom,
    title_of,
)
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.foreign_city import SmallObject
from worlds.imports.ground import Ground
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.named_randomness import random_generator
from worlds.imports.streets import Street
from worlds.shapes import Structure, pick_key

# Distance between random lamps, and from them to those of the file [m].
_LAMP_EVERY = 27.0
# Mean distance between random small objects [m].
_SMALL_EVERY = 22.0
# Distance between two random small objects, in shares of the mean distance.
_SMALL_SPACINGS = (0.6, 1.4)
# Least and greatest distance of the first random object from the start of a
# street [m].
_FIRST_OBJECT = (3.0, 12.0)
# Where there is no room beside the carriageway, lamps stand on its edge: this
# far inside it, or this far from the middle of the street [m].
_LAMP_INSIDE = 0.4
_LAMP_FROM_MIDDLE = 2.3
# Nothing is added along streets farther than this from all drives [m].
_ROWS_WITHIN = 70.0
# Least and greatest distance between cars that are parked along a street [m].
_CAR_EVERY = (5.8, 7.2)
# Share of the places that are taken.
_TAKEN_SHARE = 0.6
# Least and greatest distance of the first car from the start of a street [m].
_FIRST_CAR = (4.0, 9.0)
# Cars keep this distance from the end of a street [m].
_FROM_END = 4.0
# Greatest angle between a parked car and its place [rad].
_MOST_TURNED = 0.02
# Greatest distance of a car from the middle of its bay, along the row [m].
_MOST_ASIDE = 0.2
# Lines within this distance of a street's line belong to the street [m].
_SAME_LINE = 0.5
# Distance of bays from the edges of a car park, along and across the row [m].
_BAYS_FROM_ENDS = 0.25
_BAYS_FROM_EDGE = 0.2
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
_AISLE_WIDTH = 5.5
_TABLES = parse_yaml(Path(__file__).with_name("streets.yaml").read_bytes())
# Objects on a carriageway are moved to this distance beside its edge [m].
_FROM_EDGE = 0.6
# Objects closer to the middle of a street are on neither side of it [m].
_IN_THE_MIDDLE = 0.05


def dress_streets(
    objects: Sequence[ImportedObject],
    small_objects: Sequence[SmallObject],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
    ground: Ground,
    guessed_ground: Sequence[Structure],
    seed: int,
) -> PlacedObjects:
    """Places small objects along the streets of a city, and returns them.

    Objects from the imported file are placed first, and then random objects.
    Objects are placed near the paths of the drives, but not on the paths.
    Without drives nothing is placed.

    Args:
        objects: objects that already stand there.
        small_objects: small objects from the imported file.
        streets: the streets along which objects are added.
        drives: the drives of the map.
        ground: heights of the ground on which objects stand.
        guessed_ground: structures of the ground that was guessed; empty if the
            file has a terrain.
        seed: seed of all random draws.
    """
    if not drives:
        return PlacedObjects()
    room = StreetRoom(objects, drives, ground, guessed_ground)
    near = [s for s in streets if room.is_near(s.line)]
    courses = [LineString(street.line) for street in near]
    lines = MultiLineString(courses)
    for imported in objects:
        if imported.object_type == "Tree":
            room.keep_tree(_off_carriageway(room, imported, near, courses))
    for number, small in enumerate(small_objects):
        if room.is_near(np.array([small.xy] * 2)):
            _place_from_file(room, small, number, near, courses, seed)
    for imported in objects:
        if imported.is_ground and imported.object_type == "Parking":
            _fill_car_park(room, imported, seed)
    for row in _streets_to_dress(near, drives):
        if room.is_near(np.array(row.line.coords), _ROWS_WITHIN):
            rng = random_generator(seed, "row", row.name)
            _park_along(room, row, lines, rng)
            _place_lamps(room, row, rng)
            if not small_objects:
                _place_small_objects(room, row, rng)
    return room.placed


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


class _DressedStreet(NamedTuple):
    """A street along which objects are placed, and cars may park.

    Attributes:
        line: middle line of the street [m].
        half: half the width of the carriageway [m].
        may_park: whether cars may park on the right, and on the left.
    """

    name: str
    line: LineString
    half: float
    may_park: tuple[bool, bool]


def _park_along(
    room: StreetRoom,
    row: _DressedStreet,
    lines: BaseGeometry,
    rng: np.random.Generator,
) -> None:
    """Parks cars at random on the sides of a street that allow parking.

    Args:
        room: the city, which places cars where there is room.
        lines: middle lines of all streets, near whose crossings no car parks.
    """
    line = row.line
    others = lines.difference(line.buffer(_SAME_LINE))
    for side, is_allowed in zip((1.0, -1.0), row.may_park, strict=True):
        if not is_allowed:
            continue
        s = float(rng.uniform(*_FIRST_CAR))
        while s < line.length - _FROM_END:
            xy, yaw = _place_along(line, s, side, row.half - _FROM_KERB)
            yaw += 0.0 if side > 0 else np.pi
            is_taken = rng.random() < _TAKEN_SHARE
            yaw += float(rng.uniform(-_MOST_TURNED, _MOST_TURNED))
            form = pick_key(_TABLES["vehicles"], rng)
            # Without other streets, the distance is NaN.
            is_clear = not others.distance(Point(xy)) <= _FROM_CROSSING
            if is_taken and is_clear:
                letter = "r" if side > 0 else "l"
                name = f"car_{row.name}_{int(s)}_{letter}"
                if room.place(name, form, xy, yaw, rng):
                    room.placed.at_random["Parked vehicles"] += 1
            s += float(rng.uniform(*_CAR_EVERY))


def _fill_car_park(
    room: StreetRoom, car_park: ImportedObject, seed: int
) -> None:
    """Parks cars at random along the longer sides of a car park.

    Args:
        room: the city, which places cars where there is room.
    """
    outline = MultiPoint(car_park.triangles.reshape(-1, 3)[:, :2])
    box = np.array(outline.minimum_rotated_rectangle.boundary.coords)
    # A car park without area has no rectangle.
    if len(box) != 5 or not room.is_near(box, _ROWS_WITHIN):
        return
    sides = np.diff(box, axis=0)[:2]
    length, width = sorted(np.hypot(*sides.T).tolist(), reverse=True)
    first = int(np.subtract(*np.hypot(*sides.T)) < -1e-6)
    along = sides[first] / length
    across = np.array([-along[1], along[0]])
    middle = box[:4].mean(axis=0)
    is_row = width < _BAY_LENGTH
    pitch = _ROW_PITCH if is_row else _BAY_WIDTH
    offsets = [0.0]
    if not is_row:
        offsets = [width / 2.0 - _BAY_LENGTH / 2.0 - _BAYS_FROM_EDGE]
    if width > 2.0 * _BAY_LENGTH + _AISLE_WIDTH:
        offsets.append(-offsets[0])
    heading = math.atan2(along[1], along[0])
    heading += 0.0 if is_row else np.pi / 2.0
    area = shapely.union_all(shapely.polygons(car_park.triangles[:, :, :2]))
    name = car_park.structure.name
    rng = random_generator(seed, "car park", name)
    count = int((length - 2.0 * _BAYS_FROM_ENDS) / pitch)
    for row, offset in enumerate(offsets):
        for k in range(count):
            x = (k - (count - 1) / 2.0) * pitch
            x += float(rng.uniform(-_MOST_ASIDE, _MOST_ASIDE))
            place = middle + x * along + offset * across
            yaw = heading + float(rng.uniform(-_MOST_TURNED, _MOST_TURNED))
            form = pick_key(_TABLES["vehicles"], rng)
            if rng.random() > _TAKEN_SHARE or not area.contains(Point(place)):
                continue
            xy = (float(place[0]), float(place[1]))
            if room.place(f"car_{name}_{row}_{k}", form, xy, yaw, rng):
                room.placed.at_random["Parked vehicles"] += 1


def _streets_to_dress(
    streets: Sequence[Street], drives: Sequence[WaypointRoute]
) -> Iterator[_DressedStreet]:
    """Yields the streets; without streets, drives as middles of streets."""
    for street in streets:
        may_park = (may_park_on("right", street), may_park_on("left", street))
        half = street.width / 2.0
        yield _DressedStreet(
            street.name, LineString(street.line), half, may_park
        )
    if not streets:
        for number, drive in enumerate(drives):
            line = LineString(drive.path)
            yield _DressedStreet(
                f"drive_{number}", line, HALF_STREET, (True, True)
            )


def _off_carriageway(
    room: StreetRoom,
    tree: ImportedObject,
    streets: Sequence[Street],
    courses: Sequence[LineString],
) -> ImportedObject:
    """Returns a tree, moved off the carriageway and its kerb if necessary.

    The tree stays if it is far from drives, or if there is no room beside the
    carriageway. If it is moved, this is noted among the placed objects.

    Args:
        room: the city, which places objects where there is room.
        streets: the streets near drives.
        courses: middle line of each of these streets.
    """
    structure = tree.structure
    xy = np.array(structure.xyz[:2])
    if not streets or not room.is_near(np.array([xy] * 2)):
        return tree
    beside, _ = _beside_street(xy, streets, courses)
    if np.array_equal(beside, xy) or not room.has_tree_pit(beside):
        return tree
    x, y = np.round(beside, 3).tolist()
    z = structure.xyz[2]
    moved = replace(
        tree,
        structure=replace(structure, xyz=(x, y, z)),
        triangles=tree.triangles + np.array([x - xy[0], y - xy[1], 0.0]),
    )
    room.placed.moved[tree] = moved
    return moved


def _place_from_file(
    room: StreetRoom,
    small: SmallObject,
    number: int,
    streets: Sequence[Street],
    courses: Sequence[LineString],
    seed: int,
) -> None:
    """Places a small object of the file, moved off the carriageway.

    Args:
        room, streets, courses: see `_off_carriageway`.
    """
    name = f"{small.kind}_{small.source}"
    if small.source.startswith("w"):
        # A tree row has several trees.
        name += f"_{number}"
    xy, yaw = np.array(small.xy), small.yaw
    if streets:
        xy, towards = _beside_street(xy, streets, courses)
        yaw = towards if yaw is None else yaw
    rng = random_generator(seed, "thing", name)
    at = (float(xy[0]), float(xy[1]))
    if room.place(name, small.kind, at, yaw or 0.0, rng, small.height):
        placed_last = room.placed.objects[-1].structure.name
        room.placed.from_file.add(placed_last)
        room.placed.sources.add(small.source)
        room.placed.by_file[title_of(small.kind)] += 1
    else:
        room.placed.no_room += 1


def _place_lamps(
    room: StreetRoom, row: _DressedStreet, rng: np.random.Generator
) -> None:
    """Places lamps along a street, on alternate sides, if the file has none."""
    s = float(rng.uniform(*_FIRST_OBJECT))
    side = 1.0
    offsets = (
        row.half + _FROM_EDGE,
        row.half - _LAMP_INSIDE,
        _LAMP_FROM_MIDDLE,
    )
    while s < row.line.length:
        for offset in offsets:
            xy, yaw = _place_along(row.line, s, side, offset)
            if any(
                np.hypot(x - xy[0], y - xy[1]) < _LAMP_EVERY
                for x, y in room.lamps
            ):
                break
            # The lamp's arm extends over the street.
            yaw += side * np.pi / 2.0
            lamp = f"lamp_post_{row.name}_{int(s)}"
            if room.place(lamp, "lamp_post", xy, yaw, rng):
                room.placed.at_random["Lamp post"] += 1
                break
        s += _LAMP_EVERY
        side = -side


def _place_small_objects(
    room: StreetRoom, row: _DressedStreet, rng: np.random.Generator
) -> None:
    """Places random small objects along a street, for a file without any."""
    s = float(rng.uniform(*_FIRST_OBJECT))
    while s < row.line.length:
        side = 1.0 if rng.random() < 0.5 else -1.0
        kind = pick_key(_TABLES["small things"], rng)
        xy, yaw = _place_along(row.line, s, side, row.half + _FROM_EDGE)
        yaw += side * np.pi / 2.0
        if room.place(f"{kind}_{row.name}_{int(s)}", kind, xy, yaw, rng):
            room.placed.at_random[title_of(kind)] += 1
        s += float(rng.uniform(*_SMALL_SPACINGS)) * _SMALL_EVERY


def _beside_street(
    xy: np.ndarray, streets: Sequence[Street], courses: Sequence[LineString]
) -> tuple[np.ndarray, float]:
    """Returns a place beside the nearest street, and the heading to the street.

    A place on or close to the carriageway is moved to 0.6 m from the edge of
    the carriageway. Any other place stays. The heading is from the place to the
    middle of the street [rad].

    Args:
        xy: (2,) the place in W [m].
        courses: middle line of each street [m].
    """
    point = Point(xy)
    distances = shapely.distance(courses, point)
    nearest = int(np.argmin(np.round(distances, 6)))
    line = courses[nearest]
    half = streets[nearest].width / 2.0
    station = station_at(line, line.project(point))
    middle = np.array([station.x, station.y])
    offset = xy - middle
    distance = float(np.hypot(*offset))
    if distance < _IN_THE_MIDDLE:
        # On the right of the street, where signs stand.
        offset = np.array([math.sin(station.yaw), -math.cos(station.yaw)])
        distance = 1.0
    outwards = offset / distance
    if distances[nearest] < half + _FROM_EDGE:
        xy = middle + outwards * (half + _FROM_EDGE)
    return xy, math.atan2(-outwards[1], -outwards[0])


def _place_along(
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
    x = at.x + side * offset * math.sin(at.yaw)
    y = at.y - side * offset * math.cos(at.yaw)
    return (x, y), at.yaw
