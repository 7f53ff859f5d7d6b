"""Constrained Delaunay triangulation in whole millimetres, exactly.

Libraries resolve ties (four corners on a circle, as in every rectangle)
differently from version to version. Generated files must not depend on that,
so triangles are made here with integers: cut off ears, then flip edges until
the triangulation is Delaunay.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import shapely
from shapely.geometry import LinearRing, Polygon

from cns_drake.base.compiled import compiled

_MM = 1000.0
# A corner or point as whole millimetres.
_Point = tuple[int, int]


def triangulate(polygon: Polygon) -> np.ndarray:
    """Returns a polygon as (M, 3, 2) counter-clockwise triangles [m].

    Vertices are those of the polygon, rounded to millimetres; its edges are
    edges of triangles.

    Args:
        polygon: valid, also after rounding; holes may touch the outer ring
            and each other in points.

    Raises:
        ValueError: the polygon is found not to be valid.
    """
    polygon = shapely.orient_polygons(shapely.normalize(polygon))
    rings = [_ring(ring) for ring in (polygon.exterior, *polygon.interiors)]
    if len(rings[0]) < 3:
        return np.zeros((0, 3, 2))
    corners = sorted({corner for ring in rings for corner in ring})
    outer, *holes = (_with_corners_on_edges(ring, corners) for ring in rings)
    fixed = {
        frozenset(edge) for ring in (outer, *holes) for edge in _edges(ring)
    }
    triangles = _flip(_cut_ears(_bridge(outer, holes)), fixed)
    return np.array(triangles, dtype=float).reshape(-1, 3, 2) / _MM


def _ring(ring: LinearRing) -> list[_Point]:
    """Returns a ring's corners without repetitions, from the least one on."""
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
    """Returns a ring with a corner wherever another ring touches it."""
    points = np.array(corners, dtype=np.int64)
    starts = np.array(ring, dtype=np.int64)
    ways = np.roll(starts, -1, axis=0) - starts
    touched = _touched(starts, ways, points).tolist()
    result = []
    for k, corner in enumerate(ring):
        result.append(corner)
        if touched[k]:
            offset = points - starts[k]
            part = offset @ ways[k]
            inside = ways[k, 0] * offset[:, 1] == ways[k, 1] * offset[:, 0]
            inside &= (part > 0) & (part < ways[k] @ ways[k])
            those = np.flatnonzero(inside)
            order = np.argsort(part[those], kind="stable")
            result += [corners[i] for i in those[order]]
    return result


@compiled
def _touched(
    starts: np.ndarray, ways: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Returns which edges (N,) have a point within them.

    Args:
        starts, ways: (N, 2) their starts, and from there to their ends.
        points: (P, 2).
    """
    found = np.zeros(len(starts), dtype=np.bool_)
    for k in range(len(starts)):
        x, y = ways[k, 0], ways[k, 1]
        whole = x * x + y * y
        for i in range(len(points)):
            u, v = points[i, 0] - starts[k, 0], points[i, 1] - starts[k, 1]
            if x * v == y * u and 0 < u * x + v * y < whole:
                found[k] = True
                break
    return found


def _edges(ring: list[_Point]) -> Iterator[tuple[_Point, _Point]]:
    return zip(ring, ring[1:] + ring[:1], strict=True)


def _cross(a: _Point, b: _Point, c: _Point) -> int:
    """Returns twice the area of a triangle, positive counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _bridge(outer: list[_Point], holes: list[list[_Point]]) -> list[_Point]:
    """Returns one ring that runs into every hole and back again."""
    ring = outer
    left = sorted(holes, key=lambda hole: max(hole), reverse=True)
    while left:
        # The hole that reaches furthest to the right sees the ring.
        hole = left.pop(0)
        walls = [*_edges(ring), *(e for h in (hole, *left) for e in _edges(h))]
        touching = _insert_touching(ring, hole)
        ring = touching or _insert_apart(ring, hole, walls)
    return ring


def _insert_touching(
    ring: list[_Point], hole: list[_Point]
) -> list[_Point] | None:
    """Runs around a hole at a corner that it shares; None if there is none."""
    for k, corner in enumerate(hole):
        for i in (i for i, other in enumerate(ring) if other == corner):
            if _opens_towards(ring, i, hole[(k + 1) % len(hole)]):
                return ring[:i] + hole[k:] + hole[:k] + ring[i:]
    return None


def _insert_apart(
    ring: list[_Point], hole: list[_Point], walls: list[tuple[_Point, _Point]]
) -> list[_Point]:
    """Runs to a hole along a line that crosses no wall, and back."""
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
    """Returns whether a point is in the inner angle at a corner of a ring."""
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
    """Returns whether a point on the line pq is on the segment."""
    return all(min(p[k], q[k]) <= c[k] <= max(p[k], q[k]) for k in range(2))


def _cut_ears(ring: list[_Point]) -> list[tuple[_Point, _Point, _Point]]:
    """Returns triangles that fill a ring, which may touch itself."""
    triangles, is_whole = _ears(np.array(ring, dtype=np.int64))
    if not is_whole:
        raise ValueError("the polygon crosses itself")
    return [(ring[a], ring[b], ring[c]) for a, b, c in triangles.tolist()]


@compiled
def _ears(points: np.ndarray) -> tuple[np.ndarray, bool]:
    """Returns numbers of corners (M, 3), and whether they fill the ring.

    Args:
        points: (N, 2) corners of the ring in whole millimetres, fewer than
            10^9 from each other, so that no product overflows.
    """
    left = np.arange(len(points))
    count, found, start = len(points), 0, 0
    triangles = np.empty((max(count - 2, 0), 3), dtype=np.int64)
    while count > 3:
        is_cut = False
        for step in range(count):
            k = (start + step) % count
            a, b, c = left[(k - 1) % count], left[k], left[(k + 1) % count]
            if _is_ear(points, left[:count], a, b, c):
                _write(triangles, found, a, b, c)
                found += 1
                count -= 1
                for i in range(k, count):
                    left[i] = left[i + 1]
                # Continuing behind the ear avoids fans of thin triangles.
                start = k
                is_cut = True
                break
        if not is_cut:
            for i in left[:count]:
                if _side(points, left[0], left[1], i) != 0:
                    return triangles[:found], False
            return triangles[:found], True
    if count == 3 and _side(points, left[0], left[1], left[2]) > 0:
        _write(triangles, found, left[0], left[1], left[2])
        found += 1
    return triangles[:found], True


@compiled
def _write(triangles: np.ndarray, row: int, a: int, b: int, c: int) -> None:
    triangles[row, 0], triangles[row, 1], triangles[row, 2] = a, b, c


@compiled
def _is_ear(
    points: np.ndarray, left: np.ndarray, a: int, b: int, c: int
) -> bool:
    """Returns whether the corner b is convex and nothing lies in its ear."""
    if _side(points, a, b, c) <= 0:
        return False
    for i in left:
        is_corner = False
        for j in (a, b, c):
            if points[i, 0] == points[j, 0] and points[i, 1] == points[j, 1]:
                is_corner = True
        if (
            not is_corner
            and _side(points, a, b, i) >= 0
            and _side(points, b, c, i) >= 0
            and _side(points, c, a, i) >= 0
        ):
            return False
    return True


@compiled
def _side(points: np.ndarray, a: int, b: int, c: int) -> int:
    """Returns twice the area of a triangle, positive counter-clockwise."""
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])


def _flip(
    triangles: Iterable[tuple[_Point, _Point, _Point]],
    fixed: set[frozenset[_Point]],
) -> list[tuple[_Point, _Point, _Point]]:
    """Flips inner edges until every circumcircle is empty (Lawson)."""
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
