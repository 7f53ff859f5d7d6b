"""Casts single rays on triangles in double precision.

Embree works in single precision. Where a ray runs nearly in the plane of a
triangle, or through a vertex, Embree may therefore lose a hit, or report a hit
where there is none. Scans accept these errors because Embree is fast; see the
notes on the LiDAR.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.math import inv

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits
from cns_drake.scene.surfaces import TriangleSurface, merge_triangles

# Greatest number of triangles in a leaf.
_LEAF_SIZE = 4
# Boxes are this much wider than the triangles on each side [m].
_BOX_MARGIN = 1e-6
# Number of planes, plus one, at which dividing a node is considered.
_BINS = 16
# Depth of nodes from which on they are halved, so that stacks suffice.
_DEEPEST = 100
# Tolerance of a hit beside an edge, as a share of the triangle's size. With it,
# no ray passes between two triangles that share an edge.
_EDGE_TOLERANCE = 1e-9
# Additional tolerance for rounding, relative to the numbers that are rounded.
_ROUNDING_TOLERANCE = 1e-14
# Greatest error of a hit by rounding, as a share of the triangle's size.
_PARALLEL = 1e-3


class _Tree(NamedTuple):
    """The T triangles of a group, and boxes around them.

    Attributes:
        corners: (T, 3, 3) corners of each triangle in the group's frame L [m],
            sorted by leaves.
        owners: (T,) the group's member to which each belongs.
        boxes: (K, 2, 3) least and greatest coordinates of each node [m]; node 0
            contains all.
        begins: (K,) first triangle of a leaf, or first of the two children of
            another node.
        counts: (K,) number of triangles of a leaf, 0 for other nodes.
    """

    corners: np.ndarray
    owners: np.ndarray
    boxes: np.ndarray
    begins: np.ndarray
    counts: np.ndarray


class ExactTriangles:
    """The triangles of groups, on which rays are cast in double precision."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Sorts the triangles.

        Args:
            groups: the groups, already placed (see `RayGroup.place`). Each cast
                takes their current poses and motions.
        """
        by_content: dict[tuple, _Tree] = {}
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
                    by_content[content] = _make_tree(*merge_triangles(flat))
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
            _cast(
                tree,
                R_LO,
                X_OL[:, 3].copy(),
                row,
                indices,
                p_Oset,
                d_Oset,
                hits,
            )


def _make_tree(surface: TriangleSurface, owners: np.ndarray) -> _Tree:
    """Returns the tree of a surface's triangles.

    Nodes are divided by the surface area heuristic (Wald 2007, with bins).
    """
    corners = surface.p_GVset[surface.triangles].astype(float)
    low, high = (
        corners.min(axis=1) - _BOX_MARGIN,
        corners.max(axis=1) + _BOX_MARGIN,
    )
    order = np.arange(len(corners))
    boxes = np.empty((2 * len(corners), 2, 3))
    begins = np.empty(2 * len(corners), np.int64)
    counts = np.empty(2 * len(corners), np.int64)
    size = _divide(low, high, order, boxes, begins, counts)
    return _Tree(
        corners[order],
        owners[order].astype(np.int64),
        boxes[:size].copy(),
        begins[:size].copy(),
        counts[:size].copy(),
    )


@compiled
def _half_area(box: np.ndarray) -> float:
    """Returns half the surface area of a box, 0 for an empty one."""
    x, y, z = (
        box[1, 0] - box[0, 0],
        box[1, 1] - box[0, 1],
        box[1, 2] - box[0, 2],
    )
    return x * y + y * z + z * x if x >= 0.0 else 0.0


@compiled
def _widen(box: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    for i in range(3):
        box[0, i] = min(box[0, i], low[i])
        box[1, i] = max(box[1, i], high[i])


@compiled
def _empty(box: np.ndarray) -> None:
    for i in range(3):
        box[0, i], box[1, i] = np.inf, -np.inf


@compiled
def _divide(
    low: np.ndarray,
    high: np.ndarray,
    order: np.ndarray,
    boxes: np.ndarray,
    begins: np.ndarray,
    counts: np.ndarray,
) -> int:
    """Fills the nodes of a tree, and sorts `order`; returns their number.

    Every node is divided where the expected cost of a ray is least, among
    planes across the widest axis of its triangles' middles. The function is
    compiled, because a city has a million nodes.
    """
    bins = np.empty((_BINS, 2, 3))
    in_bin = np.empty(_BINS, np.int64)
    behind, side = np.empty(_BINS), np.empty((2, 3))
    pending = np.empty((2 * _DEEPEST, 3), np.int64)
    pending[0, 0], pending[0, 1], pending[0, 2] = 0, 0, len(order)
    waiting = 1
    size = 1
    while waiting:
        waiting -= 1
        node, begin = pending[waiting, 0], pending[waiting, 1]
        end = pending[waiting, 2]
        _empty(boxes[node])
        _empty(side)
        for k in range(begin, end):
            one = order[k]
            _widen(boxes[node], low[one], high[one])
            for i in range(3):
                middle = low[one, i] + high[one, i]
                side[0, i] = min(side[0, i], middle)
                side[1, i] = max(side[1, i], middle)
        begins[node], counts[node] = begin, end - begin
        if end - begin <= _LEAF_SIZE:
            continue
        axis = 0
        for i in range(1, 3):
            if side[1, i] - side[0, i] > side[1, axis] - side[0, axis]:
                axis = i
        start = side[0, axis]
        width = side[1, axis] - side[0, axis]
        split = begin
        if width > 0.0:
            scale = _BINS * (1.0 - 1e-9) / width
            for k in range(_BINS):
                _empty(bins[k])
                in_bin[k] = 0
            for k in range(begin, end):
                one = order[k]
                place = int(scale * (low[one, axis] + high[one, axis] - start))
                _widen(bins[place], low[one], high[one])
                in_bin[place] += 1
            _empty(side)
            number = 0
            for k in range(_BINS - 1, 0, -1):
                _widen(side, bins[k, 0], bins[k, 1])
                number += in_bin[k]
                behind[k] = number * _half_area(side)
            _empty(side)
            number = 0
            least = np.inf
            best = 1
            for k in range(1, _BINS):
                _widen(side, bins[k - 1, 0], bins[k - 1, 1])
                number += in_bin[k - 1]
                cost = number * _half_area(side) + behind[k]
                if cost < least:
                    least, best = cost, k
            other = end
            while split < other:
                one = order[split]
                place = int(scale * (low[one, axis] + high[one, axis] - start))
                if place < best:
                    split += 1
                else:
                    other -= 1
                    order[split], order[other] = order[other], one
        # Halves, if all middles are the same, or nodes would be too deep.
        if split in (begin, end) or waiting > _DEEPEST:
            split = (begin + end) // 2
        begins[node], counts[node] = size, 0
        for k in range(2):
            pending[waiting, 0] = size + k
            pending[waiting, 1] = split if k else begin
            pending[waiting, 2] = end if k else split
            waiting += 1
        size += 2
    return size


@compiled
def _entry_distance(
    boxes: np.ndarray, node: int, p: np.ndarray, r: np.ndarray, limit: float
) -> float:
    """Returns the distance at which a ray enters a node's box [m].

    It is infinite if the ray does not enter the box before a limit. `p` is the
    ray's origin, and `r` the reciprocal of its direction; where that is
    infinite, comparisons with NaN let the ray pass, which only costs time.
    """
    near, far = 0.0, limit
    for axis in range(3):
        one = (boxes[node, 0, axis] - p[axis]) * r[axis]
        other = (boxes[node, 1, axis] - p[axis]) * r[axis]
        if one > other:
            one, other = other, one
        if one > near:
            near = one
        if other < far:
            far = other
    return near if near <= far else np.inf


@compiled
def _cast(
    tree: _Tree,
    R_LO: np.ndarray,
    p_OL: np.ndarray,
    row: int,
    indices: np.ndarray,
    p_Oset: np.ndarray,
    d_Oset: np.ndarray,
    hits: Hits,
) -> None:
    """Casts rays on one group; R_LO may also stretch.

    After Moeller and Trumbore (1997), with a tolerance at edges. The function
    is compiled, because single rays and triangles are slow in Python.
    """
    # As names of their own, fields are fast.
    corners, boxes = tree.corners, tree.boxes
    p, d, r, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    a, b, s = np.empty(3), np.empty(3), np.empty(3)
    stack = np.empty(2 * _DEEPEST, np.int64)
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
                if rounding >= _PARALLEL * abs(det):
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
