"""A building under construction: its frame, behind scaffolds, and a crane."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.buildings import ARCHETYPES, sample
from cns_drake.city.furniture.tower_crane import CRANES
from cns_drake.city.geometry.structures import Model, Part

_FRAME = "unfinished_tower"
# Room for a crane beside the frame [m].
_CRANE_ROOM = 7.0
# The jib clears the frame by this [m].
_CRANE_RISE = 14.0
_CRANE_REACH = 30.0
# Grid lines in each direction from which a rectangle on a lot is chosen.
_MOST_SIDES = 12


def building_site(model: Model, height: float, name: str, seed: int) -> Model:
    """Returns the frame of a building that is being built, with its crane.

    Args:
        model: the finished building.
        height: of the frame [m].
        name: of the building.
        seed: of the frame and the crane.

    Returns:
        A model within the building's footprint, except for the jib.

    Raises:
        ValueError: there is no room for a frame.
    """
    lot = largest_rectangle(model.footprint)
    x0, y0, x1, y1 = lot.bounds
    low, high = ARCHETYPES[_FRAME].widths
    rng = np.random.default_rng(seed)
    crane_xy = None
    if x1 - x0 > low + _CRANE_ROOM:
        crane_xy = (x1 - _CRANE_ROOM / 2, (y0 + y1) / 2)
        x1 -= _CRANE_ROOM
    x1, y1 = min(x1, x0 + high), min(y1, y0 + high)
    if min(x1 - x0, y1 - y0) < low:
        raise ValueError(
            f"sites: {name}: its lot is too small for a site, which takes "
            f"{low} m by {low} m"
        )
    lowest, highest = ARCHETYPES[_FRAME].heights
    height = float(np.clip(height, lowest, highest))
    frame = sample(_FRAME, box(x0, y0, x1, y1), height, rng, f"{name}_site")
    if crane_xy is None:
        return Model(frame.parts, frame.meshes, model.footprint)
    crane = CRANES["tower_crane"].build(
        rng, height=height + _CRANE_RISE, reach=_CRANE_REACH
    )
    return Model(
        (*frame.parts, *(_beside(part, crane_xy) for part in crane.parts)),
        {**frame.meshes, **crane.meshes},
        model.footprint,
    )


def _beside(part: Part, xy: tuple[float, float]) -> Part:
    x, y, z = part.xyz
    at = (round(x + xy[0], 3), round(y + xy[1], 3), z)
    return Part(f"crane_{part.name}", part.shape, at, part.rpy, part.rgb)


def largest_rectangle(footprint: BaseGeometry) -> Polygon:
    """Returns a large rectangle along the axes that lies within a footprint.

    If all edges of the footprint run along the axes, it is the largest.
    Otherwise it is the largest whose sides pass through corners of the
    footprint.
    """
    corners = shapely.get_coordinates(footprint.simplify(0.05))
    xs, ys = (_spread(np.unique(np.round(c, 3))) for c in corners.T)
    x0, x1 = (xs[k] for k in np.triu_indices(len(xs), 1))
    y0, y1 = (ys[k] for k in np.triu_indices(len(ys), 1))
    boxes = shapely.box(x0[:, None], y0[None], x1[:, None], y1[None]).reshape(
        -1
    )
    room = footprint.buffer(0.01)
    shapely.prepare(room)
    inside = boxes[shapely.covers(room, boxes)]
    if len(inside) == 0:
        x, y = footprint.representative_point().coords[0]
        return box(x - 0.1, y - 0.1, x + 0.1, y + 0.1)
    return max(inside, key=lambda one: one.area)


def _spread(values: np.ndarray) -> np.ndarray:
    """Returns at most a dozen of increasing values."""
    if len(values) <= _MOST_SIDES:
        return values
    kept = np.linspace(0, len(values) - 1, _MOST_SIDES).round().astype(int)
    return values[kept]
