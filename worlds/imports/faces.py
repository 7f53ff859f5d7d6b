"""Converts polygons, in space or level, to triangles."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient
from shapely.validation import make_valid

from evaluation.base import dot
from worlds.imports.faults import ImportFaults
from worlds.shapes import GRID, long_normals, triangulate

# Faces with less area are dropped [m^2].
LEAST_AREA = 1e-5
# A face is bent if a corner is farther than this from its plane [m].
_BENT = 0.05
# Millimetres in a metre: corners that are equal in whole millimetres are one.
_MM = 1000.0
# Smaller polygons of a geometry are dropped [m^2].
_LEAST_PART_AREA = 0.01
# Lines that cross themselves more often are not read, nor lines whose pieces
# meet more others than this.
_MOST_CROSSINGS = 1000
_MOST_MET = 8.0
# Number of pieces of a line whose crossings are counted.
_SAMPLED = 64
# The four corner triangles of a face with four corners. The second and the last
# one together fill the face.
_CORNERS_OF_FOUR = np.array([(3, 0, 1), (0, 1, 2), (1, 2, 3), (0, 2, 3)])


def joined_triangles(surfaces: Iterable[np.ndarray]) -> np.ndarray:
    """Returns the triangles (N, 3, 3) of surfaces with (M, 3, 3) triangles."""
    return np.concatenate([np.zeros((0, 3, 3)), *surfaces])


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
    outer = rings[0]
    normal = _normal_of_ring(outer)
    if not normal.any():
        faults.add("face without area, left out", name)
        return np.zeros((0, 3, 3))
    has_holes = any(len(hole) >= 3 for hole in rings[1:])
    if len(outer) == 3 and not has_holes:
        return outer[None]
    heights = dot(outer - outer[0], normal)
    if np.ptp(heights) > 2.0 * _BENT * np.linalg.norm(normal, axis=0):
        faults.add("face that is not plane, folded between its corners", name)
    if len(outer) == 4 and not has_holes:
        corners = outer[_CORNERS_OF_FOUR]
        if (dot(long_normals(corners), normal) > 0.0).all():
            return corners[[1, 3]]
    return _triangulate_along(normal, rings, name, faults)


def _normal_of_ring(ring: np.ndarray) -> np.ndarray:
    """Returns a vector (3,) normal to a ring (N, 3); 0 for a ring without area.

    The ring is counter-clockwise as seen from the end of the vector.
    """
    first, rest = ring[:1], ring[1:]
    fan = [np.repeat(first, len(rest) - 1, axis=0), rest[:-1], rest[1:]]
    # The vector is as long as twice the area.
    normals = long_normals(np.stack(fan, axis=1))
    normal = normals.sum(axis=0)
    if 0.5 * np.linalg.norm(normal, axis=0) < LEAST_AREA:
        # The two halves of a ring that crosses itself may have the same area.
        areas = 0.5 * np.linalg.norm(normals, axis=1)
        largest = int(np.round(areas / LEAST_AREA).argmax())
        is_flat = areas[largest] < LEAST_AREA
        return np.zeros(3) if is_flat else np.asarray(normals[largest])
    return np.asarray(normal)


def _without_repetitions(
    ring: np.ndarray, name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns a ring without corners that repeat the corner before them."""
    if len(ring) == 0:
        return ring
    rounded = np.rint(ring * _MM).tolist()
    kept = [k for k in range(len(ring)) if rounded[k] != rounded[k - 1]]
    if len(kept) < len(ring):
        repeated = len(ring) - len(kept)
        faults.add("repeated corner, left out", name, repeated)
        return ring[kept]
    return ring


def _triangulate_along(
    normal: np.ndarray,
    rings: Sequence[np.ndarray],
    name: str,
    faults: ImportFaults,
) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of a face [m].

    The face is triangulated as seen along the axis of W that is nearest to its
    `normal` (3,). Corners of the face keep their exact coordinates; all other
    corners of triangles lie in the face's plane. The other arguments are as for
    `face_triangles`.
    """
    axis = int(np.abs(normal).round(9).argmax())
    axes = [(axis + 1) % 3, (axis + 2) % 3]
    if normal[axis] < 0.0:
        axes.reverse()
    flat_mm = [np.rint(ring[:, axes] * _MM) for ring in rings]
    corners = {
        tuple(key): corner
        for keys, ring in zip(flat_mm, rings, strict=True)
        for key, corner in zip(keys.tolist(), ring, strict=True)
    }
    holes = [hole / _MM for hole in flat_mm[1:] if len(hole) >= 3]
    face = Polygon(flat_mm[0] / _MM, holes)
    polygon: BaseGeometry = face
    if not face.is_valid:
        polygon = repaired(face, "face", name, faults)
        polygon = shapely.set_precision(polygon, 1.0 / _MM)
    parts = [np.zeros((0, 3, 2))]
    for part in shapely.get_parts(polygon):
        if isinstance(part, Polygon) and part.area >= LEAST_AREA:
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
        corner = corners.get(tuple(key))
        if corner is not None:
            row[:] = corner
            continue
        row[axes] = point
        row[axis] = origin[axis]
        row[axis] -= dot(normal, row - origin) / normal[axis]
    return lifted.reshape(-1, 3, 3)


def repaired(
    polygon: Polygon, what: str, name: str, faults: ImportFaults
) -> BaseGeometry:
    """Returns `valid_area`, and counts why it is not the polygon.

    The fault is counted in `faults`, with `name` as the name of the object and
    `what` as the kind of outline.
    """
    area = valid_area(polygon)
    if area.is_empty:
        faults.add(f"{what} that crosses itself very often, left out", name)
    elif area is not polygon:
        faults.add(f"{what} that crosses itself, repaired", name)
    return area


def valid_area(polygon: Polygon) -> BaseGeometry:
    """Returns a polygon, as valid areas if its outline crosses itself.

    An outline that crosses itself very often has none.
    """
    if polygon.is_valid:
        return polygon
    rings = (polygon.exterior, *polygon.interiors)
    if is_tangled(*(np.array(ring.coords) for ring in rings)):
        return Polygon()
    return make_valid(polygon)


def is_tangled(*lines: np.ndarray, reach: float = 0.0) -> bool:
    """Returns whether pieces of lines (N, 2) meet too many others.

    Shapely takes minutes and gigabytes for a line that crosses or covers itself
    very often, which no map needs and a small file can contain. The pieces of
    long lines are sampled.

    Args:
        lines: the corners of each line.
        reach: distance at which pieces meet; by default they cross.
    """
    ends = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
    pieces = np.asarray(shapely.linestrings(np.concatenate(ends)))
    some = pieces[:: max(1, len(pieces) // _SAMPLED)]
    tree = shapely.STRtree(pieces)
    _, met = tree.query(some, predicate="dwithin", distance=reach)
    # Each piece meets itself and its neighbours.
    others = len(met) / len(some) - 3.0
    crossings = 0.0 if reach else others * len(pieces) / 2.0
    return others > _MOST_MET or crossings > _MOST_CROSSINGS


def flat_surface(
    polygon: Polygon, z: float, name: str, faults: ImportFaults
) -> np.ndarray:
    """Returns a level area at the height `z` as triangles (M, 3, 3) [m].

    The triangles face upwards. Faults are counted in `faults`, with `name` as
    the name of the object.
    """
    return face_triangles(level_rings(orient(polygon), z), name, faults)


def level_rings(polygon: Polygon, z: float) -> list[np.ndarray]:
    """Returns the rings of a polygon, (N, 3) each, at a height z [m].

    The first corner of a ring is not repeated at its end.
    """
    rings = (polygon.exterior, *polygon.interiors)
    return [
        np.column_stack(
            [np.array(ring.coords)[:-1, :2], np.full(len(ring.coords) - 1, z)]
        )
        for ring in rings
    ]


def parts_of(geometry: BaseGeometry) -> Iterator[Polygon]:
    """Yields the polygons of a geometry, except polygons below 0.01 m^2."""
    if isinstance(geometry, Polygon):
        if geometry.area > _LEAST_PART_AREA:
            yield geometry
        return
    for part in getattr(geometry, "geoms", ()):
        yield from parts_of(part)


def valid_parts(
    polygon: Polygon, name: str, faults: ImportFaults
) -> list[Polygon]:
    """Returns the valid parts of a polygon, in whole millimetres.

    An outline that crosses itself is repaired, and counted in `faults` with
    `name` as the name of the object.
    """
    geometry = repaired(polygon, "outline", name, faults)
    return list(parts_of(shapely.set_precision(geometry, GRID)))
