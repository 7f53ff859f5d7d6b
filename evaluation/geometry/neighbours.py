"""The nearest neighbours of every point of a cloud within the cloud.

This is faster than a tree query for each point, because nearby points share the
search. The cloud is cut into groups of nearby points, and a group determines
once which other groups can hold neighbours of its points. If the k nearest of a
point are within r, then the k nearest of another one at distance d are within r
+ d. Points in order of place therefore have a bound of their neighbourhood
before the search.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled

# Least number of points in a group; it has less than twice as many.
_GROUP_SIZE = 16
# Number of earlier points that bound the next one's neighbourhood.
_MEMORY = 32
# Bounds are widened by this factor, against rounding.
_MARGIN = 1.0 + 1e-9


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
    cloud = np.ascontiguousarray(points.T, dtype=np.float64)
    order, starts = _group(cloud, _GROUP_SIZE)
    return _search(np.ascontiguousarray(cloud[:, order]), order, starts, k)


@compiled
def _select(
    keys: np.ndarray, items: np.ndarray, start: int, stop: int, k: int
) -> None:
    """Rearranges [start, stop) so that its k smallest keys come first.

    Items move with their keys. It partitions around a pivot like quicksort, and
    continues with one part only. It has no branches that depend on keys: half
    of them would be mispredicted.
    """
    target = start + k - 1
    low, high = start, stop - 1
    while low < high:
        middle = (low + high) // 2
        pivot, pivot_item = keys[middle], items[middle]
        keys[middle], items[middle] = keys[high], items[high]
        smaller = low
        for index in range(low, high):
            key, item = keys[index], items[index]
            keys[index], items[index] = keys[smaller], items[smaller]
            keys[smaller], items[smaller] = key, item
            smaller += key < pivot
        keys[high], items[high] = keys[smaller], items[smaller]
        keys[smaller], items[smaller] = pivot, pivot_item
        if smaller == target:
            return
        if target < smaller:
            high = smaller - 1
            continue
        if smaller == low:
            # The pivot is the least key. All keys equal to it are passed over;
            # otherwise each would take a round.
            for index in range(low, high + 1):
                key, item = keys[index], items[index]
                keys[index], items[index] = keys[smaller], items[smaller]
                keys[smaller], items[smaller] = key, item
                smaller += key == pivot
            if target < smaller:
                return
            low = smaller
        else:
            low = smaller + 1


@compiled
def _group(cloud: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Cuts a cloud into groups, halving parts across their longest side.

    Args:
        cloud: (3, N).
        size: least number of points in a group, if there are so many.

    Returns:
        (N,) int32 points, group after group; (G + 1,) where each group
        starts, and the last one ends.
    """
    num_points = cloud.shape[1]
    order = np.arange(num_points).astype(np.int32)
    keys = np.empty(num_points)
    starts = np.empty(num_points // size + 2, np.int64)
    num_groups = 0
    # Ends of the parts still to be cut; the nearest one is on top.
    ends = np.empty(64, np.int64)
    ends[0] = num_points
    depth = 1
    start = 0
    while depth > 0:
        end = ends[depth - 1]
        if end - start < 2 * size:
            starts[num_groups] = start
            num_groups += 1
            start = end
            depth -= 1
            continue
        axis, longest = 0, -1.0
        for candidate in range(3):
            least, most = np.inf, -np.inf
            for index in range(start, end):
                value = cloud[candidate, order[index]]
                least = min(least, value)
                most = max(most, value)
            if most - least > longest:
                axis, longest = candidate, most - least
        for index in range(start, end):
            keys[index] = cloud[axis, order[index]]
        half = (end - start) // 2
        _select(keys, order, start, end, half)
        ends[depth] = start + half
        depth += 1
    starts[num_groups] = num_points
    return order, starts[: num_groups + 1]


@compiled
def _search(
    cloud: np.ndarray, order: np.ndarray, starts: np.ndarray, k: int
) -> np.ndarray:
    """Finds the neighbours, group by group.

    Args:
        cloud: (3, N) in the order of the groups, N >= k.
        order: (N,) index of each point in the caller's cloud.
        starts: (G + 1,) of the groups.
        k: how many.

    Returns:
        (N, k) in the caller's order and indices.
    """
    # Separate arrays are indexed faster than one array.
    x, y, z = cloud[0], cloud[1], cloud[2]
    num_points = len(x)
    num_groups = len(starts) - 1
    boxes = _boxes(cloud, starts)
    result = np.empty((num_points, k), np.int32)
    # Distance of each point's k-th neighbour.
    radius = np.empty(num_points)
    near = np.empty(num_groups, np.int64)
    # One slot more than points, for writes that are not kept.
    squared = np.empty(num_points + 1)
    found = np.empty(num_points + 1, np.int32)
    for group in range(num_groups):
        first, last = starts[group], starts[group + 1]
        num_near = num_groups
        for index in range(num_groups):
            near[index] = index
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
                farthest = _farthest(x, y, z, point, begin, begin + k)
                limit = min(limit, farthest)
            limit = (limit * _MARGIN) ** 2
            count = 0
            for index in range(num_near):
                other = near[index]
                dx = max(boxes[other, 0] - px, px - boxes[other, 3], 0.0)
                dy = max(boxes[other, 1] - py, py - boxes[other, 4], 0.0)
                dz = max(boxes[other, 2] - pz, pz - boxes[other, 5], 0.0)
                if dx * dx + dy * dy + dz * dz > limit:
                    continue
                for candidate in range(starts[other], starts[other + 1]):
                    dx, dy = x[candidate] - px, y[candidate] - py
                    dz = z[candidate] - pz
                    distance = dx * dx + dy * dy + dz * dz
                    # Each point is written, and kept if it is near: a branch
                    # would often be predicted wrongly.
                    squared[count] = distance
                    found[count] = candidate
                    count += distance <= limit
            _select(squared, found, 0, count, k)
            radius[point] = np.sqrt(squared[:k].max())
            for index in range(k):
                result[order[point], index] = order[found[index]]
            if point == first:
                spread = _farthest(x, y, z, point, first, last)
                num_near = _near_groups(
                    boxes, group, (radius[point] + spread) * _MARGIN, near
                )
    return result


@compiled
def _boxes(cloud: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns the bounding boxes of groups, (G, 6): least and greatest."""
    boxes = np.empty((len(starts) - 1, 6))
    for group in range(len(boxes)):
        for axis in range(3):
            values = cloud[axis, starts[group] : starts[group + 1]]
            boxes[group, axis] = values.min()
            boxes[group, 3 + axis] = values.max()
    return boxes


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


@compiled
def _near_groups(
    boxes: np.ndarray, group: int, reach: float, near: np.ndarray
) -> int:
    """Writes boxes within a group's reach to `near`; returns their number."""
    count = 0
    for other in range(len(boxes)):
        gap = 0.0
        for axis in range(3):
            apart = max(
                boxes[other, axis] - boxes[group, 3 + axis],
                boxes[group, axis] - boxes[other, 3 + axis],
                0.0,
            )
            gap += apart * apart
        if gap <= reach * reach:
            near[count] = other
            count += 1
    return count
