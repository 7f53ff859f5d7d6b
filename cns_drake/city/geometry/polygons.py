"""Ground polygons: tiles, surfaces and walls as meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import math
from typing import TypeVar

import numpy as np
import shapely
from shapely.affinity import affine_transform
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.triangulation import triangulate

# Height above W's origin [m] at arrays of x and y [m].
HeightMap = Callable[[np.ndarray, np.ndarray], np.ndarray]
Shape = TypeVar("Shape", bound=BaseGeometry)

# Polygons are snapped to whole millimetres like the meshes, so that shapes
# which share an edge keep sharing it.
_GRID = 0.001
# Slivers that polygon differences leave behind [m^2].
_SLIVER = 0.01


def snap(geometry: BaseGeometry) -> BaseGeometry:
    """Returns the geometry with coordinates in whole millimetres."""
    return shapely.set_precision(geometry, _GRID)


def hull_of(xy: np.ndarray) -> BaseGeometry:
    """Returns the convex hull of places (N, 2)."""
    # Points are made one at a time, which takes far longer than a line.
    make = shapely.linestrings if len(xy) > 1 else shapely.multipoints
    hull = shapely.convex_hull(make(xy))
    assert isinstance(hull, BaseGeometry)
    return hull


def placed(shape: Shape, xy: Sequence[float], yaw: float) -> Shape:
    """Returns a shape turned about the origin [rad], then moved by xy [m]."""
    c, s = math.cos(yaw), math.sin(yaw)
    return affine_transform(shape, [c, -s, s, c, *xy])


def polygons_of(geometry: BaseGeometry) -> list[Polygon]:
    """Returns the polygons of a geometry without slivers, in fixed order.

    The order is by the lower left corner of the bounds, so that it does not
    depend on how the geometry was made.
    """
    parts = [
        part
        for part in shapely.get_parts(geometry)
        if isinstance(part, Polygon) and part.area > _SLIVER
    ]
    return sorted(parts, key=lambda part: (part.bounds, part.area))


def tiles(
    geometry: BaseGeometry, size: float
) -> Iterator[tuple[int, int, MultiPolygon]]:
    """Yields the pieces of a geometry in squares of a world-anchored grid.

    Args:
        geometry: polygons in W [m].
        size: edge length of a square [m].

    Yields:
        The square's column and row, and the polygons within it.
    """
    if geometry.is_empty:
        return
    x0, y0, x1, y1 = np.floor(np.array(geometry.bounds) / size).astype(int)
    shapely.prepare(geometry)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            square = box(
                column * size, row * size, (column + 1) * size, (row + 1) * size
            )
            if not geometry.intersects(square):
                continue
            piece = polygons_of(snap(geometry.intersection(square)))
            if piece:
                yield column, row, MultiPolygon(piece)


def surface_mesh(
    geometry: BaseGeometry, height: HeightMap | float, spacing: float = 0.0
) -> Mesh:
    """Returns the upper side of polygons at a height.

    Args:
        geometry: polygons in W [m].
        height: one height [m], or a height map.
        spacing: where positive, the polygons are first cut into squares of
            this size [m], so that the mesh can follow a height map.
    """
    squares = np.zeros((0, 4, 2))
    pieces: list[BaseGeometry | None] = [geometry]
    if spacing > 0:
        squares, pieces = _cut_into_squares(geometry, spacing)
    is_plane = iter(_are_planes(squares, height))
    whole = iter(squares)
    halves = triangulate(box(0, 0, spacing, spacing))
    corners: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []

    def add(ring: np.ndarray) -> None:
        faces.append(tuple(range(len(corners), len(corners) + len(ring))))
        corners.extend(ring)

    for piece in pieces:
        if piece is None:
            # A square of the grid stays one face where it is plane.
            ring = next(whole)
            rings = [ring] if next(is_plane) else halves + ring[3]
        else:
            rings = _faces(piece, height)
        for ring in rings:
            add(ring)
    xy = np.array(corners).reshape(-1, 2)
    return Mesh(np.column_stack([xy, _heights(xy, height)]), tuple(faces))


def _faces(
    geometry: BaseGeometry, height: HeightMap | float
) -> Iterator[np.ndarray]:
    """Yields the corners of the faces that polygons are cut into."""
    for polygon in polygons_of(geometry):
        if _is_convex_quad(polygon):
            ring = np.array(shapely.normalize(polygon).exterior.coords[:4])
            ring = _counter_clockwise(ring)
            if _are_planes(ring[None], height)[0]:
                yield ring
                continue
        yield from triangulate(polygon)


def _cut_into_squares(
    geometry: BaseGeometry, size: float
) -> tuple[np.ndarray, list[BaseGeometry | None]]:
    """Cuts polygons along a world-anchored grid.

    Returns:
        (N, 4, 2) corners of the squares that lie wholly inside, counter-
        clockwise from the right and lower one; and in the order of the grid
        the pieces in all squares, None for each whole one.
    """
    if geometry.is_empty:
        return np.zeros((0, 4, 2)), []
    x0, y0, x1, y1 = np.floor(np.array(geometry.bounds) / size).astype(int)
    y, x = np.mgrid[y0 : y1 + 1, x0 : x1 + 1].reshape(2, -1) * size
    squares = shapely.box(x, y, x + size, y + size)
    shapely.prepare(geometry)
    hit = shapely.intersects(geometry, squares)
    x, y, squares = x[hit], y[hit], squares[hit]
    is_whole = shapely.contains_properly(geometry, squares)
    pieces = np.full(len(squares), None)
    pieces[~is_whole] = snap(geometry.intersection(squares[~is_whole]))
    x, y = x[is_whole], y[is_whole]
    xx, yy = (x + size, x + size, x, x), (y, y + size, y + size, y)
    return np.stack([np.transpose(xx), np.transpose(yy)], axis=2), list(pieces)


def wall_mesh(
    geometry: BaseGeometry,
    bottom: HeightMap | float,
    top: HeightMap | float,
    *,
    along: BaseGeometry | None = None,
) -> Mesh:
    """Returns upright walls on the edges of polygons, seen from inside.

    Args:
        geometry: polygons in W [m]; the walls face their interior.
        bottom: height of the lower edge [m].
        top: height of the upper edge [m].
        along: where given, only edges whose middle lies in this area.
    """
    starts, ends = [], []
    for polygon in polygons_of(geometry):
        polygon = shapely.orient_polygons(polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            coordinates = np.array(ring.coords)[:, :2]
            starts.append(coordinates[:-1])
            ends.append(coordinates[1:])
    if not starts:
        return Mesh(np.zeros((0, 3)), ())
    start, end = np.concatenate(starts), np.concatenate(ends)
    if along is not None:
        middle = (start + end) / 2
        keep = shapely.contains_xy(along, middle[:, 0], middle[:, 1])
        start, end = start[keep], end[keep]
    # From the interior, which lies to the left of start -> end, the wall
    # reads end, start at the foot and start, end at the top.
    vertices = np.concatenate(
        [
            np.column_stack([end, _heights(end, bottom)]),
            np.column_stack([start, _heights(start, bottom)]),
            np.column_stack([start, _heights(start, top)]),
            np.column_stack([end, _heights(end, top)]),
        ]
    )
    count = len(start)
    faces = tuple(
        (i, i + count, i + 2 * count, i + 3 * count) for i in range(count)
    )
    return Mesh(vertices, faces)


def _heights(xy: np.ndarray, height: HeightMap | float) -> np.ndarray:
    if callable(height):
        return np.asarray(height(xy[:, 0], xy[:, 1]), dtype=float)
    return np.full(len(xy), float(height))


def _counter_clockwise(ring: np.ndarray) -> np.ndarray:
    x, y = ring[:, 0], ring[:, 1]
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return ring if area > 0 else ring[::-1]


def _is_convex_quad(polygon: Polygon) -> bool:
    """Returns whether a polygon is a grid square: its area fills its bounds."""
    return (
        len(polygon.exterior.coords) == 5
        and not polygon.interiors
        and polygon.area > 0.999999 * box(*polygon.bounds).area
    )


def _are_planes(rings: np.ndarray, height: HeightMap | float) -> np.ndarray:
    """Returns which of (N, 4, 2) rings have their corners in one plane."""
    z = np.round(_heights(rings.reshape(-1, 2), height), 3).reshape(-1, 4)
    return abs(z[:, 0] - z[:, 1] + z[:, 2] - z[:, 3]) < 0.0005
