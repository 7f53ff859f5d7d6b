"""Temporary changes to parked cars: some leave, move or are replaced."""

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely import Polygon

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.obstacles import Obstacles
from cns_drake.transient.structure_geometry import StructureGeometry
from cns_drake.transient.surroundings import Surroundings
from evaluation.base import product
from worlds.shapes import (
    GROUND_CLASSES,
    PARKED_CARS,
    Model,
    part_mesh,
)

# Cause of these changes in the structure table.
_CAUSE = "parked_cars"
_PARKED = frozenset({"car", "truck", "bus"})
# Share of the changed bays whose car has gone.
_GONE = 0.3
# Share of the changed bays whose car has moved. All others get another car.
_MOVED = 0.2
# Greatest free length of a bay in front of a car and behind it [m].
_LENGTHWISE = 0.5
# Greatest free width of a bay beside a car [m].
_SIDEWAYS = 0.25
# Greatest turn of a car relative to its bay [rad].
_SKEW = 0.03
# Distance between cars and all other objects [m].
_GAP = 0.05
# Least distance between the new and the old place of a moved car [m].
_LEAST_MOVE = 0.1
_CAR_TRIES = 12
# Body types of parked vehicles -> weight in the random choice.
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
    """The free rectangle around a parked car; bays do not overlap.

    Attributes:
        middle: (2,) middle of the car [m].
        yaw: heading of the bay's long axis [rad].
        reach: (4,) distances from the middle to the front, back, left and right
            end of the bay [m].
    """

    def __init__(self, car: StructureGeometry):
        """Makes a bay of the size of the car."""
        hull = shapely.MultiPoint(car.p_WPs[:, :2])
        corners = shapely.get_coordinates(hull.minimum_rotated_rectangle)[:4]
        sides = np.diff(corners, axis=0)[:2]
        lengths = np.linalg.norm(sides, axis=1)
        along = sides[int(lengths.argmax())]
        self.middle = corners.mean(axis=0)
        self.yaw = math.atan2(along[1], along[0])
        self.reach = np.repeat([lengths.max() / 2, lengths.min() / 2], 2)

    def box(self, beyond: np.ndarray | float = 0.0) -> Polygon:
        """Returns the rectangle of the bay as seen from above, enlarged [m].

        Args:
            beyond: lengths by which the bay is enlarged at the front, back,
                left and right, (4,), or one length for all sides [m].
        """
        front, back, left, right = self.reach + beyond
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        corners = np.array(
            [(front, left), (-back, left), (-back, -right), (front, -right)]
        )
        return Polygon(
            product(corners, np.array([[c, s], [-s, c]])) + self.middle
        )

    def grow(
        self, car: StructureGeometry, cars: Obstacles, others: Obstacles
    ) -> None:
        """Enlarges the bay up to other objects, and halfway to other cars.

        The bay grows by at most 0.5 m in front and behind, and by at most 0.25
        m on each side.
        """
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
        """Returns a random place for a car in the bay.

        Args:
            half_size: (2,) half the length and half the width of the car [m].
            rng: the random generator.

        Returns:
            The middle (2,) [m] and yaw [rad] of the car; None if the car is too
            big for the bay.
        """
        skew = float(rng.uniform(-_SKEW, _SKEW))
        across = rng.uniform(size=2)
        turned = rng.uniform() < 0.5
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
    """Returns name -> bay, for all parked cars near a drive."""
    cars = {car.name: car for car in around.of_classes(_PARKED)}
    bays = {name: Bay(car) for name, car in cars.items()}
    if not bays:
        return {}
    standing = Obstacles((n, bay.box()) for n, bay in bays.items())
    others = around.obstacles_except(_PARKED | GROUND_CLASSES)
    grown = {}
    for name, car in cars.items():
        grown[name] = Bay(car)
        grown[name].grow(car, standing, others)
    # Two bays that meet at a corner both keep their size.
    boxes = [bay.box() for bay in grown.values()]
    names = list(grown)
    first, second = shapely.STRtree(boxes).query(boxes, "intersects")
    for a, b in zip(first, second, strict=True):
        if a != b:
            grown[names[a]] = bays[names[a]]
    return grown


def change_parked_cars(around: Surroundings, share: float) -> None:
    """Changes some of the parked cars.

    A changed car is removed, moved in its bay, or replaced by another car.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the cars that are changed, from 0 to 1.
    """
    editing = around.editing
    bays = make_bays(around)
    if not bays:
        editing.note("parked_cars: the world has no car, truck or bus")
    cars = [around.structures[name] for name in bays]
    for car, rng in around.chosen(_CAUSE, cars, share):
        bay = bays[car.name]
        fate = rng.uniform()
        if fate < _GONE:
            editing.remove(car, _CAUSE)
        elif fate < _GONE + _MOVED:
            X_new = _random_move(bay, car, around.ground, rng)
            editing.move(car, X_new, f"parked_{car.name}", _CAUSE)
        else:
            _replace_car(around, car, bay, rng)


EFFECT = Effect("parked_cars", Phase.OBJECTS, change_parked_cars, order=1)


def _random_move(
    bay: Bay,
    car: StructureGeometry,
    ground: GroundSurface,
    rng: np.random.Generator,
) -> RigidTransform:
    """Returns the rigid transform in W of a car's points to a random place."""
    own = Bay(car)
    half_size = own.reach[::2]
    middle, yaw = own.middle, own.yaw + np.pi  # At least, it turns round.
    for _ in range(_CAR_TRIES):
        found = bay.place(half_size, rng)
        if (
            found is not None
            and np.linalg.norm(found[0] - own.middle) >= _LEAST_MOVE
        ):
            middle, yaw = found
            break
    X_WC = RigidTransform(RollPitchYaw(0, 0, own.yaw), [*own.middle, 0])
    rise = ground.rise(own.middle, middle)
    # N is the car's frame C at the new place.
    X_WN = RigidTransform(RollPitchYaw(0, 0, yaw), [*middle, rise])
    return X_WN @ X_WC.inverse()


def _replace_car(
    around: Surroundings,
    car: StructureGeometry,
    bay: Bay,
    rng: np.random.Generator,
) -> None:
    """Puts another car in a bay; leaves the bay empty if it is too small."""
    editing = around.editing
    forms = list(_FORMS)
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
        editing.remove(car, _CAUSE)
        editing.add(
            f"parked_{car.name}",
            builder.semantic_class,
            model,
            X_WS,
            _CAUSE,
        )
        return
    editing.remove(car, _CAUSE)


def _extent(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest x and y (2,) of a car's model [m]."""
    corners = np.concatenate(
        [part_mesh(part, model.meshes).vertices for part in model.parts]
    )[:, :2]
    return corners.min(axis=0), corners.max(axis=0)
