"""Points that cover surfaces of triangles."""

from collections.abc import Iterator

import numpy as np

from worlds.shapes import quartered

# Triangles with longer edges are divided, so that parts far away can be left
# out [spacings].
_LONGEST_EDGE = 256
# About the greatest number of points at a time, so that they stay in the cache.
_POINTS_AT_ONCE = 2**15


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields blocks of points that cover triangles (M, 3, 3) [m].

    A block is points (N, 3), and the index of the triangle of each, (N,). Every
    place on a triangle, including its edges, is at most `spacing` [m]
    from one of the points. `window` contains the least and the greatest x and
    y, (2,) each; points outside of these limits are left out.
    """
    owner = np.arange(len(triangles))
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            is_near = is_near.all(axis=1)
            triangles, owner = triangles[is_near], owner[is_near]
        edges = triangles - np.roll(triangles, 1, axis=1)
        lengths = np.linalg.norm(edges, axis=2)
        longest = lengths.max(axis=1, initial=0.0)
        is_small = longest <= _LONGEST_EDGE * spacing
        small, owner_of_small = triangles[is_small], owner[is_small]
        # As many lines as the longest side has parts, each half as long as the
        # shortest side on average.
        lines = longest[is_small] / spacing + 2.0
        shortest = lengths[is_small].min(axis=1, initial=np.inf)
        count = np.cumsum(lines * (shortest / (2.0 * spacing) + 2.0))
        last = 0
        while last < len(small):
            first = last
            most = count[first] + _POINTS_AT_ONCE
            last = int(np.searchsorted(count, most))
            points, number = _points_on(small[first:last], spacing)
            number = owner_of_small[first:last][number]
            if window is not None:
                # The columns one by one: NumPy is slow for rows of two.
                (x, y), (left, front), (right, back) = points.T[:2], low, high
                is_in = (x >= left) & (x <= right) & (y >= front) & (y <= back)
                points, number = points[is_in], number[is_in]
            yield points, number
        triangles = quartered(triangles[~is_small])
        owner = np.tile(owner[~is_small], 4)


def _points_on(
    triangles: np.ndarray, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns points (N, 3) on triangles (M, 3, 3), triangle by triangle [m].

    The second array is the index of the triangle of each point, (N,).

    The points are in lines between the two longer sides, parallel to the
    shortest side.
    """
    sides = np.roll(triangles, 1, axis=1) - np.roll(triangles, -1, axis=1)
    lengths = np.sqrt((sides * sides).sum(axis=2))
    # The apex is opposite the shortest side.
    apex = lengths.argmin(axis=1)[:, None, None]
    a, b, c = (
        np.take_along_axis(triangles, (apex + k) % 3, axis=1)[:, 0]
        for k in range(3)
    )
    lines = np.maximum(np.ceil(lengths.max(axis=1) / spacing).astype(int), 1)
    owner, u = _part_ends(lines)
    steps = u * lengths.min(axis=1)[owner] / spacing
    line, v = _part_ends(np.maximum(np.ceil(steps).astype(int), 1))
    owner = owner[line]
    u = u[line][:, None]
    v = v[:, None]
    along = (1.0 - v) * (b - a)[owner] + v * (c - a)[owner]
    return a[owner] + u * along, owner


def _part_ends(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ends of the equal parts into which N segments are divided.

    Segment k has counts[k] parts. The ends are two arrays: the number of the
    segment (M,), and the position of the end on it, from 0 to 1 (M,).
    """
    owner = np.repeat(np.arange(len(counts)), counts + 1)
    first = np.cumsum(counts + 1) - counts - 1
    return owner, (np.arange(len(owner)) - first[owner]) / counts[owner]
