"""Triangulates the plans of buildings, which have few corners."""

from __future__ import annotations

import numpy as np


def ears(points: np.ndarray) -> list[tuple[int, ...]]:
    """Triangulates a simple outline by cutting ears off (O(N^3))."""
    left = list(range(len(points)))
    faces = []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            triangle = points[[a, b, c]]
            others = [i for i in left if i not in (a, b, c)]
            if _cross(*triangle) > 1e-9 and not any(
                _inside(points[i], triangle) for i in others
            ):
                faces.append((a, b, c))
                left.pop(k)
                break
        else:
            raise ValueError("an outline crosses itself or runs clockwise")
    return [*faces, tuple(left)]


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _inside(p: np.ndarray, triangle: np.ndarray) -> bool:
    a, b, c = triangle
    return (
        _cross(a, b, p) > -1e-9
        and _cross(b, c, p) > -1e-9
        and _cross(c, a, p) > -1e-9
    )
