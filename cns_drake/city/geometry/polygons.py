"""Polygons on the ground, their tiles, and surfaces and walls on them."""

from collections.abc import Callable, Iterator, Sequence
import itertools
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
# Polygons are rounded to millimetres like the meshes, so that shapes that share
# an edge keep sharing it [m].
_GRID = 0.001
# Polygons smaller than this are slivers, left over by set operations [m^2].
_SLIVER = 0.01


def snap(geometry: BaseGeometry) -> BaseGeometry:
    """Returns the geometry with coordinates in whole millimetres."""
    return shapely.set_precision(geometry, _GRID)


def hull_of(xy: np.ndarray) -> BaseGeometry:
    """Returns the convex hull of points (N, 2)."""
    # GEOS makes points one at a time, which takes far longer than a line.
    make = shapely.linestrings if len(xy) > 1 else shapely.multipoints
    hull = shapely.convex_hull(make(xy))
    assert isinstance(hull, BaseGeometry)
    return hull


def placed(shape: Shape, xy: Sequence[float], yaw: float) -> Shape:
    """Returns a shape rotated about the origin and then moved.

    `yaw` is the angle of the rotation [rad], and `xy` contains the shift along
    x and y [m].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    return affine_transform(shape, [c, -s, s, c, *xy])


def polygons_of(geometry: BaseGeometry) -> list[Polygon]:
    """Returns the polygons of a geometry, except slivers, in fixed order.

    The polygons are sorted by the lower left corners of their bounding boxes,
    so that the order does not depend on how the geometry was made.
    """
    parts = [
        part
        for part in shapely.get_parts(geometry)
        if isinstance(part, Polygon) and part.area > _SLIVER
    ]
    return sorted(parts, key=lambda part: (part.bounds, part.area))


def tiles(geometry: BaseGeometry, size: float) -> Iterator[MultiPolygon]:
    """Yields the part of an area in each square of a grid in W.

    `size` is the side of the squares [m]. Squares without any part are left
    out.
    """
    _, squares = _squares(geometry, size)
    pieces = shapely.intersection(geometry, squares)
    for piece in shapely.set_precision(pieces, _GRID):
        if polygons := polygons_of(piece):
            yield MultiPolygon(polygons)


def _squares(
    geometry: BaseGeometry, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the corners (N, 2) and the boxes (N,) of squares that are hit.

    The corners are the lower left ones [m].
    """
    if geometry.is_empty:
        return np.zeros((0, 2)), np.zeros(0, object)
    x0, y0, x1, y1 = np.floor(np.array(geometry.bounds) / size).astype(int)
    y, x = np.mgrid[y0 : y1 + 1, x0 : x1 + 1].reshape(2, -1) * size
    squares = shapely.box(x, y, x + size, y + size)
    shapely.prepare(geometry)
    hit = shapely.intersects(geometry, squares)
    return np.column_stack([x, y])[hit], squares[hit]


def surface_mesh(
    geometry: BaseGeometry, height: HeightMap | float, spacing: float = 0.0
) -> Mesh:
    """Returns a horizontal or curved surface that covers polygons in W.

    Args:
        geometry: the polygons [m].
        height: height of the surface [m], or a function that returns the
            heights at arrays of x and y [m].
        spacing: side of the squares into which the polygons are divided first,
            so that the surface can follow `height` [m]; 0 for no division.
    """
    squares = np.zeros((0, 4, 2))
    pieces: list[BaseGeometry | None] = [geometry]
    if spacing > 0:
        squares, pieces = _cut_into_squares(geometry, spacing)
    parts = [[] if piece is None else polygons_of(piece) for piece in pieces]
    rings = [_quad(polygon) for polygon in itertools.chain(*parts)]
    quads = np.reshape([r for r in rings if r is not None], (-1, 4, 2))
    plane = iter(_are_planes(quads, height))
    own = (r if r is not None and next(plane) else None for r in rings)
    is_plane = iter(_are_planes(squares, height))
    whole = iter(squares)
    halves = triangulate(box(0, 0, spacing, spacing))
    corners: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []

    def add(ring: np.ndarray) -> None:
        faces.append(tuple(range(len(corners), len(corners) + len(ring))))
        corners.extend(ring)

    for piece, polygons in zip(pieces, parts, strict=True):
        if piece is None:
            # A square of the grid stays one face if it is plane.
            ring = next(whole)
            for face in [ring] if next(is_plane) else halves + ring[3]:
                add(face)
        for polygon in polygons:
            quad = next(own)
            for face in triangulate(polygon) if quad is None else [quad]:
                add(face)
    xy = np.array(corners).reshape(-1, 2)
    return Mesh(np.column_stack([xy, _heights(xy, height)]), tuple(faces))


def _cut_into_squares(
    geometry: BaseGeometry, size: float
) -> tuple[np.ndarray, list[BaseGeometry | None]]:
    """Divides polygons along a grid that is fixed in W.

    Returns:
        First, the (N, 4, 2) corners of the squares that lie wholly inside,
        counter-clockwise from the lower right one. Second, the piece in each
        square in the order of the grid; None for each whole square.
    """
    corners, squares = _squares(geometry, size)
    is_whole = shapely.contains_properly(geometry, squares)
    pieces = np.full(len(squares), None)
    cut = shapely.intersection(geometry, squares[~is_whole])
    pieces[~is_whole] = shapely.set_precision(cut, _GRID)
    ring = size * np.array([(1, 0), (1, 1), (0, 1), (0, 0)])
    return corners[is_whole][:, None] + ring, list(pieces)


def wall_mesh(
    geometry: BaseGeometry,
    bottom: HeightMap | float,
    top: HeightMap | float,
    *,
    along: BaseGeometry | None = None,
) -> Mesh:
    """Returns vertical walls on the edges of polygons in W, facing inwards.

    Args:
        geometry: the polygons [m].
        bottom: height of the walls' foot [m], or a function that returns the
            heights at arrays of x and y [m].
        top: height of the walls' top, given in the same way.
        along: only edges whose middle lies in this area get a wall; None for
            all edges.
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
    # Seen from the interior, which is to the left of start -> end, a wall's
    # corners are end, start at the foot, then start, end at the top.
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


def _quad(polygon: Polygon) -> np.ndarray | None:
    """Returns the corners (4, 2) of a polygon that is an axis-aligned box.

    It is None for any other polygon. The corners are counter-clockwise.
    """
    x0, y0, x1, y1 = polygon.bounds
    if (
        polygon.interiors
        or len(polygon.exterior.coords) != 5
        or polygon.area <= 0.999999 * (x1 - x0) * (y1 - y0)
    ):
        return None
    # A normalized ring is clockwise.
    return np.array(shapely.normalize(polygon).exterior.coords[3::-1])


def _are_planes(rings: np.ndarray, height: HeightMap | float) -> np.ndarray:
    """Returns (N,) whether the corners of (N, 4, 2) rings lie in one plane."""
    z = np.round(_heights(rings.reshape(-1, 2), height), 3).reshape(-1, 4)
    return abs(z[:, 0] - z[:, 1] + z[:, 2] - z[:, 3]) < 0.0005
