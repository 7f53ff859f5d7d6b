"""Details of roofs: equipment on flat ones, chimneys on others."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from cns_drake.city.facades.assembly import Assembly, Site
from cns_drake.city.facades.roofs import add_chimney, equip_roof
from cns_drake.city.geometry.structures import Model
from cns_drake.imports.dressing.styles import Style, Use
from cns_drake.imports.dressing.upper_sides import UpperSides
from cns_drake.imports.dressing.wall_panels import long_normals, unit_normals

# A roof is level if the z of its unit normal is at least the first; level parts
# of one height differ by less than the second [m].
_LEVEL, _SAME_HEIGHT = 0.999, 0.1
_FLAT_PART = 0.6
_LEAST_ROOF = 40.0  # [m^2]
# Roof area for each piece of equipment [m^2], and the most pieces.
_ROOF_EACH, _MOST = 90.0, 6
_ITEMS = {
    Use.FLATS: "stair_house vents skylight tank vents dish",
    Use.OFFICE: "lift_house air_handler ac_unit ac_unit vents cooling_tower",
    Use.RETAIL: "air_handler ac_unit skylight vents ac_unit dish",
    Use.PUBLIC: "stair_house air_handler skylight vents ac_unit mast",
    Use.INDUSTRIAL: "skylight vents skylight vents air_handler tank",
    Use.HOUSE: "vents dish",
}
_CHIMNEYS = (Use.HOUSE, Use.FLATS, Use.PUBLIC)
_BRICK = (0.45, 0.27, 0.22)
# Depth of a chimney's foot below the ridge, and its scale against the shared
# mesh.
_BELOW_RIDGE, _CHIMNEY_SCALE = 0.35, 0.6
# Points of a ridge are at most this much below its highest one [m].
_RIDGE = 0.15


def is_flat_roof(roof: np.ndarray) -> bool:
    """Returns whether most of a roof (M, 3, 3) is level."""
    above = np.abs(long_normals(roof)[:, 2])
    level = np.abs(unit_normals(roof)[:, 2]) > _LEVEL
    return bool(above[level].sum() >= _FLAT_PART * above.sum())


def roof_pieces(
    roof: np.ndarray,
    style: Style,
    is_flat: bool,
    rng: np.random.Generator,
    name: str,
) -> Model:
    """Returns the equipment of a roof, in the world.

    Args:
        roof: (M, 3, 3) its upper sides [m].
        style: of the building.
        is_flat: whether its roof is flat.
        rng: of the building.
        name: of the structure.
    """
    footprint = box(0.0, 0.0, 1.0, 1.0)
    out = Assembly(Site(footprint, name), rng)
    if is_flat:
        _equip(out, roof, style)
    elif style.use in _CHIMNEYS:
        _add_chimneys(out, roof)
    return Model(tuple(out.parts), out.meshes, footprint)


def _equip(out: Assembly, roof: np.ndarray, style: Style) -> None:
    items = _ITEMS.get(style.use, "").split()
    found = _largest_level(roof)
    if found is None or not items:
        return
    area, z = found
    count = min(_MOST, len(items), int(area.area / _ROOF_EACH) + 1)
    ring = np.array(area.exterior.coords)[:-1]
    equip_roof(out, ring, z, items[:count])


def _largest_level(roof: np.ndarray) -> tuple[Polygon, float] | None:
    """Returns the largest level part of a roof without holes, and its z."""
    level = roof[unit_normals(roof)[:, 2] > _LEVEL]
    best: tuple[Polygon, float] | None = None
    if not len(level):
        return None
    steps = np.round(level[:, :, 2].mean(axis=1) / _SAME_HEIGHT)
    for step in np.unique(steps):
        some = level[steps == step]
        whole = shapely.union_all(
            [Polygon(one) for one in np.round(some[:, :, :2], 3)],
            grid_size=1e-3,
        )
        for part in shapely.get_parts(whole):
            if isinstance(part, Polygon) and part.area > _LEAST_ROOF:
                part = _without_holes(part)
                if best is None or part.area > best[0].area:
                    best = part, float(some[:, :, 2].max())
    return best


def _without_holes(area: Polygon) -> Polygon:
    """Returns the largest piece of an area that is cut through its holes."""
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
    corners = roof.reshape(-1, 3)
    ridge = corners[corners[:, 2] > corners[:, 2].max() - _RIDGE]
    start = ridge[np.lexsort([ridge[:, 1], ridge[:, 0]])[0]]
    end = ridge[np.linalg.norm(ridge - start, axis=1).argmax()]
    length = float(np.linalg.norm(end - start))
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    sides = UpperSides(roof)
    count = 1 + int(length > 15.0)
    for k, share in enumerate(out.rng.uniform(0.12, 0.88, 2)[:count]):
        x, y, z = start + share * (end - start)
        height = float(sides.heights(np.array([[x, y]]))[0])
        # Two gables may have no ridge between them.
        if height > z - 1.0:
            item = "chimney_row" if out.rng.random() < 0.3 else "chimney"
            scale = (_CHIMNEY_SCALE, _CHIMNEY_SCALE, _CHIMNEY_SCALE)
            xyz = (x, y, height - _BELOW_RIDGE)
            part = f"chimney_{k}"
            add_chimney(out, part, xyz, _BRICK, item=item, yaw=yaw, scale=scale)
