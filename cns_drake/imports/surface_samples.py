"""Points that cover surfaces of triangles."""

from collections.abc import Iterator

import numpy as np

from cns_drake.city import quartered

# Triangles with longer edges are divided, so that parts far away can be left
# out [spacings].
_LONGEST_EDGE = 256
# Number of triangles that are processed at a time.
_TRIANGLES_AT_ONCE = 64


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[np.ndarray]:
    """Yields blocks of points (N, 3) that cover triangles (M, 3, 3) [m].

    Every place on a triangle, including its edges, is at most `spacing` [m]
    from one of the points. `window` contains the least and the greatest x and
    y, (2,) each; points outside of these limits are left out.
    """
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            triangles = triangles[is_near.all(axis=1)]
        edges = triangles - np.roll(triangles, 1, axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1, initial=0.0)
        is_small = longest <= _LONGEST_EDGE * spacing
        small = triangles[is_small]
        for first in range(0, len(small), _TRIANGLES_AT_ONCE):
            points = _points_on(
                small[first : first + _TRIANGLES_AT_ONCE], spacing
            )
            if window is not None:
                xy = points[:, :2]
                points = points[((xy >= low) & (xy <= high)).all(axis=1)]
            yield points
        triangles = quartered(triangles[~is_small])


def _points_on(triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Returns points (N, 3) on triangles (M, 3, 3), triangle by triangle [m].

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
    return a[owner] + u * ((1.0 - v) * (b - a)[owner] + v * (c - a)[owner])


def _part_ends(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ends of the equal parts into which N segments are divided.

    Segment k has counts[k] parts. The ends are two arrays: the number of the
    segment (M,), and the position of the end on it, from 0 to 1 (M,).
    """
    owner = np.repeat(np.arange(len(counts)), counts + 1)
    first = np.cumsum(counts + 1) - counts - 1
    return owner, (np.arange(len(owner)) - first[owner]) / counts[owner]
