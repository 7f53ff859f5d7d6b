"""Meshes on polygons: horizontal or curved surfaces, and walls on edges."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from worlds.shapes.mesh import Mesh
from worlds.shapes.polygons import GRID, polygons_of, squares_of_grid
from worlds.shapes.triangulation import triangulate

# Height above W's origin [m] at arrays of x and y [m].
HeightMap = Callable[[np.ndarray, np.ndarray], np.ndarray]


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
    pieces: list[np.ndarray | BaseGeometry] = [geometry]
    if spacing > 0:
        pieces = _cut_into_squares(geometry, spacing)
    shapes: list[np.ndarray | Polygon] = []
    for piece in pieces:
        shapes += (
            [piece] if isinstance(piece, np.ndarray) else polygons_of(piece)
        )
    rings = [
        s if isinstance(s, np.ndarray) else _rectangle_corners(s)
        for s in shapes
    ]
    halves = triangulate(box(0, 0, spacing, spacing))
    corners: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []
    for shape, plane in zip(shapes, _plane_rings(rings, height), strict=True):
        own: Iterable[np.ndarray]
        if plane is not None:
            own = [plane]
        elif isinstance(shape, np.ndarray):
            own = halves + shape[3]
        else:
            own = triangulate(shape)
        for ring in own:
            faces.append(tuple(range(len(corners), len(corners) + len(ring))))
            corners.extend(ring)
    xy = np.array(corners).reshape(-1, 2)
    return Mesh(np.column_stack([xy, _heights(xy, height)]), tuple(faces))


def _cut_into_squares(
    geometry: BaseGeometry, size: float
) -> list[np.ndarray | BaseGeometry]:
    """Divides polygons along a grid that is fixed in W.

    Returns:
        The piece in each square, in the order of the grid. A square that lies
        wholly inside a polygon is given by its corners (4, 2),
        counter-clockwise from the lower right one.
    """
    corners, squares = squares_of_grid(geometry, size)
    is_whole = shapely.contains_properly(geometry, squares)
    ring = size * np.array([(1, 0), (1, 1), (0, 1), (0, 0)])
    cut = shapely.intersection(geometry, squares[~is_whole])
    others = iter(shapely.set_precision(cut, GRID))
    return [
        corner + ring if whole else next(others)
        for corner, whole in zip(corners, is_whole, strict=True)
    ]


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


def _rectangle_corners(polygon: Polygon) -> np.ndarray | None:
    """Returns the corners (4, 2) of a polygon that is an axis-aligned box.

    The corners are counter-clockwise. The result is None for any other polygon.
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


def _plane_rings(
    rings: Sequence[np.ndarray | None], height: HeightMap | float
) -> list[np.ndarray | None]:
    """Returns the rings (4, 2) whose corners lie in one plane.

    Each other ring is None in the result.
    """
    found = np.reshape([ring for ring in rings if ring is not None], (-1, 2))
    z = np.round(_heights(found, height), 3).reshape(-1, 4)
    is_plane = iter(abs(z[:, 0] - z[:, 1] + z[:, 2] - z[:, 3]) < 0.0005)
    return [
        ring if ring is not None and next(is_plane) else None for ring in rings
    ]
