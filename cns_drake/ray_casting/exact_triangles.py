"""Casts single rays on triangles in double precision.

Embree works in single precision. Where a ray runs nearly in the plane of a
triangle, or through a vertex, Embree may therefore lose a hit, or report a hit
where there is none. Scans accept these errors because Embree is fast; see the
notes on the LiDAR.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import inv

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits
from cns_drake.ray_casting.triangle_tree import (
    MOST_DEPTH,
    TriangleTree,
    make_tree,
)
from cns_drake.scene.surfaces import TriangleSurface, merge_triangles

# Tolerance of a hit beside an edge, as a share of the triangle's size. With it,
# no ray passes between two triangles that share an edge.
_EDGE_TOLERANCE = 1e-9
# Additional tolerance for rounding, relative to the numbers that are rounded.
_ROUNDING_TOLERANCE = 1e-14
# Greatest error of a hit by rounding, as a share of the triangle's size.
_LARGEST_ERROR = 1e-3


class ExactTriangles:
    """The triangles of groups, on which rays are cast in double precision."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Sorts the triangles.

        Args:
            groups: the groups, already placed (see `RayGroup.place`). Each cast
                takes their current poses and motions.
        """
        by_content: dict[tuple, TriangleTree] = {}
        self._found = []
        for row, group in enumerate(groups):
            flat = [
                (k, X_LG, surface)
                for k, (_, X_LG, surface) in enumerate(group.members)
                if isinstance(surface, TriangleSurface)
            ]
            if flat:
                content = group.content()
                if content not in by_content:
                    by_content[content] = make_tree(*merge_triangles(flat))
                indices = np.array([index for index, *_ in group.members])
                self._found.append((row, group, by_content[content], indices))

    def cast(
        self, p_Oset: np.ndarray, d_Oset: np.ndarray, time: float, hits: Hits
    ) -> None:
        """Replaces the hits of rays that hit a triangle at a shorter range.

        Args:
            p_Oset: (N, 3) origins [m].
            d_Oset: (N, 3) unit directions.
            time: time of the cast, as a fraction of the LiDAR's revolution.
            hits: N hits with normals, changed in place; the `ranges` of misses
                are the maximum ranges.
        """
        for row, group, tree, indices in self._found:
            if not group.in_sight:
                continue
            X_OL = group.X_OL_at(np.array([time]))[0]
            R_LO = np.array(inv(X_OL[:, :3]))
            _cast_on_group(
                tree,
                R_LO,
                X_OL[:, 3].copy(),
                row,
                indices,
                p_Oset,
                d_Oset,
                hits,
            )


@compiled
def _entry_distance(
    boxes: np.ndarray, node: int, p: np.ndarray, r: np.ndarray, limit: float
) -> float:
    """Returns the distance at which a ray enters a node's box [m].

    The distance is infinite if the ray does not enter the box before a limit.
    `p` is the ray's origin, and `r` is the reciprocal of the ray's direction.
    Where `r` is infinite, comparisons with NaN let the ray pass, which only
    costs time.
    """
    near, far = 0.0, limit
    for axis in range(3):
        enters = (boxes[node, 0, axis] - p[axis]) * r[axis]
        leaves = (boxes[node, 1, axis] - p[axis]) * r[axis]
        if enters > leaves:
            enters, leaves = leaves, enters
        if enters > near:
            near = enters
        if leaves < far:
            far = leaves
    return near if near <= far else np.inf


@compiled
def _cast_on_group(
    tree: TriangleTree,
    R_LO: np.ndarray,
    p_OL: np.ndarray,
    row: int,
    indices: np.ndarray,
    p_Oset: np.ndarray,
    d_Oset: np.ndarray,
    hits: Hits,
) -> None:
    """Casts rays on one group; the matrix R_LO may scale as well as rotate.

    After Moeller and Trumbore (1997), with a tolerance at edges. The function
    is compiled, because single rays and triangles are slow in Python.
    """
    # As names of their own, fields are fast.
    corners, boxes = tree.corners, tree.boxes
    p, d, r, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    a, b, s = np.empty(3), np.empty(3), np.empty(3)
    stack = np.empty(2 * MOST_DEPTH, np.int64)
    begins, counts = tree.begins, tree.counts
    for ray in range(len(p_Oset)):
        for i in range(3):
            p[i] = d[i] = 0.0
            for j in range(3):
                p[i] += R_LO[i, j] * (p_Oset[ray, j] - p_OL[j])
                d[i] += R_LO[i, j] * d_Oset[ray, j]
            r[i] = 1.0 / d[i] if d[i] != 0.0 else np.inf
        best = np.float64(hits.ranges[ray])
        met = -1
        size = 1
        stack[0] = 0
        while size:
            size -= 1
            node = stack[size]
            if _entry_distance(boxes, node, p, r, best) == np.inf:
                continue
            if counts[node] == 0:
                first = begins[node]
                second = first + 1
                one = _entry_distance(boxes, first, p, r, best)
                other = _entry_distance(boxes, second, p, r, best)
                if other < one:
                    first, second = second, first
                # The nearer one is next.
                if max(one, other) < np.inf:
                    stack[size] = second
                    size += 1
                if min(one, other) < np.inf:
                    stack[size] = first
                    size += 1
                continue
            for k in range(begins[node], begins[node] + counts[node]):
                c = corners[k]
                for i in range(3):
                    a[i], b[i] = c[1, i] - c[0, i], c[2, i] - c[0, i]
                    s[i] = p[i] - c[0, i]
                for i in range(3):
                    j, m = (i + 1) % 3, (i + 2) % 3
                    n[i] = a[j] * b[m] - a[m] * b[j]
                det = -(n[0] * d[0] + n[1] * d[1] + n[2] * d[2])
                longest = 0.0
                for i in range(3):
                    longest += abs(a[i]) + abs(b[i])
                far = abs(s[0]) + abs(s[1]) + abs(s[2])
                rounding = _ROUNDING_TOLERANCE * longest * far
                # In the plane of the triangle, as far as numbers tell: the ray
                # meets the edge of a neighbour instead.
                if rounding >= _LARGEST_ERROR * abs(det):
                    continue
                distance = (n[0] * s[0] + n[1] * s[1] + n[2] * s[2]) / det
                if not 0.0 < distance < best:
                    continue
                u = v = 0.0
                for i in range(3):
                    j, m = (i + 1) % 3, (i + 2) % 3
                    across = s[j] * d[m] - s[m] * d[j]
                    u += b[i] * across
                    v -= a[i] * across
                slack = _EDGE_TOLERANCE * abs(det) + rounding
                if det < 0.0:
                    u, v = -u, -v
                if u >= -slack and v >= -slack and u + v <= abs(det) + slack:
                    best, met = distance, k
        if met < 0:
            continue
        c = corners[met]
        hits.ranges[ray], hits.group[ray] = best, row
        hits.owner[ray] = indices[tree.owners[met]]
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            hits.normals[ray, i] = (c[1, j] - c[0, j]) * (c[2, m] - c[0, m]) - (
                c[1, m] - c[0, m]
            ) * (c[2, j] - c[0, j])
