"""What is on a lot before its building is built, such as a garden."""

from collections.abc import Iterator, Mapping
import math
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry

from cns_drake.base import parse_yaml
from cns_drake.city.geometry import Occupancy, Structure
from cns_drake.city.geometry.rectangles import largest_rectangle
from cns_drake.city.placement.objects import OBJECTS, pick_key
from cns_drake.city.stages import LotUse

# Distance of objects from the edges of the lot, where the neighbours stand [m].
_MARGIN = 0.8
# A smaller lot is a gap between houses, and stays empty [m^2].
_SMALLEST = 40.0
# Use of a lot -> the objects on the lot, the distances between their places,
# and the share of the places that have an object.
_LAYOUTS = parse_yaml(Path(__file__).with_name("lot_uses.yaml").read_bytes())


def use_by_size(structure: Structure) -> LotUse:
    """Returns the default use of a lot before its building is built.

    The use depends on the area of the lot: from small to large, it is a garden,
    a yard, a market or a car park. `structure` is the building that stands on
    the lot in other stages.
    """
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
    """Yields the structures on a lot before its building is built.

    `structure` is the building, and `use` the earlier use of its lot. The names
    of the yielded structures begin with the name of the building. `cars` maps
    kinds of parked cars to their weights in the random choice.
    """
    footprint = structure.model.footprint
    if use == "empty" or footprint.area < _SMALLEST:
        return
    weights = _LAYOUTS[use].get("objects", cars)
    taken = Occupancy()
    count = 0
    for x, y, yaw in _object_places(footprint, use, rng):
        kind = pick_key(weights, rng)
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


def _object_places(
    footprint: BaseGeometry, use: LotUse, rng: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    """Yields x, y [m] and heading [rad] of the objects on a lot, in S."""
    x0, y0, x1, y1 = largest_rectangle(footprint).bounds
    along, across = _LAYOUTS[use]["pitch"]
    columns = max(1, math.floor((x1 - x0 - 2 * _MARGIN) / along))
    rows = max(1, math.floor((y1 - y0 - 2 * _MARGIN) / across))
    for row in range(rows):
        y = (y0 + y1) / 2 + (row - (rows - 1) / 2) * across
        for column in range(columns):
            x = (x0 + x1) / 2 + (column - (columns - 1) / 2) * along
            taken = rng.random() < _LAYOUTS[use]["fill"]
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
