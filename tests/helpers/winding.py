"""Generalised winding number: is a point inside a polygon soup?"""

import numpy as np


def winding_numbers(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Returns the winding number of closed triangles around each point.

    Args:
        triangles: (M, 3, 3) corners, wound outwards.
        points: (N, 3), none on the surface.

    Solid angles after van Oosterom and Strackee, "The solid angle of a
    plane triangle", 1983; T-junctions do not disturb their sum.
    """
    total = np.zeros(len(points))
    for k, point in enumerate(points):
        a, b, c = (triangles[:, i] - point for i in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
        denominator = (
            la * lb * lc
            + np.einsum("ij,ij->i", a, b) * lc
            + np.einsum("ij,ij->i", b, c) * la
            + np.einsum("ij,ij->i", c, a) * lb
        )
        total[k] = 2 * np.arctan2(numerator, denominator).sum()
    return total / (4 * np.pi)
