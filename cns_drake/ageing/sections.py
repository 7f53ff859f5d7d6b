"""Horizontal sections of triangles, which show where walls are."""

import math

import numpy as np


def horizontal_section(triangles: np.ndarray, z: float) -> np.ndarray:
    """Returns where triangles cut a horizontal plane: segments (N, 2, 2) [m].

    Each row of a segment contains x and y of an end of the segment.

    Args:
        triangles: (M, 3, 3) triangles [m].
        z: height of the plane [m].
    """
    z += 1e-4  # Not exactly at a vertex, whose heights are whole millimetres.
    a, b = triangles, np.roll(triangles, -1, axis=1)
    rise = b[..., 2] - a[..., 2]
    cut = (a[..., 2] - z) * (b[..., 2] - z) < 0
    t = (z - a[..., 2]) / np.where(cut, rise, 1.0)
    points = a[..., :2] + t[..., None] * (b - a)[..., :2]
    both = cut.sum(axis=1) == 2
    return points[both][cut[both]].reshape(-1, 2, 2)


def greatest_y(segments: np.ndarray, x: float) -> float:
    """Returns the greatest y at which segments cross a line of constant x.

    Args:
        segments: (N, 2, 2) segments; each row is x and y of an end [m].
        x: x of all points of the line [m].

    Returns:
        The coordinate y [m]; NaN if no segment crosses the line.
    """
    a, b = segments[:, 0], segments[:, 1]
    meets = (a[:, 0] - x) * (b[:, 0] - x) < 0
    a, b = a[meets], b[meets]
    y = a[:, 1] + (x - a[:, 0]) / (b[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    return float(y.max()) if len(y) else math.nan
