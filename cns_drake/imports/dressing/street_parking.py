"""Cars parked along streets and in car parks, at random."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Point
from shapely.geometry.base import BaseGeometry

from cns_drake.city.plan.weighted import pick
from cns_drake.imports.dressing.roadside import place_along
from cns_drake.imports.dressing.street_room import StreetRoom
from cns_drake.imports.foreign_city import Imported, Street, lot_generator

# Cars farther from all drives are left out [m].
ROWS_WITHIN = 70.0
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


def park_along(
    placing: StreetRoom,
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
            xy, yaw = place_along(line, s, side, half - _FROM_KERB)
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


def fill_car_park(placing: StreetRoom, one: Imported, seed: int) -> None:
    """Parks cars along the longer sides of an area."""
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
