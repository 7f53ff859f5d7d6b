"""Triangles in space: normals, orientation, outlines and parts."""

import numpy as np
import shapely

# A face looks upwards if the z of its unit normal is greater than this.
_UPWARDS = 0.05


def long_normals(triangles: np.ndarray) -> np.ndarray:
    """Returns the cross products (M, 3) of two edges of triangles (M, 3, 3).

    Each result is a normal of its triangle, with a length of twice the
    triangle's area.
    """
    # For a few triangles, this is faster than `np.cross`.
    u = triangles[:, 1] - triangles[:, 0]
    v = triangles[:, 2] - triangles[:, 0]
    normal = np.empty(u.shape)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        normal[:, k] = u[:, i] * v[:, j] - u[:, j] * v[:, i]
    return normal


def unit_normals(triangles: np.ndarray) -> np.ndarray:
    """Returns the unit normals (M, 3) of triangles (M, 3, 3).

    The normal of a triangle without area is zero.
    """
    normal = long_normals(triangles)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.where(size > 1e-9, size, np.inf)


def looks_up(triangles: np.ndarray) -> np.ndarray:
    """Returns (M,) bool: whether triangles (M, 3, 3) face upwards."""
    return np.asarray(unit_normals(triangles)[:, 2] > _UPWARDS)


def turned_up(triangles: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 3), reversed where they face downwards."""
    is_down = unit_normals(triangles)[:, 2] < 0.0
    return np.where(is_down[:, None, None], triangles[:, ::-1], triangles)


def from_above(triangles: np.ndarray) -> np.ndarray:
    """Returns the outlines (M,) of triangles (M, 3, 3), seen from above."""
    return np.asarray(shapely.polygons(triangles[:, :, :2]), object)


def quartered(triangles: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 3), each divided into four: (4 M, 3, 3).

    The new corners are the middles of the sides.
    """
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(part, axis=1) for part in parts])
