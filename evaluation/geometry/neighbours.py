"""The nearest neighbours of every point of a cloud within the cloud.

This is faster than a tree query for each point, because nearby points share the
search. A k-d tree cuts the cloud into groups, and a group determines once which
other groups can hold neighbours of its points. If the k nearest of a point are
within r, then the k nearest of another one at distance d are within r + d.
Points in order of place therefore have a bound of their neighbourhood before
the search.
"""

import numpy as np
from scipy.spatial import KDTree

from cns_drake.base.compiled import compiled

# Least number of points in a group; it has less than twice as many.
_GROUP_SIZE = 16
# Number of earlier points that bound the next one's neighbourhood.
_MEMORY = 32
# Bounds are widened by this factor, against rounding.
_MARGIN = 1.0 + 1e-9
# Indices of the inner loops are unsigned: with others, compiled code asks each
# time whether they count from the end.
_ONE = np.uint64(1)


def nearest_neighbours(points: np.ndarray, k: int) -> np.ndarray:
    """Returns for every point its k nearest, itself among them.

    Args:
        points: (N, 3) finite, N >= k.
        k: how many, at least 1.

    Returns:
        (N, k) int32 indices in no particular order. The choice among equally
        far points is not defined, but constant for a cloud.

    Raises:
        ValueError: if there are fewer than k points.
    """
    if len(points) < k:
        raise ValueError(
            f"{k} neighbours are wanted, but there are only {len(points)} "
            "points"
        )
    points = np.asarray(points, dtype=np.float64)
    # The tree halves the points again and again: parts of equal size are leaves
    # of it, or nearly so.
    order = KDTree(points, leafsize=_GROUP_SIZE).indices.astype(np.int32)
    num_groups = 2 ** int(np.log2(max(len(points) // _GROUP_SIZE, 1)))
    starts = np.linspace(0, len(points), num_groups + 1).astype(np.int64)
    cloud = np.ascontiguousarray(points[order].T)
    boxes = [
        least_or_greatest.reduceat(cloud, starts[:-1], axis=1)
        for least_or_greatest in (np.minimum, np.maximum)
    ]
    return _search(cloud, order, starts, np.concatenate(boxes), k)


@compiled
def _select(
    keys: np.ndarray, items: np.ndarray, start: int, stop: int, k: int
) -> None:
    """Rearranges [start, stop) so that its k smallest keys come first.

    Items move with their keys. It partitions around a pivot like quicksort, and
    continues with one part only. It has no branches that depend on keys: half
    of them would be mispredicted.
    """
    target = np.uint64(start + k - 1)
    low, high = np.uint64(start), np.uint64(stop - 1)
    while low < high:
        middle = (low + high) >> _ONE
        pivot, pivot_item = keys[middle], items[middle]
        keys[middle], items[middle] = keys[high], items[high]
        smaller = low
        for index in range(low, high):
            key, item = keys[index], items[index]
            keys[index], items[index] = keys[smaller], items[smaller]
            keys[smaller], items[smaller] = key, item
            smaller += np.uint64(key < pivot)
        keys[high], items[high] = keys[smaller], items[smaller]
        keys[smaller], items[smaller] = pivot, pivot_item
        if smaller == target:
            return
        if target < smaller:
            high = smaller - _ONE
            continue
        if smaller == low:
            # The pivot is the least key. All keys equal to it are passed over;
            # otherwise each would take a round.
            for index in range(low, high + _ONE):
                key, item = keys[index], items[index]
                keys[index], items[index] = keys[smaller], items[smaller]
                keys[smaller], items[smaller] = key, item
                smaller += np.uint64(key == pivot)
            if target < smaller:
                return
            low = smaller
        else:
            low = smaller + _ONE


@compiled
def _search(
    cloud: np.ndarray,
    order: np.ndarray,
    starts: np.ndarray,
    boxes: np.ndarray,
    k: int,
) -> np.ndarray:
    """Finds the neighbours (N, k), group by group, in the caller's order.

    Args:
        cloud: (3, N) in the order of the groups, N >= k.
        order: (N,) index of each point in the caller's cloud.
        starts: (G + 1,) where each group starts, and the last one ends.
        boxes: (6, G) least and greatest coordinates of the groups.
        k: how many.
    """
    # Separate arrays are indexed faster than one array.
    x, y, z = cloud[0], cloud[1], cloud[2]
    num_points = len(x)
    num_groups = len(starts) - 1
    result = np.empty((num_points, k), np.int32)
    # Distance of each point's k-th neighbour.
    radius = np.empty(num_points)
    all_groups = np.arange(num_groups).astype(np.uint64)
    near_groups = np.empty(num_groups, np.uint64)
    near_boxes = np.empty((6, num_groups))
    own_box = np.empty(6)
    gaps = np.empty(num_groups)
    # One slot more than needed, for writes that are not kept.
    within = np.empty(num_groups + 1, np.uint64)
    squared = np.empty(num_points + 1)
    found = np.empty(num_points + 1, np.int32)
    for group in range(num_groups):
        first, last = starts[group], starts[group + 1]
        others, other_boxes, num_others = all_groups, boxes, num_groups
        for point in range(first, last):
            px, py, pz = x[point], y[point], z[point]
            limit = np.inf
            for other in range(max(point - _MEMORY, 0), point):
                dx, dy, dz = x[other] - px, y[other] - py, z[other] - pz
                distance = np.sqrt(dx * dx + dy * dy + dz * dz)
                limit = min(limit, radius[other] + distance)
            if point == first:
                # Any k points are a bound, too.
                begin = min(point, num_points - k)
                limit = min(limit, _farthest(x, y, z, point, begin, begin + k))
            limit = (limit * _MARGIN) ** 2
            for axis in range(3):
                own_box[axis] = own_box[3 + axis] = cloud[axis, point]
            _squared_gaps(own_box, other_boxes, num_others, gaps)
            # Each group or point is written, and kept if it is near: a branch
            # would often be predicted wrongly.
            num_within = np.uint64(0)
            for index in range(num_others):
                within[num_within] = others[index]
                num_within += np.uint64(gaps[index] <= limit)
            count = np.uint64(0)
            for index in range(num_within):
                other = within[index]
                for candidate in range(
                    np.uint64(starts[other]), np.uint64(starts[other + _ONE])
                ):
                    dx, dy = x[candidate] - px, y[candidate] - py
                    dz = z[candidate] - pz
                    distance = dx * dx + dy * dy + dz * dz
                    squared[count] = distance
                    found[count] = candidate
                    count += np.uint64(distance <= limit)
            _select(squared, found, 0, int(count), k)
            farthest = 0.0
            own = result[order[point]]
            for index in range(k):
                farthest = max(farthest, squared[index])
                own[index] = order[np.uint64(found[index])]
            radius[point] = np.sqrt(farthest)
            if point == first:
                spread = _farthest(x, y, z, point, first, last)
                reach = (radius[point] + spread) * _MARGIN
                for side in range(6):
                    own_box[side] = boxes[side, group]
                _squared_gaps(own_box, boxes, num_groups, gaps)
                num_others = 0
                for other in range(num_groups):
                    if gaps[other] <= reach * reach:
                        near_groups[num_others] = other
                        for side in range(6):
                            near_boxes[side, num_others] = boxes[side, other]
                        num_others += 1
                others, other_boxes = near_groups, near_boxes
    return result


@compiled
def _squared_gaps(
    box: np.ndarray, others: np.ndarray, number: int, gaps: np.ndarray
) -> None:
    """Writes the squared distances of a box (6,) to the first others (6, G)."""
    x0, y0, z0 = box[0], box[1], box[2]
    x1, y1, z1 = box[3], box[4], box[5]
    for index in range(number):
        dx = max(others[0, index] - x1, x0 - others[3, index], 0.0)
        dy = max(others[1, index] - y1, y0 - others[4, index], 0.0)
        dz = max(others[2, index] - z1, z0 - others[5, index], 0.0)
        gaps[index] = dx * dx + dy * dy + dz * dz


@compiled
def _farthest(
    x: np.ndarray,
    y: np.ndarray,
    z: np.ndarray,
    point: int,
    start: int,
    stop: int,
) -> float:
    """Returns the distance of a point to the farthest of [start, stop)."""
    px, py, pz = x[point], y[point], z[point]
    farthest = 0.0
    for other in range(start, stop):
        dx, dy, dz = x[other] - px, y[other] - py, z[other] - pz
        farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return np.sqrt(farthest)
