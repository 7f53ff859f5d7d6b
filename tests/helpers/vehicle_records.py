"""Vehicles of traffic as records, for single steps of its models."""

import numpy as np

from cns_drake.traffic import CURRENT, VEHICLE


def make_vehicles(*states, **fields):
    """Returns records of vehicles of 4 m.

    Args:
        states: the pieces of the path from the current one on, the place on
            that [m], the speed [m/s].
        fields: other fields of all of them.
    """
    cars = np.zeros(len(states), VEHICLE)
    for name in ("held", "left_lane", "path"):
        cars[name] = -1
    cars["since"], cars["change_length"] = np.inf, 1.0
    cars["length"], cars["top"], cars["factor"] = 4.0, 20.0, 1.0
    cars["a"], cars["b"], cars["headway"] = 1.5, 2.0, 1.3
    for name, value in fields.items():
        cars[name] = value
    for car, (pieces, s, v) in zip(cars, states, strict=True):
        car["path"][CURRENT : CURRENT + len(pieces)] = pieces
        car["s"], car["v"] = s, v
    return cars
