"""Solids on footprints, with the roof shapes that OpenStreetMap describes."""

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from cns_drake.city import long_normals
from cns_drake.imports.faces import LEAST_AREA, flat_surface, level_rings
from cns_drake.imports.faults import ImportFaults

# The ends of a hipped roof's ridge are inset by at most this share of its
# length.
_MOST_INSET_SHARE = 0.45
# Shorter ridges count as this long [m].
_SHORTEST_RIDGE = 1e-6
# Triangles (M, 3, 3) of a pitched roof [m]: its slopes, and its gables.
_Roof = tuple[list[np.ndarray], list[np.ndarray]]


def extruded(
    polygon: Polygon,
    low: float,
    high: float,
    name: str,
    faults: ImportFaults,
    roof: str = "flat",
    roof_height: float = 0.0,
    ground: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the walls and the roof of a solid, as triangles (M, 3, 3) [m].

    A roof that is impossible on the footprint is replaced by a flat roof, and
    counts as a fault.

    Args:
        polygon: the footprint.
        low: height of the lowest point [m]; above the ground, the walls
            include an underside.
        high: height of the highest point [m].
        name: name of the object, as an example in `faults`.
        faults: counts roofs and areas that were replaced or left out.
        roof: `flat`; `pyramidal`, on a footprint without holes whose centroid
            sees all of its walls; `gabled` or `hipped`, on a footprint with
            four corners.
        roof_height: height of the roof above the eaves [m].
        ground: height of the ground [m].
    """
    polygon = orient(polygon)
    eaves = high - roof_height
    # A solid that begins above the ground can be seen from below.
    floor = np.zeros((0, 3, 3))
    if low > ground:
        floor = flat_surface(polygon, low, name, faults)[:, ::-1]
    corners = level_rings(polygon, eaves)[0]
    pitched = None
    if roof != "flat" and roof_height > 0.0:
        pitched = _slopes_and_gables(roof, polygon, corners, high)
        # A slope that looks downwards reaches beyond the footprint.
        if pitched is None or (
            long_normals(np.concatenate(pitched[0]))[:, 2].min() < -LEAST_AREA
        ):
            pitched = None
            faults.add(f"roof of shape {roof}, made flat", name)
    if pitched is None:
        top = flat_surface(polygon, high, name, faults)
        return np.concatenate([floor, _walls(polygon, low, high)]), top
    slopes, gables = pitched
    walls = np.concatenate([floor, _walls(polygon, low, eaves), *gables])
    return walls, np.concatenate(slopes)


def _walls(polygon: Polygon, low: float, high: float) -> np.ndarray:
    """Returns the walls from `low` to `high`, as triangles (M, 3, 3) [m]."""
    triangles = []
    for ring in level_rings(polygon, low):
        following = np.roll(ring, -1, axis=0)
        up = np.array([0.0, 0.0, high - low])
        triangles.append(np.stack([ring, following, following + up], axis=1))
        triangles.append(np.stack([ring, following + up, ring + up], axis=1))
    return np.concatenate(triangles)


def _slopes_and_gables(
    roof: str, polygon: Polygon, corners: np.ndarray, high: float
) -> _Roof | None:
    """Returns the slopes and gables of a roof; None if it cannot be made.

    Args:
        roof: shape of the roof, as for `extruded`.
        polygon: the footprint.
        corners: (N, 3) outline of the footprint at the height of the eaves [m].
        high: height of the highest point [m].
    """
    if roof == "pyramidal" and not polygon.interiors:
        top = np.array([polygon.centroid.x, polygon.centroid.y, high])
        following = np.roll(corners, -1, axis=0)
        tops = np.broadcast_to(top, corners.shape)
        return [np.stack([corners, following, tops], axis=1)], []
    if roof not in ("gabled", "hipped") or len(corners) != 4:
        return None
    if polygon.interiors:
        return None
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    # The ridge runs along the two longer sides: from corners 0 and 2.
    if sides[1] + sides[3] > sides[0] + sides[2]:
        corners = np.roll(corners, -1, axis=0)
    a, b, c, d = corners
    start, end = (a + d) / 2.0, (b + c) / 2.0
    start[2] = end[2] = high
    if roof == "hipped":
        across = float(np.linalg.norm(d - a))
        along = max(float(np.linalg.norm(end - start)), _SHORTEST_RIDGE)
        # Slopes on all sides have the same pitch, if the ridge is long enough.
        share = min(_MOST_INSET_SHARE, 0.5 * across / along)
        inset = (end - start) * share
        start, end = start + inset, end - inset
    slopes = [
        np.array([[a, b, end], [a, end, start]]),
        np.array([[c, d, start], [c, start, end]]),
    ]
    ends = [np.array([[b, c, end]]), np.array([[d, a, start]])]
    return (slopes + ends, []) if roof == "hipped" else (slopes, ends)
