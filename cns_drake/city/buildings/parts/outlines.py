"""Plans of buildings made from the outline of a site.

All keep the front edge first.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
import math

import numpy as np


def chamfered(points: np.ndarray, cut: float) -> np.ndarray:
    """Cuts every convex corner of an outline, `cut` metres along each edge."""
    return _replaced(points, lambda p, a, b: [p - a * cut, p + b * cut])


def notched(points: np.ndarray, depth: float) -> np.ndarray:
    """Takes a square of side `depth` out of every convex corner."""
    return _replaced(
        points,
        lambda p, a, b: [
            p - a * depth,
            p - a * depth + b * depth,
            p + b * depth,
        ],
    )


def _replaced(
    points: np.ndarray,
    corner: Callable[[np.ndarray, np.ndarray, np.ndarray], list[np.ndarray]],
) -> np.ndarray:
    points = np.asarray(points, dtype=float)
    result: list[np.ndarray] = []
    for k, p in enumerate(points):
        a = p - points[k - 1]
        b = points[(k + 1) % len(points)] - p
        a, b = a / np.hypot(*a), b / np.hypot(*b)
        convex = a[0] * b[1] - a[1] * b[0] > 0.1
        result.extend(corner(p, a, b) if convex else [p])
        if k == 0:
            front = len(result) - 1
    return np.roll(np.array(result), -front, axis=0)


def stadium(
    x0: float, y0: float, x1: float, y1: float, step: float = 3.0
) -> np.ndarray:
    """A rectangle whose short ends, left and right, are half circles.

    Args:
        x0, y0, x1, y1: its extent [m], longer along x.
        step: longest chord of the half circles [m].
    """
    radius, middle = (y1 - y0) / 2, (y0 + y1) / 2
    count = max(2, math.ceil(math.pi * radius / step))
    angles = np.linspace(-math.pi / 2, math.pi / 2, count + 1)
    arc = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    right = np.array([x1 - radius, middle]) + arc
    left = np.array([x0 + radius, middle]) - arc
    # The arc on the left ends where the front begins.
    return np.roll(np.vstack([right, left]), 1, axis=0)


def u_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """A court open to the back: wings left and right of it, front closed."""
    return np.array(
        [
            (x0, y0),
            (x1, y0),
            (x1, y1),
            (x1 - wing, y1),
            (x1 - wing, y0 + back),
            (x0 + wing, y0 + back),
            (x0 + wing, y1),
            (x0, y1),
        ]
    )


def l_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """A front range and one wing on the left."""
    return np.array(
        [
            (x0, y0),
            (x1, y0),
            (x1, y0 + back),
            (x0 + wing, y0 + back),
            (x0 + wing, y1),
            (x0, y1),
        ]
    )


def mirrored(points: np.ndarray) -> np.ndarray:
    """Mirrors an outline left to right about the middle of its extent."""
    points = np.asarray(points, dtype=float)
    middle = (points[:, 0].min() + points[:, 0].max()) / 2
    flipped = np.column_stack([2 * middle - points[:, 0], points[:, 1]])
    # Mirroring turns it clockwise; the front edge stays first.
    return np.roll(flipped[::-1], 2 - len(points), axis=0)


def edges_on(
    plan: np.ndarray, outline: np.ndarray, edges: Collection[int]
) -> frozenset[int]:
    """Returns the edges of a plan that are part of some edges of an outline."""
    found = set()
    ends = np.roll(plan, -1, axis=0)
    for k, (a, b) in enumerate(zip(plan, ends, strict=True)):
        for edge in edges:
            start = outline[edge]
            along = outline[(edge + 1) % len(outline)] - start
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            if max(abs(normal @ (a - start)), abs(normal @ (b - start))) < 0.01:
                found.add(k)
    return frozenset(found)
