"""Solids on footprints, with the roof shapes that OpenStreetMap describes."""

import itertools
import math

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from evaluation.base import cos, dot, sin
from worlds.imports.faces import LEAST_AREA, flat_surface, level_rings
from worlds.imports.faults import ImportFaults
from worlds.shapes import long_normals

# The ends of a hipped roof's ridge are inset by at most this share of its
# length.
_MOST_INSET_SHARE = 0.45
# Shorter ridges count as this long [m].
_SHORTEST_RIDGE = 1e-6
# Shape of a roof -> its outline as shares of the footprint's size, and heights
# as shares of the roof's height, from the eaves to the top.
_ARC = np.linspace(0.0, 0.5 * np.pi, 7)
_PROFILES: dict[str, list[tuple[float, float]]] = {
    "pyramidal": [(1.0, 0.0), (0.0, 1.0)],
    "dome": [*zip(cos(_ARC).tolist(), sin(_ARC).tolist(), strict=True)],
    "onion": [
        (1.0, 0.0),
        (0.96, 0.2),
        (0.8, 0.4),
        (0.45, 0.6),
        (0.15, 0.75),
        (0.06, 0.9),
        (0.0, 1.0),
    ],
}
# Sides whose lengths differ by less are equally long [m].
_SAME_LENGTH = 0.05
# Inset of a mansard roof's flat top, as a share of the roof's height.
_MANSARD_INSET = 0.5
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
    is_raised: bool = False,
    facing_deg: float | None = None,
    is_across: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the walls and the roof of a solid, as triangles (M, 3, 3) [m].

    A roof that is impossible on the footprint is replaced by a flat roof, and
    counts as a fault.

    Args:
        polygon: the footprint.
        low: height of the lowest point [m].
        high: height of the highest point [m].
        name: name of the object, as an example in `faults`.
        faults: counts roofs and areas that were replaced or left out.
        roof: `flat`; `skillion`; `pyramidal`, `dome` or `onion`, on a
            footprint without holes whose centroid sees all of its walls;
            `mansard`, on a footprint without holes; `gabled` or `hipped`, on a
            footprint with four corners.
        roof_height: height of the roof above the eaves [m].
        is_raised: whether the solid begins above the ground. The walls of such
            a solid include its underside, which can be seen from below.
        facing_deg: direction that a slope of a `skillion`, `gabled` or `hipped`
            roof faces, counter-clockwise from x [deg]; by default that of a
            longest side.
        is_across: whether the ridge is along the shorter sides instead. Counts
            only without `facing_deg`.
    """
    polygon = orient(polygon)
    eaves = high - roof_height
    floor = np.zeros((0, 3, 3))
    if is_raised:
        floor = flat_surface(polygon, low, name, faults)[:, ::-1]
    corners = level_rings(polygon, eaves)[0]
    pitched = None
    if roof != "flat" and roof_height > 0.0:
        eave = _lower_side(corners, facing_deg, is_across)
        pitched = _slopes_and_gables(
            roof, polygon, corners, high, roof_height, eave
        )
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
    roof: str,
    polygon: Polygon,
    corners: np.ndarray,
    high: float,
    roof_height: float,
    eave: int,
) -> _Roof | None:
    """Returns the slopes and gables of a roof; None if it cannot be made.

    Args:
        roof: shape of the roof, as for `extruded`.
        corners: (N, 3) outline of the footprint at the height of the eaves [m].
        high: height of the highest point [m].
        roof_height: height of the roof above the eaves [m].
        eave: the side that a slope faces, see `_lower_side`.
    """
    if polygon.interiors:
        return None
    if roof in _PROFILES:
        return _rising_rings(corners, polygon, roof_height, _PROFILES[roof]), []
    if roof == "mansard":
        return _mansard(corners, polygon, roof_height)
    corners = np.roll(corners, -eave, axis=0)
    if roof == "skillion":
        return _skillion(corners, polygon, roof_height)
    if roof not in ("gabled", "hipped") or len(corners) != 4:
        return None
    a, b, c, d = corners
    start, end = (a + d) / 2.0, (b + c) / 2.0
    start[2] = end[2] = high
    if roof == "hipped":
        across = float(np.linalg.norm(d - a, axis=0))
        along = max(float(np.linalg.norm(end - start, axis=0)), _SHORTEST_RIDGE)
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


def _rising_rings(
    corners: np.ndarray,
    polygon: Polygon,
    roof_height: float,
    profile: list[tuple[float, float]],
) -> list[np.ndarray]:
    """Returns the surface of a roof whose outline shrinks to a point.

    Args:
        corners: (N, 3) outline at the eaves [m].
        roof_height: height of the roof [m].
        profile: see `_PROFILES`.
    """
    middle = np.array([polygon.centroid.x, polygon.centroid.y, corners[0, 2]])
    rings = [
        middle + size * (corners - middle) + [0.0, 0.0, rise * roof_height]
        for size, rise in profile
    ]
    rings[0] = corners
    surface = []
    for below, above in itertools.pairwise(rings):
        following = np.roll(below, -1, axis=0)
        surface.append(np.stack([below, following, above], axis=1))
        if above is not rings[-1]:
            next_above = np.roll(above, -1, axis=0)
            surface.append(np.stack([following, next_above, above], axis=1))
    return surface


def _mansard(
    corners: np.ndarray, polygon: Polygon, roof_height: float
) -> _Roof | None:
    """Returns steep slopes around a flat top; None without room for it."""
    top = polygon.buffer(-_MANSARD_INSET * roof_height, join_style="mitre")
    if not isinstance(top, Polygon) or top.is_empty:
        return None
    ring = level_rings(orient(top), corners[0, 2] + roof_height)[0]
    if len(ring) != len(corners):
        return None
    # Each corner moves inwards, so that the nearest is its own.
    first = (
        np.linalg.norm(ring[:, :2] - corners[0, :2], axis=1).round(6).argmin()
    )
    ring = np.roll(ring, -int(first), axis=0)
    following, next_ring = (
        np.roll(corners, -1, axis=0),
        np.roll(ring, -1, axis=0),
    )
    flat = flat_surface(
        Polygon(ring[:, :2]), float(ring[0, 2]), "", ImportFaults()
    )
    return [
        np.stack([corners, following, next_ring], axis=1),
        np.stack([corners, next_ring, ring], axis=1),
        flat,
    ], []


def _lower_side(
    corners: np.ndarray, facing_deg: float | None, is_across: bool
) -> int:
    """Returns the side of an outline that a slope of its roof faces.

    Of sides that are equally long, or opposite, the first one counts, because
    this is the same one wherever north is.

    Args:
        corners: (N, 3) the outline, counter-clockwise [m].
        facing_deg, is_across: see `extruded`.
    """
    sides = np.roll(corners, -1, axis=0)[:, :2] - corners[:, :2]
    lengths = np.linalg.norm(sides, axis=1)
    if facing_deg is not None:
        angle = math.radians(facing_deg)
        # The outward normals are the sides, turned clockwise.
        outward = np.array([-math.sin(angle), math.cos(angle)])
        facing = dot(sides, outward) / lengths
        return int(facing.round(6).argmax())
    longest = int((lengths > lengths.max() - _SAME_LENGTH).argmax())
    return longest + 1 if is_across else longest


def _skillion(
    corners: np.ndarray, polygon: Polygon, roof_height: float
) -> _Roof:
    """Returns a roof that rises from the first side, and its gables."""
    side = corners[1] - corners[0]
    inwards = np.array([-side[1], side[0]])
    away = dot(corners[:, :2] - corners[0, :2], inwards)
    low, high = away.min(), away.max()

    def raised(points: np.ndarray) -> np.ndarray:
        share = dot(points[..., :2] - corners[0, :2], inwards)
        found = points.copy()
        found[..., 2] += roof_height * (share - low) / (high - low)
        return found

    flat = flat_surface(polygon, float(corners[0, 2]), "", ImportFaults())
    following = np.roll(corners, -1, axis=0)
    top, next_top = raised(corners), raised(following)
    gables = np.concatenate(
        [
            np.stack([corners, following, next_top], axis=1),
            np.stack([corners, next_top, top], axis=1),
        ]
    )
    areas = np.linalg.norm(long_normals(gables), axis=1)
    return [raised(flat)], [gables[areas > LEAST_AREA]]
