"""Converts polygons to triangles: faces in space, level areas and solids.

Solids can have the roof shapes that OpenStreetMap describes.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient
from shapely.validation import make_valid

from cns_drake.city.geometry import long_normals, quartered, triangulate
from cns_drake.imports.options import ImportFaults

# Faces with less area are dropped [m^2].
_LEAST_AREA = 1e-5
# A face is bent if a corner is farther than this from its plane [m].
_BENT = 0.05
# Millimetres in a metre: corners that are equal in whole millimetres are one.
_MM = 1000.0
_LEAST_PART = 0.01  # [m^2]
# The four corner triangles of a face with four corners. The second and the last
# one together fill the face.
_CORNERS_OF_FOUR = np.array([(3, 0, 1), (0, 1, 2), (1, 2, 3), (0, 2, 3)])


def joined(some: Iterable[np.ndarray]) -> np.ndarray:
    """Concatenates arrays of triangles (M, 3, 3)."""
    return np.concatenate([np.zeros((0, 3, 3)), *some])


def face_triangles(
    rings: Sequence[np.ndarray], name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of a face [m].

    The triangles have the orientation of the outer ring. `rings` contains the
    outer ring (N, 3) and then the holes [m]; the first corner of a ring is not
    repeated at its end. Faces that are repaired or left out are counted in
    `faults`, with `name` as the name of the object.
    """
    rings = [_without_repetitions(ring, name, faults) for ring in rings]
    if len(rings[0]) < 3:
        faults.add("face without area, left out", name)
        return np.zeros((0, 3, 3))
    # The vector is as long as twice the area.
    first, rest = rings[0][:1], rings[0][1:]
    fan = [np.repeat(first, len(rest) - 1, axis=0), rest[:-1], rest[1:]]
    normal = long_normals(np.stack(fan, axis=1)).sum(axis=0)
    if 0.5 * np.linalg.norm(normal) < _LEAST_AREA:
        # The two halves of a ring that crosses itself may have the same area.
        _, spread, axes = np.linalg.svd(rings[0] - rings[0].mean(axis=0))
        normal = axes[2] if spread[1] ** 2 >= _LEAST_AREA else np.zeros(3)
    if not normal.any():
        faults.add("face without area, left out", name)
        return np.zeros((0, 3, 3))
    outer = rings[0]
    has_holes = any(len(hole) >= 3 for hole in rings[1:])
    if len(outer) == 3 and not has_holes:
        return outer[None]
    heights = (outer - outer[0]) @ normal
    if np.ptp(heights) > 2.0 * _BENT * np.linalg.norm(normal):
        faults.add("face that is not plane, folded between its corners", name)
    if len(outer) == 4 and not has_holes:
        corners = outer[_CORNERS_OF_FOUR]
        if (long_normals(corners) @ normal > 0.0).all():
            return corners[[1, 3]]
    return _triangulate_along(normal, rings, name, faults)


def _without_repetitions(
    ring: np.ndarray, name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns a ring without repeated corners."""
    if len(ring) == 0:
        return ring
    rounded = np.rint(ring * _MM).tolist()
    kept = [k for k in range(len(ring)) if rounded[k] != rounded[k - 1]]
    if len(kept) < len(ring):
        twice = len(ring) - len(kept)
        faults.add("repeated corner, left out", name, twice)
        return ring[kept]
    return ring


def _triangulate_along(
    normal: np.ndarray,
    rings: Sequence[np.ndarray],
    name: str,
    faults: ImportFaults,
) -> np.ndarray:
    """Returns the triangles of a face, triangulated as seen along an axis."""
    axis = int(np.abs(normal).argmax())
    axes = [(axis + 1) % 3, (axis + 2) % 3]
    if normal[axis] < 0.0:
        axes.reverse()
    # In whole millimetres.
    flat = [np.rint(ring[:, axes] * _MM) for ring in rings]
    corners = {
        tuple(key): corner
        for keys, ring in zip(flat, rings, strict=True)
        for key, corner in zip(keys.tolist(), ring, strict=True)
    }
    holes = [one / _MM for one in flat[1:] if len(one) >= 3]
    polygon: BaseGeometry = Polygon(flat[0] / _MM, holes)
    if not polygon.is_valid:
        faults.add("face that crosses itself, repaired", name)
        polygon = shapely.set_precision(make_valid(polygon), 1.0 / _MM)
    parts = [np.zeros((0, 3, 2))]
    for part in shapely.get_parts(polygon):
        if isinstance(part, Polygon) and part.area >= _LEAST_AREA:
            try:
                parts.append(triangulate(part))
            except ValueError:
                faults.add("part of a face that is in no plane, left out", name)
    xy = np.concatenate(parts).reshape(-1, 2)
    origin = rings[0].mean(axis=0)
    lifted = np.empty((len(xy), 3))
    for row, key, point in zip(
        lifted, np.rint(xy * _MM).tolist(), xy, strict=True
    ):
        # Corners keep their exact coordinates.
        corner = corners.get(tuple(key))
        if corner is not None:
            row[:] = corner
            continue
        row[axes] = point
        row[axis] = origin[axis]
        row[axis] -= normal @ (row - origin) / normal[axis]
    return lifted.reshape(-1, 3, 3)


def flat_surface(
    polygon: Polygon, z: float, name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns a level area at the height `z` as triangles (M, 3, 3) [m].

    The triangles face upwards. Faults are counted in `faults`, with `name` as
    the name of the object.
    """
    return face_triangles(_rings(orient(polygon), z), name, faults)


def extruded(
    polygon: Polygon,
    low: float,
    high: float,
    name: str,
    faults: ImportFaults,
    roof: str = "flat",
    roof_height: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the walls and the roof of a solid, as triangles (M, 3, 3) [m].

    A roof that is impossible on the footprint is replaced by a flat roof, and
    counts as a fault.

    Args:
        polygon: the footprint.
        low: height of the lowest point [m]; above 0, the walls include an
            underside.
        high: height of the highest point [m].
        name: name of the object, as an example in `faults`.
        faults: counts roofs and areas that were replaced or left out.
        roof: `flat`; `pyramidal`, on a footprint without holes whose centroid
            sees all of its walls; `gabled` or `hipped`, on a footprint with
            four corners.
        roof_height: height of the roof above the eaves [m].
    """
    polygon = orient(polygon)
    eaves = high - roof_height
    # A solid that begins above the ground can be seen from below.
    floor = np.zeros((0, 3, 3))
    if low > 0.0:
        floor = flat_surface(polygon, low, name, faults)[:, ::-1]
    corners = _rings(polygon, eaves)[0]
    ridge = None
    if roof != "flat" and roof_height > 0.0:
        ridge = _ridge(roof, polygon, corners, high)
        # A slope that looks downwards reaches beyond the footprint.
        if ridge is None or (
            long_normals(np.concatenate(ridge[0]))[:, 2].min() < -_LEAST_AREA
        ):
            ridge = None
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
    """Returns the slopes and gables of a roof; None if it cannot be made."""
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
        along = max(float(np.linalg.norm(end - start)), 1e-6)
        inset = (end - start) * min(0.45, 0.5 * across / along)
        start, end = start + inset, end - inset
    slopes = [
        np.array([[a, b, end], [a, end, start]]),
        np.array([[c, d, start], [c, start, end]]),
    ]
    ends = [np.array([[b, c, end]]), np.array([[d, a, start]])]
    return (slopes + ends, []) if roof == "hipped" else (slopes, ends)


def parts_of(geometry: BaseGeometry) -> Iterator[Polygon]:
    """Yields the polygons of a geometry, except tiny ones."""
    if isinstance(geometry, Polygon):
        if geometry.area > _LEAST_PART:
            yield geometry
        return
    for one in getattr(geometry, "geoms", ()):
        yield from parts_of(one)


def sound_parts(
    polygon: Polygon, name: str, faults: ImportFaults
) -> list[Polygon]:
    """Returns the valid parts of a polygon, in whole millimetres.

    An outline that crosses itself is repaired, and counted in `faults` with
    `name` as the name of the object.
    """
    geometry: BaseGeometry = polygon
    if not polygon.is_valid:
        faults.add("outline that crosses itself, repaired", name)
        geometry = make_valid(polygon)
    return list(parts_of(shapely.set_precision(geometry, 0.001)))


# Longer triangles are divided, so that parts far away can be left out.
_LONGEST = 256  # In spacings.
# Number of triangles that are processed at a time.
_AT_ONCE = 64


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[np.ndarray]:
    """Yields blocks of points (N, 3) that cover triangles (M, 3, 3) [m].

    Every place on a triangle, including its edges, is at most `spacing` [m]
    from one of the points. `window` contains the least and the greatest x and
    y, (2,) each; points outside of these limits are left out.
    """
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            triangles = triangles[is_near.all(axis=1)]
        edges = triangles - np.roll(triangles, 1, axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1, initial=0.0)
        is_small = longest <= _LONGEST * spacing
        small = triangles[is_small]
        for first in range(0, len(small), _AT_ONCE):
            points = _samples(small[first : first + _AT_ONCE], spacing)
            if window is not None:
                xy = points[:, :2]
                points = points[((xy >= low) & (xy <= high)).all(axis=1)]
            yield points
        triangles = quartered(triangles[~is_small])


def _samples(triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Returns points (N, 3) on triangles (M, 3, 3), triangle by triangle [m].

    The points are in lines between the two longer sides, parallel to the
    shortest one.
    """
    sides = np.roll(triangles, 1, axis=1) - np.roll(triangles, -1, axis=1)
    lengths = np.sqrt((sides * sides).sum(axis=2))
    # The apex is opposite the shortest side.
    apex = lengths.argmin(axis=1)[:, None, None]
    a, b, c = (
        np.take_along_axis(triangles, (apex + k) % 3, axis=1)[:, 0]
        for k in range(3)
    )
    lines = np.maximum(np.ceil(lengths.max(axis=1) / spacing).astype(int), 1)
    owner, u = _part_ends(lines)
    steps = u * lengths.min(axis=1)[owner] / spacing
    line, v = _part_ends(np.maximum(np.ceil(steps).astype(int), 1))
    owner = owner[line]
    u = u[line][:, None]
    v = v[:, None]
    return a[owner] + u * ((1.0 - v) * (b - a)[owner] + v * (c - a)[owner])


def _part_ends(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ends of equal parts into which things are divided.

    Thing k has counts[k] parts. The ends are two arrays: the number of the
    thing (M,), and the position of the end on it, from 0 to 1 (M,).
    """
    owner = np.repeat(np.arange(len(counts)), counts + 1)
    first = np.cumsum(counts + 1) - counts - 1
    return owner, (np.arange(len(owner)) - first[owner]) / counts[owner]
