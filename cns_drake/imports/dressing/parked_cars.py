"""Cars that are parked at random along streets and in car parks."""

from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Point
from shapely.geometry.base import BaseGeometry

from cns_drake.city.placement.objects import pick_key
from cns_drake.imports.dressing.roadside_places import place_along
from cns_drake.imports.dressing.street_room import StreetRoom
from cns_drake.imports.dressing.street_tables import TABLES
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.named_randomness import random_generator
from cns_drake.imports.streets import Street

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
_AISLE_WIDTH = 5.5


def may_park_on(side: str, street: Street) -> bool:
    """Returns whether the tags of a street allow parking on one of its sides.

    `side` is `left` or `right`. Tags:
    https://wiki.openstreetmap.org/wiki/Street_parking
    """
    if street.tags.get("highway", "") in TABLES["streets without parked cars"]:
        return False
    values = {
        street.tags.get(key.format(which))
        for which in (side, "both")
        for key in TABLES["parking keys"]
    }
    return not values & set(TABLES["no parking"])


class DressedStreet(NamedTuple):
    """A street along which objects are placed, and cars may park.

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
    room: StreetRoom,
    row: DressedStreet,
    lines: BaseGeometry,
    rng: np.random.Generator,
) -> None:
    """Parks cars at random on the sides of a street that allow parking.

    Args:
        room: the city, which places cars where there is room.
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
            form = pick_key(TABLES["vehicles"], rng)
            # Without other streets, the distance is NaN.
            is_clear = not others.distance(Point(xy)) <= _FROM_CROSSING
            if is_taken and is_clear:
                kind = f"car_{row.name}_{int(s)}_{'lr'[side > 0]}"
                if room.place(kind, form, xy, yaw, rng):
                    room.found.at_random["Parked vehicles"] += 1
            s += float(rng.uniform(*_CAR_EVERY))


def fill_car_park(room: StreetRoom, one: ImportedObject, seed: int) -> None:
    """Parks cars at random along the longer sides of a car park.

    Args:
        room: the city, which places cars where there is room.
        one: the car park.
        seed: seed of the random draws.
    """
    outline = MultiPoint(one.triangles.reshape(-1, 3)[:, :2])
    box = np.array(outline.minimum_rotated_rectangle.boundary.coords)
    if len(box) != 5 or not room.is_near(box, ROWS_WITHIN):
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
    if width > 2.0 * _BAY_LENGTH + _AISLE_WIDTH:
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
            form = pick_key(TABLES["vehicles"], rng)
            if rng.random() > _TAKEN_SHARE or not area.contains(Point(place)):
                continue
            xy = (float(place[0]), float(place[1]))
            if room.place(f"car_{name}_{row}_{k}", form, xy, yaw, rng):
                room.found.at_random["Parked vehicles"] += 1
