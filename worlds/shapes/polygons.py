"""Polygons on the ground: rounding, placing, order and tiles."""

from collections.abc import Iterator, Sequence
import math
from typing import TypeAlias, TypeVar

import numpy as np
import shapely
from shapely.affinity import affine_transform
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

# An area seen from above, in W or in the frame of what it is the ground of [m].
Area: TypeAlias = BaseGeometry
Shape = TypeVar("Shape", bound=BaseGeometry)
# Polygons are rounded to millimetres like the meshes, so that shapes that share
# an edge keep sharing it [m].
GRID = 0.001
# Polygons smaller than this are slivers, left over by set operations [m^2].
_SLIVER = 0.01


def snap(geometry: BaseGeometry) -> BaseGeometry:
    """Returns the geometry with coordinates in whole millimetres."""
    return shapely.set_precision(geometry, GRID)


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
    return sorted(
        parts, key=lambda part: np.round([*part.bounds, part.area], 6).tolist()
    )


def tiles(geometry: BaseGeometry, size: float) -> Iterator[MultiPolygon]:
    """Yields the part of an area in each square of a grid in W.

    `size` is the side of the squares [m]. Squares without any part are left
    out.
    """
    _, squares = squares_of_grid(geometry, size)
    pieces = shapely.intersection(geometry, squares)
    for piece in shapely.set_precision(pieces, GRID):
        if polygons := polygons_of(piece):
            yield MultiPolygon(polygons)


def squares_of_grid(
    geometry: BaseGeometry, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the squares of a grid in W that an area intersects.

    `size` is the side of the squares [m].

    Returns:
        The lower left corners (N, 2) [m] and the polygons (N,) of the squares.
    """
    if geometry.is_empty:
        return np.zeros((0, 2)), np.zeros(0, object)
    x0, y0, x1, y1 = np.floor(np.array(geometry.bounds) / size).astype(int)
    y, x = np.mgrid[y0 : y1 + 1, x0 : x1 + 1].reshape(2, -1) * size
    squares = shapely.box(x, y, x + size, y + size)
    shapely.prepare(geometry)
    hit = shapely.intersects(geometry, squares)
    return np.column_stack([x, y])[hit], squares[hit]
