"""Parked vehicles: body types, colours, and single cars made from them."""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from cns_drake.city.furniture.car_bodies import CarForm, car_meshes
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import Builder, assemble, triple
from cns_drake.city.geometry.structures import MeshShape, Model, Part

# Paint colours, roughly as often as they are seen on the road.
_PAINTS = (
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
_TRIM = (0.13, 0.15, 0.17)
_WHITE = (0.85, 0.85, 0.84)

FORMS = {
    "city_car": CarForm(
        length=3.6, width=1.66, height=1.52, axles=(-1.18, 1.17),
        wheel_radius=0.29, sill=0.2,
        line=(
            (-1.8, 0.72), (-1.72, 0.9), (-0.3, 0.93), (0.85, 0.92), (1.5, 0.82),
            (1.74, 0.72), (1.8, 0.56),
        ),
        cabin_base=(-1.76, 1.0), cabin_roof=(-1.5, 0.3), pillars=(-0.35,),
    ),
    "hatchback": CarForm(
        length=4.2, width=1.78, height=1.47, axles=(-1.32, 1.3),
        wheel_radius=0.31, sill=0.2,
        line=(
            (-2.1, 0.62), (-2.0, 0.93), (-0.4, 0.94), (0.8, 0.92), (1.6, 0.84),
            (2.03, 0.73), (2.1, 0.55),
        ),
        cabin_base=(-1.98, 1.05), cabin_roof=(-1.45, 0.2),
        pillars=(-0.95, -0.1),
    ),
    "saloon": CarForm(
        length=4.75, width=1.83, height=1.45, axles=(-1.4, 1.42),
        wheel_radius=0.33, sill=0.19,
        line=(
            (-2.375, 0.62), (-2.28, 0.92), (-1.75, 0.96), (0.75, 0.92),
            (1.7, 0.84), (2.29, 0.73), (2.375, 0.54),
        ),
        cabin_base=(-1.8, 1.0), cabin_roof=(-0.95, 0.15),
        pillars=(-1.05, -0.15),
    ),
    "estate": CarForm(
        length=4.7, width=1.82, height=1.48, axles=(-1.38, 1.4),
        wheel_radius=0.32, sill=0.2,
        line=(
            (-2.35, 0.6), (-2.27, 0.94), (-0.5, 0.95), (0.8, 0.92), (1.7, 0.84),
            (2.27, 0.73), (2.35, 0.55),
        ),
        cabin_base=(-2.24, 1.05), cabin_roof=(-1.9, 0.2), pillars=(-1.3, -0.15),
    ),
    "suv": CarForm(
        length=4.6, width=1.89, height=1.7, axles=(-1.36, 1.36),
        wheel_radius=0.37, sill=0.27,
        line=(
            (-2.3, 0.75), (-2.2, 1.06), (-0.5, 1.07), (0.85, 1.06),
            (1.75, 1.01), (2.22, 0.92), (2.3, 0.66),
        ),
        cabin_base=(-2.15, 1.1), cabin_roof=(-1.75, 0.35), pillars=(-1.2, -0.1),
    ),
    "pickup": CarForm(
        length=5.3, width=1.88, height=1.8, axles=(-1.6, 1.6),
        wheel_radius=0.38, sill=0.33,
        line=(
            (-2.65, 0.75), (-2.6, 0.92), (-1.0, 0.92), (-0.9, 1.12),
            (0.95, 1.1), (1.9, 1.04), (2.57, 0.97), (2.65, 0.68),
        ),
        cabin_base=(-0.88, 1.15), cabin_roof=(-0.8, 0.5), pillars=(0.05,),
        bed_wall=0.3,
    ),
    "van": CarForm(
        length=5.5, width=2.0, height=2.45, axles=(-1.6, 1.75),
        wheel_radius=0.35, sill=0.25,
        line=(
            (-2.75, 0.95), (-2.72, 1.15), (0.8, 1.15), (1.95, 1.18),
            (2.5, 1.05), (2.68, 0.92), (2.75, 0.6),
        ),
        cabin_base=(-2.72, 2.05), cabin_roof=(-2.68, 1.45), pillars=(),
        panelled=True,
    ),
    "box_truck": CarForm(
        length=6.4, width=2.1, height=2.25, axles=(-1.75, 2.15),
        wheel_radius=0.38, sill=0.36,
        line=(
            (-3.2, 0.75), (-3.15, 0.82), (1.2, 0.82), (1.35, 1.2), (2.7, 1.2),
            (3.1, 1.05), (3.2, 0.7),
        ),
        cabin_base=(1.3, 3.0), cabin_roof=(1.35, 2.3), pillars=(),
        panelled=True,
    ),
    "bus": CarForm(
        length=11.2, width=2.5, height=3.05, axles=(-2.9, 2.9),
        wheel_radius=0.48, sill=0.3,
        line=((-5.6, 0.95), (-5.55, 1.25), (0.0, 1.25), (5.5, 1.2), (5.6, 0.9)),
        cabin_base=(-5.56, 5.54), cabin_roof=(-5.5, 5.42),
        pillars=(-4.0, -2.5, -1.0, 0.4, 1.9, 3.3, 4.6),
    ),
}  # fmt: skip


def car(rng: np.random.Generator, *, form: str) -> Model:
    """Returns a parked vehicle: scaled by a few per cent and painted.

    Args:
        rng: draws size and paint.
        form: a key of `FORMS`.
    """
    size = rng.uniform(0.97, 1.03, 3)
    scale = triple(round(float(s), 3) for s in size)
    paint = _PAINTS[int(rng.integers(len(_PAINTS)))]
    meshes = dict(vehicle_meshes(form))
    colours = {"body": paint, "trim": _TRIM, "box": _WHITE}
    parts = [
        Part(
            name.rsplit("_", 1)[1],
            MeshShape(name, scale),
            rgb=colours[name.rsplit("_", 1)[1]],
        )
        for name in meshes
    ]
    return assemble(*parts, meshes=meshes)


@cache
def vehicle_meshes(form: str) -> dict[str, Mesh]:
    """Returns the meshes of a body type by their names."""
    body, trim = car_meshes(FORMS[form])
    meshes = {f"{form}_body": body, f"{form}_trim": trim}
    if form == "box_truck":
        meshes[f"{form}_box"] = _truck_box()
    return meshes


def _truck_box() -> Mesh:
    """Returns the box body of a small truck with its frame and doors."""
    pieces = [box_mesh((4.1, 2.2, 2.1), (-1.2, 0, 1.95))]
    pieces += boxes((0.08, 2.26, 2.16), (-3.24, 0.84), (0,), (1.95,))
    pieces += boxes((4.1, 2.26, 0.08), (-1.2,), (0,), (0.93, 3.0))
    return merge_meshes(*pieces)


_CLASSES = {"box_truck": "truck", "bus": "bus"}

PARKED_CARS = {
    name: Builder(_CLASSES.get(name, "car"), partial(car, form=name))
    for name in FORMS
}
