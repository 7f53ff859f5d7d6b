"""Equipment on flat roofs, and chimneys on pitched roofs."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from cns_drake.city import (
    GRID,
    Assembly,
    Finish,
    UpperSides,
    add_chimney,
    equip_roof,
    long_normals,
    unit_normals,
)
from cns_drake.imports.dressing.styles import Style

# A roof is level if the z of its unit normal is greater than this.
_LEVEL_COSINE = 0.999
# Level parts have the same height if they differ by less than this [m].
_SAME_HEIGHT = 0.1
# A roof is flat if at least this share of its area is level.
_FLAT_PART = 0.6
# Level parts smaller than this get no equipment [m^2].
_LEAST_ROOF = 40.0
# Roof area per piece of equipment [m^2].
_AREA_OF_ITEM = 90.0
# Greatest number of pieces of equipment on a roof.
_MOST_ITEMS = 6
# Use of a building -> the equipment of its roof, the first piece first.
_ITEMS = {
    "flats": "stair_house vents skylight tank vents dish",
    "office": "lift_house air_handler ac_unit ac_unit vents cooling_tower",
    "retail": "air_handler ac_unit skylight vents ac_unit dish",
    "public": "stair_house air_handler skylight vents ac_unit mast",
    "industrial": "skylight vents skylight vents air_handler tank",
    "house": "vents dish",
}
# Uses of buildings with chimneys.
_WITH_CHIMNEYS = ("house", "flats", "public")
_BRICK = Finish((0.45, 0.27, 0.22), "brick")
# Depth of a chimney's foot below the ridge [m].
_BELOW_RIDGE = 0.35
# A ridge longer than this has two chimneys [m].
_SHORT_RIDGE = 15.0
# Chimneys stand on this range of a ridge's length, in shares of the length.
_CHIMNEY_PLACES = (0.12, 0.88)
# Probability that a chimney is a row of chimneys.
_ROW_SHARE = 0.3
# Chimneys are left out where the roof is lower than the ridge by this [m].
_MOST_BELOW = 1.0
# Scale of a chimney relative to the shared mesh.
_CHIMNEY_SCALE = 0.6
# Points of a ridge are at most this far below its highest one [m].
_RIDGE_TOLERANCE = 0.15


def is_flat_roof(roof: np.ndarray) -> bool:
    """Returns whether most of the area of a roof is level.

    `roof` contains the triangles (M, 3, 3) of the roof [m].
    """
    above = np.abs(long_normals(roof)[:, 2])
    level = np.abs(unit_normals(roof)[:, 2]) > _LEVEL_COSINE
    return bool(above[level].sum() >= _FLAT_PART * above.sum())


def add_roof_pieces(
    out: Assembly, roof: np.ndarray, style: Style, is_flat: bool
) -> None:
    """Adds equipment to a flat roof, or chimneys to a pitched roof.

    Args:
        out: the building under assembly, which gets the parts.
        roof: triangles (M, 3, 3) of the roof [m].
        style: style of the building; the use of the building decides what is
            added.
        is_flat: whether the roof is flat.
    """
    items = _ITEMS.get(style.use, "").split()
    if is_flat and items and (level := _largest_level_part(roof)) is not None:
        area, z = level
        count = min(_MOST_ITEMS, len(items), int(area.area / _AREA_OF_ITEM) + 1)
        ring = np.array(area.exterior.coords)[:-1]
        equip_roof(out, ring, z, items[:count])
    if not is_flat and style.use in _WITH_CHIMNEYS:
        _add_chimneys(out, roof)


def _largest_level_part(roof: np.ndarray) -> tuple[Polygon, float] | None:
    """Returns a roof's largest level part, without holes, and the part's z.

    The result is None if no level part is large enough for equipment.
    """
    level = roof[unit_normals(roof)[:, 2] > _LEVEL_COSINE]
    best: tuple[Polygon, float] | None = None
    if not len(level):
        return None
    steps = np.round(level[:, :, 2].mean(axis=1) / _SAME_HEIGHT)
    for step in np.unique(steps):
        alike = level[steps == step]
        whole = shapely.union_all(
            [Polygon(triangle) for triangle in np.round(alike[:, :, :2], 3)],
            grid_size=GRID,
        )
        for part in shapely.get_parts(whole):
            if isinstance(part, Polygon) and part.area > _LEAST_ROOF:
                part = _without_holes(part)
                if best is None or part.area > best[0].area:
                    best = part, float(alike[:, :, 2].max())
    return best


def _without_holes(area: Polygon) -> Polygon:
    """Divides an area at its holes, and returns the largest piece."""
    while area.interiors:
        x0, y0, x1, y1 = area.bounds
        x = Polygon(area.interiors[0]).centroid.x
        halves = [
            part
            for half in (box(x0, y0, x, y1), box(x, y0, x1, y1))
            for part in shapely.get_parts(area.intersection(half))
            if isinstance(part, Polygon)
        ]
        area = max(halves, key=lambda part: part.area)
    return area


def _add_chimneys(out: Assembly, roof: np.ndarray) -> None:
    """Adds one or two chimneys at random places on the ridge of a roof."""
    corners = roof.reshape(-1, 3)
    ridge = corners[corners[:, 2] > corners[:, 2].max() - _RIDGE_TOLERANCE]
    start = ridge[np.lexsort([ridge[:, 1], ridge[:, 0]])[0]]
    end = ridge[np.linalg.norm(ridge - start, axis=1).argmax()]
    length = float(np.linalg.norm(end - start))
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    sides = UpperSides(roof)
    count = 1 + int(length > _SHORT_RIDGE)
    # Two numbers are sampled for any roof.
    shares = out.rng.uniform(*_CHIMNEY_PLACES, 2)[:count]
    for k, share in enumerate(shares):
        x, y, z = start + share * (end - start)
        height = float(sides.heights(np.array([[x, y]]))[0])
        # There may be no ridge between two gables.
        if height > z - _MOST_BELOW:
            is_row = out.rng.random() < _ROW_SHARE
            item = "chimney_row" if is_row else "chimney"
            scale = (_CHIMNEY_SCALE, _CHIMNEY_SCALE, _CHIMNEY_SCALE)
            xyz = (x, y, height - _BELOW_RIDGE)
            part = f"chimney_{k}"
            add_chimney(out, part, xyz, _BRICK, item=item, yaw=yaw, scale=scale)
