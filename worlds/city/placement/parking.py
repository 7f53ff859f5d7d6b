"""Parks cars in parking bays along streets and in car parks."""

from collections.abc import Mapping
import math

import numpy as np
from numpy.random import Generator
import shapely

from worlds.city.city_plan import ParkingPlan
from worlds.city.placement.draft import Draft
from worlds.roads import RoadNetwork
from worlds.shapes import OBJECTS, pick_key

# Length of a parking bay along the street, least and greatest [m].
_BAY_LENGTH = (5.6, 7.0)
# Share of the bays along a street in which a car stands.
_BAY_FILL = 0.72
# Distance of the first car from the start of a road, least and greatest [m].
_FIRST_CAR = (2.0, 5.0)
# Greatest angle between a parked car and the street [rad].
_SKEW = 0.03
# Greatest angle between a car and its bay, on a district's own ground [rad].
_BAY_SKEW = 0.04
# Greatest distance of a car from the middle of its bay, along x and y [m].
_BAY_SHIFT = 0.15
# Share of the drivers who park nose in.
_NOSE_IN = 0.7
# Cars are parked a little closer to the kerb than to the lane [m].
_TO_KERB = 0.08


def park_along_streets(draft: Draft, network: RoadNetwork) -> None:
    """Parks cars in the parking bays along the roads, where there is room."""
    for (name, side), bay in network.areas.parking_bays.items():
        road = network.roads[name]
        rng = draft.task("bays", name, side)
        sign = 1 if side == "left" else -1
        offset = sign * (road.half_width + road.parking / 2 + _TO_KERB)
        s = road.first_station + float(rng.uniform(*_FIRST_CAR))
        while s < road.last_station:
            x, y, _, heading = road.evaluate([s], offset)[0]
            if shapely.contains_xy(bay, x, y) and rng.uniform() < _BAY_FILL:
                # On the left of the direction `forward`, traffic runs the other
                # way.
                yaw = heading + (math.pi if side == "left" else 0.0)
                yaw += float(rng.uniform(-_SKEW, _SKEW))
                tags = ("bay", name)
                place_car(draft, draft.plan.cars, (x, y), yaw, rng, tags)
            s += float(rng.uniform(*_BAY_LENGTH))


def park_in_bays(
    draft: Draft, district: str, plan: ParkingPlan, rng: Generator
) -> None:
    """Parks cars in a row of parking bays on a district's own ground.

    Args:
        draft: the city so far, to which the cars are added.
        district: name of the district.
        plan: the row of bays.
        rng: random generator for the choice and the places of the cars.
    """
    start, end = np.array(plan.start), np.array(plan.end)
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    inwards = np.array([-along[1], along[0]])
    width, depth = plan.bay
    for k in range(int(length / width)):
        if rng.uniform() > plan.fill:
            continue
        at = start + along * (k + 0.5) * width + inwards * depth / 2
        at = at + rng.uniform(-_BAY_SHIFT, _BAY_SHIFT, 2)
        nose = inwards if rng.uniform() < _NOSE_IN else -inwards
        skew = float(rng.uniform(-_BAY_SKEW, _BAY_SKEW))
        yaw = math.atan2(nose[1], nose[0]) + skew
        place_car(draft, draft.plan.cars, tuple(at), yaw, rng, (district,))


def place_car(
    draft: Draft,
    cars: Mapping[str, float],
    xy: tuple[float, float],
    yaw: float,
    rng: Generator,
    tags: tuple[str, ...],
) -> None:
    """Places a parked car of a random kind, if there is room.

    Args:
        draft: the city so far, to which the car is added.
        cars: kind of car -> its weight in the random choice.
        xy: position of the car's centre in W [m].
        yaw: heading of the car [rad].
        rng: random generator for the choice of the car.
        tags: tags of the structure.
    """
    car_kind = pick_key(cars, rng)
    draft.place(car_kind, OBJECTS[car_kind].build(rng), xy, yaw, tags)
