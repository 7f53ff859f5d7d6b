"""Points on triangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

# Of an edge that is not parted before, and points at once.
_MOST_STEPS = 256
_AT_ONCE = 1_000_000


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[np.ndarray]:
    """Yields points (N, 3) on triangles (M, 3, 3), edges included [m].

    No place on a triangle is farther from all of them than the spacing. There
    are not more than about a million at once.

    Args:
        triangles: to sample.
        spacing: of the points [m].
        window: (2,) least and greatest x and y; what is outside is left out.
    """
    for part, number in _in_pieces(triangles, spacing, window):
        i, j = np.meshgrid(np.arange(number + 1), np.arange(number + 1))
        inside = i + j <= number
        u, v = i[inside] / number, j[inside] / number
        weights = np.stack([1.0 - u - v, u, v], axis=1)
        most = max(1, _AT_ONCE // len(weights))
        for first in range(0, len(part), most):
            some = part[first : first + most]
            points = np.einsum("kc,mcx->mkx", weights, some).reshape(-1, 3)
            if window is not None:
                low, high = window
                xy = points[:, :2]
                points = points[((xy >= low) & (xy <= high)).all(axis=1)]
            if len(points):
                yield points


def _in_pieces(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None,
) -> Iterator[tuple[np.ndarray, int]]:
    """Yields triangles of a size, and into how many steps to part an edge."""
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            triangles = triangles[is_near.all(axis=1)]
        edges = triangles - np.roll(triangles, 1, axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1)
        steps = np.maximum(1, np.ceil(longest / spacing)).astype(int)
        for number in np.unique(steps[steps <= _MOST_STEPS]):
            yield triangles[steps == number], int(number)
        # Large ones in four, so that what is far of them is left out.
        a, b, c = np.moveaxis(triangles[steps > _MOST_STEPS], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(q, axis=1) for q in quarters])
