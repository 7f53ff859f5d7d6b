"""Polygons on the ground: triangulation, tiles, surfaces, walls, occupancy."""

from collections.abc import Callable, Iterable, Iterator, Sequence
import itertools
import math
from typing import TypeVar

import numpy as np
import shapely
from shapely.affinity import affine_transform
from shapely.geometry import LinearRing, MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh

_MM = 1000.0
# A corner or point in whole millimetres.
_Point = tuple[int, int]


def triangulate(polygon: Polygon) -> np.ndarray:
    """Divides a polygon into (M, 3, 2) counter-clockwise triangles [m].

    The triangles have the vertices of the polygon, rounded to millimetres. All
    edges of the polygon are edges of triangles.

    Args:
        polygon: a polygon that is valid, even after rounding. Holes may touch
            the outer ring and each other in points.

    Raises:
        ValueError: the polygon turns out not to be valid.
    """
    polygon = shapely.orient_polygons(shapely.normalize(polygon))
    rings = [_ring(ring) for ring in (polygon.exterior, *polygon.interiors)]
    if len(rings[0]) < 3:
        return np.zeros((0, 3, 2))
    outer, *holes = rings
    if holes:
        corners = sorted({corner for ring in rings for corner in ring})
        outer, *holes = (_with_corners_on_edges(one, corners) for one in rings)
    fixed = {
        frozenset(edge) for ring in (outer, *holes) for edge in _edges(ring)
    }
    ring = _bridge(outer, holes)
    ears = ([ring[k] for k in ear] for ear in cut_ears(ring))
    triangles = _flip(ears, fixed)
    return np.array(triangles, dtype=float).reshape(-1, 3, 2) / _MM


def _ring(ring: LinearRing) -> list[_Point]:
    """Returns a ring's corners without repetitions, the smallest one first."""
    xy = np.array(ring.coords)[:-1, :2]
    points = [tuple(p) for p in np.rint(xy * _MM).astype(int).tolist()]
    corners = [p for k, p in enumerate(points) if p != points[k - 1]]
    if not corners:
        return []
    start = corners.index(min(corners))
    return corners[start:] + corners[:start]


def _with_corners_on_edges(
    ring: list[_Point], corners: list[_Point]
) -> list[_Point]:
    """Returns a ring with more corners, where other rings touch its edges."""
    points = np.array(corners, dtype=np.int64)
    starts = np.array(ring, dtype=np.int64)
    ways = np.roll(starts, -1, axis=0) - starts
    result = []
    # The edges are handled in portions: thousands of edges and thousands of
    # corners would need too much memory at once.
    parts = 1 + len(ring) * len(corners) // 1_000_000
    for some in np.array_split(np.arange(len(ring)), parts):
        way = ways[some, None]
        offset = points - starts[some, None]
        part = (offset * way).sum(axis=2)
        inside = way[..., 0] * offset[..., 1] == way[..., 1] * offset[..., 0]
        inside &= (part > 0) & (part < (way * way).sum(axis=2))
        for k, row, touched in zip(some, part, inside, strict=True):
            result.append(ring[k])
            if touched.any():
                those = np.flatnonzero(touched)
                order = np.argsort(row[those], kind="stable")
                result += [corners[i] for i in those[order]]
    return result


def _edges(ring: list[_Point]) -> Iterator[tuple[_Point, _Point]]:
    return zip(ring, ring[1:] + ring[:1], strict=True)


def _cross(a: _Point, b: _Point, c: _Point) -> int:
    """Returns twice the area of a triangle; positive if counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _bridge(outer: list[_Point], holes: list[list[_Point]]) -> list[_Point]:
    """Returns one ring that leads into every hole and back again."""
    ring = outer
    left = sorted(holes, key=lambda hole: max(hole), reverse=True)
    while left:
        # From the hole that reaches furthest to the right, the ring can be
        # seen.
        hole = left.pop(0)
        walls = [*_edges(ring), *(e for h in (hole, *left) for e in _edges(h))]
        touching = _insert_touching(ring, hole)
        ring = touching or _insert_apart(ring, hole, walls)
    return ring


def _insert_touching(
    ring: list[_Point], hole: list[_Point]
) -> list[_Point] | None:
    """Returns a ring that also runs around a hole, from a corner they share.

    It is None if they share no corner.
    """
    for k, corner in enumerate(hole):
        for i in (i for i, other in enumerate(ring) if other == corner):
            if _opens_towards(ring, i, hole[(k + 1) % len(hole)]):
                return ring[:i] + hole[k:] + hole[:k] + ring[i:]
    return None


def _insert_apart(
    ring: list[_Point], hole: list[_Point], walls: list[tuple[_Point, _Point]]
) -> list[_Point]:
    """Returns a ring that also runs around a hole that it does not touch.

    It leads there and back along a line that crosses none of the walls.
    """
    k = hole.index(max(hole))
    for i in sorted(
        range(len(ring)),
        key=lambda i: (_square_distance(ring[i], hole[k]), ring[i], i),
    ):
        if _opens_towards(ring, i, hole[k]) and not any(
            _crosses(ring[i], hole[k], a, b) for a, b in walls
        ):
            return ring[: i + 1] + hole[k:] + hole[: k + 1] + ring[i:]
    raise ValueError("a hole lies outside its polygon")


def _square_distance(a: _Point, b: _Point) -> int:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


def _opens_towards(ring: list[_Point], i: int, target: _Point) -> bool:
    """Returns whether a point lies in the inner angle at the i-th corner."""
    before, at, after = ring[i - 1], ring[i], ring[(i + 1) % len(ring)]
    is_left_of_in = _cross(before, at, target) > 0
    is_left_of_out = _cross(at, after, target) > 0
    if _cross(before, at, after) > 0:
        return is_left_of_in and is_left_of_out
    return is_left_of_in or is_left_of_out


def _crosses(p: _Point, q: _Point, a: _Point, b: _Point) -> bool:
    """Returns whether segment pq meets segment ab other than at p or q."""
    sides = (_cross(p, q, a), _cross(p, q, b))
    others = (_cross(a, b, p), _cross(a, b, q))
    if sides[0] * sides[1] < 0 and others[0] * others[1] < 0:
        return True
    return any(
        side == 0 and c not in (p, q) and _is_between(p, q, c)
        for side, c in zip(sides, (a, b), strict=True)
    )


def _is_between(p: _Point, q: _Point, c: _Point) -> bool:
    """Returns whether c, on the line through p and q, lies between them."""
    return all(min(p[k], q[k]) <= c[k] <= max(p[k], q[k]) for k in range(2))


def cut_ears(
    ring: Sequence[_Point], fans: bool = False
) -> list[tuple[int, ...]]:
    """Divides a polygon into triangles, as indices of its corners.

    Args:
        ring: the corners, counter-clockwise, in whole numbers such as
            millimetres. The ring may touch itself.
        fans: whether many thin triangles may share one corner, as in a fan;
            otherwise such fans are avoided.

    Returns:
        The indices of three corners of `ring` for each triangle.

    Raises:
        ValueError: the ring crosses itself, or runs clockwise.
    """
    points = np.array(ring, dtype=np.int64)
    left = list(range(len(ring)))
    triangles: list[tuple[int, ...]] = []
    start = 0
    while len(left) > 3:
        for step in range(len(left)):
            k = (start + step) % len(left)
            ear = (left[k - 1], left[k], left[k + 1 - len(left)])
            corners = (ring[ear[0]], ring[ear[1]], ring[ear[2]])
            if _cross(*corners) > 0 and not _any_inside(points[left], corners):
                triangles.append(ear)
                left.pop(k)
                start = 0 if fans else k
                break
        else:
            a, b = ring[left[0]], ring[left[1]]
            if any(_cross(a, b, ring[i]) for i in left):
                raise ValueError("the polygon crosses itself or runs clockwise")
            return triangles
    a, b, c = (ring[i] for i in left)
    return [*triangles, tuple(left)] if _cross(a, b, c) > 0 else triangles


def _any_inside(
    points: np.ndarray, triangle: tuple[_Point, _Point, _Point]
) -> bool:
    """Returns whether any points (N, 2), except its corners, are inside."""
    x, y = points.T
    inside = np.ones(len(points), dtype=bool)
    is_corner = np.zeros(len(points), dtype=bool)
    for k, (bx, by) in enumerate(triangle):
        ax, ay = triangle[k - 1]
        inside &= (bx - ax) * (y - ay) >= (by - ay) * (x - ax)
        is_corner |= (x == bx) & (y == by)
    return bool((inside & ~is_corner).any())


def _flip(
    triangles: Iterable[Sequence[_Point]],
    fixed: set[frozenset[_Point]],
) -> list[tuple[_Point, _Point, _Point]]:
    """Returns a Delaunay triangulation with fixed edges, by flips (Lawson)."""
    # Directed edge -> the third corner of the triangle on its left.
    apex: dict[tuple[_Point, _Point], _Point] = {}
    for a, b, c in triangles:
        apex[a, b], apex[b, c], apex[c, a] = c, a, b
    pending = sorted(apex)
    while pending:
        a, b = pending.pop()
        if (a, b) not in apex or (b, a) not in apex:
            continue
        if frozenset((a, b)) in fixed:
            continue
        c, d = apex[a, b], apex[b, a]
        if not _in_circle(a, b, c, d):
            continue
        del apex[a, b], apex[b, a]
        for u, v, w in ((a, d, c), (d, b, c)):
            apex[u, v], apex[v, w], apex[w, u] = w, u, v
        pending += [(b, c), (c, a), (a, d), (d, b)]
    return sorted((a, b, c) for (a, b), c in apex.items() if a < b and a < c)


def _in_circle(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """Returns whether d is inside the circle through a, b and c.

    The three are counter-clockwise. Then the quadrilateral a, d, b, c is
    convex as well, so that its diagonal can be flipped.
    """
    rows = [(p[0] - d[0], p[1] - d[1]) for p in (a, b, c)]
    (ax, ay), (bx, by), (cx, cy) = rows
    a2, b2, c2 = (x * x + y * y for x, y in rows)
    return (
        ax * (by * c2 - b2 * cy)
        - ay * (bx * c2 - b2 * cx)
        + a2 * (bx * cy - by * cx)
    ) > 0


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

    They are sorted by the lower left corners of their bounding boxes, so that
    the order does not depend on how the geometry was made.
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


class Occupancy:
    """The occupied ground: a growing set of polygons in W."""

    def __init__(self) -> None:
        self._geometries: list[BaseGeometry] = []
        self._bounds: np.ndarray = np.zeros((64, 4))

    def add(self, geometry: BaseGeometry) -> None:
        """Marks the area of a polygon in W as occupied."""
        count = len(self._geometries)
        if count == len(self._bounds):
            self._bounds = np.concatenate(
                [self._bounds, np.zeros_like(self._bounds)]
            )
        shapely.prepare(geometry)
        self._bounds[count] = geometry.bounds
        self._geometries.append(geometry)

    def is_free(
        self,
        geometry: BaseGeometry,
        clearance: float = 0.0,
        ignore: BaseGeometry | None = None,
    ) -> bool:
        """Returns whether an area in W keeps clear of all occupied ground.

        Args:
            geometry: the area.
            clearance: least distance from occupied ground [m]; with 0, areas
                may touch.
            ignore: an occupied polygon that may be closer than `clearance`, but
                must not be overlapped.
        """
        # One comparison of all bounding boxes finds the few candidates.
        x0, y0, x1, y1 = geometry.bounds
        taken = self._bounds[: len(self._geometries)]
        near = np.flatnonzero(
            (taken[:, 0] < x1 + clearance)
            & (taken[:, 1] < y1 + clearance)
            & (taken[:, 2] > x0 - clearance)
            & (taken[:, 3] > y0 - clearance)
        )
        for index in near:
            other = self._geometries[index]
            if clearance > 0 and other is not ignore:
                if other.distance(geometry) < clearance:
                    return False
            elif other.intersects(geometry) and not other.touches(geometry):
                return False
        return True
