"""The use of a lot before its building is built."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import math
from typing import get_args

import numpy as np
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.occupancy import Occupancy
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.growth.building_sites import largest_rectangle
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plan.stages import LotUse
from cns_drake.city.plan.weighted import pick

# Distance to the edges of the lot, where the neighbours stand [m].
_MARGIN = 0.8
# A smaller lot is a gap between houses [m^2].
_SMALLEST = 40.0
# Objects along the front and across the lot are this far apart [m].
_PITCH = {
    "car_park": (2.7, 8.5),
    "market": (4.2, 5.0),
    "garden": (3.6, 3.6),
    "yard": (7.5, 5.5),
}
_OBJECTS: dict[str, Mapping[str, float]] = {
    "market": {"market_stall": 6, "kiosk": 0.5, "cafe_table": 1},
    "garden": {
        "low_shrub": 3,
        "flower_bed": 3,
        "shrub": 1,
        "picnic_table": 0.4,
        "bench": 0.6,
    },
    "yard": {
        "container": 2,
        "site_cabin": 1,
        "brick_pallets": 1,
        "pipe_stack": 1,
        "skip": 0.7,
    },
}
# Part of the places that are taken.
_FILL = {"car_park": 0.6, "market": 0.7, "garden": 0.5, "yard": 0.45}
USES: tuple[LotUse, ...] = get_args(LotUse)


def use_by_size(structure: Structure) -> LotUse:
    """Returns the use that suits the size of a building's lot."""
    area = structure.model.footprint.area
    if area > 900:
        return "car_park"
    if area > 450:
        return "market"
    return "yard" if area > 250 else "garden"


def lot_objects(
    structure: Structure,
    use: LotUse,
    cars: Mapping[str, float],
    rng: np.random.Generator,
) -> Iterator[Structure]:
    """Yields the structures on the lot of a building that is not built yet.

    Args:
        structure: the building.
        use: one of `USES`.
        cars: object -> weight of the parked cars.
        rng: the only source of variation.

    Yields:
        Structures called after the building.
    """
    footprint = structure.model.footprint
    if use == "empty" or footprint.area < _SMALLEST:
        return
    weights = cars if use == "car_park" else _OBJECTS[use]
    taken = Occupancy()
    count = 0
    for x, y, yaw in _places(footprint, use, rng):
        kind = pick(weights, rng)
        builder = OBJECTS[kind]
        model = builder.build(rng)
        xyz = structure.p_WP((x, y, 0.0))
        thing = Structure(
            f"{structure.name}_lot_{count + 1:02d}_{kind}",
            builder.semantic_class,
            model,
            (round(xyz[0], 3), round(xyz[1], 3), round(xyz[2], 3)),
            structure.yaw + yaw,
            (*structure.tags, "lot"),
        )
        area = thing.footprint_W
        if structure.footprint_W.contains(area) and taken.is_free(area):
            taken.add(area)
            count += 1
            yield thing


def _places(
    footprint: BaseGeometry, use: LotUse, rng: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    """Yields x, y and heading of the places that are taken, in S."""
    x0, y0, x1, y1 = largest_rectangle(footprint).bounds
    along, across = _PITCH[use]
    columns = max(1, math.floor((x1 - x0 - 2 * _MARGIN) / along))
    rows = max(1, math.floor((y1 - y0 - 2 * _MARGIN) / across))
    for row in range(rows):
        y = (y0 + y1) / 2 + (row - (rows - 1) / 2) * across
        for column in range(columns):
            x = (x0 + x1) / 2 + (column - (columns - 1) / 2) * along
            taken = rng.random() < _FILL[use]
            jitter = rng.uniform(-0.3, 0.3, 2)
            turn = int(rng.integers(2)) * math.pi
            if not taken:
                continue
            if use == "car_park":
                yield x, y + float(jitter[1]), math.pi / 2 + turn
            elif use == "market":
                yield x, y, math.pi / 2 + turn
            else:
                yield x + float(jitter[0]), y + float(jitter[1]), turn
