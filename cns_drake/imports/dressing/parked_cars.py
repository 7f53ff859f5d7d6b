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
    others = lines.difference(line.buffer(_SAME_LINE))
    for side, is_allowed in zip((1.0, -1.0), row.may_park, strict=True):
        if not is_allowed:
            continue
        s = float(rng.uniform(*_FIRST_CAR))
        while s < line.length - _FROM_END:
            xy, yaw = place_along(line, s, side, row.half - _FROM_KERB)
            yaw += 0.0 if side > 0 else np.pi
            is_taken = rng.random() < _TAKEN_SHARE
            yaw += float(rng.uniform(-_MOST_TURNED, _MOST_TURNED))
            form = pick_key(TABLES["vehicles"], rng)
            # Without other streets, the distance is NaN.
            is_clear = not others.distance(Point(xy)) <= _FROM_CROSSING
            if is_taken and is_clear:
                letter = "r" if side > 0 else "l"
                name = f"car_{row.name}_{int(s)}_{letter}"
                if room.place(name, form, xy, yaw, rng):
                    room.placed.at_random["Parked vehicles"] += 1
            s += float(rng.uniform(*_CAR_EVERY))


def fill_car_park(
    room: StreetRoom, car_park: ImportedObject, seed: int
) -> None:
    """Parks cars at random along the longer sides of a car park.

    Args:
        room: the city, which places cars where there is room.
        car_park: the car park.
        seed: seed of the random draws.
    """
    outline = MultiPoint(car_park.triangles.reshape(-1, 3)[:, :2])
    box = np.array(outline.minimum_rotated_rectangle.boundary.coords)
    # A car park without area has no rectangle.
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
    offsets = [0.0]
    if not is_row:
        offsets = [width / 2.0 - _BAY_LENGTH / 2.0 - _BAYS_FROM_EDGE]
    if width > 2.0 * _BAY_LENGTH + _AISLE_WIDTH:
        offsets.append(-offsets[0])
    heading = float(np.arctan2(along[1], along[0]))
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
            form = pick_key(TABLES["vehicles"], rng)
            if rng.random() > _TAKEN_SHARE or not area.contains(Point(place)):
                continue
            xy = (float(place[0]), float(place[1]))
            if room.place(f"car_{name}_{row}_{k}", form, xy, yaw, rng):
                room.placed.at_random["Parked vehicles"] += 1
