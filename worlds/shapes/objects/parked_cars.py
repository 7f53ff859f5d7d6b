"""Parked vehicles of random body types and colours.

Vehicle frame: x forward, y left, z up; the origin is on the ground below the
middle of the vehicle.
"""

from functools import partial

import numpy as np

from worlds.shapes.models import MeshShape, Model, Part, triple
from worlds.shapes.object_models import Builder, assemble

# Paint colours, roughly in the shares seen on the road.
PAINTS = (
    (0.85, 0.85, 0.84),
    (0.85, 0.85, 0.84),
    (0.12, 0.12, 0.13),
    (0.12, 0.12, 0.13),
    (0.45, 0.46, 0.48),
    (0.45, 0.46, 0.48),
    (0.66, 0.67, 0.68),
    (0.17, 0.26, 0.42),
    (0.55, 0.12, 0.12),
    (0.2, 0.32, 0.26),
    (0.58, 0.52, 0.42),
)
# Colour of tyres, windows and lamps.
TRIM = (0.13, 0.15, 0.17)
# Colour of the box of a truck.
WHITE = (0.85, 0.85, 0.84)

# Body type -> semantic class.
FORMS = {
    "city_car": "car",
    "hatchback": "car",
    "saloon": "car",
    "estate": "car",
    "suv": "car",
    "pickup": "car",
    "van": "car",
    "box_truck": "truck",
    "bus": "bus",
}


def car(rng: np.random.Generator, *, form: str) -> Model:
    """Returns a parked vehicle with random paint and a slightly random size.

    `form` is a body type, such as `van`: a key of `FORMS`.
    """
    size = rng.uniform(0.97, 1.03, 3)
    scale = triple(round(float(s), 3) for s in size)
    paint = PAINTS[int(rng.integers(len(PAINTS)))]
    colours = {"body": paint, "trim": TRIM}
    if form == "box_truck":
        colours["box"] = WHITE
    parts = [
        Part(
            name,
            MeshShape(f"{form}_{name}", scale),
            rgb=rgb,
            material="trim" if name == "trim" else None,
        )
        for name, rgb in colours.items()
    ]
    return assemble(*parts)


PARKED_CARS = {
    form: Builder(semantic_class, partial(car, form=form))
    for form, semantic_class in FORMS.items()
}
