"""Triangulation of polygons on the ground, in whole millimetres."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LinearRing, Polygon

_MM_PER_M = 1000.0
# Of a polygon with more corners, GEOS makes the triangles: the time for those
# below, of which cities consist, grows by the square of the corners.
_MANY_CORNERS = 1500
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
    if shapely.get_num_coordinates(polygon) > _MANY_CORNERS:
        return _triangles_of_geos(polygon)
    polygon = shapely.orient_polygons(shapely.normalize(polygon))
    rings = [_corners(ring) for ring in (polygon.exterior, *polygon.interiors)]
    if len(rings[0]) < 3:
        return np.zeros((0, 3, 2))
    outer, *holes = rings
    if holes:
        corners = sorted({corner for ring in rings for corner in ring})
        outer, *holes = (_with_corners_on_edges(one, corners) for one in rings)
    fixed = {
        frozenset(edge) for ring in (outer, *holes) for edge in _edges(ring)
    }
    ring = _joined_ring(outer, holes)
    ears = ([ring[k] for k in ear] for ear in cut_ears(ring))
    triangles = _delaunay(ears, fixed)
    return np.array(triangles, dtype=float).reshape(-1, 3, 2) / _MM_PER_M


def _triangles_of_geos(polygon: Polygon) -> np.ndarray:
    rounded = shapely.transform(
        polygon, lambda xy: np.rint(xy * _MM_PER_M) / _MM_PER_M
    )
    rounded = shapely.remove_repeated_points(rounded)
    try:
        triangles = shapely.constrained_delaunay_triangles(rounded)
    except shapely.errors.GEOSException as error:
        raise ValueError("the polygon is not valid") from error
    parts = shapely.orient_polygons(shapely.get_parts(triangles))
    return shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]


def _corners(ring: LinearRing) -> list[_Point]:
    """Returns a ring's corners without repetitions, the smallest one first."""
    xy = np.array(ring.coords)[:-1, :2]
    points = [tuple(p) for p in np.rint(xy * _MM_PER_M).astype(int).tolist()]
    corners = [p for k, p in enumerate(points) if p != points[k - 1]]
    if not corners:
        return []
    start = corners.index(min(corners))
    return corners[start:] + corners[:start]


def _with_corners_on_edges(
    ring: list[_Point], corners: list[_Point]
) -> list[_Point]:
    """Adds to a ring the points of `corners` that lie on its edges."""
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


def _joined_ring(
    outer: list[_Point], holes: list[list[_Point]]
) -> list[_Point]:
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

    The result is None if ring and hole share no corner.
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

    The ring leads to the hole and back along a line that crosses none of the
    edges `walls`.
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
    """Returns whether segment pq meets ab at a point other than p and q."""
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


def _delaunay(
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

    The points a, b and c are counter-clockwise. If d, which lies beyond the
    edge a b, is inside the circle, the quadrilateral a, d, b, c is convex, so
    that its diagonal can be flipped.
    """
    rows = [(p[0] - d[0], p[1] - d[1]) for p in (a, b, c)]
    (ax, ay), (bx, by), (cx, cy) = rows
    a2, b2, c2 = (x * x + y * y for x, y in rows)
    return (
        ax * (by * c2 - b2 * cy)
        - ay * (bx * c2 - b2 * cx)
        + a2 * (bx * cy - by * cx)
    ) > 0
