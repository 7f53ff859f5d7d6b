"""Points on triangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cns_drake.base.compiled import compiled

# Longer triangles are divided, so that their far parts can be left out.
_LONGEST = 256  # In spacings.
# Points at a time, unless a single triangle has more.
_AT_ONCE = 1_000_000


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[np.ndarray]:
    """Yields points (N, 3) on triangles (M, 3, 3), edges included [m].

    No place on a triangle is farther from all of them than the spacing. At most
    about a million come at a time.

    Args:
        triangles: to sample.
        spacing: of the points [m].
        window: (2,) least and greatest x and y; points outside are left out.
    """
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            triangles = triangles[is_near.all(axis=1)]
        edges = triangles - np.roll(triangles, 1, axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1, initial=0.0)
        is_small = longest <= _LONGEST * spacing
        yield from _in_batches(triangles[is_small], spacing, window)
        a, b, c = np.moveaxis(triangles[~is_small], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(q, axis=1) for q in quarters])


def _in_batches(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None,
) -> Iterator[np.ndarray]:
    triangles = np.ascontiguousarray(triangles, dtype=np.float64)
    counts = _fill(triangles, spacing, np.zeros((0, 3)))
    ends = np.cumsum(counts)
    first = 0
    while first < len(triangles):
        before = ends[first - 1] if first else 0
        last = int(np.searchsorted(ends, before + _AT_ONCE, "right"))
        last = max(last, first + 1)
        points = np.empty((int(ends[last - 1] - before), 3))
        _fill(triangles[first:last], spacing, points)
        first = last
        if window is not None:
            low, high = window
            xy = points[:, :2]
            points = points[((xy >= low) & (xy <= high)).all(axis=1)]
        if len(points):
            yield points


@compiled
def _fill(
    triangles: np.ndarray, spacing: float, points: np.ndarray
) -> np.ndarray:
    """Writes the points of triangles (M, 3, 3) one after the other.

    Lines of points run across the two longer sides, along the shortest one.

    Args:
        triangles: to sample.
        spacing: of the points.
        points: (N, 3) to write to, for all; (0, 3) to count them only.

    Returns:
        (M,) number of points of each triangle.
    """
    counts = np.zeros(len(triangles), dtype=np.int64)
    written = 0
    for k in range(len(triangles)):
        # The apex is opposite the shortest side.
        apex, shortest, longest = 0, np.inf, 0.0
        for m in range(3):
            side = triangles[k, (m + 2) % 3] - triangles[k, (m + 1) % 3]
            length = np.sqrt((side * side).sum())
            longest = max(longest, length)
            if length < shortest:
                shortest, apex = length, m
        a = triangles[k, apex]
        ab = triangles[k, (apex + 1) % 3] - a
        ac = triangles[k, (apex + 2) % 3] - a
        lines = max(1, int(np.ceil(longest / spacing)))
        for i in range(lines + 1):
            u = i / lines
            steps = max(1, int(np.ceil(u * shortest / spacing)))
            counts[k] += steps + 1
            if len(points) == 0:
                continue
            for j in range(steps + 1):
                v = j / steps
                for axis in range(3):
                    points[written, axis] = a[axis] + u * (
                        (1.0 - v) * ab[axis] + v * ac[axis]
                    )
                written += 1
    return counts
