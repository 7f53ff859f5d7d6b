"""Temporary changes to parked cars: some leave, move or are replaced."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.scene import SceneStructure
from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.surroundings import Surroundings
from worlds.shapes import (
    GROUND_CLASSES,
    PARKED_CARS,
    Bay,
    GroundSurface,
    Model,
    grown_bays,
    part_mesh,
)

# Cause of these changes in the structure table.
_CAUSE = "parked_cars"
_PARKED = frozenset({"car", "truck", "bus"})
# Share of the changed bays whose car has gone.
_GONE = 0.3
# Share of the changed bays whose car has moved. All others get another car.
_MOVED = 0.2
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


def change_parked_cars(around: Surroundings, share: float) -> None:
    """Changes some of the parked cars.

    A changed car is removed, moved in its bay, or replaced by another car.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the cars that are changed, from 0 to 1.
    """
    editing = around.editing
    cars = around.of_classes(_PARKED)
    if not cars:
        editing.note("parked_cars: the world has no car, truck or bus")
    others = around.obstacles_except(_PARKED | GROUND_CLASSES)
    bays = grown_bays({car.name: car for car in cars}, others)
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
    car: SceneStructure,
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
    car: SceneStructure,
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
