"""A bounding volume hierarchy of triangles, in double precision."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.scene.surfaces import TriangleSurface

# Greatest number of triangles in a leaf.
_LEAF_SIZE = 4
# Boxes are this much wider than the triangles on each side [m].
_BOX_MARGIN = 1e-6
# Number of bins; a node can be divided at the planes between them.
_BINS = 16
# From this depth on, nodes are halved, so that stacks of fixed size suffice.
MOST_DEPTH = 100


class TriangleTree(NamedTuple):
    """The T triangles of a group, and boxes around them.

    Attributes:
        corners: (T, 3, 3) corners of each triangle in the group's frame L [m],
            sorted by leaves.
        owners: (T,) index of the group's member to which each triangle belongs.
        boxes: (K, 2, 3) least and greatest coordinates of each node [m]; node 0
            contains all triangles.
        begins: (K,) index of a leaf's first triangle, or of the first of
            another node's two children.
        counts: (K,) number of triangles of a leaf, 0 for other nodes.
    """

    corners: np.ndarray
    owners: np.ndarray
    boxes: np.ndarray
    begins: np.ndarray
    counts: np.ndarray


def make_tree(surface: TriangleSurface, owners: np.ndarray) -> TriangleTree:
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
    size = _divide_nodes(low, high, order, boxes, begins, counts)
    return TriangleTree(
        corners[order],
        owners[order].astype(np.int64),
        boxes[:size].copy(),
        begins[:size].copy(),
        counts[:size].copy(),
    )


@compiled
def _half_area(box: np.ndarray) -> float:
    """Returns half the surface area of a box; 0 for an empty box."""
    x, y, z = (
        box[1, 0] - box[0, 0],
        box[1, 1] - box[0, 1],
        box[1, 2] - box[0, 2],
    )
    return x * y + y * z + z * x if x >= 0.0 else 0.0


@compiled
def _widen_box(box: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    for i in range(3):
        box[0, i] = min(box[0, i], low[i])
        box[1, i] = max(box[1, i], high[i])


@compiled
def _empty_box(box: np.ndarray) -> None:
    for i in range(3):
        box[0, i], box[1, i] = np.inf, -np.inf


@compiled
def _divide_nodes(
    low: np.ndarray,
    high: np.ndarray,
    order: np.ndarray,
    boxes: np.ndarray,
    begins: np.ndarray,
    counts: np.ndarray,
) -> int:
    """Fills the nodes of a tree and sorts `order`; returns the number of nodes.

    Every node is divided where the expected cost of a ray is least, among
    planes across the widest axis of its triangles' middles. The function is
    compiled, because a city has a million nodes.
    """
    bins = np.empty((_BINS, 2, 3))
    in_bin = np.empty(_BINS, np.int64)
    behind, side = np.empty(_BINS), np.empty((2, 3))
    # Nodes that may be divided: node, and range of its triangles in `order`.
    pending = np.empty((2 * MOST_DEPTH, 3), np.int64)
    pending[0, 0], pending[0, 1], pending[0, 2] = 0, 0, len(order)
    waiting = 1
    size = 1
    while waiting:
        waiting -= 1
        node, begin = pending[waiting, 0], pending[waiting, 1]
        end = pending[waiting, 2]
        _empty_box(boxes[node])
        _empty_box(side)
        for k in range(begin, end):
            triangle = order[k]
            _widen_box(boxes[node], low[triangle], high[triangle])
            for i in range(3):
                middle = low[triangle, i] + high[triangle, i]
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
                _empty_box(bins[k])
                in_bin[k] = 0
            for k in range(begin, end):
                triangle = order[k]
                middle = low[triangle, axis] + high[triangle, axis]
                place = int(scale * (middle - start))
                _widen_box(bins[place], low[triangle], high[triangle])
                in_bin[place] += 1
            best = _cheapest_plane(bins, in_bin, behind, side)
            other = end
            while split < other:
                triangle = order[split]
                middle = low[triangle, axis] + high[triangle, axis]
                if int(scale * (middle - start)) < best:
                    split += 1
                else:
                    other -= 1
                    order[split], order[other] = order[other], triangle
        # Halves, if all middles are the same, or nodes would be too deep.
        if split in (begin, end) or waiting > MOST_DEPTH:
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
def _cheapest_plane(
    bins: np.ndarray, in_bin: np.ndarray, behind: np.ndarray, side: np.ndarray
) -> int:
    """Returns the bin before which a plane makes the expected cost least.

    The cost of each side is the number of its triangles times half the area of
    its box.

    Args:
        bins: (B, 2, 3) box of the triangles in each bin.
        in_bin: (B,) number of the triangles in each bin.
        behind: (B,) room for the costs behind each plane.
        side: (2, 3) room for the box of a side.
    """
    _empty_box(side)
    number = 0
    for k in range(_BINS - 1, 0, -1):
        _widen_box(side, bins[k, 0], bins[k, 1])
        number += in_bin[k]
        behind[k] = number * _half_area(side)
    _empty_box(side)
    number = 0
    least = np.inf
    best = 1
    for k in range(1, _BINS):
        _widen_box(side, bins[k - 1, 0], bins[k - 1, 1])
        number += in_bin[k - 1]
        cost = number * _half_area(side) + behind[k]
        if cost < least:
            least, best = cost, k
    return best
