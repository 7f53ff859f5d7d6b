"""Orients the normals of surfaces that rays have met."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled


@compiled
def face_origins(
    normals: np.ndarray,
    group: np.ndarray,
    normal_maps: np.ndarray,
    R_OSset: np.ndarray,
    d_Sset: np.ndarray,
    is_outside: np.ndarray,
) -> None:
    """Makes normals unit vectors that face the origins of their rays.

    Args:
        normals: (N, 3) float32 in the frame of each group, to change; zero
            for a miss.
        group: (N,) row of each hit's group, -1 for a miss.
        normal_maps: (G, 3, 3) from a group's frame to O: the inverse
            transpose of its X_OL's linear part.
        R_OSset: (L, 3, 3) orientations of S, taken in turn.
        d_Sset: (N, 3) directions.
        is_outside: (N,) bool to fill: whether the ray has met the outside of
            the surface, by its winding.
    """
    n = np.empty(3)
    turn = -1
    for ray in range(len(normals)):
        # Counted along: remainders would take a third of the time.
        turn = turn + 1 if turn + 1 < len(R_OSset) else 0
        row = group[ray]
        if row < 0:
            continue
        M = normal_maps[row]
        R = R_OSset[turn]
        length = 0.0
        along = 0.0
        for i in range(3):
            n[i] = (
                M[i, 0] * normals[ray, 0]
                + M[i, 1] * normals[ray, 1]
                + M[i, 2] * normals[ray, 2]
            )
            length += n[i] * n[i]
            along += n[i] * (
                R[i, 0] * d_Sset[ray, 0]
                + R[i, 1] * d_Sset[ray, 1]
                + R[i, 2] * d_Sset[ray, 2]
            )
        is_outside[ray] = along <= 0.0
        scale = np.sqrt(length)
        if along > 0.0:
            scale = -scale
        if scale == 0.0:
            scale = 1.0
        for i in range(3):
            normals[ray, i] = n[i] / scale
