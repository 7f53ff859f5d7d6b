"""Ground polygons: tiles, surfaces and walls as meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.triangulation import triangulate

# Height above W's origin [m] at arrays of x and y [m].
HeightMap = Callable[[np.ndarray, np.ndarray], np.ndarray]

# Polygons are snapped to whole millimetres like the meshes, so that shapes
# which share an edge keep sharing it.
_GRID = 0.001
# Slivers that polygon differences leave behind [m^2].
_SLIVER = 0.01


def snap(geometry: BaseGeometry) -> BaseGeometry:
    """Returns the geometry with coordinates in whole millimetres."""
    return shapely.set_precision(geometry, _GRID)


def polygons_of(geometry: BaseGeometry) -> list[Polygon]:
    """Returns the polygons of a geometry without slivers, in fixed order.

    The order is by the lower left corner of the bounds, so that it does not
    depend on how the geometry came about.
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
    pieces = [geometry]
    if spacing > 0:
        pieces = [piece for _, _, piece in tiles(geometry, spacing)]
    corners, faces = [], []
    for polygon in (p for piece in pieces for p in polygons_of(piece)):
        if _is_convex_quad(polygon):
            # A square of the grid stays one face where it is level.
            ring = np.array(shapely.normalize(polygon).exterior.coords[:4])
            ring = _counter_clockwise(ring)
            if _is_plane(ring, height):
                faces.append(tuple(range(len(corners), len(corners) + 4)))
                corners.extend(ring)
                continue
        for triangle in triangulate(polygon):
            faces.append(tuple(range(len(corners), len(corners) + 3)))
            corners.extend(triangle)
    xy = np.array(corners).reshape(-1, 2)
    return Mesh(np.column_stack([xy, _heights(xy, height)]), tuple(faces))


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
    """Tells a grid square: four corners, as large as its bounds."""
    return (
        len(polygon.exterior.coords) == 5
        and not polygon.interiors
        and polygon.area > 0.999999 * box(*polygon.bounds).area
    )


def _is_plane(ring: np.ndarray, height: HeightMap | float) -> bool:
    z = np.round(_heights(ring, height), 3)
    return abs(z[0] - z[1] + z[2] - z[3]) < 0.0005
