"""Leaves: small plane rhombi in tufts, with gaps that rays pass through."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.geometry.mesh import Mesh

# Leaf vectors are whole centimetres: rhombi stay exactly plane after rounding
# and their OBJ text is short.
_GRID = 100.0


def unit(vector: ArrayLike) -> np.ndarray:
    """Returns the vector(s) divided by the length along the last axis."""
    vector = np.asarray(vector, dtype=float)
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def leaves(
    base: ArrayLike,
    direction: ArrayLike,
    normal: ArrayLike,
    length: ArrayLike,
    width: ArrayLike,
) -> Mesh:
    """Returns one rhombus per row.

    Args:
        base: (N, 3) corner at the twig [m].
        direction: (N, 3) from the twig to the tip, any length.
        normal: (N, 3) rough normal of the leaf, not along `direction`.
        length: distance from the twig to the tip, scalar or (N,) [m].
        width: greatest width, scalar or (N,) [m].
    """
    base = np.round(np.asarray(base, float) * _GRID)
    direction = unit(direction)
    across = unit(np.cross(np.asarray(normal, float), direction))
    along = direction * np.reshape(length, (-1, 1)) / 2
    across = across * np.reshape(width, (-1, 1)) / 2
    left = np.round((along + across) * _GRID)
    right = np.round((along - across) * _GRID)
    corners = np.stack([base, base + right, base + right + left, base + left])
    vertices = corners.transpose(1, 0, 2).reshape(-1, 3) / _GRID
    first = 4 * np.arange(len(base))
    faces = np.column_stack([first, first + 1, first + 2, first + 3])
    return Mesh(vertices, tuple(map(tuple, faces.tolist())))


def tufts(
    rng: np.random.Generator,
    centers: ArrayLike,
    axes: ArrayLike,
    leaf_count: int,
    length: float,
    width: float,
    spread: float = 1.1,
) -> Mesh:
    """Returns leaves that radiate in tufts from shared points.

    Args:
        rng: source of the directions and sizes.
        centers: (N, 3) where the leaves of a tuft meet [m].
        axes: (N, 3) mean direction of each tuft.
        leaf_count: leaves of a tuft.
        length: mean leaf length [m].
        width: mean leaf width [m].
        spread: how far the leaves turn away from the axis; 0 is not at
            all, 2 is nearly every direction.
    """
    centers = np.repeat(np.asarray(centers, float), leaf_count, axis=0)
    axes = np.repeat(unit(axes), leaf_count, axis=0)
    n = len(centers)
    direction = unit(axes + spread * unit(rng.standard_normal((n, 3))))
    normal = unit(axes + 0.8 * rng.standard_normal((n, 3)))
    # Keep the normal off the direction, where the leaf would have no width.
    off_axis = axes + np.array([0.31, 0.17, 0.05])
    normal = normal + 0.3 * np.cross(direction, off_axis)
    size = rng.uniform(0.7, 1.3, n)
    return leaves(centers, direction, normal, length * size, width * size)


def keep_above(foliage: Mesh, height: float) -> Mesh:
    """Returns the faces whose corners all lie at or above `height` [m]."""
    low = foliage.vertices[:, 2] < height
    kept = tuple(f for f in foliage.faces if not low[list(f)].any())
    used = sorted({i for face in kept for i in face})
    index = {old: new for new, old in enumerate(used)}
    return Mesh(
        foliage.vertices[used],
        tuple(tuple(index[i] for i in face) for face in kept),
    )
