"""Footprints raised to solids, with the roofs that OpenStreetMap describes."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from cns_drake.imports.faces import face_triangles
from cns_drake.imports.import_faults import ImportFaults


def flat_surface(
    polygon: Polygon, z: float, name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns a level area as (M, 3, 3) triangles that look upwards [m]."""
    return face_triangles(_rings(polygon, z), name, faults)


def extruded(
    polygon: Polygon,
    low: float,
    high: float,
    name: str,
    faults: ImportFaults,
    roof: str = "flat",
    roof_height: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns walls and roof of a footprint, (M, 3, 3) each [m].

    Args:
        polygon: the footprint.
        low, high: heights of its lowest and its highest point.
        name: of the object, for the faults.
        faults: counts roofs that became flat.
        roof: shape: flat; pyramidal on any footprint; gabled or hipped on
            one of four corners. Others are made flat.
        roof_height: of the roof, from the eaves.
    """
    polygon = orient(polygon)
    eaves = high - roof_height
    # A solid above the ground is seen from below.
    floor = np.zeros((0, 3, 3))
    if low > 0.0:
        floor = flat_surface(polygon, low, name, faults)[:, ::-1]
    corners = _rings(polygon, eaves)[0]
    ridge = None
    if roof != "flat" and roof_height > 0.0:
        ridge = _ridge(roof, polygon, corners, high)
        if ridge is None:
            faults.add(f"roof of shape {roof}, made flat", name)
    if ridge is None:
        roofs = flat_surface(polygon, high, name, faults)
        return np.concatenate([floor, _walls(polygon, low, high)]), roofs
    slopes, gables = ridge
    walls = np.concatenate([floor, _walls(polygon, low, eaves), *gables])
    return walls, np.concatenate(slopes)


def _rings(polygon: Polygon, z: float) -> list[np.ndarray]:
    rings = (polygon.exterior, *polygon.interiors)
    return [
        np.column_stack(
            [np.array(ring.coords)[:-1, :2], np.full(len(ring.coords) - 1, z)]
        )
        for ring in rings
    ]


def _walls(polygon: Polygon, low: float, high: float) -> np.ndarray:
    found = []
    for ring in _rings(polygon, low):
        following = np.roll(ring, -1, axis=0)
        up = np.array([0.0, 0.0, high - low])
        found.append(np.stack([ring, following, following + up], axis=1))
        found.append(np.stack([ring, following + up, ring + up], axis=1))
    return np.concatenate(found)


def _ridge(
    roof: str, polygon: Polygon, corners: np.ndarray, high: float
) -> tuple[list[np.ndarray], list[np.ndarray]] | None:
    """Returns slopes and gables; None for a roof that cannot be made."""
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
    # The ridge runs along the longer sides, those from corner 0 and 2.
    if sides[1] + sides[3] > sides[0] + sides[2]:
        corners = np.roll(corners, -1, axis=0)
    a, b, c, d = corners
    start, end = (a + d) / 2.0, (b + c) / 2.0
    start[2] = end[2] = high
    if roof == "hipped":
        inset = (end - start) * min(
            0.45,
            0.5
            * float(np.linalg.norm(d - a))
            / max(float(np.linalg.norm(end - start)), 1e-6),
        )
        start, end = start + inset, end - inset
    slopes = [
        np.array([[a, b, end], [a, end, start]]),
        np.array([[c, d, start], [c, start, end]]),
    ]
    ends = [np.array([[b, c, end]]), np.array([[d, a, start]])]
    return (slopes + ends, []) if roof == "hipped" else (slopes, ends)
