"""Small objects along streets: those in the file, and random ones."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from shapely.geometry import LineString, MultiLineString

from cns_drake.city.geometry import Structure
from cns_drake.city.placement.objects import pick_key
from cns_drake.imports.dressing.guessed_streets import HALF_STREET
from cns_drake.imports.dressing.parked_cars import (
    ROWS_WITHIN,
    DressedStreet,
    fill_car_park,
    may_park_on,
    park_along,
)
from cns_drake.imports.dressing.roadside_places import (
    FROM_EDGE,
    beside_street,
    place_along,
)
from cns_drake.imports.dressing.street_room import (
    PlacedObjects,
    StreetRoom,
    title_of,
)
from cns_drake.imports.dressing.street_tables import TABLES
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.foreign_city import SmallObject
from cns_drake.imports.ground import Ground
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.named_randomness import random_generator
from cns_drake.imports.streets import Street

# Objects farther than this from all drives are left out [m].
_OBJECTS_WITHIN = 100.0
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
    near = [s for s in streets if room.is_near(s.line, _OBJECTS_WITHIN)]
    courses = [LineString(street.line) for street in near]
    lines = MultiLineString(courses)
    for imported in objects:
        if imported.object_type == "Tree":
            room.keep_tree(_off_carriageway(room, imported, near, courses))
    for number, small in enumerate(small_objects):
        if room.is_near(np.array([small.xy] * 2), _OBJECTS_WITHIN):
            _place_from_file(room, small, number, near, courses, seed)
    for imported in objects:
        if imported.object_type == "Parking":
            fill_car_park(room, imported, seed)
    for row in _streets_to_dress(near, drives):
        if room.is_near(np.array(row.line.coords), ROWS_WITHIN):
            rng = random_generator(seed, "row", row.name)
            park_along(room, row, lines, rng)
            _place_lamps(room, row, rng)
            if not small_objects:
                _place_small_objects(room, row, rng)
    return room.placed


def _streets_to_dress(
    streets: Sequence[Street], drives: Sequence[WaypointRoute]
) -> Iterator[DressedStreet]:
    """Yields the streets; without streets, drives as middles of streets."""
    for street in streets:
        may_park = (may_park_on("right", street), may_park_on("left", street))
        half = street.width / 2.0
        yield DressedStreet(
            street.name, LineString(street.line), half, may_park
        )
    if not streets:
        for number, drive in enumerate(drives):
            line = LineString(drive.path)
            yield DressedStreet(
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
        tree: the tree.
        streets: the streets near drives.
        courses: middle line of each of these streets.
    """
    structure = tree.structure
    xy = np.array(structure.xyz[:2])
    if not streets or not room.is_near(np.array([xy] * 2), _OBJECTS_WITHIN):
        return tree
    beside, _ = beside_street(xy, streets, courses)
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
        room: the city, which places objects where there is room.
        small: the small object.
        number: number of the object among all small objects.
        streets: the streets near drives.
        courses: middle line of each of these streets.
        seed: seed of the random draws.
    """
    name = f"{small.kind}_{small.source}"
    if small.source.startswith("w"):
        # A tree row has several trees.
        name += f"_{number}"
    xy, yaw = np.array(small.xy), small.yaw
    if streets:
        xy, towards = beside_street(xy, streets, courses)
        yaw = towards if yaw is None else yaw
    rng = random_generator(seed, "thing", name)
    at = (float(xy[0]), float(xy[1]))
    if room.place(name, small.kind, at, yaw or 0.0, rng):
        placed_last = room.placed.objects[-1].structure.name
        room.placed.from_file.add(placed_last)
        room.placed.sources.add(small.source)
        room.placed.by_file[title_of(small.kind)] += 1
    else:
        room.placed.no_room += 1


def _place_lamps(
    room: StreetRoom, row: DressedStreet, rng: np.random.Generator
) -> None:
    """Places lamps along a street, on alternate sides, if the file has none."""
    s = float(rng.uniform(*_FIRST_OBJECT))
    side = 1.0
    offsets = (row.half + FROM_EDGE, row.half - _LAMP_INSIDE, _LAMP_FROM_MIDDLE)
    while s < row.line.length:
        for offset in offsets:
            xy, yaw = place_along(row.line, s, side, offset)
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
    room: StreetRoom, row: DressedStreet, rng: np.random.Generator
) -> None:
    """Places random small objects along a street, for a file without any."""
    s = float(rng.uniform(*_FIRST_OBJECT))
    while s < row.line.length:
        side = 1.0 if rng.random() < 0.5 else -1.0
        kind = pick_key(TABLES["small things"], rng)
        xy, yaw = place_along(row.line, s, side, row.half + FROM_EDGE)
        yaw += side * np.pi / 2.0
        if room.place(f"{kind}_{row.name}_{int(s)}", kind, xy, yaw, rng):
            room.placed.at_random[title_of(kind)] += 1
        s += float(rng.uniform(*_SMALL_SPACINGS)) * _SMALL_EVERY
