"""Parked cars that have left, stand elsewhere in their bay, or are others."""

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely import Polygon

from cns_drake.base.elementary import product
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry.structures import Model, part_triangles
from cns_drake.transient.scene_editing import Surroundings
from cns_drake.transient.world_structures import (
    GROUND_CLASSES,
    GroundSurface,
    Obstacles,
    Structure,
)

CAUSE = "parked_cars"
CLASSES = frozenset({"car", "truck", "bus"})
# Shares of changed bays: the car is gone; the car has moved. The rest have
# another car.
_GONE = 0.3
_MOVED = 0.2
# Greatest room of a bay before and behind a car, and beside it [m].
_LENGTHWISE = 0.5
_SIDEWAYS = 0.25
# Greatest turn of a car against its bay [rad].
_SKEW = 0.03
# Distance of cars from all other things [m].
_GAP = 0.05
# Least distance of a moved car from its old place [m].
_LEAST_MOVE = 0.1
_TRIES = 12
# Kinds of parked vehicles, with relative shares.
_FORMS = {
    "city_car": 3,
    "hatchback": 4,
    "saloon": 3,
    "estate": 3,
    "suv": 3,
    "pickup": 1,
    "van": 2,
}


class Bay:
    """The room of a parked car, which overlaps no other bay.

    Attributes:
        middle: (2,) of the car [m].
        yaw: heading of its long axis [rad].
        reach: (4,) of the bay from there: front, back, left, right [m].
    """

    def __init__(self, car: Structure):
        """A bay as large as the car."""
        hull = shapely.MultiPoint(car.p_WPs[:, :2])
        corners = shapely.get_coordinates(hull.minimum_rotated_rectangle)[:4]
        sides = np.diff(corners, axis=0)[:2]
        lengths = np.linalg.norm(sides, axis=1)
        along = sides[int(lengths.argmax())]
        self.middle = corners.mean(axis=0)
        self.yaw = math.atan2(along[1], along[0])
        self.reach = np.repeat([lengths.max() / 2, lengths.min() / 2], 2)

    def box(self, beyond: np.ndarray | float = 0.0) -> Polygon:
        """Returns the bay, extended, seen from above [m].

        `beyond` has lengths at front, back, left and right [m].
        """
        front, back, left, right = self.reach + beyond
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        corners = np.array(
            [(front, left), (-back, left), (-back, -right), (front, -right)]
        )
        return Polygon(
            product(corners, np.array([[c, s], [-s, c]])) + self.middle
        )

    def grow(self, car: Structure, cars: Obstacles, others: Obstacles) -> None:
        """Grows towards other things, and half the way towards other cars."""
        own = (car.name,)
        box = self.box()
        growth = np.zeros(4)
        for k, most in enumerate((_LENGTHWISE,) * 2 + (_SIDEWAYS,) * 2):
            reach = np.zeros(4)
            reach[k] = 2 * most + _GAP
            around = self.box(reach)
            room = min(
                cars.distance(box, around, own) / 2,
                others.distance(box, around, own),
                most + _GAP,
            )
            growth[k] = max(room - _GAP, 0.0)
        self.reach = self.reach + growth

    def place(
        self, half_size: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, float] | None:
        """Returns middle and yaw of a car in the bay; None if it is too big.

        It has (2,) half its length and width [m].
        """
        skew = float(rng.uniform(-_SKEW, _SKEW))
        across, turned = rng.uniform(size=2), rng.uniform() < 0.5
        c, s = math.cos(skew), abs(math.sin(skew))
        half = half_size * c + half_size[::-1] * s
        low, high = half - self.reach[1::2], self.reach[::2] - half
        if (low > high).any():
            return None
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = low + across * (high - low)
        offset = np.array([c * x - s * y, s * x + c * y])
        yaw = self.yaw + skew + np.pi * turned
        return self.middle + offset, float(yaw)


def make_bays(around: Surroundings) -> dict[str, Bay]:
    """Returns the bays of all parked cars, by the cars' names."""
    cars = {car.name: car for car in around.of_classes(CLASSES)}
    bays = {name: Bay(car) for name, car in cars.items()}
    if not bays:
        return {}
    standing = Obstacles((n, bay.box()) for n, bay in bays.items())
    others = around.obstacles(ignored=CLASSES | GROUND_CLASSES)
    grown = {}
    for name, car in cars.items():
        grown[name] = Bay(car)
        grown[name].grow(car, standing, others)
    # Two bays that meet at a corner both stay as they are.
    boxes = [bay.box() for bay in grown.values()]
    names = list(grown)
    first, second = shapely.STRtree(boxes).query(boxes, "intersects")
    for a, b in zip(first, second, strict=True):
        if a != b:
            grown[names[a]] = bays[names[a]]
    return grown


def change_parked_cars(around: Surroundings, share: float) -> None:
    """Changes a share of the parked cars, from 0 to 1."""
    editing, bays = around.editing, make_bays(around)
    if not bays:
        editing.note("parked_cars: the world has no car, truck or bus")
    cars = [around.things[name] for name in bays]
    for car, rng in around.chosen(CAUSE, cars, share):
        bay, fate = bays[car.name], rng.uniform()
        if fate < _GONE:
            editing.remove(car, CAUSE)
        elif fate < _GONE + _MOVED:
            X_new = _moved(bay, car, around.ground, rng)
            editing.move(car, X_new, f"parked_{car.name}", CAUSE)
        else:
            _replace(around, car, bay, rng)


def _moved(
    bay: Bay, car: Structure, ground: GroundSurface, rng: np.random.Generator
) -> RigidTransform:
    """Returns the transformation of a moved car's points."""
    own = Bay(car)
    half_size = own.reach[::2]
    middle, yaw = own.middle, own.yaw + np.pi  # At least turned round.
    for _ in range(_TRIES):
        found = bay.place(half_size, rng)
        if (
            found is not None
            and np.linalg.norm(found[0] - own.middle) >= _LEAST_MOVE
        ):
            middle, yaw = found
            break
    X_WC = RigidTransform(RollPitchYaw(0, 0, own.yaw), [*own.middle, 0])
    rise = ground.rise(own.middle, middle)
    X_new = RigidTransform(RollPitchYaw(0, 0, yaw), [*middle, rise])
    return X_new @ X_WC.inverse()


def _replace(
    around: Surroundings, car: Structure, bay: Bay, rng: np.random.Generator
) -> None:
    """Puts another car into a bay, or none if the bay is too small."""
    editing, forms = around.editing, list(_FORMS)
    shares = np.array(list(_FORMS.values()), float)
    for k in rng.choice(len(forms), len(forms), False, shares / shares.sum()):
        builder = PARKED_CARS[forms[k]]
        model = builder.build(rng)
        low, high = _extent(model)
        found = bay.place((high - low) / 2, rng)
        if found is None:
            continue
        middle, yaw = found
        R = RollPitchYaw(0, 0, yaw)
        # The origin of the model is not exactly in the middle of the car.
        offset = R.ToRotationMatrix() @ [*((low + high) / 2), 0.0]
        z = car.bottom + around.ground.rise(Bay(car).middle, middle)
        X_WS = RigidTransform(R, [*middle, z] - offset)
        editing.remove(car, CAUSE)
        editing.add(
            f"parked_{car.name}",
            builder.semantic_class,
            model,
            X_WS,
            CAUSE,
        )
        return
    editing.remove(car, CAUSE)


def _extent(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Returns the lowest and highest x and y of a car's model [m]."""
    corners = np.concatenate(
        [part_triangles(part, model.meshes)[0] for part in model.parts]
    )[:, :2]
    return corners.min(axis=0), corners.max(axis=0)
