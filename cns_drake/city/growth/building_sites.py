"""Buildings under construction: a frame, and a crane beside it."""

from dataclasses import replace

import numpy as np
from shapely.geometry import box

from cns_drake.city.buildings import ARCHETYPES, sample
from cns_drake.city.geometry import Model, Part
from cns_drake.city.geometry.rectangles import largest_rectangle
from cns_drake.city.placement.objects import OBJECTS

# Archetype of the frame.
_FRAME = "unfinished_tower"
# Room for a crane beside the frame [m].
_CRANE_ROOM = 7.0
# The jib is this far above the frame [m].
_CRANE_RISE = 14.0
# The jib is this long [m].
_CRANE_REACH = 30.0


def building_site(model: Model, height: float, name: str, seed: int) -> Model:
    """Returns a building under construction: a frame, and a crane if it fits.

    Frame and crane stand within the footprint of the building; the jib of the
    crane reaches beyond it.

    Args:
        model: the finished building.
        height: height of the frame [m], which is limited to the range of
            heights of the archetype `unfinished_tower`.
        name: name of the building.
        seed: seed of the random parameters.

    Raises:
        ValueError: the footprint has no room for a frame.
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
    crane = OBJECTS["tower_crane"].build(
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
    return replace(part, name=f"crane_{part.name}", xyz=at)
